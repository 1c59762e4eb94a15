"""Percepts of many recordings on one machine."""

from __future__ import annotations

import concurrent.futures
import concurrent.futures.process
import multiprocessing
import os
import pathlib
import signal
from collections.abc import Callable, Iterable
from typing import Any

from . import Body, Calibration, Scene, SomaticError
from ._jobs import Job, Report, outputs
from ._progress import Bar

__all__ = ["Report", "percepts"]


_is_at_work = False


def _start(threads: int) -> None:
    """Prepares a worker: how many threads the library may start in it, and how it ends."""
    os.environ["RAYON_NUM_THREADS"] = str(threads)
    # A terminal sends Ctrl-C to all processes; this one's end is up to the one that asks for percepts.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _stop)


def _stop(number: int, frame: object) -> None:
    if _is_at_work:
        raise KeyboardInterrupt
    os._exit(128 + number)


def _run(job: Job, recording: pathlib.Path, out: pathlib.Path) -> dict[str, Any]:
    global _is_at_work
    _is_at_work = True
    try:
        return job.run(recording, out)
    except KeyboardInterrupt:
        # The half table is gone. Others wait in this process's queue, and nobody wants them.
        os._exit(128 + signal.SIGTERM)
    finally:
        _is_at_work = False


def percepts(
    recordings: Iterable[str | os.PathLike[str]],
    scene: Scene | dict[str, Any] | str | None,
    out: str | os.PathLike[str],
    *,
    body: Body | str | None = None,
    calibration: Calibration | str | None = None,
    backend: str | None = "cpu",
    all_fields: bool = False,
    workers: int | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
) -> Report:
    """Makes a table in Parquet of each recording, below the folder `out`, in `workers` processes (by default one a core).

    A recording is one piece of work and never cut, as touches and filters have a state. A table appears when it is whole. One that is
    there already, made of the same file by the same body, scene, calibration, backend and version, is left as it is, so that a job that
    was ended goes on where it stopped. A damaged recording is a row of `Report.errors`. `progress` is called with how many recordings are
    done, and of how many; True shows a bar of tqdm. Ctrl-C gives up what is under way and leaves no half table. A script guards its own start with ``if __name__ == "__main__":``, as all that start processes do.

    >>> import pathlib, tempfile
    >>> import somatic_touch as st, somatic_touch.batch
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> for name in "ab":
    ...     _ = (folder / f"{name}.csv").write_text("t,0,1\\n0,1,2\\n0.1,3,4\\n")
    >>> sensor = st.Body.grid(1, 2, 0.01)
    >>> st.batch.percepts(folder.glob("*.csv"), {"outputs": "total"}, folder / "out", body=sensor, workers=1)
    <Report: 2 done, 0 done before, 0 failed>
    >>> st.batch.percepts(folder.glob("*.csv"), {"outputs": "total"}, folder / "out", body=sensor, workers=1)
    <Report: 0 done, 2 done before, 0 failed>
    """
    job = Job.of(scene, body, calibration, backend, all_fields)
    pairs = outputs(recordings, out)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    workers = min(workers or cores, len(pairs))
    skipped = [(recording, table) for recording, table in pairs if recording.exists() and job.is_done(recording, table)]
    todo = [pair for pair in pairs if pair not in skipped]
    rows: list[dict[str, Any]] = []

    bar = Bar(len(pairs), "recordings") if progress is True else None

    def tell() -> None:
        if bar is not None:
            bar(len(skipped) + len(rows))
        elif callable(progress):
            progress(len(skipped) + len(rows), len(pairs))

    tell()
    if workers == 1:
        for recording, table in todo:
            rows.append(job.run(recording, table))
            tell()
    elif todo:
        # Large ones first, so that the last one to end is a small one.
        todo.sort(key=lambda pair: -pair[0].stat().st_size if pair[0].exists() else 0)
        others = set(multiprocessing.active_children())
        pool = concurrent.futures.ProcessPoolExecutor(
            workers, multiprocessing.get_context("spawn"), _start, (max(1, cores // workers),)
        )
        try:
            for done in concurrent.futures.as_completed([pool.submit(_run, job, *pair) for pair in todo]):
                rows.append(done.result())
                tell()
        except concurrent.futures.process.BrokenProcessPool as error:
            what = "a worker process was ended from outside; call again, and the job goes on where it stopped"
            raise SomaticError(what) from error
        except BaseException:
            # Ctrl-C, or an error of `progress`: recordings under way are given up.
            for worker in set(multiprocessing.active_children()) - others:
                worker.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
    if bar is not None:
        bar.close()
    order = {str(recording): index for index, (recording, _) in enumerate(pairs)}
    rows.sort(key=lambda row: order[row["recording"]])
    return Report(rows, [str(recording) for recording, _ in skipped])
