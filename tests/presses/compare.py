"""What simulated touches of a whole body are by an integration of their own, against what `somatic simulate` wrote.

    compare.py where ROBOT                              the URDF of a robot of example-robot-data, and the folder of the package
    compare.py compare BODY.glb SIMULATION.toml FRAMES.csv TRUTH.csv TAXELS.json [LINE ...]

Each touch of the simulation stays at a taxel. `compare` prints a JSON object: per touch how far the place is from the truth's, m,
the force by the depth in the truth as a share of the force, by how much the taxels' forces differ as a share of the force, and the
angles of the axis and the direction, degrees. Everything is read and made anew here, from docs/explanation/simulation.md: nothing is shared with
the crate but the file formats. BODY.glb must have links without scale.
"""

import csv
import importlib.metadata
import json
import struct
import sys
import tomllib
from pathlib import Path

import numpy as np

FACES = np.cos(np.radians(83))
BESIDE = np.cos(np.radians(97))
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Inside(Exception):
    """All that an indenter reaches is inside the body, as at a taxel that nothing can touch."""


def unit(v):
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)


# The body.


def glb(path):
    data = Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


class Body:
    """Triangles at rest: corners n × 3 × 3, normals, the link (a node) and the mesh of each."""

    def __init__(self, path):
        self.file, self.binary = glb(path)
        nodes = self.file["nodes"]
        parents = {child: node for node, entry in enumerate(nodes) for child in entry.get("children", [])}

        def world(node):
            own = self.local(nodes[node])
            return world(parents[node]) @ own if node in parents else own

        self.world = [world(node) for node in range(len(nodes))]
        # A field may be called as a link is, which comes first.
        self.by_name = {entry.get("name"): index for index, entry in reversed(list(enumerate(nodes)))}
        corners, links, meshes, skinned = [], [], [], []
        for index, node in enumerate(nodes):
            if "mesh" not in node:
                continue
            for primitive in self.file["meshes"][node["mesh"]]["primitives"]:
                if primitive.get("mode", 4) != 4 or "indices" not in primitive:
                    continue
                at = primitive["attributes"]
                points = self.accessor(at["POSITION"]).astype(float)
                triangles = self.accessor(primitive["indices"]).reshape(-1, 3).astype(int)
                if "skin" in node:
                    skin = self.file["skins"][node["skin"]]
                    inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
                    ways = np.array([self.world[j] @ i for j, i in zip(skin["joints"], inverse)])
                    weights, joints = self.accessor(at["WEIGHTS_0"]), self.accessor(at["JOINTS_0"]).astype(int)
                    heaviest = joints[np.arange(len(joints)), weights.argmax(axis=1)]
                    points = np.einsum("nij,nj->ni", ways[heaviest][:, :3, :3], points) + ways[heaviest][:, :3, 3]
                    links.append(np.array(skin["joints"])[heaviest[triangles[:, 0]]])
                else:
                    way = self.world[index]
                    points = points @ way[:3, :3].T + way[:3, 3]
                    # A node of its own for the mesh hangs on the link's.
                    links.append(np.full(len(triangles), index))
                corners.append(points[triangles])
                meshes.append(np.full(len(triangles), len(meshes)))
                skinned.append(np.full(len(triangles), "skin" in node))
        self.corners, self.links = np.concatenate(corners), np.concatenate(links)
        self.meshes, self.skinned = np.concatenate(meshes), np.concatenate(skinned)
        across = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        sound = np.linalg.norm(across, axis=1) > 1e-16
        for name in ("corners", "links", "meshes", "skinned"):
            setattr(self, name, getattr(self, name)[sound])
        self.normals, self.areas = unit(across[sound]), np.linalg.norm(across[sound], axis=1) / 2
        self.middles = self.corners.mean(axis=1)
        self.radii = np.linalg.norm(self.corners - self.middles[:, None], axis=2).max(axis=1)
        self.joined = self.edges()

    @staticmethod
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

    def edges(self):
        """Pairs of triangles that share an edge and a layer."""
        where = np.unique(np.round(self.corners.reshape(-1, 3) / 1e-6).astype(np.int64), axis=0, return_inverse=True)[1]
        corner = where.reshape(-1, 3)
        ends = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
        of = np.tile(np.arange(len(corner)), 3)
        key = np.sort(ends, axis=1)
        order = np.lexsort((key[:, 1], key[:, 0]))
        key, of, ends = key[order], of[order], ends[order]
        _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
        first = first[count == 2]
        pairs = np.stack([of[first], of[first + 1]], axis=1)
        # Neighbours that agree on what is outside run through the edge in opposite ways.
        pairs = pairs[(ends[first] != ends[first + 1]).all(axis=1)]
        a, b = pairs.T
        return pairs[(self.links[a] == self.links[b]) | (self.skinned[a] & self.skinned[b])]

    def near(self, p, within):
        return np.flatnonzero(np.linalg.norm(self.middles - p, axis=1) <= within + self.radii)


