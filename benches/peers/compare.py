#!/usr/bin/env python3
"""Kernels: `somatic bench` against the kernels of kernels.py on the same arrays, in turns, and whether they agree."""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import time
from pathlib import Path

import numpy as np

import kernels

PLACE = Path("target/peers")
SOMATIC = Path("target/release/somatic")

# Name, sensors, fields, members of each, frames a call.
SHAPES = [
    ("hundreds, live", 400, 60, 9, 1),
    ("whole robot, live", 1000, 100, 16, 1),
    ("tum-h1, live", 7560, 600, 24, 1),
    ("whole robot, 9984 frames", 1000, 100, 16, 9984),
    ("hundreds, 9984 frames", 400, 60, 9, 9984),
]

U = 2.0**-24  # unit roundoff of single precision


def bench(shape, *more):
    sensors, fields, members, frames = shape
    command = [SOMATIC, "bench", "--sensors", sensors, "--fields", fields, "--members", members, "--frames", frames]
    command += ["--outputs", "centroid,orientation", "--backend", "cpu", "--json", *more]
    done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def dumped(shape):
    """The arrays of somatic's own inputs and outputs."""
    folder = PLACE / "dump"
    shutil.rmtree(folder, ignore_errors=True)
    bench(shape, "--calls", 1, "--dump", folder)
    index = json.loads((folder / "dump.json").read_text())
    arrays = {name: np.load(folder / array["file"]) for name, array in index["arrays"].items()}
    for name, array in index["arrays"].items():
        assert arrays[name].shape == tuple(array["shape"]) and arrays[name].dtype == array["dtype"], name
    shutil.rmtree(folder)
    for name in ["centroid", "orientation"]:
        arrays[f"has_{name}"] = arrays["present"] & index["present_bits"][name] != 0
    arrays["tie"] = arrays["flags"] & index["flag_bits"]["tie"] != 0
    return arrays


class Truth:
    """The answer in double precision, and how far single precision may be off.

    M products and M - 1 sums of numbers up to X = max |uv| put an error of at most (M + 4) u X on the centroid, in
    whatever order they are added; the inputs' own rounding adds 2 u X. The two points are off by that times P and a few
    roundings more. Where the third farthest is so near to the second that this can swap them, the line is not compared.
    """

    def __init__(self, arrays, frames):
        members, uv = arrays["members"], arrays["uv"]
        pressed = arrays["values"][:frames].astype(np.float64)[:, members]
        self.centroid = np.einsum("tfm,fmk->tfk", pressed, uv) / pressed.sum(axis=2, keepdims=True)
        size = np.abs(uv).max()
        self.centroid_bound = (members.shape[1] + 6) * U * size
        points = (uv - self.centroid[:, :, None, :]) * pressed[..., None]
        reach = np.linalg.norm(points, axis=3)
        order = np.argsort(-reach, axis=2)[:, :, :3]
        ends = np.take_along_axis(points, order[..., None], axis=2)
        far = np.take_along_axis(reach, order, axis=2)
        point_bound = np.sqrt(2) * pressed.max() * (self.centroid_bound + 4 * U * 2 * size)
        self.is_clear = far[:, :, 1] - far[:, :, 2] > 2 * point_bound
        line = ends[:, :, 0] - ends[:, :, 1]
        self.direction = np.arctan2(line[..., 1], line[..., 0])
        # Two points, and the arc tangent's own few last places.
        self.direction_bound = 2 * point_bound / np.linalg.norm(line, axis=2) + 8 * U * np.pi

    def check(self, name, centroid, direction):
        """Share of lines that were too near to a tie to compare."""
        off = np.abs(centroid[: len(self.centroid)] - self.centroid)
        assert np.isfinite(off).all() and off.max() <= self.centroid_bound, f"{name}: centroid off by {off.max()} m"
        if direction is not None:
            turned = np.mod(direction[: len(self.direction)] - self.direction, np.pi)
            off = np.minimum(turned, np.pi - turned)
            wrong = (off > self.direction_bound) & self.is_clear
            assert not wrong.any(), f"{name}: {wrong.sum()} lines differ, by up to {off[wrong].max()} rad"
        return 1 - self.is_clear.mean()


