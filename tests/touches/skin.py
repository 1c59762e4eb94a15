"""The skin of a body as its files have it: places of taxels, edges, cells and normals by `somatic inspect --json`, triangles by glTF."""

import json
import struct
from pathlib import Path

import numpy as np

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
# A direction is along an axis within this angle, where a chart's u is chosen.
ALONG = np.cos(np.radians(10))


class Glb:
    """Nodes with their poses at rest, and accessors. Nodes of links have no scale."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        length = struct.unpack_from("<I", data, 12)[0]
        self.file, self.binary = json.loads(data[20 : 20 + length]), data[28 + length :]
        nodes = self.file["nodes"]
        parents = {child: node for node, entry in enumerate(nodes) for child in entry.get("children", [])}

        def pose(node):
            own = local(nodes[node])
            return pose(parents[node]) @ own if node in parents else own

        self.poses = [pose(node) for node in range(len(nodes))]
        # A field may be called as a link is, which comes first.
        self.by_name = {entry.get("name"): node for node, entry in reversed(list(enumerate(nodes)))}

    def accessor(self, index):
        entry = self.file["accessors"][index]
        view = self.file["bufferViews"][entry["bufferView"]]
        kind, width = np.dtype(TYPES[entry["componentType"]]), COMPONENTS[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        raw = np.frombuffer(self.binary, "u1", stride * (entry["count"] - 1) + kind.itemsize * width, start)
        rows = np.lib.stride_tricks.as_strided(raw, (entry["count"], kind.itemsize * width), (stride, 1))
        found = np.ascontiguousarray(rows).view(kind)
        return found[:, 0] if width == 1 else found

    def triangles(self):
        """Corners of all triangles at rest, n × 3 × 3."""
        corners = [np.zeros((0, 3, 3))]
        for index, node in enumerate(self.file["nodes"]):
            for primitive in self.file["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
                if primitive.get("mode", 4) != 4:
                    continue
                points = self.accessor(primitive["attributes"]["POSITION"]).astype(float)
                order = np.arange(len(points)) if "indices" not in primitive else self.accessor(primitive["indices"])
                way = self.poses[index]
                if "skin" in node:
                    points = self.bound(self.file["skins"][node["skin"]], primitive["attributes"], points)
                else:
                    points = points @ way[:3, :3].T + way[:3, 3]
                corners.append(points[order.reshape(-1, 3).astype(int)])
        return np.concatenate(corners)

    def bound(self, skin, attributes, points):
        """Where skinned points are at rest, each on its heaviest joint."""
        inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        ways = np.array([self.poses[joint] @ way for joint, way in zip(skin["joints"], inverse)])
        weights, joints = self.accessor(attributes["WEIGHTS_0"]), self.accessor(attributes["JOINTS_0"]).astype(int)
        ways = ways[joints[np.arange(len(joints)), weights.argmax(axis=1)]]
        return np.einsum("nij,nj->ni", ways[:, :3, :3], points) + ways[:, :3, 3]


def local(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * np.array(node.get("scale", [1, 1, 1])), node.get("translation", [0, 0, 0])
    return matrix


class Skin:
    """Pressure taxels by ascending id; a number in this order is a node."""

    def __init__(self, body, listed):
        glb, listed = Glb(body), json.loads(Path(listed).read_text())
        taxels = sorted((t for t in listed["taxels"] if t["modality"] == "pressure"), key=lambda t: t["id"])
        column = lambda key: np.array([t[key] for t in taxels], float)
        self.ids = [t["id"] for t in taxels]
        self.node_of = {taxel: node for node, taxel in enumerate(self.ids)}
        self.links = listed["links"]
        self.link = np.array([self.links.index(t["link"]) for t in taxels])
        self.poses = np.array([glb.poses[glb.by_name[name]] for name in self.links])
        turns = self.poses[self.link][:, :3, :3]
        self.at = np.einsum("nij,nj->ni", turns, column("position")) + self.poses[self.link][:, :3, 3]
        self.normal = np.einsum("nij,nj->ni", turns, column("normal"))
        self.mean_normal = np.einsum("nij,nj->ni", turns, column("mean_normal"))
        self.cell, self.area = column("cell"), column("area")
        self.beside = [[] for _ in taxels]
        for a, b in listed["edges"]:
            self.beside[self.node_of[a]].append(self.node_of[b])
            self.beside[self.node_of[b]].append(self.node_of[a])
        self.fields = {
            field["name"]: {self.node_of[m["taxel"]] for m in field["members"] if m["taxel"] in self.node_of}
            for field in listed["fields"]
        }
        self.fields_of = [[] for _ in taxels]
        for name, members in self.fields.items():
            for node in members:
                self.fields_of[node].append(name)
        self.surface = Surface(glb.triangles())
        is_bare = len(self.surface.corners) == 0
        self.part = None if is_bare else np.array([self.surface.part_at(place) for place in self.at])
        gaps = np.linalg.norm(self.at[:, None] - self.at[None], axis=2) if len(taxels) < 3000 else None
        if gaps is not None:
            np.fill_diagonal(gaps, np.inf)
        self.spacing = float(np.median(gaps.min(axis=1))) if gaps is not None else float(np.sqrt(np.median(self.cell)))

    def into_body(self, link, vector, is_place):
        pose = self.poses[link]
        return pose[:3, :3] @ vector + (pose[:3, 3] if is_place else 0)

    def bridged(self, has_value):
        """Neighbours of taxels that have a value, where others are bridges: what surrounds connected ones are each other's."""
        if all(has_value):
            return self.beside
        beside = [set(others) for others in self.beside]
        seen = set()
        for start in range(len(self.ids)):
            if has_value[start] or start in seen:
                continue
            seen.add(start)
            bridge, around = [start], set()
            for node in bridge:
                for other in self.beside[node]:
                    if has_value[other]:
                        around.add(other)
                    elif other not in seen:
                        seen.add(other)
                        bridge.append(other)
            for node in around:
                beside[node] |= around - {node}
        return [{o for o in others if has_value[o]} if has_value[node] else set() for node, others in enumerate(beside)]

    def u(self, link, normal):
        """The direction of +u of a chart with this normal: the link's x, or its z where x is along the normal."""
        axes = self.poses[link][:3, :3]
        along = axes[:, 2] if abs(axes[:, 0] @ normal) >= ALONG else axes[:, 0]
        along = along - normal * (along @ normal)
        return along / np.linalg.norm(along)


