#!/usr/bin/env python3
"""From Python, as delivered: `Engine.process` and `Engine.step` against NumPy and Numba (kernels.py), on the same arrays in turns.

    pip install ./python; python benches/peers/from_python.py [--rounds N] [--json FILE]

The command says what the Rust call takes on the same skin: `somatic bench`, of the same process's machine, in between.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import time

import numpy as np

import somatic_touch as st

FRAMES = 9984


def seconds(work, least: float = 0.0) -> float:
    """How long a call of `work` takes."""
    begin = time.perf_counter()
    count = 0
    while count == 0 or time.perf_counter() - begin < least:
        work()
        count += 1
    return (time.perf_counter() - begin) / count


def main() -> None:
    """Measures and prints."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--rounds", type=int, default=7)
    words.add_argument("--somatic", default="target/release/somatic")
    words.add_argument("--json", type=argparse.FileType("w"))
    asked = words.parse_args()

    body = st.Body.grid(25, 40, 0.005, name="skin", regions=(10, 10))
    scene = {"outputs": ["total", "peak", "active", "centroid", "orientation"], "fields": "skin/*"}
    random = np.random.default_rng(1)
    values = random.gamma(0.3, 60, (FRAMES, 1000)).astype(np.float32)
    t = np.arange(FRAMES) * 0.001
    members = [np.searchsorted(body.taxels["id"], field.taxels) for name, field in body.fields.items() if name != "skin"]
    uv = [field.uv for name, field in body.fields.items() if name != "skin"]

    def numpy() -> None:
        """Totals, peaks, counts and centroids; not even orientations."""
        for places, at in zip(members, uv, strict=True):
            pressed = values[:, places]
            total = pressed.sum(axis=1)
            pressed.max(axis=1)
            (pressed > 0).sum(axis=1)
            (pressed @ at.astype(np.float32)) / np.maximum(total, 1e-9)[:, None]

    engine = st.Engine(body, scene, backend="cpu")
    live = st.Engine(body, scene, backend="cpu")
    frame = values[7].copy()
    clock = iter(range(10**9))
    ways = {
        "process": lambda: engine.process(t, values),
        "process, total as an array": lambda: engine.process(t, values)["total"],
        "step": lambda: live.step(next(clock) * 0.001, frame),
        "NumPy, without orientation": numpy,
    }
    found: dict[str, list[float]] = {name: [] for name in ways}
    for name, work in ways.items():
        work()
    for _ in range(asked.rounds):
        for name, work in ways.items():
            found[name].append(seconds(work, 0.3 if name != "NumPy, without orientation" else 0))
    medians = {name: statistics.median(times) for name, times in found.items()}
    for name, median in medians.items():
        per = 1 if name == "step" else FRAMES
        print(f"{name:32} {1e3 * median:10.3f} ms a call {1e6 * median / per:10.3f} µs a frame")
    print(f"NumPy takes {medians['NumPy, without orientation'] / medians['process']:.0f} times as long")
    if asked.json:
        json.dump({"python": sys.version, "numpy": np.__version__, "seconds": found}, asked.json)


if __name__ == "__main__":
    main()
