#!/usr/bin/env python3
"""Programs: `somatic run` from CSV to NDJSON against with_pandas.py, as whole processes in turns, on the same recording."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import with_pandas

PLACE = Path("target/peers")
SOMATIC = Path("target/release/somatic")
DEAD_BAND = 10  # five of the sensors' sigma
OUTPUTS = "total,peak,active,centroid,orientation"
U = 2.0**-24

SENSOR = """
[layer]
thickness_m = 0.008

[sensor]
kind = "linear"
gain = 20
bits = 12
noise_sigma = 2
"""

# Body, frames a second, and what touches it for ten seconds.
RECORDINGS = {
    "mat": (300, """
[[touch]]
on = "mat"
indenter = "flat"
radius_m = 0.045
path = [[-0.1, -0.7], [0.2, 0.6]]
times_s = [0.0, 10.0]
force_newton = [[0, 300], [10, 300]]

[[touch]]
on = "mat"
indenter = "flat"
radius_m = 0.035
path = [[0.2, -0.6], [-0.2, 0.5]]
times_s = [0.0, 10.0]
force_newton = [[0, 200], [10, 200]]
"""),
    "humanoid": (400, """
[[touch]]
on = "torso/waist/left_1"
indenter = "fingertip"
path = [[0, 0]]
press = { from_s = 0, to_s = 10, newton = 20, ramp_s = 0.2 }