def check_that_checks_can_fail(truth, centroid, direction):
    for what, args in {
        "a centroid off by 1 %": (centroid * 1.01, direction),
        "lines turned by 1 mrad": (centroid, direction + 1e-3),
    }.items():
        try:
            truth.check(what, *args)
        except AssertionError:
            continue
        raise SystemExit(f"{what} was not noticed: the comparison is worth nothing")


def median_us(compute, seconds):
    compute()
    times = []
    end = time.perf_counter() + seconds
    while len(times) < 2 or time.perf_counter() < end:
        start = time.perf_counter()
        compute()
        times.append(time.perf_counter() - start)
    return statistics.median(times) * 1e6


def compare(name, shape, rounds, seconds):
    frames = shape[3]
    arrays = dumped(shape)
    truth = Truth(arrays, min(frames, 128))
    assert arrays["has_centroid"].all() and arrays["has_orientation"].all()
    truth.check("somatic", arrays["centroid"], arrays["orientation"])
    check_that_checks_can_fail(truth, arrays["centroid"], arrays["orientation"])

    given = (arrays["members"].astype(np.int32), arrays["uv"].astype(np.float32), arrays["values"])
    peers = {peer: make(*given) for peer, make in kernels.MAKERS.items() if kernels.fits(peer, frames)}
    near_ties = max(truth.check(peer, *kernels.in_frames(peer, compute())) for peer, compute in peers.items())

    us = {contestant: [] for contestant in ["somatic", *peers]}
    calls = [] if frames == 1 else ["--calls", 15]
    for turn in range(rounds):
        order = list(us)
        for contestant in order[turn % len(order) :] + order[: turn % len(order)]:
            if contestant == "somatic":
                us[contestant].append(bench(shape, *calls)["us_median"])
            else:
                us[contestant].append(median_us(peers[contestant], seconds))
    ours = statistics.median(us["somatic"])
    results = {}
    for contestant, times in us.items():
        median = statistics.median(times)
        ratios = sorted(theirs / own for theirs, own in zip(times, us["somatic"]))
        results[contestant] = {
            "us_median": round(median, 2),
            "us_of_rounds": [round(t, 2) for t in times],
            "memberships_per_s": float(f"{shape[1] * shape[2] * frames / median * 1e6:.4g}"),
            "times_somatic": round(median / ours, 2),
            "times_somatic_of_rounds": [round(ratios[0], 2), round(ratios[-1], 2)],
        }
    return {
        "name": name,
        "shape": dict(zip(["sensors", "fields", "members", "frames"], shape)),
        "near_ties_not_compared": float(f"{near_ties:.3g}"),
        "results": results,
    }


def table(found):
    shape = found["shape"]
    print(f"\n{found['name']}: {shape['fields']} fields of {shape['members']} out of {shape['sensors']} sensors")
    print(f"  {'':42} {'median':>12} {'rate':>10} {'× somatic':>10}  rounds")
    for contestant, result in found["results"].items():
        low, high = result["times_somatic_of_rounds"]
        rate = f"{result['memberships_per_s'] / 1e6:.1f} M/s"
        print(f"  {contestant:42} {result['us_median']:>9.1f} µs {rate:>10} {result['times_somatic']:>10.2f}  {low}–{high}", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--quick", action="store_true", help="one short round")
    arguments.add_argument("--rounds", type=int, default=7)
    given = arguments.parse_args()
    rounds, seconds = (1, 0.05) if given.quick else (given.rounds, 0.3)
    before = os.getloadavg()[0]
    found = []
    for name, *shape in SHAPES:
        found.append(compare(name, shape, rounds, seconds))
        table(found[-1])
    answer = {"load_before": before, "rounds": rounds, "shapes": found}
    (PLACE / "kernels.json").write_text(json.dumps(answer, indent=1) + "\n")


if __name__ == "__main__":
    main()
