"""Measures how much truer touches are on even taxels than on scattered ones, by the same simulated presses on both layouts.

    even.py SOMATIC FOLDER --on sheet|cylinder|BODY [--taxels N] [--presses N] [--seed N] [--layers X,…]

BODY is a mesh, or hand or humanoid. The sheet is flat; the cylinder is open and five times as long as wide. Balls and rods are pressed
at random places that are far from the borders of sheet and cylinder. σ of the layer is each of --layers spacings [default: 0.4,0.6,0.9].
Sensors have no noise: they feel the mean pressure on their cells (`equal`, sensors of one size) or the force on them (`cell`), and
values under the dead band, a share of the press's largest one, are 0. Touches count that three taxels feel, that do not wrap and are
away from creases on both layouts; axes those with an anisotropy of at least 0.4. Prints a row for each: medians, and the 95th
percentiles in brackets.
"""

import argparse
import csv
import json
from pathlib import Path

import numpy as np
from accuracy import judge
from pressing import Press, Scene, indenter, random_place, spacing_of
from random_touches import Program
from skin import Skin

SENSORS, DEAD_BANDS = ["equal", "cell"], [0.01, 0.05]
LAYOUTS = {"even": [], "scattered": ["--even", "off"]}


def mesh_of(points, rows, columns, is_ring):
    """An OBJ of a grid of points, the last column joined with the first of a ring."""
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in points]
    for row in range(rows - 1):
        for column in range(columns if is_ring else columns - 1):
            a, b = row * columns + column + 1, row * columns + (column + 1) % columns + 1
            lines += [f"f {a} {a + columns} {b + columns}", f"f {a} {b + columns} {b}"]
    return "\n".join(lines) + "\n"


def sheet():
    steps = np.linspace(-0.21, 0.21, 25)
    return mesh_of([(x, 0, z) for z in steps for x in steps], 25, 25, False)


def cylinder():
    radius, count = 0.06, 96
    around = 2 * np.pi * np.arange(count) / count
    points = [(radius * np.sin(a), y, radius * np.cos(a)) for y in np.linspace(0.3, -0.3, 61) for a in around]
    return mesh_of(points, 61, count, True)


def layouts(somatic, folder, arguments):
    made = {"sheet": sheet, "cylinder": cylinder}.get(arguments.on)
    mesh = arguments.on
    if made:
        mesh = folder / f"{arguments.on}.obj"
        mesh.write_text(made())
    for name, flags in LAYOUTS.items():
        path = folder / f"{name}.glb"
        if not path.exists():
            somatic("author", mesh, "--taxels", arguments.taxels, *flags, "-o", path)
        (folder / f"{name}.json").write_text(somatic("inspect", path, "--json"))
        yield name, Skin(path, folder / f"{name}.json")


def place(arguments, skin, rng):
    """A random place, away from the ends of a sheet or a cylinder."""
    while True:
        found = random_place(skin, rng, 0.28 if arguments.on == "sheet" else None)
        if arguments.on != "cylinder" or abs(found.at[1]) < 0.18:
            return found


def judged(somatic, scene, name, sensors, dead_band):
    """By press the error of place and, if it has one, of axis."""
    skin, answers = scene.skin, {}
    for stem, part in scene.done:
        rows = list(csv.reader(open(stem.with_suffix(".csv"))))
        order = [skin.node_of[int(taxel)] for taxel in rows[0][1:]]
        felt = np.array([[float(x) for x in row[1:]] for row in rows[1:]])
        if sensors == "equal":
            felt = felt / skin.cell[order] * skin.cell.mean()
        most = felt.max(axis=1, keepdims=True)
        raw = np.divide(felt, most, out=np.zeros_like(felt), where=most > 0)
        source, calibration, sink = (stem.with_suffix(suffix) for suffix in (".even.csv", ".even.toml", ".even.ndjson"))
        lines = [",".join(["t", *rows[0][1:]])]
        lines += [",".join([f"{k / 25:.6f}", *(f"{x:.9g}" for x in row)]) for k, row in enumerate(raw)]
        source.write_text("\n".join(lines) + "\n")
        calibration.write_text(f'[all]\nunit = "N"\nsensors = "{sensors}"\ndead_band = {dead_band}\n')
        somatic("run", "--body", scene.body, "--source", source, "--calibration", calibration, "--outputs",
                "touches,touches.taxels", "--sink", f"ndjson:{sink}", "--force")
        told, truths = [json.loads(line) for line in open(sink)], scene.truths(stem)
        for k, (index, _) in enumerate(part):
            touches = told[2 * k]["touches"]
            if touches and 2 * k in truths:
                one = judge(skin, truths[2 * k][0], touches)
                if one["active"] >= 3 and one["good"] and not one["wrapped"]:
                    answers[index] = (1e3 * one["place"], one.get("axis"))
    return answers


def row(even, scattered):
    """Medians and 95th percentiles of both, and the ratio of the medians."""
    if not even:
        return "- | - | -"
    cell = lambda values: f"{np.median(values):.2f} ({np.quantile(values, 0.95):.2f})"
    return f"{cell(scattered)} | {cell(even)} | {np.median(even) / np.median(scattered):.2f} ({np.quantile(even, 0.95) / np.quantile(scattered, 0.95):.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("somatic")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--on", required=True)
    parser.add_argument("--taxels", type=int, default=670)
    parser.add_argument("--presses", type=int, default=120)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--layers", default="0.4,0.6,0.9")
    arguments = parser.parse_args()
    somatic, folder = Program(arguments.somatic), arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    skins = dict(layouts(somatic, folder, arguments))
    spacing = spacing_of(skins["even"])
    print(f"{arguments.on}: {arguments.taxels} taxels, {1e3 * spacing:.1f} mm apart, {arguments.presses} presses")
    print("| sensors | layer | dead band | touches | place mm: scattered | even | ratio | axes | axis °: scattered | even | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for layer in map(float, arguments.layers.split(",")):
        rng = np.random.default_rng(arguments.seed)
        presses = []
        for index in range(arguments.presses):
            kind = ["ball", "rod"][index % 2]
            shape, newton = indenter(kind, spacing / 0.0162, rng)
            presses.append(Press(kind, shape, [place(arguments, skins["even"], rng)], newton))
        scenes = {}
        for name, skin in skins.items():
            # The layer is the same under both.
            scenes[name] = Scene(somatic, folder / f"{name}-{layer}", folder / f"{name}.glb", skin, spacing / 0.0162, layer)
            scenes[name].press(presses, 1e9)
        for sensors in SENSORS:
            for dead_band in DEAD_BANDS:
                told = {name: judged(somatic, scene, name, sensors, dead_band) for name, scene in scenes.items()}
                both = sorted(set(told["even"]) & set(told["scattered"]))
                axes = [k for k in both if told["even"][k][1] is not None and told["scattered"][k][1] is not None]
                pick = lambda which, of: row(*([told[name][k][which] for k in of] for name in ("even", "scattered")))
                print(f"| {sensors} | {layer} | {100 * dead_band:.0f} % | {len(both)} | {pick(0, both)} | {len(axes)} | {pick(1, axes)} |", flush=True)


if __name__ == "__main__":
    main()
