#!/usr/bin/env python3
"""Throughput of `somatic_touch.batch` by workers, and with --ray of a Ray cluster of two nodes, warm, in one run; and what a terabyte takes.

    pip install './python[ray]'; python benches/peers/many.py [--ray] [--recordings N] [--frames N] [--rounds N]

Recordings are CSV, and MCAP that `somatic convert` (--somatic) makes of it. Ways take turns, and medians are shown.
"""

from __future__ import annotations

import argparse
import os
import pathlib
import shutil
import statistics
import subprocess
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
    words.add_argument("--rounds", type=int, default=3)
    words.add_argument("--somatic", default="target/release/somatic")
    asked = words.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp())
    body = st.Body.grid(25, 40, 0.005, name="skin", regions=(5, 5))
    scene = {"outputs": ["total", "peak", "centroid", "principal_axis", "speed"]}
    random = np.random.default_rng(1)
    rows, columns = np.divmod(np.arange(1000), 40)
    one = folder / "0.csv"
    with one.open("w") as file:
        file.write(",".join(["t", *map(str, range(1000))]) + "\n")
        for frame in range(asked.frames):
            distance = (rows - 12 - 8 * np.sin(frame / 200)) ** 2 + (columns - 20 - 15 * np.cos(frame / 300)) ** 2
            values = (900 * np.exp(-distance / 8) + random.normal(0, 1.5, 1000)).clip(0).astype(int)
            file.write(f"{frame / 100:.2f}," + ",".join(map(str, values)) + "\n")
    body.save(folder / "skin.glb")
    other = folder / "0.mcap"
    subprocess.run([asked.somatic, "convert", one, other, "--body", folder / "skin.glb"], check=True, capture_output=True)
    paths: dict[str, list[pathlib.Path]] = {}
    for first in (one, other):
        copies = [pathlib.Path(shutil.copy(first, folder / f"{number}{first.suffix}")) for number in range(1, asked.recordings)]
        paths[first.suffix[1:].upper()] = [first, *copies]
    frames = asked.recordings * asked.frames
    size = {kind: sum(path.stat().st_size for path in those) for kind, those in paths.items()}

    def pool(kind: str, workers: int) -> pathlib.Path:
        out = pathlib.Path(tempfile.mkdtemp(dir=folder))
        assert not st.batch.percepts(paths[kind], scene, out, body=body, workers=workers).errors
        return out

    ways = {
        (kind, f"pool of {workers}"): lambda kind=kind, workers=workers: pool(kind, workers) for kind in paths for workers in (1, 2)
    }
    if asked.ray:
        # Ray gives its workers way to everything else on the machine; the pool does not.
        os.environ["RAY_worker_niceness"] = "0"
        import ray
        from ray.cluster_utils import Cluster

        import somatic_touch.ray

        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        cluster.add_node(num_cpus=1)
        ray.init(address=cluster.address, log_to_driver=False)

        def tasks(kind: str) -> pathlib.Path:
            out = pathlib.Path(tempfile.mkdtemp(dir=folder))
            assert not st.ray.percepts(paths[kind], scene, out, body=body)[1].errors
            return out

        ways |= {(kind, "Ray, two nodes, warm"): lambda kind=kind: tasks(kind) for kind in paths}
        tasks("CSV")

    took: dict[tuple[str, str], list[float]] = {way: [] for way in ways}
    for _ in range(asked.rounds):
        for way, work in ways.items():
            begin = time.perf_counter()
            out = work()
            took[way].append(time.perf_counter() - begin)
            made = sum(path.stat().st_size for path in out.rglob("*.parquet"))
            shutil.rmtree(out)
    print(f"{asked.recordings} recordings of {asked.frames} frames of 1000 taxels; {made / frames:.0f} bytes of Parquet a frame; medians of {asked.rounds}")
    for (kind, what), times in took.items():
        median, bytes_a_frame = statistics.median(times), size[kind] / frames
        rate, hours = size[kind] / median, 1e12 / (size[kind] / median) / 3600
        print(
            f"{kind:5} {bytes_a_frame:5.0f} bytes a frame, {what:22} {median:6.2f} s ({min(times):.2f}–{max(times):.2f}) {rate / 1e6:6.1f} MB/s "
            f"{frames / median:7.0f} frames/s; a terabyte {hours:.1f} h, {1e12 / bytes_a_frame * made / frames / 1e9:.0f} GB of Parquet",
            flush=True,
        )
    if asked.ray:
        for kind in paths:
            pairs = zip(took[kind, "pool of 2"], took[kind, "Ray, two nodes, warm"], strict=True)
            print(f"{kind}: Ray has {statistics.median(pool / ray for pool, ray in pairs):.2f} of the pool's throughput")
        ray.shutdown()
        cluster.shutdown()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
