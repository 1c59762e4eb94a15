"""Simulated presses: where and with what, as `somatic simulate` takes them, and what sensors with noise feel of them."""

import csv
import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from skin import Skin, nearest_on

# Presses of one simulation.
CHUNK = 25
# Readings are whole numbers of this many parts of a press's largest value.
PARTS = 800
# Readings of untouched sensors are 0 while their noise is below this number of standard deviations.
SIGMAS = 6
STIFFNESS = 400e3


@dataclass
class Place:
    at: np.ndarray
    normal: np.ndarray
    text: str


@dataclass
class Press:
    kind: str
    shape: str
    places: list
    newton: float


def spacing_of(skin):
    """The mean distance of taxels: the root of the mean cell."""
    return float(np.sqrt(skin.cell.mean()))


def indenter(kind, size, rng):
    """Keys of an indenter `size` times as large as for cells of (16.2 mm)², and its force."""
    between = lambda low, high: float(rng.uniform(low, high) * size)
    newton = float(rng.uniform(2, 12) * size**2)
    angle = f"angle_deg = {rng.uniform(0, 180):.3f}\n"
    match kind:
        case "ball":
            return f'indenter = "ball"\nradius_m = {between(0.008, 0.02):.6f}\n', newton
        case "fingertip":
            radii = [between(0.010, 0.013), between(0.007, 0.009), between(0.007, 0.010)]
            return f'indenter = "ellipsoid"\nradii_m = {[round(r, 6) for r in radii]}\n' + angle, newton
        case "rod":
            return f'indenter = "rod"\nradius_m = {between(0.006, 0.012):.6f}\nlength_m = {between(0.03, 0.08):.6f}\n' + angle, newton
        case "strap":
            return f'indenter = "strap"\nwidth_m = {between(0.012, 0.02):.6f}\nlength_m = {between(0.04, 0.1):.6f}\n' + angle, newton
        case "pair":
            radius = between(0.007, 0.010)
            # The contact's width is about that of the pressure under the layer.
            width = 2 * (2 * radius * 0.0015 * size) ** 0.5 + 0.0162 * size
            return f'indenter = "pair"\nradius_m = {radius:.6f}\napart_m = {rng.uniform(1.5, 4) * width / 2:.6f}\n' + angle, newton
    raise ValueError(kind)


def random_place(skin, rng, inner=None):
    """A place on the surface near a taxel that faces the same way; `inner`: in that share of a sheet's middle."""
    corners, normals = skin.surface.corners, skin.surface.normals
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    while True:
        triangle = rng.choice(len(corners), p=areas / areas.sum())
        u, v = rng.random(2)
        u, v = (1 - u, 1 - v) if u + v > 1 else (u, v)
        a, b, c = corners[triangle]
        at = a + u * (b - a) + v * (c - a)
        away = np.linalg.norm(skin.at - at, axis=1)
        near = away.argmin()
        if away[near] > 1.2 * np.sqrt(skin.cell[near]) or skin.normal[near] @ normals[triangle] < 0.5:
            continue
        if inner is not None and np.abs(at - corners.reshape(-1, 3).mean(axis=0)).max() > inner * np.ptp(corners.reshape(-1, 3), axis=0).max():
            continue
        link = skin.link[near]
        inside = skin.poses[link][:3, :3].T @ (at - skin.poses[link][:3, 3])
        text = ", ".join(f"{x:.7f}" for x in inside)
        return Place(at, normals[triangle], f'{{ link = "{skin.links[link]}", at = [{text}] }}')


def sheet(somatic, folder, skin, size, seed, layer=0.5):
    """A flat sheet of taxels that are spread alike, as many on a square metre as `skin` has."""
    side, count = 0.42 * size, 24
    number = round(side * side / skin.cell.mean())
    path = folder / f"sheet-{side:.4f}-{number}.glb"
    steps = [side * (k / count - 0.5) for k in range(count + 1)]
    lines = [f"v {x:.7g} 0 {z:.7g}" for z in steps for x in steps]
    for row in range(count):
        for column in range(count):
            a = row * (count + 1) + column + 1
            lines += [f"f {a} {a + count + 1} {a + count + 2}", f"f {a} {a + count + 2} {a + 1}"]
    mesh = path.with_suffix(".obj")
    mesh.write_text("\n".join(lines) + "\n")
    if not path.exists():
        somatic("author", mesh, "--taxels", number, "--seed", seed, "-o", path)
    listed = path.with_suffix(".json")
    listed.write_text(somatic("inspect", path, "--json"))
    found = Scene(somatic, folder / path.stem, path, Skin(path, listed), size, layer)
    found.inner = 0.3
    return found