class Surface:
    def __init__(self, corners):
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sound = np.linalg.norm(across, axis=1) > 1e-16
        self.corners = corners[sound]
        self.normals = across[sound] / np.linalg.norm(across[sound], axis=1)[:, None]
        self.middles = self.corners.mean(axis=1)
        self.radii = np.linalg.norm(self.corners - self.middles[:, None], axis=2).max(axis=1, initial=0)
        self.part = parts(self.corners)

    def part_at(self, place):
        """The connected part of the surface that is nearest to `place`."""
        within = np.linalg.norm(self.middles - place, axis=1).min() + 1e-9
        near = self.near(place, within)
        return self.part[near[np.linalg.norm(nearest_on(self.corners[near], place) - place, axis=1).argmin()]]

    def near(self, place, within):
        return np.flatnonzero(np.linalg.norm(self.middles - place, axis=1) <= within + self.radii)

    def nearest(self, place, within, on=None):
        """The point of the surface, or of its parts `on`, that is nearest to `place`, at most `within` away."""
        near = self.near(place, within)
        if on is not None:
            near = near[np.isin(self.part[near], on)]
        if len(near) == 0:
            return None
        found = nearest_on(self.corners[near], place)
        return found[np.linalg.norm(found - place, axis=1).argmin()]


def parts(corners):
    """Per triangle the number of the connected part that it is in: triangles are connected where they have a corner in common."""
    _, corner = np.unique(np.round(corners.reshape(-1, 3), 7), axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    up = np.arange(corner.max(initial=-1) + 1)

    def root(one):
        while up[one] != one:
            up[one] = up[up[one]]
            one = up[one]
        return one

    for first, *others in corner.tolist():
        for other in others:
            up[root(other)] = root(first)
    return np.array([root(first) for first in corner[:, 0].tolist()], int)


def nearest_on(corners, p):
    """Per triangle its point nearest to p: the foot of p if that is inside, else of three edges' points the nearest."""
    a, b, c = corners.transpose(1, 0, 2)
    found = []
    for start, end in ((a, b), (b, c), (c, a)):
        way = end - start
        share = np.einsum("ni,ni->n", p - start, way) / np.maximum(np.einsum("ni,ni->n", way, way), 1e-300)
        found.append(start + way * np.clip(share, 0, 1)[:, None])
    normal = np.cross(b - a, c - a)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    foot = p - normal * np.einsum("ni,ni->n", p - a, normal)[:, None]
    inside = np.ones(len(a), bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= np.einsum("ni,ni->n", np.cross(end - start, foot - start), normal) >= 0
    found = np.array(found)
    best = found[np.linalg.norm(found - p, axis=2).argmin(axis=0), np.arange(len(a))]
    return np.where(inside[:, None], foot, best)
