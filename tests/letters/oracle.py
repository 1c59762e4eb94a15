"""Compares shear, temperature and proximity that `somatic run` gave with a definition of their own.

    oracle.py SOMATIC FOLDER [--long] [--seed N]

Makes random bodies, calibrations, frames and poses in FOLDER (`made.py`), runs SOMATIC on them, and compares each cell: a field's letter
in a frame; and what touches feel (`of_touches.py`). Prints a JSON object: `cells`, by letter `by_letter`, `touches` (compared), `present`
(by quantity, how often there was one), `touch_flags` (how often each was there), `in_world` (touches of frames with poses), `wrong` (cells
and touches with something wrong), `examples` of these, `largest` (by quantity the largest difference over what rounding may be), and
`missed`: what was changed in a line and not found to be wrong. Some ten thousand cells, or with --long over a million.

The definition is that of the documentation, in numpy, over arrays of frames; it shares nothing with the program but files.
"""

import argparse
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from calibrated import PRESSURES, SAME, UNITS, Value, arc, gradient_within, read, sensed
from made import Recording, recordings
from of_touches import FLAGS, TOUCHES, TouchesOf
from slope import Slope

LETTERS = {
    "shear": ["shear", "shear_direction", "shear_vector", "force_vector", "torsion", "friction", "friction_sigma", "slip_ratio"],
    "temperature": [
        "temperature", "warmest", "warmest_taxel", "warmest_position", "coldest", "coldest_taxel", "coldest_position",
        "temperature_gradient", "temperature_rate",
    ],
    "proximity": [
        "nearest", "nearest_taxel", "nearest_position", "nearest_normal", "approach_speed", "covered", "proximity_centroid",
    ],
}
HUGE = 2.0**60
LEAST_M = 1e-4
LONGEST_GAP_S, SHORTEST_STEP_S = 10.0, 1e-9
MOST_EXAMPLES = 20


class Field:
    def __init__(self, recording, field, kinds):
        body = recording.body
        self.body, self.chart = body, body.chart_of(field)
        self.members = sorted((taxel for taxel in field.members if body.kind[taxel] in kinds), key=lambda taxel: body.ids[taxel])
        self.weights = np.array([field.members[taxel] for taxel in self.members])
        self.moved, self.anchor_pose = recording.frames.moved, body.pose(body.anchor(field))
        at, normals, first, second = body.in_anchor(field, self.members)
        self.at, self.normals, self.tangents = at, normals, (first, second)
        if self.chart:
            origin, u, v, n = self.chart
            self.places = np.stack([(at - origin) @ u, (at - origin) @ v], axis=1)
            self.along = [np.array([[turned @ u, turned @ v] for turned in map(arc, normals, [n] * len(normals), way)]) for way in self.tangents]

    def placed(self, frame):
        """Places, normals and both tangents in a frame: in the anchor, or in the world if it has poses."""
        if self.moved[frame] is None:
            return self.at, self.normals, self.tangents
        (rotation, origin), (turns, steps) = self.anchor_pose, (of[self.body.link[self.members]] for of in self.moved[frame])
        turned = lambda ways: np.einsum("nij,nj->ni", turns, ways @ rotation.T)
        return turned(self.at) + turns @ origin + steps, turned(self.normals), tuple(map(turned, self.tangents))


