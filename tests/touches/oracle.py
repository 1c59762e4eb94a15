"""Compares touches of the whole body that `somatic run` gave with a definition of its own.

    oracle.py compare BODY.glb LISTED.json FRAMES.csv CALIBRATION.toml TOUCHES.ndjson [ON OFF]
    oracle.py random SOMATIC FOLDER [--long] [--seed N]

LISTED.json is what `somatic inspect BODY.glb --json` prints. TOUCHES.ndjson is what `somatic run --outputs
touches,touches.taxels,touches.orientation` gave for FRAMES.csv. CALIBRATION.toml may have baseline, gain, dead_band, unit, noise and
mask; gains are powers of two and baselines whole numbers, so that P is exact.

Prints a JSON object: `frames`, `touches` (compared), `wrong` (the number of touches and frames with something wrong), `examples` of
these, and `excluded`: by kind of choice, the number of touches that depend on a choice too close to call.

`random` makes bodies and recordings in FOLDER, runs SOMATIC on them, and compares: some thousands of touches, or with --long over
100,000. It prints a line for each recording, then the sum, with `missed`: what was changed in a touch and not found to be wrong.

Each frame is judged by itself: which touches there were in the frame before is what SOMATIC gave.
"""

import csv
import json
import sys
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from definition import CLOSE, Frame, measure, normal_at, regions
from skin import Skin

UNITS = {"N": ("N", 1.0), "Pa": ("Pa", 1.0), "kPa": ("Pa", 1e3)}
# Values are compared within this, as a share, and places within this many metres.
SAME = 1e-9
MOST_EXAMPLES = 20
LONGEST_GAP_S, SHORTEST_STEP_S, VELOCITY_OVER_S = 10.0, 1e-9, 0.2


class Calibration:
    def __init__(self, path, skin):
        keys = tomllib.loads(Path(path).read_text()) if path else {}
        every = keys.get("all", {})
        of = lambda key, default: np.array([keys.get("taxel", {}).get(str(i), {}).get(key, every.get(key, default)) for i in skin.ids])
        self.quantity, unit = UNITS.get(every.get("unit"), (None, 1.0))
        self.baseline, self.gain = of("baseline", 0.0).astype(float), of("gain", 1.0) * unit
        self.dead_band, self.mask = of("dead_band", 0.0) * unit, of("mask", False).astype(bool)
        noise = of("noise", np.nan).astype(float)
        unknown = np.maximum(self.gain / 2, self.dead_band / 3)
        self.sigma = np.where(np.isnan(noise), unknown, self.gain * noise)
        self.weight = np.ones(len(skin.ids)) if self.quantity == "N" else skin.cell

    def frame(self, skin, raw):
        pressures = self.gain * (raw - self.baseline)
        with np.errstate(invalid="ignore"):
            has_value = ~self.mask & np.isfinite(raw) & (np.abs(pressures) <= 2.0**60)
            pressures = np.where(has_value & (pressures > self.dead_band), pressures, 0.0)
        return Frame(pressures, has_value, skin.bridged(has_value))


def recorded(path, skin):
    """Times, raw values by node (NaN: no number), and which are missing."""
    with open(path) as file:
        rows = list(csv.reader(file))
    nodes = [skin.node_of[int(name)] for name in rows[0][1:]]
    for row in rows[1:]:
        raw, missing = np.full(len(skin.ids), np.nan), np.ones(len(skin.ids), bool)
        for node, cell in zip(nodes, row[1:]):
            if cell:
                raw[node], missing[node] = float(cell), False
        yield float(row[0]), raw, missing


