"""Random recordings of touches, on bodies of each kind, for `oracle.py random`."""

import json
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from skin import Skin

OUTPUTS = "touches,touches.taxels,touches.orientation"
# Frames of a recording, in the short mode and in the long one. Random fields have many touches a frame, the hand few.
FRAMES = {False: 40, True: 400}
SHARES = {"fields": 0.25, "hand": 4}
CALIBRATIONS = {
    "counts": "",
    "pascal": '[all]\nunit = "Pa"\ngain = 0.5\nbaseline = 8\nnoise = 2\ndead_band = 2\n',
    "newton": '[all]\nunit = "N"\ngain = 0.0625\ndead_band = 0.25\n',
}


@dataclass
class Recording:
    body: str
    kind: str
    calibration: str
    seed: int
    on: float = 0.0
    off: float = 0.0


class Program:
    def __init__(self, path):
        self.path = path

    def __call__(self, *arguments):
        done = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{arguments}: {done.stderr}")
        return done.stdout


def points(folder, rng):
    """A body without a surface, three sheets of points that are bent, as a table."""
    path, rows = folder / "points.csv", ["id,link,x,y,z,nx,ny,nz,area"]
    for sheet in range(3):
        for _ in range(150):
            u, v = rng.uniform(-0.12, 0.12), rng.uniform(-0.06, 0.06)
            radius, turn = 0.05, u / 0.05
            x, y, z = radius * np.sin(turn), v, radius * np.cos(turn)
            area = "" if sheet == 1 else 2e-4
            rows.append(f"{len(rows) - 1},part_{sheet},{x:.6f},{y:.6f},{z:.6f},{np.sin(turn):.6f},0,{np.cos(turn):.6f},{area}")
    path.write_text("\n".join(rows) + "\n")
    return path


def bodies(somatic, folder, long):
    """The files of bodies by name."""
    bundled = Path(__file__).resolve().parents[2] / "bodies"
    found = {"hand": bundled / "hand.glb", "mat": folder / "mat.glb", "points": folder / "points.glb"}
    somatic("author", "--grid", "24x20", "--pitch", "12mm", "-o", found["mat"], "--force")
    somatic("author", "--csv-skin", points(folder, np.random.default_rng(5)), "-o", found["points"], "--force")
    if long:
        found["humanoid"] = folder / "humanoid.glb"
        somatic("author", "humanoid", "--taxels", "2000", "--seed", "1", "-o", found["humanoid"], "--force")
    else:
        found["humanoid"] = bundled / "humanoid.glb"
    return found


def recordings(long, seed):
    kinds = ["blobs", "blobs", "gaps", "fields"]
    for body in ("hand", "mat", "points", "humanoid"):
        for turn in range(12 if long else 1):
            for index, kind in enumerate(kinds):
                calibration = list(CALIBRATIONS)[(turn + index) % 3]
                on, off = ((30.0, 12.0) if calibration == "counts" else (8.0, 4.0)) if (turn + index) % 4 == 1 else (0.0, 0.0)
                yield Recording(body, kind, calibration, seed * 1000 + turn * 10 + index, on, off)