def nearest_on(corners, p):
    """Per triangle its point nearest to p, by the seven regions' candidates."""
    a, b, c = corners.transpose(1, 0, 2)
    found = []
    for start, end in ((a, b), (b, c), (c, a)):
        way = end - start
        share = np.einsum("ni,ni->n", p - start, way) / np.maximum(np.einsum("ni,ni->n", way, way), 1e-300)
        found.append(start + way * np.clip(share, 0, 1)[:, None])
    normal = unit(np.cross(b - a, c - a))
    foot = p - normal * np.einsum("ni,ni->n", p - a, normal)[:, None]
    inside = np.ones(len(a), bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= np.einsum("ni,ni->n", np.cross(end - start, foot - start), normal) >= 0
    found = np.array(found)
    away = np.linalg.norm(found - p, axis=2)
    best = found[away.argmin(axis=0), np.arange(len(a))]
    return np.where(inside[:, None], foot, best)


def sampled(corners, spacing):
    """Points of the triangles with their areas, and whose they are."""
    if len(corners) == 0:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(0, int)
    edges = corners - np.roll(corners, -1, axis=1)
    lengths = np.linalg.norm(edges, axis=2)
    whole = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    parts = np.ceil(lengths.max(axis=1) / spacing).astype(int)
    points, areas, of = [], [], []
    for k in np.unique(parts[parts <= 16]):
        # The middles of k² equal triangles, those that point up and those that point down.
        i, j = np.meshgrid(np.arange(k), np.arange(k))
        up, down = i + j < k, i + j < k - 1
        u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / k
        v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / k
        which = np.flatnonzero(parts == k)
        a, b, c = corners[which].transpose(1, 0, 2)
        points.append((a[:, None] + u[:, None] * (b - a)[:, None] + v[:, None] * (c - a)[:, None]).reshape(-1, 3))
        areas.append(np.repeat(whole[which] / k**2, k * k))
        of.append(np.repeat(which, k * k))
    for index in np.flatnonzero(parts > 16):
        for at, area in rows(corners[index], whole[index], lengths[index], spacing):
            points.append(at)
            areas.append(np.full(len(at), area / len(at)))
            of.append(np.full(len(at), index))
    return np.concatenate(points), np.concatenate(areas), np.concatenate(of)


def between(corners, along, low, high):
    """The triangles that make up what lies between two planes across `along`, and whose they are."""
    found, of = [], []
    for index, triangle in enumerate(corners):
        outline = list(triangle)
        for limit, inwards in ((low, 1), (high, -1)):
            beyond = [(p @ along - limit) * inwards for p in outline]
            cut = []
            for k, p in enumerate(outline):
                q, here, there = outline[(k + 1) % len(outline)], beyond[k], beyond[(k + 1) % len(outline)]
                if here >= 0:
                    cut.append(p)
                if (here < 0) != (there < 0):
                    cut.append(p + (q - p) * here / (here - there))
            outline = cut
        for k in range(1, len(outline) - 1):
            found.append((outline[0], outline[k], outline[k + 1]))
            of.append(index)
    return np.array(found, float).reshape(-1, 3, 3), np.array(of, int)


def rows(triangle, area, lengths, spacing):
    """The points of a long triangle in rows along its longest edge, with the rows' areas."""
    k = int(np.argmax(lengths))
    a, b, c = triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]
    across = max(1, int(np.ceil(lengths[k] / spacing)))
    count = max(1, int(np.ceil(2 * area / lengths[k] / spacing)))
    for row in range(count):
        low, high = row / count, (row + 1) / count
        part = (high - low) * (2 - low - high)
        # The middle of the row's area.
        v = ((high**2 - low**2) / 2 - (high**3 - low**3) / 3) * 2 / part
        u = (np.arange(max(1, int(np.ceil(across * (1 - low))))) + 0.5) / max(1, int(np.ceil(across * (1 - low))))
        yield (1 - v) * (a + u[:, None] * (b - a)) + v * c, area * part


