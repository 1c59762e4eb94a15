"""Measures how true touches of the whole body are, by simulated presses on bodies and on flat sheets.

    accuracy.py SOMATIC FOLDER --body BODY [--presses N] [--strokes N] [--pairs N] [--seed N] [--size X] [--layer X] [--seconds N]

BODY is a file, or hand, mat or humanoid. Prints a table and, last, a JSON object. What was simulated stays in FOLDER, and is used
again. --seconds stops simulating after that time; what is done is measured.

**Presses** are at random places of the skin: balls, fingertips, rods, and straps that wrap, of sizes for cells of (16.2 mm)²,
times --size [default: the root of the body's mean cell, its spacing, by 16.2 mm]. The same indenters with the same forces press a flat sheet of taxels that are
spread alike, as many on a square metre. σ of the layer is --layer spacings [default: 0.5]. Sensors feel the force on their cells; they have 10
bits, noise of 1.5 % of the press's largest value, and are 0 up to six σ, as `simulate` has it. Touches of three taxels and more
count. Errors of position are distances from the truth's place; those of axes angles to the truth's axis in its tangent plane, of touches
with an anisotropy of at least 0.4 that are not wrapped. A touch is good if the RMS angle of its taxels' normals is under 35° and under 15 %
of its taxels have fewer than five edges.

**Strokes** are rods' and balls' of 20 to 80 mm; each should be one identity from onset to release. Those that press in two places
(without noise, a saddle under 0.7 of the lower peak) and those whose truth leaps by over a spacing from frame to frame are told apart.

**Pairs** are two balls 1.5 to 4 contact widths apart, with gains that are lognormal with an SD of 5, 10 and 20 % and noise of 1 to 3 %.
"""

import argparse
import json
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from pressing import Press, Scene, indenter, random_place, sheet, spacing_of
from random_touches import Program
from skin import Skin

ANISOTROPY, GOOD_ANGLE, FEW_EDGES, GOOD_FEW = 0.4, 35.0, 5, 0.15
KINDS = ["ball", "fingertip", "rod", "strap"]


