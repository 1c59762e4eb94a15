"""Random bodies, calibrations and frames of all letters, for `oracle.py`."""

import json
import struct
from dataclasses import dataclass, field

import numpy as np

KINDS = ("pressure", "temperature", "proximity", "force3")
# Turns that glTF's single precision holds exactly: none, a half, and thirds about the space diagonals.
TURNS = [(0, 0, 0, 1), (1, 0, 0, 0), (0, 1, 0, 0), (0.5, 0.5, 0.5, 0.5), (-0.5, 0.5, 0.5, 0.5), (0.5, -0.5, 0.5, -0.5)]
# The cosine of 10°: a default tangent is along z where the normal is nearer than this to x.
ALONG = np.cos(np.radians(10))


def matrix(turn):
    x, y, z, w = turn
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ], float)


def single(numbers):
    return np.asarray(numbers, np.float32).astype(float)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@dataclass
class OneField:
    name: str
    # By the taxel's place in the body, its weight.
    members: dict
    # Origin and u in the anchor's frame; None: no chart.
    chart: tuple | None


@dataclass
class Body:
    """Links, each below the one before or the first; taxels by ascending id; fields without parents."""

    links: list  # (name, parent, translation, turn)
    ids: list
    kind: list
    link: np.ndarray
    at: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    tangent: np.ndarray  # zero: the default
    fields: list = field(default_factory=list)

    def pose(self, link):
        """Of a link in the body: rotation and place."""
        _, parent, place, turn = self.links[link]
        if parent is None:
            return matrix(turn), np.array(place, float)
        rotation, origin = self.pose(parent)
        return rotation @ matrix(turn), origin + rotation @ np.array(place, float)

    def above(self, link):
        return [] if link is None else [link] + self.above(self.links[link][1])

    def anchor(self, one):
        chains = [self.above(self.link[taxel]) for taxel in one.members]
        return next(link for link in chains[0] if all(link in chain for chain in chains))

    def in_anchor(self, one, members):
        """Places, normals, and both tangents of `members` in the field's anchor."""
        rotation, origin = self.pose(self.anchor(one))
        found = []
        for taxel in members:
            own, place = self.pose(self.link[taxel])
            turned = lambda x: rotation.T @ own @ x
            normal = unit(self.normal[taxel])
            wanted = self.tangent[taxel]
            if not wanted.any():
                wanted = np.array([0.0, 0, 1]) if abs(normal[0]) > ALONG else np.array([1.0, 0, 0])
            first = unit(wanted - normal * (wanted @ normal))
            at = rotation.T @ (place + own @ self.at[taxel] - origin)
            found.append((at, turned(normal), turned(first), turned(np.cross(normal, first))))
        return [np.array(column) for column in zip(*found)] if found else [np.zeros((0, 3))] * 4

    def chart_of(self, one):
        """Origin, u, v and the normal in the field's anchor, if it has a chart."""
        if one.chart is None:
            return None
        origin, wanted = (np.array(x, float) for x in one.chart)
        normal = unit(self.in_anchor(one, list(one.members))[1].sum(axis=0))
        u = unit(wanted - normal * (wanted @ normal))
        return origin, u, np.cross(normal, u), normal

    def glb(self):
        nodes, meshes, views, accessors, data = [], [], [], [], bytearray()

        def column(numbers, kind="SCALAR"):
            numbers = np.asarray(numbers, np.float32)
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": numbers.nbytes})
            entry = {"bufferView": len(views) - 1, "componentType": 5126, "count": len(numbers), "type": kind}
            if kind == "VEC3":
                entry |= {"min": numbers.min(axis=0).tolist(), "max": numbers.max(axis=0).tolist()}
            accessors.append(entry)
            data.extend(numbers.tobytes())
            return len(accessors) - 1

        for name, _, place, turn in self.links:
            nodes.append({"name": name, "translation": list(map(float, place)), "rotation": list(map(float, turn)), "children": []})
        for link, (_, parent, _, _) in enumerate(self.links):
            if parent is not None:
                nodes[parent]["children"].append(link)
        for link, (name, *_) in enumerate(self.links):
            of = np.flatnonzero(self.link == link)
            if len(of) == 0:
                continue
            attributes = {"POSITION": column(self.at[of], "VEC3"), "_TAXEL_ID": column([self.ids[i] for i in of])}
            attributes |= {f"_N{axis}": column(self.normal[of, i]) for i, axis in enumerate("XYZ")}
            attributes |= {"_AREA": column(self.area[of]), "_MODALITY": column([KINDS.index(self.kind[i]) for i in of])}
            attributes |= {f"_T{axis}": column(self.tangent[of, i]) for i, axis in enumerate("XYZ")}
            meshes.append({"primitives": [{"attributes": attributes, "mode": 0}]})
            nodes.append({"name": f"{name} taxels", "mesh": len(meshes) - 1})
            nodes[link]["children"].append(len(nodes) - 1)
        roots = [link for link, (_, parent, _, _) in enumerate(self.links) if parent is None]
        for one in self.fields:
            chart = {"kind": "none"} if one.chart is None else {"kind": "plane", "origin": list(one.chart[0]), "u": list(one.chart[1])}
            members = {str(self.ids[taxel]): [weight] for taxel, weight in one.members.items()}
            spec = {"version": 1, "name": one.name, "chart": chart, "members": members}
            nodes.append({"name": f"field {one.name}", "extras": {"somatic_field": json.dumps(spec)}})
            roots.append(len(nodes) - 1)
        nodes = [{key: value for key, value in node.items() if value != []} for node in nodes]
        head = json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes, "meshes": meshes,
            "bufferViews": views, "accessors": accessors, "buffers": [{"byteLength": len(data)}],
        }).encode()
        head += b" " * (-len(head) % 4)
        chunk = lambda kind, body: struct.pack("<I4s", len(body), kind) + body
        body = chunk(b"JSON", head) + chunk(b"BIN\0", bytes(data))
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def random_body(rng, kinds):
    links = [("base", None, (0, 0, 0), TURNS[0])]
    for index in range(rng.integers(0, 3)):
        place = single(rng.uniform(-0.2, 0.2, 3))
        links.append((f"part {index}", int(rng.integers(0, len(links))), place, TURNS[rng.integers(len(TURNS))]))
    count = int(rng.integers(20, 90))
    kind = [str(rng.choice(kinds)) for _ in range(count)]
    ids = sorted(int(i) for i in rng.choice(rng.choice([3 * count, 100_000]), count, replace=False))
    link = rng.integers(0, len(links), count)
    # Patches of a ball, or flat ones, that face along one direction of each link.
    outward = unit(rng.normal(0, 1, (len(links), 3)))
    side = unit(np.cross(outward, rng.normal(0, 1, (len(links), 3))))
    flat = rng.uniform(-0.03, 0.03, (count, 2))
    flat[rng.random(count) < 0.1, 1] = 0
    bent = rng.choice([0.0, 10.0])
    up = outward[link] + bent * (flat[:, :1] * side[link] + flat[:, 1:] * np.cross(outward, side)[link])
    at = 0.1 * outward[link] + flat[:, :1] * side[link] + flat[:, 1:] * np.cross(outward, side)[link]
    tangent = np.where(rng.random((count, 1)) < 0.8, unit(rng.normal(0, 1, (count, 3))), 0.0)
    area = single(np.where(rng.random(count) < 0.9, rng.uniform(1e-5, 1e-4, count), 0.0))
    body = Body(links, ids, kind, link, single(at), single(unit(up)), area, single(tangent))
    for index in range(rng.integers(8, 30)):
        one_link = rng.random() < 0.8
        among = np.flatnonzero(link == rng.integers(0, len(links))) if one_link else np.arange(count)
        if len(among) == 0:
            continue
        size = int(rng.choice([1, 2, 3, 8, len(among)]))
        chosen = sorted(int(i) for i in rng.choice(among, min(size, len(among)), replace=False))
        has_chart = len({link[i] for i in chosen}) == 1 and rng.random() < 0.9
        members = {i: float(rng.choice([1.0, 1.0, 0.5, 2.0, 0.8125])) for i in chosen}
        one = OneField(f"field {index}", members, None)
        if has_chart:
            mean = unit(body.normal[chosen].sum(axis=0))
            wanted = rng.normal(0, 1, 3)
            wanted = wanted - 0.5 * mean * (wanted @ mean)
            one.chart = (list(map(float, np.round(rng.uniform(-0.1, 0.1, 3), 4))), list(map(float, np.round(wanted, 4))))
        body.fields.append(one)
    return body


