"""Many recordings: by a pool of processes, and on a Ray cluster of two nodes, one of whose workers is killed."""

from __future__ import annotations

import os
import pathlib
import signal
import threading
import time

import numpy as np
import pyarrow.parquet as pq
import pytest

import somatic_touch as st
import somatic_touch.batch

SENSORS = st.Body.grid(8, 8, 0.01, name="array")
SCENE = {"outputs": ["total", "centroid", "speed", "touches"]}


def recordings(folder: pathlib.Path, count: int, frames: int = 120) -> list[pathlib.Path]:
    """Made-up recordings in two folders, the third of them damaged."""
    random = np.random.default_rng(7)
    places = np.stack(np.divmod(np.arange(64), 8))
    paths = []
    for number in range(count):
        path = folder / f"day-{number % 2}" / f"{number:03}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        t = np.arange(frames + number % 17) * 0.01
        centre = 3.5 + 3 * np.stack([np.sin(t * (1 + number % 5)), np.cos(t * (2 + number % 3))])
        distance = ((places[:, None] - centre[:, :, None]) ** 2).sum(axis=0)
        values = (500 * np.exp(-distance) + random.normal(0, 3, distance.shape)).clip(0).round()
        lines = [",".join(["t", *map(str, range(64))])]
        lines += [f"{time:.2f}," + ",".join(f"{value:.0f}" for value in row) for time, row in zip(t, values, strict=True)]
        if number == 2:
            lines[40] = lines[40].replace(",", ",oops,", 1)
        path.write_text("\n".join(lines) + "\n")
        paths.append(path)
    return paths


def same_tables(one: pathlib.Path, other: pathlib.Path, count: int) -> None:
    """Whether two folders have the same rows, table by table, and nothing else."""
    mine, theirs = ({path.relative_to(folder) for path in folder.rglob("*") if path.is_file()} for folder in (one, other))
    assert mine == theirs and len(mine) == 2 * (count - 1), "tables, and those of touches, of all but the damaged one"
    for path in mine:
        assert pq.read_table(one / path).equals(pq.read_table(other / path)), path


def test_a_pool_goes_on_where_it_stopped(tmp_path: pathlib.Path) -> None:
    paths = recordings(tmp_path / "in", 12)
    told: list[tuple[int, int]] = []
    one = st.batch.percepts(paths, SCENE, tmp_path / "one", body=SENSORS, workers=1, progress=lambda *done: told.append(done))
    assert repr(one) == "<Report: 11 done, 0 done before, 1 failed>" and told[-1] == (12, 12)
    assert "oops" in one.errors[0]["error"] or "numbers" in one.errors[0]["error"] or "column" in one.errors[0]["error"]
    assert one.errors[0]["recording"] == str(paths[2])
    two = st.batch.percepts(paths[:7], SCENE, tmp_path / "two", body=SENSORS, workers=2)
    assert len(two.rows) == 7
    two = st.batch.percepts(paths, SCENE, tmp_path / "two", body=SENSORS, workers=2)
    assert repr(two) == "<Report: 5 done, 6 done before, 1 failed>"
    same_tables(tmp_path / "one", tmp_path / "two", 12)
    wanted = st.Engine(SENSORS, SCENE, backend="cpu")
    read = st.read(paths[5])
    table = pq.read_table(tmp_path / "one" / "day-1" / "005.csv.parquet")
    assert table.to_pylist() == wanted.process(read.t, read.values).to_arrow().to_pylist()


def test_what_has_changed_is_made_anew(tmp_path: pathlib.Path) -> None:
    paths = recordings(tmp_path / "in", 2)

    def job(**other: object) -> int:
        keys: dict = {"body": SENSORS, "workers": 1} | other
        return len(st.batch.percepts(paths, keys.pop("scene", SCENE), tmp_path / "out", **keys).rows)

    assert (job(), job()) == (2, 0)
    assert (job(scene={"outputs": "total"}), job(scene={"outputs": "total"}), job()) == (2, 0, 2)
    assert (job(backend="reference"), job(all_fields=True), job(calibration="[all]\ngain = 2"), job()) == (2, 2, 2, 2)
    assert job(body=st.Body.grid(8, 8, 0.02, name="array")) == 2
    assert (job(), job()) == (2, 0)
    # A half table is none.
    table = tmp_path / "out" / "day-0" / "000.csv.parquet"
    table.write_bytes(table.read_bytes()[:-100])
    assert (job(), job()) == (1, 0)
    os.utime(paths[1])
    assert job() == 1


def test_jobs_that_make_no_sense_are_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(st.UsageError, match="no recordings"):
        st.batch.percepts([], SCENE, tmp_path)
    with pytest.raises(st.UsageError, match="twice"):
        st.batch.percepts([tmp_path / "a.csv"] * 2, SCENE, tmp_path)
    with pytest.raises(st.UsageError, match="body="):
        st.batch.percepts([tmp_path / "a.csv"], SCENE, tmp_path, calibration="")
    report = st.batch.percepts([tmp_path / "no.csv"], SCENE, tmp_path, body=SENSORS)
    assert "no such file" in report.errors[0]["error"]


def test_a_ray_cluster_of_two_nodes(tmp_path: pathlib.Path) -> None:
    ray = pytest.importorskip("ray", reason="ray is not installed; tests/python/long installs it")
    import psutil
    from ray.cluster_utils import Cluster

    import somatic_touch.ray

    paths = recordings(tmp_path / "in", 200, 400)
    st.batch.percepts(paths, SCENE, tmp_path / "one", body=SENSORS, workers=1)
    killed: list[int] = []

    def kill() -> None:
        """Kills a worker at its work, when half of the tables are there."""
        while len(list((tmp_path / "ray").rglob("*.csv.parquet"))) < 100:
            time.sleep(0.01)
        while not killed:
            for process in psutil.process_iter(["cmdline"]):
                if (process.info["cmdline"] or [""])[0].startswith("ray::_run"):
                    os.kill(process.pid, signal.SIGKILL)
                    killed.append(process.pid)
                    return

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        ray.init(address=cluster.address, log_to_driver=False)
        assert len(ray.nodes()) == 2
        threading.Thread(target=kill, daemon=True).start()
        dataset, report = st.ray.percepts(paths, SCENE, tmp_path / "ray", body=SENSORS)
        assert killed and len(report.errors) == 1 and report.errors[0]["recording"].endswith("002.csv")
        same_tables(tmp_path / "one", tmp_path / "ray", 200)
        rows = sum(pq.read_metadata(path).num_rows for path in (tmp_path / "one").rglob("*.csv.parquet"))
        assert dataset.count() == rows
        _, again = st.ray.percepts(paths, SCENE, tmp_path / "ray", body=SENSORS)
        assert len(again.skipped) == 199
    finally:
        ray.shutdown()
        cluster.shutdown()