def temperatures(recording, field, frames):
    """What is right of a field's temperatures, by frame: quantities, flags."""
    values, inside, missing, faulty, _ = sensed(recording, "temperature", field.members)
    slope = Slope(recording.calibration.get("temperature", {}).get("window_s", 1.0))
    for frame, t in enumerate(frames.t):
        if frames.restarts[frame]:
            slope.clear()
        flags = flags_of(missing[frame], faulty[frame], field)
        there = np.flatnonzero(~missing[frame] & ~faulty[frame])
        if len(there) == 0:
            yield {}, flags | {"no_contact"}, False
            continue
        flags |= {"out_of_range"} if not inside[frame, there].all() else set()
        celsius, weights, at = values[frame, there], field.weights[there], field.placed(frame)[0]
        size = np.abs(celsius).max() + 300
        mean = (weights * celsius).sum() / weights.sum()
        found = {"temperature": Value(mean, size)}
        for name, index in (("warmest", celsius.argmax()), ("coldest", celsius.argmin())):
            member = there[index]
            found[name] = Value(celsius[index], size)
            found[f"{name}_taxel"] = Value(field.body.ids[field.members[member]])
            found[f"{name}_position"] = Value(at[member], 1)
        if field.chart and len(there) >= 3:
            away = field.places[there] - (weights[:, None] * field.places[there]).sum(axis=0) / weights.sum()
            root = np.sqrt(weights)
            moments = (root[:, None] * away).T @ (root[:, None] * away)
            least, most = np.linalg.eigvalsh(moments)
            share = least * most / (least + most) ** 2
            if share > 1.001e-6:
                gradient = np.linalg.lstsq(root[:, None] * away, root * (celsius - mean), rcond=None)[0]
                found["temperature_gradient"] = gradient_within(gradient, celsius, weights, least, most)
            elif share > 0.999e-6:
                found["temperature_gradient"] = None
            else:
                flags |= {"no_gradient"}
        elif field.chart:
            flags |= {"no_gradient"}
        weighted = lambda of: sum(field.weights[m] * c for m, c in of.items()) / sum(field.weights[m] for m in of) if of else None
        found["temperature_rate"] = slope.follow(t, dict(zip(there, celsius)), weighted, size)
        yield found, flags | (set() if found["temperature_rate"] else {"no_previous"}), True


def distances(recording, field, frames):
    keys = recording.calibration.get("proximity", {})
    values, inside, missing, faulty, beyond = sensed(recording, "proximity", field.members)
    slope = Slope(keys.get("window_s", 0.1))
    reach = keys["range"] * UNITS["proximity"][keys.get("unit", "mm")][0] if "range" in keys else np.inf
    for frame, t in enumerate(frames.t):
        if frames.restarts[frame]:
            slope.clear()
        flags = flags_of(missing[frame], faulty[frame], field)
        reads = ~missing[frame] & ~faulty[frame]
        if not reads.any():
            yield {}, flags | {"no_contact"}, False
            continue
        with np.errstate(invalid="ignore"):
            # Beyond the far end of a curve nothing is near.
            there = np.flatnonzero(reads & (beyond[frame] != 1) & (values[frame] <= reach))
        flags |= {"out_of_range"} if (reads & ~inside[frame]).any() else set()
        found = {"covered": Value(len(there))}
        if len(there) == 0:
            # One that saw something and has no reading now may see it still.
            if all(reads[member] for member, metres in slope.before.items() if np.isfinite(metres)):
                slope.clear()
            yield found, flags | {"out_of_range", "no_contact"}, False
            continue
        flags |= {"saturated"} if ((values[frame, there] < LEAST_M) | (beyond[frame, there] == -1)).any() else set()
        metres = np.maximum(values[frame, there], LEAST_M)
        nearest = there[metres.argmin()]
        found["nearest"] = Value(metres.min(), 1)
        found["nearest_taxel"] = Value(field.body.ids[field.members[nearest]])
        at, normals, _ = field.placed(frame)
        found["nearest_position"] = Value(at[nearest], 1)
        found["nearest_normal"] = Value(normals[nearest], 1)
        if field.chart:
            weights = 1 / metres**2
            found["proximity_centroid"] = Value((weights[:, None] * field.places[there]).sum(axis=0) / weights.sum(), 1)
        # Those that read that nothing is near are there, too.
        now = {member: np.inf for member in np.flatnonzero(reads)} | dict(zip(there, metres))
        least = lambda of: min(of.values()) if of and np.isfinite(min(of.values())) else None
        rate = slope.follow(t, now, least, 1e-3)
        found["approach_speed"] = rate and Value(-rate.value, rate.size)
        yield found, flags | (set() if rate else {"no_previous"}), True