def random_calibration(rng, body):
    """The tables of a calibration file."""
    number = lambda low, high, digits=4: float(round(rng.uniform(low, high), digits))
    gains = lambda: [number(0.001, 1), number(0.001, 1)] if rng.random() < 0.5 else number(0.001, 1)
    every = {"baseline": number(0, 300), "gain": number(0.001, 2), "dead_band": number(0, 20)}
    every |= {"unit": str(rng.choice(["N", "mN", "kPa", "Pa"]))} if rng.random() < 0.8 else {}
    every |= {"noise": number(0.1, 3)} if rng.random() < 0.7 else {}
    every |= {"invert": True} if rng.random() < 0.2 else {}
    every |= {"raw_range": [-1000, 900], "missing": [30000]} if rng.random() < 0.4 else {}
    # A limit under what a baseline would be of the largest gain is refused.
    every |= {"p_max": number(620, 1500)} if rng.random() < 0.4 else {}
    every |= {"scale": number(0.3, 1)} if rng.random() < 0.3 else {}
    every["dead_band"] = round(every["dead_band"] * every["gain"], 6)
    file = {"all": every, "curve": {
        "warm": {"raw": [0.0, 100.5, 400.0, 1000.0], "p": [-10.0, 18.5, 36.0, 90.25]},
        "far": {"raw": [5.0, 50.0, 300.0, 900.0], "p": [400.0, 120.0, 31.5, 2.0]},
    }, "taxel": {}}
    if rng.random() < 0.8:
        shear = {"baseline": [number(-50, 50), number(-50, 50)]} if rng.random() < 0.6 else {}
        shear |= {"gain": gains()} if rng.random() < 0.5 else {}
        rows = np.eye(3)[int(rng.integers(2)) :]
        shear |= {"cross_axis": np.round(rows + rng.normal(0, 0.1, rows.shape), 4).tolist()} if rng.random() < 0.5 else {}
        shear |= {"raw_range": [-400.0, 350.0]} if rng.random() < 0.3 else {}
        shear |= {"slips_at": number(0.2, 1.2)} if rng.random() < 0.7 else {}
        shear |= {"noise": number(0.1, 3)} if rng.random() < 0.4 else {}
        file["shear"] = shear
    warm = {"window_s": float(rng.choice([0.33, 1.0, 2.5]))} if rng.random() < 0.5 else {}
    match rng.integers(4):
        case 0:
            warm |= {"ntc": {"ohm_at_25": 10e3, "b_k": 3950.0, "series_ohm": 10e3, "full_raw": 1023.0}}
        case 1:
            warm |= {"curve": "warm", "unit": str(rng.choice(["°C", "K"]))}
        case _:
            warm |= {"unit": str(rng.choice(["°C", "K", "°F"])), "gain": number(0.01, 0.5), "baseline": number(-100, 100)}
    warm |= {"raw_range": [20.0, 950.0], "missing": [-999.0, 77.0]} if rng.random() < 0.5 else {}
    warm |= {"invert": True} if rng.random() < 0.2 else {}
    near = {"unit": str(rng.choice(["mm", "cm", "in"])), "gain": number(0.05, 1)} if rng.random() < 0.7 else {}
    near |= {"curve": "far"} if rng.random() < 0.4 else {"baseline": number(0, 20)}
    near |= {"range": number(50, 300)} if rng.random() < 0.7 else {}
    near |= {"window_s": float(rng.choice([0.11, 0.4]))} if rng.random() < 0.5 else {}
    near |= {"raw_range": [2.0, 900.0], "missing": [0.0]} if rng.random() < 0.4 else {}
    near |= {"invert": True} if rng.random() < 0.2 else {}
    file |= {"temperature": warm, "proximity": near}
    for taxel, kind in zip(body.ids, body.kind):
        if rng.random() < 0.8:
            continue
        own = {"mask": True} if rng.random() < 0.2 else {"baseline": number(0, 200)}
        own |= {"gain": number(0.01, 2)} if rng.random() < 0.5 else {}
        if kind == "force3":
            own |= {"shear_baseline": [number(-30, 30), number(-30, 30)]} if rng.random() < 0.5 else {}
            own |= {"shear_gain": gains()} if rng.random() < 0.5 else {}
            own |= {"shear_raw_range": [-150.0, 250.0]} if rng.random() < 0.3 else {}
            own |= {"shear_noise": number(0.1, 3)} if rng.random() < 0.3 else {}
        elif kind != "pressure" and rng.random() < 0.3:
            own |= {"curve": "warm" if kind == "temperature" else "far"}
        if kind == "temperature" and "ntc" in warm and "curve" not in own:
            # A thermistor has neither.
            own = {key: value for key, value in own.items() if key not in ("baseline", "gain")}
        if kind in ("temperature", "proximity") and rng.random() < 0.3:
            own |= {"invert": bool(rng.random() < 0.7)}
        file["taxel"][str(taxel)] = own
    return file