class Comparison:
    def __init__(self, skin, calibration, on, off):
        self.skin, self.calibration, self.on, self.off = skin, calibration, on, off
        self.frames = self.touches = self.wrong = 0
        self.excluded, self.examples = Counter(), []
        self.largest = {}
        self.forget()

    def forget(self):
        self.t, self.id_of, self.pairs, self.onset, self.doubtful = None, {}, set(), {}, set()
        self.trails, self.known = {}, set()
        # Of touches whose beginning, or parting, was too close to call: the trail is not known until it begins anew.
        self.unknown_trails = set()

    def error(self, what, **details):
        self.wrong += 1
        if len(self.examples) < MOST_EXAMPLES:
            self.examples.append({"what": what, "frame": self.number} | details)

    def step(self, t, raw, missing, told):
        self.frames += 1
        self.number = told["frame"]
        step = None if self.t is None else t - self.t
        restarts = step is not None and abs(step) > SHORTEST_STEP_S and (step < 0 or step > LONGEST_GAP_S)
        before = set(self.onset)
        highest = max([self.highest] + list(before)) if hasattr(self, "highest") else max(before, default=-1)
        if restarts:
            self.forget()
        frame = self.calibration.frame(self.skin, raw)
        were = lambda a, b: frozenset((self.id_of.get(a), self.id_of.get(b))) in self.pairs
        found, pairs = regions(self.skin, frame, self.calibration.sigma, were)
        for region in found:
            if {self.id_of.get(node) for node in region.members} & self.doubtful:
                region.doubts.add("pairs of the frame before")
        claims = self.identities(frame, found)
        touches = {frozenset(self.skin.node_of[i] for i in touch["taxels"]): touch for touch in told["touches"]}
        ids, new = {}, []
        # Touches of the frame before that share pressure with a region that the program divided otherwise, by a choice too close to
        # call: how they go on depends on it.
        divided_otherwise = [region for region in found if region.doubts and frozenset(region.members) not in touches]
        claimed = {self.id_of.get(node) for region in divided_otherwise for node in region.members} - {None}
        for region, (kept, merged, doubts) in zip(found, claims):
            region.doubts |= doubts
            touch = touches.pop(frozenset(region.members), None)
            total = frame.pressures[region.members].sum()
            wanted = total > self.on or (kept is not None and total > self.off)
            contested = bool({self.id_of.get(node) for node in region.members} & claimed)
            if not wanted and touch is None:
                continue
            if touch is None and contested and total <= self.on:
                self.exclude({"identity"})
                continue
            if touch is None or not wanted:
                self.mismatch(region, touch)
                continue
            ids[id(region)] = touch["id"]
            if contested:
                self.unknown_trails.add(touch["id"])
            if touch["id"] != kept and (kept is not None or touch["id"] <= highest or touch["id"] in new):
                if region.doubts or contested:
                    self.exclude(region.doubts or {"identity"})
                else:
                    self.error("another identity", told=touch["id"], here=kept, taxels=touch["taxels"])
            if kept is None:
                new.append(touch["id"])
            self.compare(t, frame, region, touch, merged, missing)
        doubtful = bool({d for region in found for d in region.doubts})
        for touch in touches.values():
            if not doubtful:
                self.error("no such region", told=touch["taxels"])
        # What was divided otherwise, by a choice that is too close to call, goes on as the program reported it.
        self.divided_otherwise = {touch["id"] for touch in touches.values()}
        self.unknown_trails |= self.divided_otherwise
        told_ids = {touch["id"] for touch in told["touches"]}
        gone = before - told_ids if not restarts else set(before)
        if sorted(gone) != told["released"]:
            self.error("released", told=told["released"], here=sorted(gone))
        self.keep(t, frame.pressures, told, ids, pairs)
        self.highest = max([highest] + list(told_ids))

    def mismatch(self, region, touch):
        taxels = [self.skin.ids[node] for node in sorted(region.members)]
        if region.doubts:
            self.exclude(region.doubts)
        else:
            self.error("not a touch" if touch is None else "not wanted", here=taxels)

    def exclude(self, doubts):
        self.excluded.update(doubts)

    def identities(self, frame, found):
        """Per region the id that it has if it was there, whether others have merged with it, and doubts.

        Pairs of a touch before and a region are made in order of the pressure that they share, Σ min(P, P before). Touches that
        are left over have merged with the region that they share most with, and the older id stays.
        """
        shares = Counter()
        for index, region in enumerate(found):
            if frame.pressures[region.members].sum() > self.off:
                for node in region.members:
                    if node in self.id_of:
                        shares[self.id_of[node], index] += min(frame.pressures[node], self.pressures[node])
        peak = lambda index: (-frame.pressures[found[index].peak], found[index].peak)
        order = sorted(shares, key=lambda pair: (-shares[pair], pair[0], peak(pair[1])))
        ids, kept, merged = {}, {}, set()
        for touch, index in order:
            if touch not in ids and index not in kept:
                ids[touch], kept[index] = index, touch
        for touch, index in order:
            if touch not in ids:
                ids[touch] = index
                merged.add(index)
                kept[index] = min(kept[index], touch)
        doubts = [set() for _ in found]
        for one, other in zip(order, order[1:]):
            if shares[one] != shares[other] and shares[one] - shares[other] <= CLOSE * shares[one]:
                for _, index in (one, other):
                    doubts[index].add("share")
        # A touch that shares pressure with a new one has lost a part.
        is_new = lambda index: index not in kept and frame.pressures[found[index].members].sum() > self.on
        self.parted = {kept[ids[touch]] for touch, index in order if is_new(index)}
        return [(kept.get(index), index in merged, doubts[index]) for index in range(len(found))]

    def keep(self, t, pressures, told, ids, pairs):
        self.t, self.pressures = t, pressures
        self.id_of = {self.skin.node_of[i]: touch["id"] for touch in told["touches"] for i in touch["taxels"]}
        both = [(ids.get(id(a)), ids.get(id(b)), d) for a, b, d in pairs]
        # Two that were found to be two are known as such as long as both last.
        last = {touch["id"] for touch in told["touches"]}
        self.pairs = {pair for pair in self.pairs if pair <= last}
        self.pairs |= {frozenset((a, b)) for a, b, _ in both if a is not None and b is not None}
        self.doubtful = {i for a, b, doubts in both if doubts for i in (a, b)} - {None} | self.divided_otherwise
        self.onset = {touch["id"]: self.onset.get(touch["id"], t) for touch in told["touches"]}

    # Quantities of one touch.

    def compare(self, t, frame, region, touch, merged, missing):
        skin, members = self.skin, np.array(sorted(region.members))
        self.touches += 1
        wrong = {}
        loads = frame.pressures[members]
        total = loads.sum()

        def same(key, told, here, within=SAME):
            if here is None or told is None:
                if (here is None) != (told is None):
                    wrong[key] = (told, here)
                return
            told, here = np.asarray(told, float), np.asarray(here, float)
            away = float(np.abs(told - here).max())
            limit = within * max(1e-3, float(np.abs(here).max()))
            if not away <= limit:
                wrong[key] = (told.tolist(), here.tolist())
            else:
                self.largest[key] = max(self.largest.get(key, 0.0), away / limit * within)

        same("total", touch["total"], total)
        same("peak", touch["peak"], loads.max())
        same("active", touch["active"], len(members))
        areas = skin.area[members]
        area = areas.sum() if (areas > 0).all() else None
        same("area", touch.get("area"), area)
        force = {"N": total, "Pa": loads @ areas if area else None, None: None}[self.calibration.quantity]
        same("force", touch.get("force"), force)
        same("mean_pressure", touch.get("mean_pressure"), force / area if force is not None and area else None)
        same("age", touch["age"], t - self.onset.get(touch["id"], t))
        links = Counter()
        for node, load in zip(members, loads):
            links[skin.link[node]] += load
        link = max(links, key=lambda index: (links[index], -index))
        tied = [index for index in links if links[index] >= links[link] * (1 - CLOSE)]
        if skin.links[link] != touch["link"]:
            if touch["link"] in [skin.links[index] for index in tied]:
                self.exclude({"link"})
                link = skin.links.index(touch["link"])
            else:
                wrong["link"] = (touch["link"], skin.links[link])
        self.shares("links", touch, {skin.links[i]: share / total for i, share in links.items()}, wrong)
        fields = Counter()
        for node, load in zip(members, loads):
            for name in skin.fields_of[node]:
                fields[name] += load / total
        self.shares("fields", touch, dict(fields), wrong)
        centre = skin.at[members].mean(axis=0)
        there = lambda key, is_place=False: skin.into_body(link, np.array(touch[key]), is_place) if touch.get(key) else None
        same("centre", there("centre", True), centre)
        choices = measure(skin, frame, self.calibration.weight, members, link)
        self.place(touch, members, choices[0]["mean"], there("position", True), there("normal"), wrong)
        self.choice(touch, choices, there, wrong)
        self.flags(touch, frame, members, links, merged, missing, choices, wrong)
        self.velocity(t, touch, link, merged, touch["id"] in self.parted, wrong)
        if wrong:
            doubts = set(region.doubts)
            if doubts:
                self.exclude(doubts)
            else:
                self.error("quantities", id=touch["id"], taxels=touch["taxels"], wrong={k: str(v) for k, v in wrong.items()})

    def shares(self, key, touch, here, wrong):
        told = touch[key]
        if told.keys() != here.keys() or any(abs(told[name] - here[name]) > SAME for name in told):
            wrong[key] = (told, here)

    def place(self, touch, members, mean, position, normal, wrong):
        skin = self.skin
        here = normal_at(skin, members, position)
        if np.linalg.norm(normal - here) > 10 * SAME:
            wrong["normal"] = (normal.tolist(), here.tolist())
        if len(skin.surface.corners) == 0:
            # It lies in the plane of the taxel nearest to the mean; of two as near, in that of either.
            gaps = np.linalg.norm(skin.at[members] - mean, axis=1)
            bases = members[gaps <= gaps.min() * (1 + CLOSE)]
            heights = ((mean - skin.at[bases]) * skin.mean_normal[bases]).sum(axis=1)
            planes = mean - skin.mean_normal[bases] * heights[:, None]
            off = np.linalg.norm(planes - position, axis=1)
            self.excluded["_placed"] += 1
            if off.min() > SAME:
                wrong["position"] = (position.tolist(), planes.tolist())
            return
        away = np.linalg.norm(position - mean)
        # The taxels are points of their cells.
        limit = np.linalg.norm(skin.at[members] - mean, axis=1).min()
        if away > limit + 1e-5:
            wrong["position"] = ("a taxel is nearer to the mean", away, limit)
        # Their cells are on the parts of the surface that they are on; inside a body others may be nearer.
        parts = np.unique(skin.part[members])
        best = skin.surface.nearest(mean, limit + 1e-4, parts)
        if best is None:
            return
        if away < np.linalg.norm(best - mean) - 1e-7:
            wrong["position"] = ("nearer than the surface", away, np.linalg.norm(best - mean))
        on = skin.surface.nearest(position, 1e-4)
        if on is None or np.linalg.norm(on - position) > 1e-6:
            wrong["position"] = ("not on the surface", position.tolist())
        gaps = np.linalg.norm(skin.at - best, axis=1)
        others = np.delete(gaps, members)
        # The nearest point is in a cell of these taxels where no other taxel is nearly as near.
        if gaps[members].min() < 0.8 * others.min(initial=np.inf):
            self.excluded["_placed"] += 1
            if np.linalg.norm(position - best) > 1e-6:
                near = skin.surface.nearest(mean, limit, parts)
                if near is not None and abs(away - np.linalg.norm(best - mean)) < 1e-9:
                    self.exclude({"nearest point"})
                else:
                    wrong["position"] = (position.tolist(), best.tolist(), mean.tolist())

    def choice(self, touch, choices, there, wrong):
        """Some choice of base and of farthest points gives what the program reported."""
        told_axis, told_line = there("principal_axis"), there("orientation")
        fits, why = [], []
        for one in choices:
            off = {}
            told_spread, spread = touch.get("spread"), one.get("spread")
            # Moments are rounded in proportion to the larger one; a root makes much of little.
            squares = None if told_spread is None or spread is None else np.array([told_spread, spread]) ** 2
            if (told_spread is None) != (spread is None) or (
                squares is not None and np.abs(squares[0] - squares[1]).max() > 1e-11 * squares.max()
            ):
                off["spread"] = (told_spread, spread)
            anisotropy, told = one.get("anisotropy"), touch.get("anisotropy")
            if (told is None) != (anisotropy is None) or (told is not None and abs(told - anisotropy) > 10 * SAME):
                off["anisotropy"] = (told, anisotropy)
            within = 10 * SAME / (anisotropy or 1)
            near_isotropic = anisotropy is not None and abs(anisotropy - 1e-3) < 10 * SAME
            if not near_isotropic:
                self.line("principal_axis", told_axis, touch.get("principal_axis_angle"), one.get("axis"), one.get("angle"), within, off)
            lines = one.get("lines") or [None]
            each = []
            for line in lines:
                off_line = {}
                way, angle = line or (None, None)
                self.line("orientation", told_line, touch.get("orientation_angle"), way, angle, 100 * SAME, off_line)
                each.append(off_line)
            off |= min(each, key=len)
            fits.append(len(lines) > 1)
            why.append(off)
        if len(choices) > 1:
            self.exclude({"base taxel"})
        if any(fits):
            self.exclude({"farthest pair"})
        best = min(why, key=len)
        if best and any(one["doubts"] for one in choices):
            self.exclude({"wrapped"})
        else:
            wrong.update(best)

    @staticmethod
    def line(key, told, told_angle, way, angle, within, off):
        if (told is None) != (way is None):
            off[key] = (told, way)
        elif told is not None and np.linalg.norm(np.cross(told, way)) > within:
            off[key] = (told.tolist(), way.tolist())
        if (told_angle is None) != (angle is None):
            off[f"{key}_angle"] = (told_angle, angle)
        elif angle is not None and abs(np.sin(told_angle - angle)) > within + SAME:
            off[f"{key}_angle"] = (told_angle, float(angle))

    def flags(self, touch, frame, members, links, merged, missing, choices, wrong):
        own, told = set(), set(touch["flags"])
        beside = {other for node in members for other in self.skin.beside[node] if not frame.has_value[other]}
        own |= {"incomplete"} if any(missing[node] for node in beside) else set()
        own |= {"faulty_input"} if any(not missing[node] for node in beside) else set()
        own |= {"merged"} if merged else set()
        own |= {"young"} if touch.get("velocity") is None else set()
        own |= {"several_links"} if len(links) > 1 else set()
        own |= {"no_unit"} if touch.get("force") is None else set()
        own |= {"wrapped"} if choices[0]["wrapped"] else set()
        own |= {choices[0]["why"]} if "why" in choices[0] else set()
        judged = {"incomplete", "faulty_input", "merged", "several_links", "no_unit", "wrapped", "one_taxel", "isotropic", "young"}
        if own & judged != told & judged and not (len(choices) > 1):
            wrong["flags"] = (sorted(told), sorted(own))

    def velocity(self, t, touch, link, is_new_or_merged, lost, wrong):
        """The change since the newest position that is 0.2 s old. Of positions some are kept only: no two within a 16th of that."""
        trail = self.trails.setdefault(touch["id"], [])
        old = lambda entry, by: t - entry[0] >= by * (1 - 1e-6)
        if is_new_or_merged or lost or (trail and trail[-1][2] != link):
            trail.clear()
            self.unknown_trails.discard(touch["id"])
        place = np.array(touch["position"])
        then = next((entry for entry in reversed(trail) if old(entry, VELOCITY_OVER_S)), None)
        if not trail or (t > trail[-1][0] and old(trail[-1], VELOCITY_OVER_S / 16)):
            trail.append((t, place, link))
        told = touch.get("velocity")
        here = None if then is None else (place - then[1]) / (t - then[0])
        if touch["id"] in self.unknown_trails:
            self.exclude({"trail"})
        elif (told is None) != (here is None) or (told is not None and np.abs(here - told).max() > 100 * SAME):
            wrong["velocity"] = (told, here)

    def report(self):
        excluded = {key: n for key, n in self.excluded.items() if not key.startswith("_")}
        return {
            "frames": self.frames, "touches": self.touches, "wrong": self.wrong, "excluded": excluded,
            "placed": self.excluded["_placed"], "examples": self.examples,
        }


def compare(body, listed, frames, calibration, touches, on=0.0, off=None):
    return compare_on(Skin(body, listed), frames, calibration, touches, on, off)


def compare_on(skin, frames, calibration, touches, on=0.0, off=None):
    comparison = Comparison(skin, Calibration(calibration, skin), float(on), float(on if off is None else off))
    with open(touches) as file:
        for (t, raw, missing), line in zip(recorded(frames, skin), file):
            comparison.step(t, raw, missing, json.loads(line))
    return comparison.report()


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["compare", *rest] if len(rest) >= 5:
            json.dump(compare(*rest), sys.stdout)
        case ["random", *rest] if len(rest) >= 2:
            from random_touches import main

            main(*rest)
        case _:
            raise SystemExit(__doc__)
