#!/usr/bin/env python3
"""Throughput of `somatic_touch.batch` by workers, and with --ray of a Ray cluster of two nodes, warm, in one run.

    pip install './python[ray]'; python benches/peers/many.py [--ray] [--recordings N] [--frames N]
"""

from __future__ import annotations

import argparse
import pathlib
import shutil
import tempfile
import time

import numpy as np

import somatic_touch as st
import somatic_touch.batch


def main() -> None:
    """Measures and prints."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--ray", action="store_true")
    words.add_argument("--recordings", type=int, default=8)
    words.add_argument("--frames", type=int, default=6000)
    asked = words.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())
    body = st.Body.grid(25, 40, 0.005, name="skin", regions=(5, 5))
    scene = {"outputs": ["total", "peak", "centroid", "axis", "speed"]}
    random = np.random.default_rng(1)
    rows, columns = np.divmod(np.arange(1000), 40)
    one = folder / "0.csv"
    with one.open("w") as file:
        file.write(",".join(["t", *map(str, range(1000))]) + "\n")
        for frame in range(asked.frames):
            distance = (rows - 12 - 8 * np.sin(frame / 200)) ** 2 + (columns - 20 - 15 * np.cos(frame / 300)) ** 2
            values = (900 * np.exp(-distance / 8) + random.normal(0, 1.5, 1000)).clip(0).astype(int)
            file.write(f"{frame / 100:.2f}," + ",".join(map(str, values)) + "\n")
    paths = [one] + [shutil.copy(one, folder / f"{number}.csv") for number in range(1, asked.recordings)]
    size = sum(pathlib.Path(path).stat().st_size for path in paths)

    def told(what: str, work) -> None:
        begin = time.perf_counter()
        out = work()
        took = time.perf_counter() - begin
        made = sum(path.stat().st_size for path in out.rglob("*.parquet"))
        frames = asked.recordings * asked.frames
        print(f"{what:24} {took:7.2f} s {size / took / 1e6:8.1f} MB/s of CSV {frames / took:9.0f} frames/s; {made / frames:.0f} bytes of Parquet a frame")

    def pool(workers: int) -> pathlib.Path:
        out = pathlib.Path(tempfile.mkdtemp(dir=folder))
        assert not st.batch.percepts(paths, scene, out, body=body, workers=workers).errors
        return out

    print(f"{asked.recordings} recordings of {asked.frames} frames of 1000 taxels, {size / 1e6:.0f} MB of CSV")
    for workers in (1, 2):
        told(f"pool of {workers}", lambda workers=workers: pool(workers))
    if asked.ray:
        import ray
        from ray.cluster_utils import Cluster

        import somatic_touch.ray

        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        cluster.add_node(num_cpus=1)
        ray.init(address=cluster.address, log_to_driver=False)

        def tasks() -> pathlib.Path:
            out = pathlib.Path(tempfile.mkdtemp(dir=folder))
            st.ray.percepts(paths, scene, out, body=body)
            return out

        tasks()
        told("Ray, two nodes, warm", tasks)
        ray.shutdown()
        cluster.shutdown()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