[[touch]]
on = "head/neck/back_1"
indenter = "fingertip"
path = [[0, 0]]
press = { from_s = 1, to_s = 9, newton = 20, ramp_s = 0.2 }
"""),
}


def somatic(*words, **more):
    return subprocess.run([str(word) for word in (SOMATIC, *words)], check=True, capture_output=True, **more).stdout


def prepare(body):
    """A recording, and what both programs need to read it."""
    rate_hz, touches = RECORDINGS[body]
    scene, csv = PLACE / f"{body}.toml", PLACE / f"{body}.csv"
    text = f'body = "{body}"\nrate_hz = {rate_hz}\nduration_s = 10\nseed = 5\n{SENSOR}{touches}'
    if not csv.exists() or not scene.exists() or scene.read_text() != text:
        scene.write_text(text)
        somatic("simulate", scene, "-o", csv, "--force")
    layout, calibration = PLACE / f"{body}.layout.json", PLACE / f"{body}.calibration.toml"
    layout.write_bytes(somatic("inspect", body, "--json"))
    calibration.write_text(f"[all]\ndead_band = {DEAD_BAND}\n")
    ours, theirs = PLACE / f"{body}.somatic.ndjson", PLACE / f"{body}.pandas.ndjson"
    run = ["run", "--body", body, "--source", f"csv:{csv}", "--sink", f"ndjson:{ours}", "--force"]
    run += ["--calibration", calibration, "--backend", "cpu", "--outputs", OUTPUTS, "--quiet"]
    script = [sys.executable, Path(__file__).with_name("with_pandas.py"), csv, layout, DEAD_BAND, theirs]
    return csv, layout, (ours, [SOMATIC, *run]), (theirs, script)


def check(csv, layout, ours, theirs):
    """Holds both outputs to each other: what is counted exactly, what is computed by the bounds of single precision."""
    _, pressures, ids = with_pandas.read_pressures(csv, DEAD_BAND)
    column_of = {taxel: column for column, taxel in enumerate(ids)}
    exact = {}
    for field in json.loads(layout.read_text())["fields"]:
        columns, uv = with_pandas.members(field, column_of)
        found = with_pandas.of_field(pressures[:, columns], uv)
        row_of = {frame: row for row, frame in enumerate(found["frames"].tolist())}
        exact[field["name"]] = (found, row_of, uv)
    compared = in_doubt = 0
    with open(ours) as our_file, open(theirs) as their_file:
        for our_line, their_line in zip(our_file, their_file, strict=True):
            our, their = json.loads(our_line), json.loads(their_line)
            assert (our["t"], our["frame"], len(our["fields"])) == (their["t"], their["frame"], len(their["fields"]))
            for a, b in zip(our["fields"], their["fields"]):
                where = f"frame {our['frame']}, {a['field']}"
                # Counts of the sensors are whole numbers whose sums stay under 2^24.
                for key in ["field", "link", "contact", "total", "peak", "active"]:
                    assert a[key] == b[key], f"{where}: {key} {a[key]} and {b[key]}"
                compared += 1
                found, row_of, uv = exact[a["field"]]
                if uv is None:
                    assert a["flags"] == b["flags"] == ["no_chart"], where
                    continue
                row = row_of[our["frame"]]
                size = np.abs(uv).max()
                bound = (a["active"] + 6) * U * size
                assert np.abs(np.subtract(a["centroid"], b["centroid"])).max() <= bound, f"{where}: centroid"
                # What a point may be off; with it, the choice of points, and whether they are a tie, may change.
                first, second, third = found["reach"][row]
                point = np.sqrt(2) * a["peak"] * (bound + 8 * U * size)
                length = np.hypot(*found["line"][row])
                tie_at = second - third - with_pandas.NEAR * first
                if (third >= 0 and (second - third <= 2 * point or abs(tie_at) <= 4 * point)) or (
                    abs(length - with_pandas.NEAR * first) <= 4 * point
                ):
                    in_doubt += 1
                    continue
                assert a["flags"] == b["flags"], f"{where}: {a['flags']} and {b['flags']}"
                assert ("orientation" in a) == ("orientation" in b), where
                if "orientation" in a:
                    turned = (a["orientation"] - b["orientation"]) % np.pi
                    off = min(turned, np.pi - turned)
                    assert off <= 2 * point / length + 8 * U * np.pi, f"{where}: {off} rad"
    assert compared > in_doubt
    return compared, in_doubt


def check_that_the_check_can_fail(csv, layout, ours, theirs):
    for key, spoil in {"centroid": lambda uv: [1.01 * uv[0], uv[1]], "orientation": lambda angle: angle + 1e-2}.items():
        spoiled = theirs.with_suffix(".spoiled")
        with open(theirs) as file, open(spoiled, "w") as out:
            for line in map(json.loads, file):
                for percept in line["fields"]:
                    if key in percept:
                        percept[key] = spoil(percept[key])
                out.write(json.dumps(line) + "\n")
        try:
            check(csv, layout, ours, spoiled)
        except AssertionError:
            continue
        finally:
            spoiled.unlink()
        raise SystemExit(f"a spoiled {key} was not noticed: the comparison is worth nothing")


def seconds(command):
    start = time.perf_counter()
    subprocess.run([str(word) for word in command], check=True)
    return time.perf_counter() - start


def compare(body, rounds):
    csv, layout, (ours, run), (theirs, script) = prepare(body)
    seconds(run)
    seconds(script)
    compared, in_doubt = check(csv, layout, ours, theirs)
    check_that_the_check_can_fail(csv, layout, ours, theirs)
    times = {"somatic run": [], "pandas + NumPy": []}
    for turn in range(rounds):
        both = [("somatic run", run), ("pandas + NumPy", script)]
        for name, command in both if turn % 2 == 0 else both[::-1]:
            times[name].append(seconds(command))
    with open(csv, "rb") as file:
        frames = sum(1 for _ in file) - 1
    ratios = sorted(their / our for our, their in zip(times["somatic run"], times["pandas + NumPy"]))
    medians = {name: statistics.median(taken) for name, taken in times.items()}
    return {
        "body": body,
        "frames": frames,
        "csv_mb": round(csv.stat().st_size / 1e6, 1),
        "ndjson_mb": round(ours.stat().st_size / 1e6, 1),
        "percepts_compared": compared,
        "lines_in_doubt_not_compared": in_doubt,
        "s_median": {name: round(taken, 3) for name, taken in medians.items()},
        "s_of_rounds": {name: [round(t, 3) for t in taken] for name, taken in times.items()},
        "times_somatic": round(medians["pandas + NumPy"] / medians["somatic run"], 2),
        "times_somatic_of_rounds": [round(ratios[0], 2), round(ratios[-1], 2)],
    }


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--quick", action="store_true", help="one round")
    arguments.add_argument("--rounds", type=int, default=7)
    given = arguments.parse_args()
    before = os.getloadavg()[0]
    found = []
    for body in RECORDINGS:
        found.append(compare(body, 1 if given.quick else given.rounds))
        result = found[-1]
        low, high = result["times_somatic_of_rounds"]
        print(f"\n{body}: {result['frames']} frames, {result['csv_mb']} MB of CSV, {result['ndjson_mb']} MB of NDJSON")
        for name, taken in result["s_median"].items():
            print(f"  {name:16} {taken:>8.3f} s  {result['frames'] / taken:>9.0f} frames/s")
        print(f"  × somatic {result['times_somatic']:.2f}, by rounds {low}–{high}", flush=True)
    answer = {"load_before": before, "recordings": found}
    (PLACE / "programs.json").write_text(json.dumps(answer, indent=1) + "\n")


if __name__ == "__main__":
    main()
