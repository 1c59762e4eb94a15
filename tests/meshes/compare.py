"""Where trimesh (with pycollada) has the triangles of robots' meshes, against triangles from elsewhere.

    compare.py list                    the meshes of example-robot-data, a path a line
    compare.py compare LIST FOLDER     LIST has paths, FOLDER the triangles of the n-th in the file `n`, as doubles

`compare` prints a JSON object: "files", their number, "apart", the largest distance of a corner of one from the nearest corner of
the other, m, and "areas", the largest difference of the areas as a share. Every corner counts, those of flat triangles too, where
these are in both; the axes are those of the file and the unit is the metre.
"""

import importlib.metadata
import io
import json
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np


def listed():
    files = [Path(file.locate()).resolve() for file in importlib.metadata.files("example-robot-data")]
    for file in sorted(set(files)):
        # What `git lfs` has left is no mesh.
        if file.suffix.lower() in (".dae", ".stl", ".obj") and file.stat().st_size > 200:
            print(file)


def theirs(path):
    """The corners of the triangles, n × 3 × 3."""
    import trimesh

    kind = path.suffix.lower()
    with open(path, "rb") as file:
        if kind == ".stl":
            loaded = trimesh.exchange.stl.load_stl(file)
            return np.asarray(loaded["vertices"], float)[loaded["faces"]]
        if kind == ".obj":
            scene = trimesh.load_scene(file, file_type="obj", process=False, skip_materials=True)
            found = [np.asarray(mesh.vertices, float)[mesh.faces] for mesh in scene.geometry.values()]
            return np.concatenate(found)
        import collada
        from trimesh.exchange.dae import load_collada

        # pycollada leaves out what has a material whose texture is missing: materials are no shape.
        text = re.sub(rb"<bind_material>.*?</bind_material>", b"", file.read(), flags=re.DOTALL)
        loaded = load_collada(io.BytesIO(text))
        metres = collada.Collada(io.BytesIO(text), ignore=[collada.common.DaeError]).assetInfo.unitmeter or 1.0
    found = [np.zeros((0, 3, 3))]
    for node in loaded["graph"]:
        mesh = loaded["geometry"][node["geometry"]]
        corners = np.asarray(mesh["vertices"], float)[mesh["faces"]]
        found.append((corners @ np.asarray(node["matrix"])[:3, :3].T + np.asarray(node["matrix"])[:3, 3]) * metres)
    return np.concatenate(found)


def area(corners):
    a, b, c = corners.transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def one(pair):
    from scipy.spatial import cKDTree

    path, numbers = pair
    ours, other = np.fromfile(numbers).reshape(-1, 3, 3), theirs(Path(path))
    if len(ours) == 0 or len(other) == 0:
        return {"path": path, "apart": 0.0 if len(ours) == len(other) else float("inf"), "areas": 0.0}
    # A flat triangle has corners at one place, which ours leaves out.
    flat = (other[:, [0, 1, 2]] == other[:, [1, 2, 0]]).all(axis=2).any(axis=1)
    # Ours are in single precision.
    ours, kept = ours.reshape(-1, 3), other[~flat].reshape(-1, 3).astype(np.float32).astype(float)
    apart = max(cKDTree(kept).query(ours)[0].max(), cKDTree(ours).query(kept)[0].max())
    areas = abs(area(ours.reshape(-1, 3, 3)) / max(area(other), 1e-30) - 1)
    return {"path": path, "apart": float(apart), "areas": float(areas)}


def compare(names, folder):
    paths = Path(names).read_text().splitlines()
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(one, [(path, f"{folder}/{index}") for index, path in enumerate(paths)]))
    worst = sorted(found, key=lambda one: -one["apart"])[:12]
    summary = {key: max(one[key] for one in found) for key in ("apart", "areas")}
    json.dump({"files": len(found), **summary, "worst": worst}, sys.stdout)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["list"]:
            listed()
        case ["compare", names, folder]:
            compare(names, folder)
        case _:
            raise SystemExit(__doc__)
