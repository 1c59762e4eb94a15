#!/usr/bin/env python3
"""Whether something can touch the taxels that `somatic author` places, by another program.

    python escape.py SOMATIC TAXELS FILE... [--keep]

Authors each FILE (a mesh, a URDF, or the name of a bundled body) with TAXELS taxels, and prints a JSON object by file. From each taxel
rays start 0.1 mm outside in 256 directions, which are turned against those of the program, on the body at rest: skinned by the weights
of all joints. Taxels from which none leaves the body are looked at again in poses of its joints, drawn at random.

taxels      how many there are
--keep has hidden surface get taxels as well, for a check of this check.

closed      from how many of them no ray escapes at rest
hidden      from how many of them none escapes in any of the poses either
by_link     links whose number of taxels is not their share of the open area: within 30 % of a share of two or more, else within 1

The open area of links is of points all over the surface from which 5 rays escape, at rest or in one of four poses.
Needs NumPy and trimesh with embreex.
"""
import json
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

START_M = 1e-4
ENOUGH = 5
POSES = 32
POSES_OF_AREA = 4
SAMPLES = 20_000
TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def directions(rng):
    """256 directions on a Fibonacci sphere, turned at random."""
    at = np.arange(256) + 0.5
    turn, height = np.pi * (1 + 5**0.5) * at, 1 - at / 128
    flat = np.sqrt(1 - height**2)
    even = np.c_[flat * np.cos(turn), flat * np.sin(turn), height]
    return even @ trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3].T


def matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    made = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    made[:3, :3] = trimesh.transformations.quaternion_matrix((w, x, y, z))[:3, :3] * node.get("scale", (1, 1, 1))
    made[:3, 3] = node.get("translation", (0, 0, 0))
    return made