def degrees(a, b):
    """The angle between two lines."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b))))


def turned(vector, normal, other):
    """`vector` turned as the plane across `normal` is turned to that across `other`, on the shortest way."""
    axis, cos = np.cross(normal, other), normal @ other
    return vector * cos + np.cross(axis, vector) + axis * (axis @ vector) / (1 + cos)


def quantiles(values):
    return [float(np.median(values)), float(np.quantile(values, 0.95))] if len(values) else [None, None]


def judge(skin, truth, touches):
    """The touch that has most of a press, against the truth."""
    main = max(touches, key=lambda touch: touch["total"])
    body = lambda link, vector, is_place: skin.into_body(skin.links.index(link), np.array(vector), is_place)
    place = body(truth["link"], truth["place"], True)
    found = {"place": np.linalg.norm(body(main["link"], main["position"], True) - place), "active": main["active"]}
    found["at"] = body(main["link"], main["position"], True)
    found["truth"], found["wrapped"] = place, "wrapped" in main["flags"]
    nodes = [skin.node_of[taxel] for taxel in main["taxels"]]
    normals = skin.mean_normal[nodes]
    mean = normals.mean(axis=0)
    mean /= np.linalg.norm(mean)
    angles = np.degrees(np.arccos(np.clip(normals @ mean, -1, 1)))
    few = np.mean([len(skin.beside[node]) < FEW_EDGES for node in nodes])
    found["good"] = bool(np.sqrt((angles**2).mean()) < GOOD_ANGLE and few < GOOD_FEW)
    found["touches"], found["links"] = len(touches), len({link for touch in touches for link in touch["links"]})
    found["ids"] = [touch["id"] for touch in touches]
    found["anisotropy"] = main.get("anisotropy", 0.0)
    if truth["axis"] is not None and main.get("principal_axis") and not found["wrapped"] and main["anisotropy"] >= ANISOTROPY:
        # The axis lies in the plane of the taxel in the middle, the truth's in that of its place.
        base = nodes[np.linalg.norm(skin.at[nodes] - found["at"], axis=1).argmin()]
        axis, normal = body(main["link"], main["principal_axis"], False), body(truth["link"], truth["normal"], False)
        if skin.mean_normal[base] @ normal > 0:
            found["axis"] = degrees(turned(axis, skin.mean_normal[base], normal), body(truth["link"], truth["axis"], False))
    return found


def random_presses(scene, count, seed, inner=None):
    """Presses at random places; one seed gives the same indenters and forces on every body."""
    shapes, places = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2])
    presses = []
    for index in range(count):
        kind = KINDS[index % 4]
        shape, newton = indenter(kind, scene.size, shapes)
        presses.append(Press(kind, shape, [random_place(scene.skin, places, inner)], newton))
    return presses


def presses(scene, flat, arguments):
    spacing = spacing_of(scene.skin)
    found = {}
    for name, of, inner in (("body", scene, None), ("flat", flat, 0.3)):
        of.press(random_presses(of, arguments.presses, arguments.seed, inner), arguments.seconds)
        found[name] = of.found(np.random.default_rng(arguments.seed + 1), noise=0.015, judge=judge)
    result = {"presses": len(found["body"]), "flat": len(found["flat"]), "spacing_mm": 1e3 * spacing}
    counted = {name: [one for one in of if one["active"] >= 3] for name, of in found.items()}
    result["counted"] = len(counted["body"])

    def ratio(key, title, pick, flat_pick=None):
        body = [one[key] for one in counted["body"] if key in one and pick(one)]
        flat = [one[key] for one in counted["flat"] if key in one and (flat_pick or pick)(one)]
        b, f = quantiles(body), quantiles(flat)
        scale = 1e3 if key == "place" else 1
        result[title] = {"touches": len(body), "median": b[0] and b[0] * scale, "p95": b[1] and b[1] * scale}
        result[title] |= {"flat_touches": len(flat), "flat_median": f[0] and f[0] * scale, "flat_p95": f[1] and f[1] * scale}
        if None not in b + f:
            result[title]["ratios"] = [b[0] / f[0], b[1] / f[1]]

    def alike(kind):
        """The axis beside that of the flat touches most alike: how far a touch is from round decides how true its axis can be."""
        of = {name: [one for one in ones if one["kind"] == kind and "axis" in one] for name, ones in counted.items()}
        if not all(of.values()):
            return
        measures = {name: np.array([[one["anisotropy"] / 0.05, np.log(one["active"]) / 0.3] for one in ones]) for name, ones in of.items()}
        far = np.linalg.norm(measures["body"][:, None] - measures["flat"][None], axis=2)
        # The three most alike of each, as one alone is chance.
        flat = np.array([one["axis"] for one in of["flat"]])[np.argsort(far, axis=1, kind="stable")[:, :3]].ravel()
        b, f = quantiles([one["axis"] for one in of["body"]]), quantiles(flat)
        result[f"axis, {kind}, beside flat touches as far from round"] = {
            "touches": len(of["body"]), "median": b[0], "p95": b[1], "flat_median": f[0], "flat_p95": f[1], "ratios": [b[0] / f[0], b[1] / f[1]]
        }

    every = lambda one: True
    ratio("place", "position, all", every)
    ratio("place", "position, good", lambda one: one["good"], every)
    for kind in KINDS:
        ratio("place", f"position, {kind}", lambda one: one["kind"] == kind)
    for kind in KINDS[1:]:
        ratio("axis", f"axis, {kind}", lambda one: one["kind"] == kind)
        ratio("axis", f"axis, {kind}, good", lambda one: one["kind"] == kind and one["good"], lambda one: one["kind"] == kind)
        alike(kind)
        of_kind = [one for one in counted["body"] if one["kind"] == kind]
        round_ones = sum(not one["wrapped"] and one["anisotropy"] < ANISOTROPY for one in of_kind)
        result[f"axis, {kind}, none"] = {"wrapped": sum(one["wrapped"] for one in of_kind), "round": round_ones, "of": len(of_kind)}
    all_places = [one["place"] for one in counted["body"]]
    result["p95_in_spacings"] = quantiles(all_places)[1] / spacing if all_places else None
    on_one = [one for one in counted["body"] if one["links"] == 1]
    result["on_one_link"] = {"presses": len(on_one), "one_touch": float(np.mean([one["touches"] == 1 for one in on_one])) if on_one else None}
    result["one_touch"] = float(np.mean([one["touches"] == 1 for one in counted["body"]])) if counted["body"] else None
    result["good"] = float(np.mean([one["good"] for one in counted["body"]])) if counted["body"] else None
    result["wrapped"] = float(np.mean([one["wrapped"] for one in counted["body"]])) if counted["body"] else None
    worst = sorted(counted["body"], key=lambda one: -one["place"])[:10]
    result["worst"] = [{"press": o["index"], "kind": o["kind"], "mm": 1e3 * o["place"], "good": o["good"], "touches": o["touches"], "links": o["links"], "active": o["active"]} for o in worst]
    return result


def strokes(scene, arguments):
    """Rods and balls that are drawn over the skin: each is one identity."""
    rng = np.random.default_rng(arguments.seed + 2)
    drawn = []
    while len(drawn) < arguments.strokes:
        kind = ["ball", "rod"][len(drawn) % 2]
        shape, newton = indenter(kind, scene.size, rng)
        start = random_place(scene.skin, rng)
        length = rng.uniform(0.02, 0.08) * scene.size
        away = np.linalg.norm(scene.skin.at - start.at, axis=1)
        # The end is at a taxel that faces the same way more or less, as a path runs under the line to it.
        ends = np.flatnonzero((np.abs(away - length) < 0.2 * length) & (scene.skin.normal @ start.normal > 0.3))
        if len(ends) == 0:
            continue
        drawn.append(Press(kind, shape, [start, scene.at_taxel(int(rng.choice(ends)))], newton))
    scene.press(drawn, arguments.seconds, frames=12)
    found = scene.found(np.random.default_rng(arguments.seed + 3), noise=0.015, judge=judge)
    spacing = spacing_of(scene.skin)
    one, several = Counter(), []
    for index in sorted({entry["index"] for entry in found}):
        frames = [entry for entry in found if entry["index"] == index]
        ids = Counter(i for entry in frames for i in entry["ids"])
        # A rod over a hollow presses twice, and a path may leap to what is beside it.
        is_two = any(entry.get("between", 1) < 0.7 for entry in frames)
        leaps = any(np.linalg.norm(a["truth"] - b["truth"]) > spacing for a, b in zip(frames, frames[1:]))
        what = "pressed in two places" if is_two else "leaping" if leaps else frames[0]["kind"]
        one[what, len(ids) == 1] += 1
        if len(ids) > 1:
            several.append({"stroke": index, "what": what, "frames_of_ids": sorted(ids.values(), reverse=True)})
    share = lambda kinds: [sum(one[kind, True] for kind in kinds), sum(one[kind, is_one] for kind in kinds for is_one in (True, False))]
    of = {kind: share([kind]) for kind in ("ball", "rod", "pressed in two places", "leaping")}
    total = share(of)
    return {"strokes": total[1], "one_identity": total[0] / total[1] if total[1] else None, "one_identity_of": of, "several": several[:20]}


def pairs(scene, arguments):
    """Two balls side by side; where the saddle between their peaks is low, they should be two touches. One ball and one rod should not."""
    rng = np.random.default_rng(arguments.seed + 4)
    made = []
    for index in range(arguments.pairs):
        kind = ["pair", "pair", "ball", "rod"][index % 4]
        shape, newton = indenter(kind, scene.size, rng)
        made.append(Press(kind, shape, [random_place(scene.skin, rng, scene.inner)], newton))
    scene.press(made, arguments.seconds)
    results = {}
    for spread in (0.05, 0.10, 0.20):
        right, told = Counter(), Counter()
        for noise in (0.01, 0.03):
            found = scene.found(np.random.default_rng(arguments.seed + 5), noise, judge, spread)
            for one in found:
                kind = one["kind"]
                if kind == "pair":
                    kind = next((f"pair, saddle under {most}" for most in (0.4, 0.55, 0.7) if one["saddle"] < most), "pair, higher saddle")
                elif one.get("between", 1) < 0.7:
                    kind += ", pressed in two places"
                told[kind] += 1
                right[kind] += one["touches"] == (2 if "under" in kind else 1)
        results[f"gains {spread}"] = {kind: {"of": n, "as_many_as_wanted": right[kind] / n} for kind, n in told.items()}
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("somatic")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--body", required=True)
    parser.add_argument("--presses", type=int, default=40)
    parser.add_argument("--strokes", type=int, default=0)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", type=float)
    parser.add_argument("--layer", type=float, default=0.5)
    parser.add_argument("--seconds", type=float, default=1e9)
    arguments = parser.parse_args()
    somatic, folder = Program(arguments.somatic), arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    bundled = Path(__file__).resolve().parents[2] / "bodies" / f"{arguments.body}.glb"
    body = bundled if bundled.exists() else Path(arguments.body).resolve()
    listed = folder / f"{body.stem}.json"
    listed.write_text(somatic("inspect", body, "--json"))
    skin = Skin(body, listed)
    size = arguments.size or spacing_of(skin) / 0.0162
    began = time.time()
    result = {"body": body.stem, "size": size}
    if arguments.presses:
        scene = Scene(somatic, folder / f"{body.stem}-presses", body, skin, size, arguments.layer)
        flat = sheet(somatic, folder, skin, size, arguments.seed, arguments.layer)
        result["presses"] = presses(scene, flat, arguments)
    if arguments.strokes:
        result["strokes"] = strokes(Scene(somatic, folder / f"{body.stem}-strokes", body, skin, size, arguments.layer), arguments)
    if arguments.pairs:
        result["pairs"] = pairs(Scene(somatic, folder / f"{body.stem}-pairs", body, skin, size, arguments.layer), arguments)
    result["seconds"] = time.time() - began
    print(json.dumps(result, indent=1, default=float))


if __name__ == "__main__":
    main()