class Scene:
    """Presses on a body, simulated without noise; each has `frames` frames, and then the skin is at rest."""

    def __init__(self, somatic, folder, body, skin, size, layer=0.5):
        self.somatic, self.folder, self.body, self.skin, self.size = somatic, folder, body, skin, size
        # σ of the layer in spacings.
        self.layer = layer
        self.inner = None
        folder.mkdir(parents=True, exist_ok=True)

    def at_taxel(self, node):
        return Place(self.skin.at[node], self.skin.normal[node], f"{{ taxel = {self.skin.ids[node]} }}")

    def simulation(self, presses, frames):
        lasts = frames + 1
        sigma = spacing_of(self.skin) * self.layer
        text = f'body = "{self.body}"\nrate_hz = 25\nduration_s = {lasts * len(presses) / 25}\n'
        text += f'[layer]\nthickness_m = {sigma * 3**0.5:.9f}\nstiffness_pa = {STIFFNESS}\n[sensor]\nkind = "ideal"\n'
        for index, press in enumerate(presses):
            first = index * lasts / 25
            start, end = first - 0.01, first + (frames - 1) / 25 + 0.01
            text += f'[[touch]]\nname = "{index}"\non = "body"\n{press.shape}path = [{", ".join(p.text for p in press.places)}]\n'
            if len(press.places) > 1:
                text += f"times_s = [{max(start, 0):.4f}, {end:.4f}]\n"
            text += f"force_newton = [[{max(start, 0):.4f}, {press.newton:.4f}], [{end:.4f}, {press.newton:.4f}]]\n"
        return text

    def press(self, presses, seconds, frames=1):
        """Simulates `presses` in parts, those that are not done yet; a press that cannot be is left out."""
        import time

        until = time.time() + seconds
        self.frames, self.done = frames, []
        for number in range(0, len(presses), CHUNK):
            part = list(enumerate(presses))[number : number + CHUNK]
            stem = self.folder / f"{number:05}"
            # The path of the simulation with those that were left out before.
            if stem.with_suffix(".left_out").exists():
                out = json.loads(stem.with_suffix(".left_out").read_text())
                part = [(index, press) for index, press in part if index not in out]
            wanted = self.simulation([press for _, press in part], frames)
            toml, table = stem.with_suffix(".toml"), stem.with_suffix(".csv")
            if not (table.exists() and toml.exists() and toml.read_text() == wanted):
                if time.time() > until:
                    break
                part = self.simulate(part, stem)
            self.done.append((stem, part))

    def simulate(self, part, stem):
        out = []
        toml, table = stem.with_suffix(".toml"), stem.with_suffix(".csv")
        while part:
            toml.write_text(self.simulation([press for _, press in part], self.frames))
            try:
                self.somatic("simulate", toml, "-o", table, "--force")
                break
            except SystemExit as error:
                # It names a line of the touch that cannot be, or the touch.
                line, name = re.search(r"line (\d+)", str(error)), re.search(r"touch `(\d+)`", str(error))
                if line:
                    bad = toml.read_text().splitlines()[: int(line[1])].count("[[touch]]") - 1
                elif name:
                    bad = int(name[1])
                else:
                    raise
                out.append(part[bad][0])
                part = part[:bad] + part[bad + 1 :]
        stem.with_suffix(".left_out").write_text(json.dumps(out))
        return part

    def found(self, rng, noise, judge, spread=0.0):
        """What touches sensors with noise give, by frame that is pressed: `judge`'s answers."""
        answers = []
        gains = np.exp(rng.normal(0, spread, len(self.skin.ids)))
        for stem, part in self.done:
            with open(stem.with_suffix(".csv")) as file:
                rows = list(csv.reader(file))
            ids = rows[0][1:]
            order = [self.skin.node_of[int(name)] for name in ids]
            felt = np.array([[float(x) for x in row[1:]] for row in rows[1:]])
            truths = self.truths(stem)
            lasts = self.frames + 1
            raw = np.zeros_like(felt)
            for k in range(len(part)):
                rows_of = slice(k * lasts, k * lasts + self.frames)
                whole = felt[rows_of] * gains[order]
                most = whole.max(initial=0)
                if most > 0:
                    values = whole / most + rng.normal(0, noise, whole.shape)
                    raw[rows_of] = np.clip(np.round(values * PARTS), 0, 1023)
            source, calibration, sink = (stem.with_suffix(s) for s in (".noisy.csv", ".calibration.toml", ".ndjson"))
            lines = [",".join(["t", *ids])] + [",".join([f"{k / 25:.6f}", *(f"{x:g}" for x in row)]) for k, row in enumerate(raw)]
            source.write_text("\n".join(lines) + "\n")
            calibration.write_text(f'[all]\nunit = "N"\nnoise = {noise * PARTS + 0.29:.3f}\ndead_band = {SIGMAS * noise * PARTS:.1f}\n')
            self.somatic("run", "--body", self.body, "--source", source, "--calibration", calibration, "--outputs",
                         "touches,touches.taxels", "--sink", f"ndjson:{sink}", "--force")
            with open(sink) as file:
                told = [json.loads(line) for line in file]
            for k, (index, press) in enumerate(part):
                for frame in range(k * lasts, k * lasts + self.frames):
                    touches = told[frame]["touches"]
                    if not touches or frame not in truths:
                        continue
                    answer = judge(self.skin, truths[frame][0], touches) | {"index": index, "kind": press.kind, "frame": frame}
                    if press.kind == "pair":
                        answer["saddle"] = self.saddle_of_pair(felt[frame], order, truths[frame])
                    if len(touches) > 1:
                        answer["between"] = self.saddle_of_touches(felt[frame], order, touches)
                    answers.append(answer)
        return answers

    def truths(self, stem):
        found = {}
        with open(stem.with_suffix(".truth.csv")) as file:
            for row in csv.DictReader(file):
                vector = lambda *keys: [float(row[key]) for key in keys] if row[keys[0]] else None
                found.setdefault(int(row["frame"]), []).append({
                    "link": row["link"], "place": vector("x", "y", "z"), "normal": vector("nx", "ny", "nz"),
                    "axis": vector("principal_axis_x", "principal_axis_y", "principal_axis_z"),
                })
        return found

    def by_node(self, felt, order):
        pressures = np.zeros(len(self.skin.ids))
        pressures[order] = felt
        return pressures

    def saddle_of_pair(self, felt, order, truths):
        """The highest pass between the peaks of two indenters without noise, as a share of the lower peak; 1 where they have one peak."""
        skin, pressures = self.skin, self.by_node(felt, order)
        places = [skin.into_body(skin.links.index(t["link"]), np.array(t["place"]), True) for t in truths]
        if len(places) < 2:
            return 1.0
        half = (np.linalg.norm(places[0] - places[1]) / 2) or 1e-9
        peaks = []
        for place in places:
            near = np.flatnonzero(np.linalg.norm(skin.at - place, axis=1) <= max(half, spacing_of(skin)))
            if len(near) == 0:
                return 1.0
            peaks.append(int(near[pressures[near].argmax()]))
        return self.saddle(pressures, peaks)

    def saddle_of_touches(self, felt, order, touches):
        """The same between the peaks of the two largest touches that were found."""
        pressures = self.by_node(felt, order)
        largest = sorted(touches, key=lambda touch: -touch["total"])[:2]
        nodes = [[self.skin.node_of[taxel] for taxel in touch["taxels"]] for touch in largest]
        return self.saddle(pressures, [of[int(pressures[of].argmax())] for of in nodes])

    def saddle(self, pressures, peaks):
        if peaks[0] == peaks[1]:
            return 1.0
        home = {}
        for node in sorted(np.flatnonzero(pressures > 0), key=lambda node: -pressures[node]):
            joined = {id(home[o]): home[o] for o in self.skin.beside[node] if o in home}
            region = {int(node)}.union(*joined.values())
            for member in region:
                home[member] = region
            if peaks[0] in region and peaks[1] in region:
                return float(pressures[node] / min(pressures[peaks]))
        return 0.0