def shears(recording, field, frames):
    file, body = recording.calibration, recording.body
    every, keys = file.get("all", {}), file.get("shear", {})
    quantity, unit = PRESSURES[every.get("unit")]
    of = lambda key, default, table=every: np.array(
        [file.get("taxel", {}).get(str(body.ids[taxel]), {}).get(key, table.get(key, default)) for taxel in field.members]
    )
    own_of = lambda key, default: [file.get("taxel", {}).get(str(body.ids[taxel]), {}).get(key, default) for taxel in field.members]
    unit *= every.get("scale", 1.0)
    baseline, gain, mask = of("baseline", 0.0).astype(float), of("gain", 1.0) * unit, of("mask", False).astype(bool)
    gain = np.where(of("invert", False).astype(bool), -gain, gain)
    dead_band, noise = of("dead_band", 0.0) * PRESSURES[every.get("unit")][1], of("noise", np.nan).astype(float)
    most = of("p_max", np.inf).astype(float) * PRESSURES[every.get("unit")][1]
    ranges = np.array([file.get("taxel", {}).get(str(body.ids[taxel]), {}).get("raw_range", every.get("raw_range", [-np.inf, np.inf])) for taxel in field.members])
    # Of u and of v.
    own_gain = np.array([np.broadcast_to(both, 2) for both in own_of("shear_gain", keys.get("gain", np.nan))], float).T * unit
    side_gain = np.where(np.isnan(own_gain), np.abs(gain), own_gain)
    rest = np.array(own_of("shear_baseline", keys.get("baseline", [0.0, 0.0])))
    side_range = np.array(own_of("shear_raw_range", keys.get("raw_range", [-np.inf, np.inf])))
    side_noise = of("shear_noise", keys.get("noise", np.nan)).astype(float)
    side_noise = np.where(np.isnan(side_noise), noise, side_noise)
    cross = np.array(keys.get("cross_axis", np.eye(3)), float)
    cross = np.vstack([np.eye(3)[: 3 - len(cross)], cross])
    areas = body.area[field.members]
    newtons = {"N": np.ones(len(areas)), "Pa": np.where(areas > 0, areas, np.nan), None: np.full(len(areas), np.nan)}[quantity]
    raw, missing = read(recording, field.members)
    sides = [read(recording, field.members, axis) for axis in ("u", "v")]
    for frame in range(len(frames.t)):
        gone = missing[frame]
        bad = ~gone & (mask | ~np.isfinite(raw[frame]))
        flags = flags_of(gone, bad, field)
        usable = ~gone & ~bad
        side = np.stack([sides[axis][0][frame] for axis in (0, 1)])
        no_side = sides[0][1][frame] | sides[1][1][frame]
        with np.errstate(invalid="ignore"):
            off_range = (side < side_range[:, 0]) | (side > side_range[:, 1])
            off_side = off_range.any(axis=0)
            lateral = side_gain * (side - rest.T)
            # What is along the skin is taken out of raw values, which are singles, as far as it is known.
            absent = np.stack([sides[axis][1][frame] for axis in (0, 1)])
            no_number = ~absent & ~np.isfinite(side)
            off_range &= ~absent & ~no_number
            in_part = usable & (cross[0, 1:, None] != 0)
            shares = np.where(absent | no_number | off_range, 0, cross[0, 1:, None] * lateral / gain)
            leak = (cross[0, 0] - 1) * (raw[frame] - baseline) + shares.sum(axis=0)
            is_leaky = usable & np.any(cross[0] != [1, 0, 0])
            normal_raw = np.where(is_leaky, (raw[frame] + leak).astype(np.float32), raw[frame])
            outside = usable & ((raw[frame] < ranges[:, 0]) | (raw[frame] > ranges[:, 1]))
            flags |= {"incomplete"} if (in_part & absent).any() else set()
            flags |= {"faulty_input"} if (in_part & no_number).any() else set()
            flags |= {"out_of_range"} if (in_part & off_range).any() else set()
            pressure = gain * (normal_raw - baseline)
            pressed = usable & (pressure > dead_band) & (pressure > 0)
            flags |= {"saturated"} if (pressed & (pressure > most)).any() else set()
        flags |= {"out_of_range"} if outside.any() else set()
        bad_side = ~no_side & ~(np.isfinite(sides[0][0][frame]) & np.isfinite(sides[1][0][frame]))
        flags |= {"incomplete"} if (pressed & no_side).any() else set()
        flags |= {"faulty_input"} if (pressed & bad_side).any() else set()
        off_side &= ~no_side & ~bad_side
        flags |= {"out_of_range"} if (pressed & off_side).any() else set()
        there = np.flatnonzero(pressed & ~no_side & ~bad_side & ~off_side)
        # What presses counts in the force, whether it is known how it pulls or not.
        presses = np.flatnonzero(pressed)
        if len(presses) == 0:
            yield {}, flags | {"no_contact"}, False
            continue
        _, normals, tangents = field.placed(frame)
        normal = -(newtons * np.where(pressed, pressure, 0))[presses, None] * normals[presses]
        if np.isnan(newtons[presses]).any():
            flags |= {"no_unit"}
        if len(there) == 0:
            force = Value(normal.sum(axis=0), np.abs(normal).sum())
            yield {} if "no_unit" in flags else {"force_vector": force}, flags, True
            continue
        p, weights, g = pressure[there], field.weights[there], side_gain[:, there]
        # What was measured along the normal, of which the matrix makes P.
        measured = (p - cross[0, 1:] @ lateral[:, there]) / cross[0, 0]
        along = cross[1:] @ np.vstack([measured, lateral[:, there]])
        in_space = along[0][:, None] * tangents[0][there] + along[1][:, None] * tangents[1][there]
        # Differences from baselines are of larger numbers.
        large = g * (np.abs(side[:, there]) + np.abs(rest[there].T))
        terms = np.abs(cross[1:]) @ np.vstack([(p + np.abs(cross[0, 1:]) @ large) / cross[0, 0], large])
        size, pull = (weights * terms.sum(axis=0)).sum(), (weights * p).sum()
        vector = (weights[:, None] * in_space).sum(axis=0)
        # Without a chart, of each.
        friction = weights @ np.linalg.norm(along, axis=0) / pull
        found = {"shear_vector": Value(vector, size)}
        if "no_unit" not in flags:
            force = (newtons[there, None] * in_space).sum(axis=0) + normal.sum(axis=0)
            found["force_vector"] = Value(force, (newtons[there] * terms.sum(axis=0)).sum() + np.abs(normal).sum())
        if field.chart:
            flat = along[0][:, None] * field.along[0][there] + along[1][:, None] * field.along[1][there]
            total, places = (weights[:, None] * flat).sum(axis=0), field.places[there]
            centre = ((weights * p)[:, None] * places).sum(axis=0) / pull
            arms = places - centre
            torsion = (weights * (arms[:, 0] * flat[:, 1] - arms[:, 1] * flat[:, 0])).sum()
            reach = np.abs(places).max() + 1e-3
            found |= {"shear": Value(total, size)}
            if len(there) > 1:
                found["torsion"] = Value(torsion, 4 * size * reach)
            elif len(presses) == 1:
                flags |= {"one_taxel"}
            length = np.linalg.norm(total)
            # Raw values are rounded to single precision.
            friction, sizes = length / pull, 2.0**-24 * (weights * np.abs(along).sum(axis=0)).sum()
            if length > 1.000001 * sizes:
                found["shear_direction"] = Value(np.arctan2(total[1], total[0]), 4 * max(1, size / length))
            elif length < 0.999999 * sizes or sizes == 0:
                flags |= {"still"}
            else:
                found["shear_direction"] = None
        found["friction"] = Value(friction, size / pull)
        if np.isnan(noise[there]).any():
            flags |= {"noise_unknown"}
        else:
            # Along the direction of the sum in the chart, or else of each.
            if field.chart:
                way = total / np.linalg.norm(total) if np.linalg.norm(total) > 0 else np.array([1.0, 0.0])
                ways = np.stack([field.along[0][there] @ way, field.along[1][there] @ way])
            else:
                lengths = np.linalg.norm(along, axis=0)
                ways = np.where(lengths > 0, along, [[1.0], [0.0]]) / np.where(lengths > 0, lengths, 1)
            # What of each measured force is in the pull, less the friction's share of what of it is in P.
            shares = cross[1:].T @ ways - friction * cross[0][:, None]
            of_each = np.vstack([np.abs(gain[there]) * noise[there], np.abs(g) * side_noise[there]])
            sigma = np.sqrt(((weights * shares * of_each) ** 2).sum()) / pull
            # A standard deviation of P is a difference of values.
            noises = np.hypot(cross[0, 0] * noise[there], np.hypot(*(cross[0, 1:, None] * g * side_noise[there] / gain[there])))
            large = (np.abs(raw[frame, there]) + np.abs(baseline[there]) + noises) / noises
            found["friction_sigma"] = Value(sigma, sigma * large.max() * max(1, size / pull / max(friction, 1e-9)))
        if "slips_at" in keys:
            found["slip_ratio"] = Value(friction / keys["slips_at"], size / pull / keys["slips_at"])
        yield found, flags, True


