"""Percepts of many recordings on a Ray cluster. Needs `pip install 'somatic-touch[ray]'`."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterable
from typing import Any

import pyarrow.fs  # type: ignore[import-untyped,import-not-found,unused-ignore]
import ray  # type: ignore[import-not-found,unused-ignore]
import ray.data  # type: ignore[import-not-found,unused-ignore]

from . import Body, Calibration, Scene
from ._jobs import Job, Report, outputs

__all__ = ["Report", "percepts"]


def _run(job: Job, recording: str, out: str, threads: int) -> dict[str, Any] | None:
    # Before the library starts its threads, which are then those of this worker.
    os.environ.setdefault("RAYON_NUM_THREADS", str(threads))
    path, table = pathlib.Path(recording), pathlib.Path(out)
    if path.exists() and job.is_done(path, table):
        return None
    return job.run(path, table)


# A task whose worker dies is run again, elsewhere if need be.
_task: Any = ray.remote(max_retries=3)(_run)


def percepts(
    recordings: Iterable[str | os.PathLike[str]],
    scene: Scene | dict[str, Any] | str | None,
    out: str | os.PathLike[str],
    *,
    body: Body | str | None = None,
    calibration: Calibration | str | None = None,
    backend: str | None = "cpu",
    all_fields: bool = False,
    num_cpus: int = 1,
) -> tuple[ray.data.Dataset, Report]:
    """What `somatic_touch.batch.percepts` does, by tasks on a Ray cluster: the tables as a Ray Dataset, and the report.

    One recording is one task of `num_cpus` cores, never cut. Recordings and `out` are on a file system that all nodes see; a table appears
    when it is whole, and a task whose worker dies is run again, so that the rows are the same whatever the workers do. Tables that are
    there already, made by the same job, are left as they are.
    """
    job = Job.of(scene, body, calibration, backend, all_fields)
    pairs = outputs(recordings, out)
    shared = ray.put(job)
    task = _task.options(num_cpus=num_cpus)
    # Large ones first, so that the last one to end is a small one.
    order = sorted(range(len(pairs)), key=lambda index: -pairs[index][0].stat().st_size if pairs[index][0].exists() else 0)
    running = {index: task.remote(shared, *map(os.path.abspath, pairs[index]), num_cpus) for index in order}
    try:
        told: list[dict[str, Any] | None] = ray.get([running[index] for index in range(len(pairs))])
    except KeyboardInterrupt:
        for reference in running.values():
            ray.cancel(reference)
        raise
    rows = [row for row in told if row is not None]
    failed = {row["out"] for row in rows if row["error"] is not None}
    tables = [path for path in (os.path.abspath(table) for _, table in pairs) if path not in failed]
    skipped = [str(recording) for (recording, _), row in zip(pairs, told, strict=True) if row is None]
    here = pyarrow.fs.LocalFileSystem()
    dataset = ray.data.read_parquet(tables, filesystem=here) if tables else ray.data.from_items([])
    return dataset, Report(rows, skipped)