def unrolled(offset, normal, other):
    """Where points at `offset` with the normals `other` lie beside one with `normal`, unrolled."""
    flat = offset - normal * np.sum(offset * normal, axis=-1, keepdims=True)
    cos = np.clip(np.sum(normal * other, axis=-1, keepdims=True), -1, 1)
    tilt = other - normal * cos
    sin = np.linalg.norm(tilt, axis=-1, keepdims=True)
    angle = np.arctan2(sin, cos)
    towards = tilt / np.maximum(sin, 1e-300)
    middle = towards * np.cos(angle / 2) - normal * np.sin(angle / 2)
    along = np.sum(offset * middle, axis=-1, keepdims=True) / np.sinc(angle / 2 / np.pi)
    bent = flat + towards * (along - np.sum(flat * towards, axis=-1, keepdims=True))
    return np.where(sin < 1e-9, flat, bent)


def distance(offset, normal, other):
    return np.maximum(np.linalg.norm(unrolled(offset, normal, other), axis=-1), np.linalg.norm(offset, axis=-1))


# The touch.


class Touch:
    def __init__(self, body, keys, layer, taxels):
        self.body, self.keys = body, keys
        self.sigma = max(layer.get("spread", 3**-0.5) * layer["thickness_m"], 5e-4)
        self.reach = 5 * self.sigma
        self.stiffness = layer.get("stiffness_pa", 400e3) / layer["thickness_m"]
        self.force = keys["force_newton"][0][1]
        at, outward, link, _ = taxels[keys["path"][0]["taxel"]]
        spot = self.surface(at, outward)
        normal = self.smooth(*spot)
        world = body.world[link][:3, :3]
        u = world[:, 0] if abs(world[:, 0] @ normal) < np.cos(np.radians(10)) else world[:, 2]
        u = unit(u - normal * (u @ normal))
        angle = np.radians(keys.get("angle_deg", 0))
        along = u * np.cos(angle) + np.cross(normal, u) * np.sin(angle)
        if keys["indenter"] == "pair":
            half = keys["apart_m"] / 2
            self.force /= 2
            self.poses = []
            for way in (-along, along):
                p, n, _ = self.walk(spot[0], spot[1], way, half)[-1]
                n = self.smooth(p, n)
                self.poses.append((p, n, unit(along - n * (along @ n))))
        else:
            self.poses = [(spot[0], normal, along)]
        self.facet_normal = spot[1]

    def surface(self, p, outward):
        body = self.body
        for within in (0.003, 0.01, 0.03, 10.0):
            near = body.near(p, within)
            near = near[body.normals[near] @ outward > FACES]
            if len(near):
                found = nearest_on(body.corners[near], p)
                away = np.linalg.norm(found - p, axis=1)
                best = away.argmin()
                if away[best] <= within:
                    return found[best], body.normals[near[best]]
        raise SystemExit("no surface")

    def smooth(self, p, normal):
        body = self.body
        near = body.near(p, 0.012)
        near = near[body.normals[near] @ normal > BESIDE]
        points, areas, of = sampled(body.corners[near], 0.0012)
        away = np.linalg.norm(points - p, axis=1)
        weights = np.where(away <= 0.012, areas * np.exp(-0.5 * (away / 0.004) ** 2), 0)
        return unit(weights @ body.normals[near][of])

    def walk(self, p, normal, along, length):
        """Points a millimetre apart, with normals and directions."""
        way = []
        while length > 1e-9:
            step = min(length, 1e-3)
            next_p, next_n = self.surface(p + along * step, normal)
            if (next_p - p) @ along < 0.5 * step:
                break
            axis, cos = np.cross(normal, next_n), normal @ next_n
            along = along + np.cross(axis, along) + np.cross(axis, np.cross(axis, along)) / (1 + cos)
            along = unit(along - next_n * (along @ next_n))
            p, normal, length = next_p, next_n, length - step
            way.append((p, normal, along))
        return way

    def depths(self, pose, depth, points, normals, line=None):
        """How deep the indenter is under each point along its normal."""
        p, n, along = pose
        keys, kind = self.keys, self.keys["indenter"]
        if kind == "strap":
            return depth * self.bulge(points, normals, line)
        axes = np.stack([along, np.cross(n, along), n])
        if kind == "ellipsoid":
            radii = np.array(keys["radii_m"])
        elif kind == "rod":
            radii = np.array([np.inf, keys["radius_m"], keys["radius_m"]])
        else:
            radii = np.full(3, keys["radius_m"])
        q = (points - (p + n * (radii[2] - depth))) @ axes.T
        inward = -normals @ axes.T
        faces = normals @ n > FACES
        a, b, c = ((inward / radii) ** 2).sum(1), (q * inward / radii**2).sum(1), ((q / radii) ** 2).sum(1) - 1
        with np.errstate(all="ignore"):
            out = (np.sqrt(np.maximum(b * b - a * c, 0)) - b) / a
            out = np.where(a > 0, out, np.inf)
            inside = c < 0
            if kind == "rod":
                half = keys["length_m"] / 2
                end = np.where(inward[:, 0] != 0, (np.copysign(half, inward[:, 0]) - q[:, 0]) / inward[:, 0], np.inf)
                out, inside = np.minimum(out, end), inside & (np.abs(q[:, 0]) <= half)
        return np.where(inside & faces, out, 0.0)

    def bulge(self, points, normals, line):
        width = self.keys["width_m"]
        least = np.full(len(points), np.inf)
        for index, (p, n, along) in enumerate(line):
            near = np.flatnonzero((np.linalg.norm(points - p, axis=1) <= width / 2 + 1e-3) & (normals @ n > FACES))
            if len(near) == 0:
                continue
            place = unrolled(points[near] - p, n[None], normals[near])
            ahead = place @ along
            ahead = np.clip(ahead, 0 if index == 0 else -1e-3, 0 if index == len(line) - 1 else 1e-3)
            least[near] = np.minimum(least[near], np.linalg.norm(place - ahead[:, None] * along, axis=1))
        return np.maximum(1 - (2 * least / width) ** 2, 0)

    def covered(self, points, normals):
        """Whether something that faces the same way lies within 20 mm over each point."""
        body, found = self.body, np.zeros(len(points), bool)
        if len(points) == 0:
            return found
        low, high = np.minimum(points, points + 0.02 * normals), np.maximum(points, points + 0.02 * normals)
        corners = body.corners
        box = (corners.max(axis=1) >= low.min(axis=0)).all(axis=1) & (corners.min(axis=1) <= high.max(axis=0)).all(axis=1)
        for triangle in np.flatnonzero(box):
            a, b, c = corners[triangle]
            n = body.normals[triangle]
            slope = normals @ n
            with np.errstate(all="ignore"):
                t = ((a - points) @ n) / slope
            maybe = np.flatnonzero((slope > 1e-12) & (t > 1e-5) & (t <= 0.02) & ~found)
            if len(maybe) == 0:
                continue
            at = points[maybe] + t[maybe, None] * normals[maybe]
            inside = np.ones(len(maybe), bool)
            for start, end in ((a, b), (b, c), (c, a)):
                inside &= np.cross(end - start, at - start) @ n >= -1e-15
            found[maybe[inside]] = True
        return found

    def press(self, pose, told_depth):
        body, keys, kind = self.body, self.keys, self.keys["indenter"]
        line = None
        margin = max(0.3 * abs(told_depth), 2e-4)
        if kind == "strap":
            p, n, along = pose
            half = keys["length_m"] / 2
            back = [(q, m, -a) for q, m, a in self.walk(p, self.facet_normal, -along, half)][::-1]
            line = back + [(p, self.facet_normal, along)] + self.walk(p, self.facet_normal, along, half)
            near = np.unique(np.concatenate([body.near(q, keys["width_m"] / 2 + 1e-3) for q, _, _ in line[::3] + [line[-1]]]))
            low, high = 0.0, told_depth + margin
        else:
            size = {"ball": lambda: keys["radius_m"], "pair": lambda: keys["radius_m"]}
            size |= {"rod": lambda: np.hypot(keys["radius_m"], keys["length_m"] / 2), "ellipsoid": lambda: max(keys["radii_m"])}
            most = keys["radii_m"][2] if kind == "ellipsoid" else keys["radius_m"]
            near = body.near(pose[0] + pose[1] * (most - told_depth), size[kind]() + 2 * margin)
            low, high = told_depth - margin, min(told_depth + margin, most)
        corners = body.corners[near]
        if kind == "rod":
            # Its flat ends stay where they are at any depth.
            middle, half = pose[0] @ pose[2], keys["length_m"] / 2
            corners, of = between(corners, pose[2], middle - half, middle + half)
            near = near[of]
        # Coarse first, to find where it presses, then fine there.
        for spacing in (1.5e-3, 0.4e-3, 0.12e-3):
            points, areas, of = sampled(corners, spacing)
            normals = body.normals[near][of]
            maybe = (self.depths(pose, high, points, normals, line) > 0) | (self.depths(pose, low, points, normals, line) > 0)
            if maybe.sum() > 4000 or spacing == 0.12e-3:
                break
            wide = np.unique(of[maybe | (self.depths(pose, high + 2 * spacing, points, normals, line) > 0)])
            if len(wide):
                near, corners = near[wide], corners[wide]
        points, areas, normals, facets = points[maybe], areas[maybe], normals[maybe], near[of[maybe]]
        open_ = ~self.covered(points, normals)
        points, areas, normals, facets = points[open_], areas[open_], normals[open_], facets[open_]
        force = lambda depth: self.stiffness * (self.depths(pose, depth, points, normals, line) @ areas)
        told = force(told_depth) / self.force
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if force(middle) < self.force else (low, middle)
        own = self.depths(pose, high, points, normals, line) * areas
        keep = own > 0
        if not keep.any():
            raise Inside
        points, normals, facets, own = points[keep], normals[keep], facets[keep], own[keep] * self.force / own.sum()
        return high, told, self.spread(points, normals, facets, own)

    def spread(self, points, normals, facets, forces):
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        body = self.body
        # Sources that lie close together count as one.
        cell = np.unique(np.floor(points / (self.sigma / 5)).astype(int), axis=0, return_inverse=True)[1].reshape(-1)
        total = np.bincount(cell, forces)
        mean = lambda values: np.stack([np.bincount(cell, forces * values[:, k]) for k in range(3)], axis=1) / total[:, None]
        sources, source_normals = mean(points), unit(mean(normals))
        first = np.unique(cell, return_index=True)[1]
        source_facets = facets[first]
        low, high = sources.min(axis=0) - self.reach, sources.max(axis=0) + self.reach
        box = (body.corners.max(axis=1) >= low).all(axis=1) & (body.corners.min(axis=1) <= high).all(axis=1)
        near = np.flatnonzero(box)
        tree = cKDTree(sources)
        at, areas, of = sampled(body.corners[near], self.sigma / 3)
        away = tree.query(at, distance_upper_bound=self.reach)[0]
        inside = np.isfinite(away)
        reached = np.zeros(len(body.corners), bool)
        reached[near[np.unique(of[inside])]] = True
        reached[facets] = True
        a, b = body.joined[reached[body.joined].all(axis=1)].T
        count = len(body.corners)
        part = connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(count, count)), directed=False)[1]
        at, areas, of = at[inside], areas[inside], near[of[inside]]
        felt = np.zeros(len(at))
        receivers = cKDTree(at)
        for source, normal, facet, force in zip(sources, source_normals, source_facets, total):
            index = np.array(receivers.query_ball_point(source, self.reach), int)
            index = index[(part[of[index]] == part[facet]) & (body.normals[of[index]] @ normal > BESIDE)]
            away = distance(at[index] - source, normal[None], body.normals[of[index]])
            share = np.where(away <= self.reach, areas[index] * np.exp(-0.5 * (away / self.sigma) ** 2), 0)
            felt[index] += force * share / share.sum()
        felt_facets = np.unique(of[felt > 0])
        mean = felt @ at / felt.sum()
        found = nearest_on(body.corners[felt_facets], mean)
        best = np.linalg.norm(found - mean, axis=1).argmin()
        place, normal = found[best], body.normals[felt_facets[best]]
        smooth = self.smooth(place, normal)
        behind = felt[body.normals[of] @ smooth < -0.5].sum() > 0.01 * felt.sum()
        offsets = at - place
        if not behind:
            offsets = unrolled(offsets, smooth[None], body.normals[of])
        offsets = offsets - felt @ offsets / felt.sum()
        moments = (offsets * felt[:, None]).T @ offsets / felt.sum()
        values, vectors = np.linalg.eigh(moments)
        links = np.bincount(body.links[of], felt)
        return {
            "place": place, "normal": smooth, "axis": vectors[:, 2], "link": int(links.argmax()),
            "anisotropy": (values[2] - values[1]) / (values[2] + values[1]), "at": at, "felt": felt, "facets": of,
        }