def flags_of(missing, faulty, field):
    own = {"incomplete"} if missing.any() else set()
    own |= {"faulty_input"} if faulty.any() else set()
    return own if field.chart else own | {"no_chart"}


MAKERS = {"shear": ("force3", shears), "temperature": ("temperature", temperatures), "proximity": ("proximity", distances)}


class Comparison:
    def __init__(self):
        self.cells, self.wrong, self.examples = Counter(), 0, []
        self.present, self.largest, self.touches = Counter(), {}, 0
        self.touch_flags, self.in_world = Counter(), 0

    def off(self, letter, told, found, flags, contact):
        """What is wrong with a cell."""
        wrong = {}
        if told["contact"] != contact:
            wrong["contact"] = (told["contact"], contact)
        if set(told["flags"]) != flags and found.get("shear_direction", 0) is not None:
            wrong["flags"] = (sorted(told["flags"]), sorted(flags))
        for name in LETTERS[letter]:
            if name in found and found[name] is None and name not in ("temperature_rate", "approach_speed"):
                continue
            right, value = found.get(name), told.get(name)
            if (right is None) != (value is None):
                wrong[name] = (value, right and right.value.tolist())
            elif right is not None:
                self.present[name] += 1
                away = np.abs(np.asarray(value, float) - right.value)
                if name == "shear_direction":
                    away = np.minimum(away, 2 * np.pi - away)
                over = float(away.max()) / (SAME * max(right.size, 1e-300)) if away.max() > 0 else 0.0
                self.largest[name] = max(self.largest.get(name, 0.0), over)
                if not over <= 1:
                    wrong[name] = (value, right.value.tolist())
        return wrong

    def take(self, letter, told, found, flags, contact, where):
        self.cells[letter] += 1
        if told is None:
            wrong = {"cell": "absent"}
        else:
            wrong = self.off(letter, told, found, flags, contact)
        self.note(wrong, where | {"letter": letter})
        return wrong

    def take_touch(self, right, number, touch, where):
        self.touches += 1
        self.present.update(f"touches.{name}" for name in TOUCHES if name in touch)
        self.in_world += touch["in"] == "world"
        self.touch_flags.update(FLAGS & set(touch["flags"]))
        wrong = right.wrong(number, touch, self.largest)
        self.note(wrong, where | {"touch": touch["id"]})
        return wrong

    def note(self, wrong, where):
        if wrong:
            self.wrong += 1
            if len(self.examples) < MOST_EXAMPLES:
                self.examples.append(where | wrong)


