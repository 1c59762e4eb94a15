#!/usr/bin/env python3
"""From Python, as delivered: `Engine.process` and `Engine.step` against the kernels of kernels.py and against the Rust call.

    benches/peers/run --only python [--quick] [--rounds N]

`somatic bench` makes the sensors, the fields and the values, and writes them down. All contestants compute centroids and orientations of
those, and must agree. The Rust call is what `somatic bench` measures, in turns with the others. "With columns" is what a peer returns too: two
arrays by frame and field. The import is timed as what `import somatic_touch` adds to `import numpy` in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import compare
import kernels
import somatic_touch as st

BATCH = ("whole robot, 9984 frames", 1000, 100, 16, 9984)
LIVE = ("whole robot, live", 1000, 100, 16, 1)
SCENE = {"outputs": ["centroid", "orientation"], "accuracy": {"coverage": "all"}}
PEERS = ["NumPy", "Numba, one thread", "Numba, all cores"]


def body_of(members: np.ndarray, uv: np.ndarray, sensors: int) -> st.Body:
    """A sheet with the fields of the dump, in their order by name, each with the chart coordinates that stand there."""
    rows = next(rows for rows in range(int(sensors**0.5), 0, -1) if sensors % rows == 0)
    path = compare.PLACE / "sheet.glb"
    st.Body.grid(rows, sensors // rows, 0.005, name="sheet").save(path, force=True)
    file = path.read_bytes()
    (length,) = struct.unpack_from("<I", file, 12)
    gltf, rest = json.loads(file[20 : 20 + length]), file[20 + length :]
    nodes = [node for node in gltf["nodes"] if "somatic_field" not in node.get("extras", {})]
    kept = {index: nodes.index(node) for index, node in enumerate(gltf["nodes"]) if node in nodes}
    first = len(nodes)
    for field, (taxels, places) in enumerate(zip(members.tolist(), uv.tolist(), strict=True)):
        chart = {"kind": "geodesic", "origin": [0, 0, 0], "u": [1, 0, 0]}
        held = {str(taxel): [1, *place] for taxel, place in zip(taxels, places, strict=True)}
        text = json.dumps({"version": 1, "name": f"field {field:06}", "chart": chart, "members": held})
        nodes.append({"name": f"field {field:06}", "extras": {"somatic_field": text}})
    for owner in [*nodes, *gltf["scenes"]]:
        for key in ("children", "nodes"):
            if key in owner:
                owner[key] = [kept[child] for child in owner[key] if child in kept]
    gltf["scenes"][0]["nodes"] += range(first, len(nodes))
    gltf["nodes"] = nodes
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest)
    return st.Body.load(path)


class Clock:
    """Times that go on from call to call."""

    def __init__(self, frames: int) -> None:
        self.t, self.step = 0.01 * np.arange(frames), 0.01 * frames

    def next(self) -> np.ndarray:
        self.t += self.step
        return self.t


def median_us(work: Callable[[], object], least_s: float) -> float:
    """How long a call takes, after two that are not counted."""
    work(), work()
    times = []
    end = time.perf_counter() + least_s
    while len(times) < 2 or time.perf_counter() < end:
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return 1e6 * statistics.median(times)


def in_turns(ways: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """What each way measures, in µs, by rounds; each begins with another one."""
    found: dict[str, list[float]] = {name: [] for name in ways}
    names = list(ways)
    for turn in range(rounds):
        for name in names[turn % len(names) :] + names[: turn % len(names)]:
            found[name].append(ways[name]())
    return found


def ratio(found: dict[str, list[float]], one: str, other: str) -> list[float]:
    """Of each round `one` over `other`: the median, the least and the most."""
    ratios = sorted(a / b for a, b in zip(found[one], found[other], strict=True))
    return [statistics.median(ratios), ratios[0], ratios[-1]]


def batches(rounds: int, seconds: float) -> dict[str, list[float]]:
    """Batches, in µs a call."""
    _, *shape = BATCH
    frames = shape[3]
    arrays = compare.dumped(shape)
    body, values = body_of(arrays["members"], arrays["uv"], shape[0]), arrays["values"]
    engine, clock = st.Engine(body, SCENE, backend="cpu"), Clock(frames)

    first = st.Engine(body, SCENE, backend="cpu").process(0.01 * np.arange(frames), values)
    for name in SCENE["outputs"]:
        assert np.array_equal(first[name], arrays[name]), f"{name} is not that of the Rust call, to the bit"
    given = (arrays["members"].astype(np.int32), arrays["uv"].astype(np.float32), values)
    peers = {name: kernels.MAKERS[name](*given) for name in PEERS}
    truth = compare.Truth(arrays, 128)
    for name, compute in peers.items():
        truth.check(name, *kernels.in_frames(name, compute()))

    def columns() -> tuple[Any, Any]:
        p = engine.process(clock.next(), values)
        return p["centroid"], p["orientation"]

    ways = {
        "Rust": lambda: compare.bench(shape, "--calls", 15)["us_median"],
        "process": lambda: median_us(lambda: engine.process(clock.next(), values), seconds),
        "process, with columns": lambda: median_us(columns, seconds),
    }
    ways |= {name: lambda compute=compute: median_us(compute, seconds) for name, compute in peers.items()}
    return in_turns(ways, rounds)


def steps(rounds: int, seconds: float) -> dict[str, list[float]]:
    """One frame a call, in µs."""
    _, *shape = LIVE
    arrays = compare.dumped(shape)
    engine = st.Engine(body_of(arrays["members"], arrays["uv"], shape[0]), SCENE, backend="cpu")
    frame, clock = arrays["values"][0].copy(), iter(range(1, 10**9))
    given = (arrays["members"].astype(np.int32), arrays["uv"].astype(np.float32), arrays["values"])
    peers = {name: kernels.MAKERS[name](*given) for name in PEERS}

    def columns() -> tuple[Any, Any]:
        p = engine.step(0.01 * next(clock), frame)
        return p["centroid"], p["orientation"]

    ways = {
        "Rust": lambda: compare.bench(shape)["us_median"],
        "step": lambda: median_us(lambda: engine.step(0.01 * next(clock), frame), seconds),
        "step, with columns": lambda: median_us(columns, seconds),
    }
    ways |= {name: lambda compute=compute: median_us(compute, seconds) for name, compute in peers.items()}
    return in_turns(ways, rounds)


def imports(rounds: int) -> dict[str, list[float]]:
    """A process that does no more than import, in µs."""

    def start(code: str) -> float:
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return 1e6 * (time.perf_counter() - begin)

    ways = {"numpy": lambda: start("import numpy"), "both": lambda: start("import numpy, somatic_touch")}
    in_turns(ways, 2)
    return in_turns(ways, 3 * rounds)


def table(title: str, found: dict[str, list[float]], base: str) -> None:
    print(f"\n{title}\n  {'':28} {'median':>12} {'× ' + base:>24}  rounds")
    for name, times in found.items():
        median, low, high = ratio(found, name, base)
        print(f"  {name:28} {statistics.median(times):>9.1f} µs {median:>24.3f}  {low:.3f}–{high:.3f}", flush=True)


def main() -> None:
    """Measures and prints."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--quick", action="store_true", help="one short round")
    words.add_argument("--rounds", type=int, default=7)
    asked = words.parse_args()
    rounds, seconds = (1, 0.05) if asked.quick else (asked.rounds, 0.3)
    before = os.getloadavg()[0]
    compare.PLACE.mkdir(parents=True, exist_ok=True)

    found = {"batches": batches(rounds, seconds), "steps": steps(rounds, seconds), "imports": imports(rounds)}
    table("9984 frames a call, 1000 sensors, 100 fields of 16", found["batches"], "process, with columns")
    print(f"  process is {ratio(found['batches'], 'process', 'Rust')[0]:.3f} times the Rust call")
    table("One frame a call", found["steps"], "step")
    over = [mine - rust for mine, rust in zip(found["steps"]["step"], found["steps"]["Rust"], strict=True)]
    print(f"  step takes {statistics.median(over):.2f} µs over the Rust call")
    over = [mine - other for mine, other in zip(found["imports"]["both"], found["imports"]["numpy"], strict=True)]
    print(f"\nImport takes {statistics.median(over) / 1e3:.1f} ms over that of NumPy")
    answer = {"load_before": before, "python": sys.version, "numpy": np.__version__, "us": found}
    (compare.PLACE / "python.json").write_text(json.dumps(answer, indent=1) + "\n")


if __name__ == "__main__":
    main()