class Body:
    """A .glb as `author` writes it."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        length = struct.unpack("<I", data[12:16])[0]
        self.json, self.bin = json.loads(data[20 : 20 + length]), data[28 + length :]
        self.nodes = self.json["nodes"]
        self.parent = {child: index for index, node in enumerate(self.nodes) for child in node.get("children", [])}
        self.joints = {}
        for index, node in enumerate(self.nodes):
            text = node.get("extras", {}).get("somatic_joint")
            if text is not None:
                self.joints[index] = json.loads(text)
        self.parts, self.points = [], []
        for index, node in enumerate(self.nodes):
            for primitive in self.json["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
                (self.points if "_TAXEL_ID" in primitive["attributes"] else self.parts).append((index, primitive))
        self.parts = [(index, part) for index, part in self.parts if part.get("mode", 4) == 4]

    def accessor(self, index):
        accessor = self.json["accessors"][index]
        kind, width, count = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]], accessor["count"]
        if "bufferView" not in accessor:
            return np.zeros((count, width), kind)
        view = self.json["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        step = view.get("byteStride", kind.itemsize * width)
        rows = np.frombuffer(self.bin, np.uint8, count=(count - 1) * step + kind.itemsize * width, offset=start)
        rows = np.lib.stride_tricks.as_strided(rows, (count, kind.itemsize * width), (step, 1))
        values = np.ascontiguousarray(rows).view(kind).reshape(count, width)
        if accessor.get("normalized") and kind != np.float32:
            values = values / float(np.iinfo(kind).max)
        return values

    def worlds(self, rng=None):
        """The place of every node, at rest or with its joints drawn within their limits."""
        position = {}
        for index, joint in self.joints.items():
            turns = joint["type"] in ("revolute", "continuous")
            low, high = joint.get("limits") or ((-np.pi, np.pi) if turns else (0, 0))
            position[index] = 0.0 if rng is None else low + (high - low) * rng.random()
        if rng is not None:
            names = {joint["name"]: index for index, joint in self.joints.items()}
            for _ in range(4):
                for index, joint in self.joints.items():
                    if joint.get("mimic"):
                        mimic = joint["mimic"]
                        lead = position[names[mimic["joint"]]]
                        position[index] = mimic.get("multiplier", 1) * lead + mimic.get("offset", 0)
        found = {}

        def world(index):
            if index not in found:
                own = matrix(self.nodes[index])
                joint = self.joints.get(index)
                if joint is not None and position[index] and joint.get("axis"):
                    axis = np.array(joint["axis"])
                    if joint["type"] in ("revolute", "continuous"):
                        own = own @ trimesh.transformations.rotation_matrix(position[index], axis)
                    elif joint["type"] == "prismatic":
                        own = own @ trimesh.transformations.translation_matrix(axis * position[index])
                found[index] = (world(self.parent[index]) if index in self.parent else np.eye(4)) @ own
            return found[index]

        for index in range(len(self.nodes)):
            world(index)
        return found

    def skinned(self, node, primitive, worlds):
        """Per vertex its transform, and its weight of each joint."""
        skin = self.json["skins"][self.nodes[node]["skin"]]
        binds = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1).astype(float)
        ways = np.array([worlds[joint] @ bind for joint, bind in zip(skin["joints"], binds)])
        attributes, joints, weights = primitive["attributes"], [], []
        while f"JOINTS_{len(joints)}" in attributes:
            weights.append(self.accessor(attributes[f"WEIGHTS_{len(joints)}"]).astype(float))
            joints.append(self.accessor(attributes[f"JOINTS_{len(joints)}"]).astype(int))
        joints, weights = np.hstack(joints), np.hstack(weights)
        blended = np.einsum("vk,vkij->vij", weights / weights.sum(1, keepdims=True), ways[joints])
        spread = np.zeros((len(joints), len(skin["joints"])))
        np.add.at(spread, (np.arange(len(joints))[:, None], joints), weights)
        return blended, spread

    def part(self, node, primitive, worlds):
        """The corners of the triangles in the mesh, and in the body; and the link of each triangle."""
        positions = self.accessor(primitive["attributes"]["POSITION"]).astype(float)
        indices = primitive.get("indices")
        indices = np.arange(len(positions)) if indices is None else self.accessor(indices).ravel()
        triangles = indices.astype(int).reshape(-1, 3)
        if "skin" in self.nodes[node]:
            ways, spread = self.skinned(node, primitive, worlds)
            joints = np.array(self.json["skins"][self.nodes[node]["skin"]]["joints"])
            links = joints[spread[triangles].sum(1).argmax(1)]
        else:
            ways = np.broadcast_to(worlds[node], (len(positions), 4, 4))
            links = np.full(len(triangles), node)
        moved = np.einsum("vij,vj->vi", ways[:, :3, :3], positions) + ways[:, :3, 3]
        if np.linalg.det(ways[0][:3, :3]) < 0:
            triangles = triangles[:, [0, 2, 1]]
        return positions[triangles], moved[triangles], links

    def surface(self, worlds):
        """The triangles, each with its link."""
        parts = [self.part(node, primitive, worlds) for node, primitive in self.parts]
        return np.concatenate([part[1] for part in parts]), np.concatenate([part[2] for part in parts])

    def taxels(self, worlds):
        """Per taxel its place, its normal and its link."""
        places, normals, links, ids = [], [], [], []
        for node, primitive in self.points:
            attributes = primitive["attributes"]
            at = self.accessor(attributes["POSITION"]).astype(float)
            normal = np.hstack([self.accessor(attributes[f"_N{axis}"]) for axis in "XYZ"]).astype(float)
            skin = self.nodes[node].get("skin")
            if skin is None:
                # Taxels are below the node that shows their mesh, which is their link.
                way = worlds[node]
                places.append(at @ way[:3, :3].T + way[:3, 3])
                turned = normal @ np.linalg.inv(way[:3, :3])
                links.append(np.full(len(at), self.parent.get(node, node)))
            else:
                # They are where the skin takes the point of the mesh that they are on.
                own = [self.part(*part, worlds) for part in self.parts if self.nodes[part[0]].get("skin") == skin]
                in_mesh, in_body = [np.concatenate([part[which] for part in own]) for which in (0, 1)]
                placed = [on_surface(point, facing, in_mesh, in_body) for point, facing in zip(at, normal)]
                places.append(np.array([place for place, _ in placed]))
                turned = np.array([turned for _, turned in placed])
                joints = np.array(self.json["skins"][skin]["joints"])
                links.append(joints[self.accessor(attributes["JOINTS_0"])[:, 0].astype(int)])
            normals.append(turned / np.linalg.norm(turned, axis=1, keepdims=True))
            ids.append(self.accessor(attributes["_TAXEL_ID"]).ravel().astype(int))
        order = np.argsort(np.concatenate(ids))
        return [np.concatenate(part)[order] for part in (places, normals, links)]


def on_surface(point, normal, in_mesh, in_body):
    """Where the triangles `in_body` have the point that is on those `in_mesh`, and their normal there."""
    a, b, c = in_mesh.transpose(1, 0, 2)
    spanned = np.cross(b - a, c - a)
    twice = np.maximum(np.linalg.norm(spanned, axis=1), 1e-300)
    unit = spanned / twice[:, None]
    weights = [np.einsum("ti,ti->t", np.cross(q - p, point - p), unit) / twice for p, q in ((b, c), (c, a), (a, b))]
    # How far it is out of the plane, and out of the triangle.
    off = np.abs(np.einsum("ti,ti->t", point - a, unit)) + np.sqrt(twice) * np.maximum(0, -np.min(weights, axis=0))
    off[unit @ normal < 0.9] += 1
    best = off.argmin()
    p, q, r = in_body[best]
    return sum(weight[best] * corner for weight, corner in zip(weights, (p, q, r))), np.cross(q - p, r - p)


class Scene:
    def __init__(self, corners):
        mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
        self.ray = mesh.ray

    def escapes(self, places, normals, ways):
        """How many rays escape from each place."""
        counts = np.zeros(len(places), int)
        starts = places + START_M * normals
        for way in ways:
            counts += ~self.ray.intersects_any(starts, np.broadcast_to(way, starts.shape))
        return counts


def sampled(corners, rng):
    """Points all over the triangles, with the triangle of each."""
    spanned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(spanned, axis=1) / 2
    up_to = np.cumsum(areas)
    of = np.minimum(np.searchsorted(up_to, (np.arange(SAMPLES) + rng.random(SAMPLES)) / SAMPLES * up_to[-1]), len(areas) - 1)
    root, along = np.sqrt(rng.random(SAMPLES))[:, None], rng.random(SAMPLES)[:, None]
    a, b, c = corners[of].transpose(1, 0, 2)
    normals = spanned[of] / np.maximum(np.linalg.norm(spanned[of], axis=1, keepdims=True), 1e-300)
    return a * (1 - root) + b * (root * (1 - along)) + c * (root * along), normals, of


def moved(places, normals, links, rest, pose):
    """Where points are in another pose: each with its link."""
    ways = {link: pose[link] @ np.linalg.inv(rest[link]) for link in set(links.tolist())}
    own = np.array([ways[link] for link in links.tolist()])
    turned = np.einsum("vij,vj->vi", own[:, :3, :3], normals)
    return np.einsum("vij,vj->vi", own[:, :3, :3], places) + own[:, :3, 3], turned


def checked(path, count):
    rng = np.random.default_rng(1)
    ways = directions(rng)
    body = Body(path)
    rest = body.worlds()
    corners, triangle_links = body.surface(rest)
    scene = Scene(corners)
    poses = [body.worlds(rng) for _ in range(POSES)] if body.joints else []
    scenes = {}

    def open_in_poses(places, normals, links, enough, most):
        """Per point whether enough rays escape in one of the first poses."""
        is_open = np.zeros(len(places), bool)
        for index, pose in enumerate(poses[:most]):
            if not is_open.all():
                if index not in scenes:
                    scenes[index] = Scene(body.surface(pose)[0])
                left = ~is_open
                there = moved(places[left], normals[left], links[left], rest, pose)
                is_open[left] = scenes[index].escapes(*there, ways) >= enough
        return is_open

    places, normals, links = body.taxels(rest)
    closed = scene.escapes(places, normals, ways) == 0
    hidden = closed.copy()
    hidden[closed] = ~open_in_poses(places[closed], normals[closed], links[closed], 1, POSES)
    at, facing, triangle = sampled(corners, rng)
    is_open = scene.escapes(at, facing, ways) >= ENOUGH
    own = triangle_links[triangle]
    is_open[~is_open] = open_in_poses(at[~is_open], facing[~is_open], own[~is_open], ENOUGH, POSES_OF_AREA)
    off = []
    for link in sorted(set(own.tolist()) | set(links.tolist())):
        share = count * (is_open & (own == link)).sum() / is_open.sum()
        has = int((links == link).sum())
        # The share itself is that of a sample of points.
        doubt = 2 * count * np.sqrt(max((is_open & (own == link)).sum(), 1)) / is_open.sum()
        limit = (0.3 * share if share >= 2 else 1.0) + doubt
        if abs(has - share) > limit:
            off.append({"link": body.nodes[link].get("name"), "share": round(float(share), 2), "taxels": has})
    return {
        "taxels": len(places),
        "closed": int(closed.sum()),
        "hidden": int(hidden.sum()),
        "hidden_ids": np.flatnonzero(hidden).tolist()[:20],
        "links": len(set(own.tolist())),
        "by_link": off,
        "open_share": round(float(is_open.mean()), 4),
    }


def main():
    somatic, count, *files = [word for word in sys.argv[1:] if word != "--keep"]
    more = ["--hidden", "keep"] if "--keep" in sys.argv else []
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for file in files:
            path = Path(folder) / "body.glb"
            start = time.time()
            command = [somatic, "author", file, "--taxels", count, "--seed", "1", "--force", "-o", path, *more]
            made = subprocess.run(command, capture_output=True, text=True)
            if made.returncode:
                found[file] = {"error": made.stderr.strip().splitlines()[-1:]}
            else:
                taken = time.time() - start
                found[file] = {**checked(path, int(count)), "author_s": round(taken, 1), "all_s": round(time.time() - start, 1)}
            print(file, found[file], file=sys.stderr, flush=True)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