def changed(told, rng, among=frozenset(name for names in LETTERS.values() for name in names)):
    """`told` with one number of `among` that is there changed by a millionth, or by one if it is an id or a count."""
    names = [name for name in told if name in among]
    if not names:
        return None, told | {"contact": not told["contact"]}
    name = str(rng.choice(sorted(names)))
    value = np.array(told[name], float)
    whole = name.endswith("taxel") or name == "covered"
    place = int(rng.integers(value.size))
    flat = value.reshape(-1)
    flat[place] += 1 if whole else 1e-6 * max(1.0, np.abs(flat).max())
    return name, told | {name: value.tolist()}


def flagged_otherwise(touch, rng):
    """`touch` with one flag more or less, of those that are never too close to call."""
    flag = str(rng.choice(sorted(FLAGS - {"still", "no_gradient"})))
    return flag, touch | {"flags": sorted(set(touch["flags"]) ^ {flag})}


def compare(recording, lines, of_touches, comparison, missed, rng):
    """Compares the lines that the program wrote for `recording`, with its touches by `of_touches` if there are any."""
    frames = recording.frames
    right = {}
    for field in recording.body.fields:
        for letter, (kind, maker) in MAKERS.items():
            of = Field(recording, field, {kind})
            if of.members:
                right[field.name, letter] = maker(recording, of, frames)
    for number, line in enumerate(lines):
        line = json.loads(line)
        told = {(cell["field"], cell.get("letter")): cell for cell in line["fields"]}
        for (field, letter), cells in right.items():
            found, flags, contact = next(cells)
            own = told.get((field, letter)) or (told.get((field, None)) if recording.is_alone(letter) else None)
            wrong = comparison.take(letter, own, found, flags, contact, {"recording": recording.name, "frame": number, "field": field})
            if own is not None and not wrong and rng.random() < 0.01:
                name, other = changed(own, rng)
                before = dict(comparison.largest)
                if not comparison.off(letter, other, found, flags, contact):
                    missed.append([recording.name, number, field, letter, name])
                comparison.largest = before
        if of_touches:
            of_touches.go_on(number, line["touches"])
        for touch in line.get("touches", []):
            wrong = comparison.take_touch(of_touches, number, touch, {"recording": recording.name, "frame": number})
            # A millionth is less than P strays in single precision.
            if recording.backend == "reference" and not wrong and rng.random() < 0.05:
                name, other = changed(touch, rng, TOUCHES) if rng.random() < 0.8 else flagged_otherwise(touch, rng)
                if not of_touches.wrong(number, other, {}):
                    missed.append([recording.name, number, touch["id"], name])
    if number + 1 != len(frames.t):
        raise SystemExit(f"{recording.name}: {number + 1} lines for {len(frames.t)} frames")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("somatic")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    comparison, missed, rng = Comparison(), [], np.random.default_rng(arguments.seed)
    for recording in recordings(arguments.long, arguments.seed):
        assert isinstance(recording, Recording)
        paths = recording.write(arguments.folder)
        outputs = [name for letter in recording.letters() for name in LETTERS[letter]]
        outputs += ["touches", "touches.taxels"] if recording.has_touches() else []
        outputs += ["touches.friction_sigma"] if "shear" in recording.letters() else []
        command = [arguments.somatic, "run", "--body", paths["glb"], "--source", paths["frames"], "--calibration", paths["toml"]]
        command += ["--backend", recording.backend, "--outputs", ",".join(outputs), "--all-fields", "--sink", f"ndjson:{paths['ndjson']}"]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise SystemExit(f"{recording.name}: {done.stderr}")
        before = (comparison.cells.total(), comparison.touches)
        listed = subprocess.run([arguments.somatic, "inspect", paths["glb"], "--json"], capture_output=True, text=True, check=True)
        of_touches = TouchesOf(recording, json.loads(listed.stdout)) if recording.has_touches() else None
        with open(paths["ndjson"]) as lines:
            compare(recording, lines, of_touches, comparison, missed, rng)
        cells, touches = comparison.cells.total() - before[0], comparison.touches - before[1]
        print(f"{recording.name}: {cells} cells, {touches} touches, {comparison.wrong} wrong", file=sys.stderr)
        for path in paths.values():
            path.unlink()
    json.dump({
        "cells": comparison.cells.total(), "by_letter": comparison.cells, "touches": comparison.touches, "present": comparison.present,
        "touch_flags": comparison.touch_flags, "in_world": comparison.in_world, "wrong": comparison.wrong,
        "examples": comparison.examples, "largest": comparison.largest, "missed": missed,
    }, sys.stdout)


if __name__ == "__main__":
    main()