def taxel_forces(body, found, taxels, carried):
    """The force on the cell of each taxel."""
    ids = list(taxels)
    positions, normals = np.array([taxels[i][0] for i in ids]), np.array([taxels[i][1] for i in ids])
    sides = np.array([taxels[i][3] for i in ids]) ** 0.5
    from scipy.spatial import cKDTree

    gaps = cKDTree(positions).query(positions, k=2)[0][:, 1] if len(ids) > 1 else np.zeros(1)
    reach = 1.5 * np.maximum(sides, gaps)
    at, felt, facets = found["at"], found["felt"], found["facets"]
    close = np.flatnonzero(
        ((positions >= at.min(axis=0) - reach.max()) & (positions <= at.max(axis=0) + reach.max())).all(axis=1)
    )
    best, least = np.full(len(at), -1), np.full(len(at), np.inf)
    for taxel in close:
        fits = (body.normals[facets] @ normals[taxel] > BESIDE) & carried(ids[taxel], facets)
        away = distance(positions[taxel] - at, body.normals[facets], normals[taxel][None])
        nearer = fits & (away < least) & (away <= reach[taxel])
        best[nearer], least[nearer] = taxel, away[nearer]
    forces = np.bincount(best[best >= 0], felt[best >= 0], len(ids))
    return dict(zip(ids, forces))