def frames(skin, recording, count):
    """Rows of raw values, None where a value is missing, "nan" where it is none."""
    rng = np.random.default_rng([recording.seed, len(skin.ids)])
    n, t = len(skin.ids), 0.0
    gains = np.exp(rng.normal(0, rng.choice([0.0, 0.1]), n))
    whole = rng.random() < 0.5
    noise = rng.choice([0.0, 3.0])
    blobs, gone = [], np.zeros(n, bool)
    faulty = np.zeros(n, bool)
    most = min(12, max(2, n // 25))
    density = rng.uniform(0.02, 0.4)
    step = rng.choice([0.02, 1 / 64, 0.05])
    for _ in range(count):
        t += step * (rng.choice([1, 1, 1, 2]) if rng.random() < 0.2 else 1)
        if rng.random() < 0.004:
            t = t - 3 if rng.random() < 0.5 else t + 12
        if recording.kind == "fields":
            raw = np.where(rng.random(n) < density, rng.integers(1, 60, n), 0).astype(float)
            if rng.random() < 0.7 and blobs:
                raw = np.where(rng.random(n) < 0.9, blobs[-1], raw)
            blobs = [raw]
        else:
            blobs = [blob for blob in blobs if rng.random() > 0.03]
            while len(blobs) < rng.integers(1, most + 1):
                start = rng.integers(n) if not blobs or rng.random() < 0.5 else int(blobs[-1]["near"])
                blobs.append({
                    "at": skin.at[start] + rng.normal(0, skin.spacing, 3), "way": rng.normal(0, 0.25 * skin.spacing, 3),
                    "sigma": skin.spacing * rng.uniform(0.5, 2), "peak": rng.uniform(20, 800),
                    "long": rng.uniform(1, 3), "axis": rng.normal(0, 1, 3), "near": start,
                })
            raw = np.zeros(n)
            for blob in blobs:
                blob["at"] = blob["at"] + blob["way"]
                away = skin.at - blob["at"]
                blob["near"] = np.linalg.norm(away, axis=1).argmin()
                # It follows the skin.
                blob["at"] = blob["at"] + 0.3 * (skin.at[blob["near"]] - blob["at"])
                axis = blob["axis"] / np.linalg.norm(blob["axis"])
                along = away @ axis
                square = (away**2).sum(axis=1) - along**2 + (along / blob["long"]) ** 2
                raw += blob["peak"] * np.exp(-0.5 * square / blob["sigma"] ** 2)
            raw = gains * raw
            raw = np.where(raw > 2, raw + rng.normal(0, 1, n) * noise, 0)
        raw = np.round(raw) if whole else np.round(raw * 64) / 64
        if recording.calibration == "pascal":
            raw = raw + 8
        missing = np.zeros(n, bool)
        if recording.kind == "gaps":
            # Some stay away, in groups.
            change = rng.random(n) < 0.01
            gone = np.where(change, rng.random(n) < 0.3, gone)
            faulty = np.where(rng.random(n) < 0.005, rng.random(n) < 0.1, faulty)
            missing = gone
        yield t, ["" if m else "nan" if f and recording.kind == "gaps" else repr(float(v)) for m, f, v in zip(missing, faulty, raw)]


def record(somatic, folder, skin, body, recording, count):
    stem = folder / f"{recording.body}-{recording.kind}-{recording.seed}"
    paths = {key: stem.with_suffix(f".{key}") for key in ("csv", "toml", "scene.toml", "ndjson")}
    rows = [",".join(["t", *map(str, skin.ids)])]
    rows += [",".join([repr(round(float(t), 9)), *cells]) for t, cells in frames(skin, recording, count)]
    paths["csv"].write_text("\n".join(rows) + "\n")
    masked = np.random.default_rng(recording.seed).choice(skin.ids, len(skin.ids) // 50, replace=False)
    text = CALIBRATIONS[recording.calibration] + "".join(f"[taxel.{taxel}]\nmask = true\n" for taxel in sorted(masked))
    paths["toml"].write_text(text if recording.kind == "gaps" else CALIBRATIONS[recording.calibration])
    paths["scene.toml"].write_text(f"[touch]\non = {recording.on}\noff = {recording.off}\n")
    somatic(
        "run", paths["scene.toml"], "--body", body, "--source", paths["csv"], "--calibration", paths["toml"], "--outputs",
        OUTPUTS, "--sink", f"ndjson:{paths['ndjson']}", "--force",
    )
    return paths


def altered(touch, key):
    """The touch with something wrong, or None where it does not have that."""
    touch = json.loads(json.dumps(touch))
    value = touch.get(key)
    if value is None:
        return None
    if key in ("id", "active"):
        touch[key] += 1
    elif key == "link":
        touch[key] = "nowhere"
    elif key == "flags":
        touch[key] = sorted({*value} ^ {"young"})
    elif key == "taxels":
        touch[key] = value[1:]
    elif key in ("links", "fields"):
        first = next(iter(value), None)
        if first is None:
            return None
        value[first] += 1e-6
    elif key in ("principal_axis", "orientation", "normal"):
        # Turned by 1e-3 across.
        x = np.array(value)
        across = np.cross(x, np.eye(3)[np.abs(x).argmin()])
        touch[key] = (x + 1e-3 * across).tolist()
    elif isinstance(value, list):
        touch[key] = [number + 1e-5 for number in value]
    else:
        touch[key] = value * 1.001 + 1e-5
    return touch


ALTERED = [
    "id", "age", "link", "total", "peak", "active", "area", "force", "mean_pressure", "position", "normal", "centre", "principal_axis",
    "principal_axis_angle", "anisotropy", "spread", "velocity", "links", "fields", "orientation", "orientation_angle", "taxels", "flags",
]


def controls(skin, paths, recording):
    """What can be changed in a touch without that anything is found wrong: nothing should."""
    from oracle import compare_on

    lines, missed = paths["ndjson"].read_text().splitlines(), []
    for key in [*ALTERED, "released"]:
        changed = list(lines)
        for number, line in enumerate(lines):
            frame = json.loads(line)
            if key == "released":
                frame["released"] = [10**6]
            else:
                # Which identity a new touch has is not the definition's to say.
                can = lambda touch: touch["active"] > 2 and (key != "id" or touch["age"] > 0)
                places = [k for k, touch in enumerate(frame["touches"]) if can(touch) and altered(touch, key)]
                if not places:
                    continue
                frame["touches"][places[0]] = altered(frame["touches"][places[0]], key)
            changed[number] = json.dumps(frame)
            break
        else:
            continue
        path = paths["ndjson"].with_suffix(".altered.ndjson")
        # As far as it was changed.
        path.write_text("\n".join(changed[: number + 1]) + "\n")
        found = compare_on(skin, paths["csv"], paths["toml"], path, recording.on, recording.off)
        if found["wrong"] == 0:
            missed.append(f"{recording.body}: {key}")
    return missed


def main(program, folder, *flags):
    from oracle import compare_on

    somatic, folder, long = Program(program), Path(folder), "--long" in flags
    seed = int(flags[flags.index("--seed") + 1]) if "--seed" in flags else 1
    only = flags[flags.index("--body") + 1] if "--body" in flags else None
    folder.mkdir(parents=True, exist_ok=True)
    skins, files = {}, bodies(somatic, folder, long)
    total, excluded, examples, controlled, missed = Counter(), Counter(), [], set(), []
    for recording in recordings(long, seed):
        if only and recording.body != only:
            continue
        body = files[recording.body]
        if recording.body not in skins:
            listed = folder / f"{recording.body}.json"
            listed.write_text(somatic("inspect", body, "--json"))
            skins[recording.body] = Skin(body, listed)
        skin = skins[recording.body]
        count = int(FRAMES[long] * SHARES.get(recording.kind, 1) * SHARES.get(recording.body, 1))
        paths = record(somatic, folder, skin, body, recording, count)
        found = compare_on(skin, paths["csv"], paths["toml"], paths["ndjson"], recording.on, recording.off)
        print(json.dumps({"recording": paths["csv"].name} | {k: v for k, v in found.items() if k != "examples"}), file=sys.stderr)
        for key in ("frames", "touches", "wrong", "placed"):
            total[key] += found[key]
        excluded.update(found["excluded"])
        if recording.body not in controlled and recording.kind == "blobs":
            controlled.add(recording.body)
            missed += controls(skin, paths, recording)
        examples += [{"recording": paths["csv"].name} | one for one in found["examples"]]
    print(json.dumps(dict(total) | {"excluded": dict(excluded), "missed": missed, "examples": examples[:20]}))