def toml(tables, path=()):
    lines, below = [], []
    for key, value in tables.items():
        if isinstance(value, dict) and key != "ntc":
            below += toml(value, (*path, key))
        elif isinstance(value, dict):
            lines.append(f"{key} = {{ " + ", ".join(f"{k} = {v!r}" for k, v in value.items()) + " }")
        else:
            lines.append(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    return ([f"[{'.'.join(path)}]"] if path and lines else []) + lines + below


class Frames:
    """Raw values by channel: not a number where a value is faulty."""

    def __init__(self, rng, body, count):
        step = float(rng.choice([0.02, 0.0151, 0.05, 0.002]))
        times = [float(rng.choice([0.0, 1000.0]))]
        while len(times) < count:
            on = step * (rng.choice([1, 1, 2, 7]) if rng.random() < 0.2 else 1)
            if rng.random() < 0.01:
                on = -2.5 if rng.random() < 0.5 else 12.0
            times.append(round(float(times[-1] + on), 6))
        self.t = times
        steps = np.diff(times, prepend=times[0])
        self.restarts = (np.abs(steps) > 1e-9) & ((steps < 0) | (steps > 10))
        self.channels = [(taxel, axis) for axis in ("", "u", "v") for taxel, kind in enumerate(body.kind) if not axis or kind == "force3"]
        taxels, level = len(body.kind), rng.choice([1.0, 0.25, 1e-3])
        raw = {}
        pressed = rng.random((count, taxels)) < rng.uniform(0.05, 0.9)
        smooth = np.cumsum(rng.normal(0, 2, (count, 1)), axis=0)
        for taxel, kind in enumerate(body.kind):
            if kind in ("pressure", "force3"):
                raw[taxel, ""] = np.where(pressed[:, taxel], rng.uniform(-200, 1000, count), rng.uniform(0, 300, count))
                if kind == "force3":
                    still = rng.random(count) < 0.1
                    raw |= {(taxel, axis): np.where(still, 0.0, rng.normal(0, 200, count)) for axis in ("u", "v")}
            else:
                raw[taxel, ""] = rng.uniform(30, 900) + smooth[:, 0] + rng.normal(0, 20, count)
                raw[taxel, ""][rng.random(count) < 0.01] = rng.choice([0.0, 1023.0, -999.0, 77.0, 5000.0])
        self.raw = np.stack([np.round(raw[channel] / level) * level for channel in self.channels], axis=1)
        holes = rng.choice([0.0, 0.003, 0.05])
        self.raw[rng.random(self.raw.shape) < holes / 3] = 30000
        self.raw = single(self.raw)
        self.raw[rng.random(self.raw.shape) < holes / 3] = np.nan
        self.missing = rng.random(self.raw.shape) < holes
        self.place = {channel: index for index, channel in enumerate(self.channels)}
        self.poses, self.moved = [{}] * count, [None] * count

    def pose(self, rng, body):
        """Puts the body into the world in most frames: by link, place and quaternion. A link without a pose goes with the one above it."""
        self.poses = []
        for frame in range(len(self.t)):
            own = [0] + [link for link in range(1, len(body.links)) if rng.random() < 0.5] if rng.random() < 0.9 else []
            self.poses.append({link: np.append(rng.uniform(-1, 1, 3), unit(rng.normal(0, 1, 4))) for link in own})
            self.moved[frame] = self.move(self.poses[-1], body) if own else None

    @staticmethod
    def move(poses, body):
        """By link, the rotation and the step that take the body at rest to where the link is in the world."""
        moved = []
        for link in range(len(body.links)):
            pose = poses[next(above for above in body.above(link) if above in poses)]
            rotation, origin = body.pose(next(above for above in body.above(link) if above in poses))
            turn = matrix(pose[3:]) @ rotation.T
            moved.append((turn, pose[:3] - turn @ origin))
        return [np.array(column) for column in zip(*moved)]

    def of(self, taxels, axis=""):
        places = [self.place[taxel, axis] for taxel in taxels]
        missing = self.missing[:, places]
        return np.where(missing, np.nan, self.raw[:, places]), missing

    def csv(self, body):
        name = lambda taxel, axis: f"{body.ids[taxel]}.{axis}" if axis else str(body.ids[taxel])
        lines = ["t," + ",".join(name(*channel) for channel in self.channels)]
        for t, raw, missing in zip(self.t, self.raw, self.missing):
            lines.append(f"{t!r}," + ",".join("" if gone else repr(float(value)) for value, gone in zip(raw, missing)))
        return "\n".join(lines) + "\n"


    def lines(self, body):
        """The same as a driver writes them, with poses."""
        told = lambda raw, gone: None if gone else "nan" if np.isnan(raw) else float(raw)
        for t, raw, missing, poses in zip(self.t, self.raw, self.missing, self.poses):
            values = {}
            for (taxel, _), value, gone in zip(self.channels, raw, missing):
                values.setdefault(str(body.ids[taxel]), []).append(told(value, gone))
            values = {name: own if len(own) > 1 else own[0] for name, own in values.items()}
            pose = {body.links[link][0]: list(map(float, pose)) for link, pose in poses.items()}
            yield json.dumps({"t": t, "values": values} | ({"pose": pose} if pose else {}))


class Recording:
    def __init__(self, name, rng, count, kinds, backend):
        self.name, self.backend, self.is_posed = name, backend, False
        self.body = random_body(rng, kinds)
        self.calibration = random_calibration(rng, self.body)
        self.frames = Frames(rng, self.body, count)

    def pose(self, rng):
        self.is_posed = True
        self.frames.pose(rng, self.body)

    def kinds(self):
        return {self.body.kind[taxel] for one in self.body.fields for taxel in one.members}

    def letters(self):
        of = {"force3": "shear", "temperature": "temperature", "proximity": "proximity"}
        return [letter for kind, letter in of.items() if kind in self.kinds()]

    def has_touches(self):
        """Whether some field has taxels that something can press."""
        return bool(self.kinds() & {"pressure", "force3"})

    def is_alone(self, letter):
        return len(self.letters()) == 1 and not self.kinds() & {"pressure", "force3"}

    def write(self, folder):
        keys = {"glb": "glb", "toml": "toml", "frames": "jsonl" if self.is_posed else "csv", "ndjson": "ndjson"}
        paths = {key: folder / f"{self.name}.{end}" for key, end in keys.items()}
        paths["glb"].write_bytes(self.body.glb())
        paths["toml"].write_text("\n".join(toml(self.calibration)) + "\n")
        frames = "\n".join(self.frames.lines(self.body)) + "\n" if self.is_posed else self.frames.csv(self.body)
        paths["frames"].write_text(frames)
        paths["ndjson"].unlink(missing_ok=True)
        return paths


def recordings(long, seed):
    mixes = [KINDS, KINDS[1:], ("force3",), ("temperature",), ("proximity",), ("pressure", "temperature")]
    for number in range(180 if long else 8):
        rng = np.random.default_rng([seed, number])
        recording = Recording(f"letters-{number}", rng, 260 if long else 60, mixes[number % len(mixes)] if number % 3 else KINDS, ("cpu", "reference")[number % 2])
        if number % 8 == 6:
            # Sensors whose noise nobody knows, in the short run, too.
            recording.calibration["all"].pop("noise", None)
        if number % 4 > 1:
            recording.pose(np.random.default_rng([seed, number, 1]))
        if recording.letters():
            yield recording