def compare(body_path, simulation, frames, truth, listed, *lines):
    body = Body(body_path)
    keys = tomllib.loads(Path(simulation).read_text())
    layer = keys.get("layer", keys.get("skin"))
    names = body.by_name
    taxels = {}
    for entry in json.loads(Path(listed).read_text())["taxels"]:
        node = names[entry["link"]]
        world = body.world[node]
        position = world[:3, :3] @ entry["position"] + world[:3, 3]
        taxels[entry["id"]] = (position, world[:3, :3] @ entry["normal"], node, entry.get("area") or 0.0)
    joints = {joint for skin in body.file.get("skins", []) for joint in skin["joints"]}

    def carried(taxel, facets):
        node = taxels[taxel][2]
        return np.where(body.skinned[facets], node in joints, body.links[facets] == node)

    with open(frames) as file:
        rows = list(csv.DictReader(file))
    found = []
    with open(truth) as file:
        truths = list(csv.DictReader(file))
    wanted = {int(line) for line in lines}
    by_touch = {}
    for row in truths:
        by_touch.setdefault(int(row["touch"]), []).append(row)
    for index, touch_keys in enumerate(keys["touch"]):
        if wanted and index not in wanted:
            continue
        touch = Touch(body, touch_keys, layer, taxels)
        said = by_touch[index]
        assert len(said) == len(touch.poses), (index, said)
        sums = {}
        for pose, row in zip(touch.poses, said):
            number = lambda *columns: np.array([float(row[column]) for column in columns])
            try:
                depth, force, pressed = touch.press(pose, float(row["depth"]))
            except Inside:
                found.append({"touch": index, "indenter": touch_keys["indenter"], "covered": True})
                continue
            world = body.world[names[row["link"]]]
            place = world[:3, :3] @ number("x", "y", "z") + world[:3, 3]
            normal = world[:3, :3] @ number("nx", "ny", "nz")
            degrees = lambda a, b: float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
            line_degrees = lambda a, b: min(degrees(a, b), 180 - degrees(a, b))
            one = {
                "touch": index, "indenter": touch_keys["indenter"], "frame": int(row["frame"]),
                "place_m": float(np.linalg.norm(place - pressed["place"])), "force": float(force - 1),
                "depth_m": float(depth - float(row["depth"])), "normal_deg": degrees(normal, pressed["normal"]),
                "link": row["link"] == body.file["nodes"][pressed["link"]].get("name"),
                "anisotropy": float(pressed["anisotropy"]),
            }
            if row["principal_axis_x"]:
                axis = world[:3, :3] @ number("principal_axis_x", "principal_axis_y", "principal_axis_z")
                one["axis_deg"] = line_degrees(axis, pressed["axis"])
                if row["direction_x"]:
                    direction = world[:3, :3] @ number("direction_x", "direction_y", "direction_z")
                    one["axis_from_direction_deg"] = line_degrees(axis, direction)
            found.append(one)
            for taxel, force in taxel_forces(body, pressed, taxels, carried).items():
                sums[taxel] = sums.get(taxel, 0.0) + force
        if not sums:
            continue
        row = rows[int(said[0]["frame"])]
        whole = sum(float(one["force"]) for one in said)
        apart = [abs(float(row[str(taxel)]) - force) for taxel, force in sums.items()]
        felt = sum(float(row[str(taxel)]) for taxel in sums)
        found[-1] |= {"taxel": max(apart) / whole, "felt": felt / whole, "felt_here": sum(sums.values()) / whole}
    json.dump({"touches": found}, sys.stdout)


def where(robot):
    files = [Path(file.locate()).resolve() for file in importlib.metadata.files("example-robot-data")]
    urdf = next(file for file in files if file.name == f"{robot}.urdf")
    print(urdf)
    print(next(parent.parent for parent in urdf.parents if parent.name == "robots"))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["where", robot]:
            where(robot)
        case ["compare", *rest] if len(rest) >= 5:
            compare(*rest)
        case _:
            raise SystemExit(__doc__)
