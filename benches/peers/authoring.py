"""Places taxels and lays a geodesic chart with the tools that people use, on the meshes of `cargo bench --bench authoring`.

Open3D samples Poisson disks by the same weighted elimination; potpourri3d solves the vector heat method's log map. Each
figure is the best of three, with the peak memory of a process of its own. Takes the text that the bench printed.
"""

import json
import os
import re
import resource
import subprocess
import sys
import time

import numpy as np


def octasphere(cuts, bump):
    """The bench's unit sphere of 8·4ⁿ triangles, each point pushed in or out by `bump`."""
    soup = []
    for x, y, z in [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1), (-1, -1, -1)]:
        a, b, c = np.array([x, 0.0, 0.0]), np.array([0.0, y, 0.0]), np.array([0.0, 0.0, z])
        soup.append((a, b, c) if x * y * z > 0 else (a, c, b))
    soup = np.array(soup)
    return welded(cut(soup, cuts), bump)


def icosphere(cuts):
    """A unit sphere of 20·4ⁿ triangles."""
    g = (1 + 5**0.5) / 2
    corners = np.array([[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
                        [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]])
    corners /= np.linalg.norm(corners, axis=1)[:, None]
    faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
             [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7],
             [9, 8, 1]]
    return welded(cut(corners[np.array(faces)], cuts), lambda p: np.zeros(len(p)))


def cut(soup, cuts):
    unit = lambda p: p / np.linalg.norm(p, axis=-1, keepdims=True)
    for _ in range(cuts):
        a, b, c = soup[:, 0], soup[:, 1], soup[:, 2]
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        soup = np.concatenate([np.stack(t, 1) for t in [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]])
    return soup


def welded(soup, bump):
    points = soup.reshape(-1, 3)
    _, first, index = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    points = points[first]
    return points * (1 + bump(points))[:, None], index.reshape(-1, 3)


def bumpy():
    return octasphere(6, lambda p: 0.1 * np.sin(5 * p[:, 0]) * np.sin(6 * p[:, 1]) * np.cos(7 * p[:, 2]))


def best_of_three(work):
    tries = []
    for _ in range(3):
        began = time.perf_counter()
        out = work()
        tries.append(time.perf_counter() - began)
    return min(tries), out


def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def open3d_places(count):
    import open3d

    points, triangles = bumpy()
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(points), open3d.utility.Vector3iVector(triangles.astype(np.int32)))
    seconds, cloud = best_of_three(lambda: mesh.sample_points_poisson_disk(count))
    from scipy.spatial import cKDTree

    placed = np.asarray(cloud.points)
    nearest = cKDTree(placed).query(placed, k=2)[0][:, 1]
    widest = 2 * (mesh.get_surface_area() / (2 * 3**0.5 * count)) ** 0.5
    return {"seconds": seconds, "least": nearest.min() / widest, "mean": nearest.mean() / widest, "mib": peak_mib()}


def heat_log_map():
    import potpourri3d

    points, triangles = icosphere(5)
    pole = points[0]
    right = np.arccos(np.clip(points @ pole, -1, 1))
    near = (right > 0.01) & (right <= 1)

    def work():
        return potpourri3d.MeshVectorHeatSolver(points, triangles).compute_log_map(0)

    seconds, uv = best_of_three(work)
    solver = potpourri3d.MeshVectorHeatSolver(points, triangles)
    again, _ = best_of_three(lambda: solver.compute_log_map(0))
    radial = np.abs(np.linalg.norm(uv[near], axis=1) / right[near] - 1).max()
    return {"seconds": seconds, "again": again, "radial": radial, "mib": peak_mib()}


def main():
    if len(sys.argv) > 2 and sys.argv[1] == "one":
        what, *rest = sys.argv[2:]
        print(json.dumps(heat_log_map() if what == "heat" else open3d_places(int(rest[0]))))
        return
    own = open(sys.argv[1]).read()

    def alone(*what):
        out = subprocess.run([sys.executable, __file__, "one", *what], check=True, capture_output=True, text=True)
        return json.loads(out.stdout.strip().splitlines()[-1])

    print(f"{os.cpu_count()} processors; best of three; spacings in 2·r_max\n")
    print("| task | somatic | peer | times as fast | somatic's quality | peer's quality | peer's peak memory |")
    print("|---|---|---|---|---|---|---|")
    for count in (10_000, 100_000):
        seconds, least, mean = map(float, re.search(
            rf"evenly, in widest spacings: {count} taxels, ([\d.]+) s, least ([\d.]+), mean ([\d.]+)", own).groups())
        peer = alone("places", str(count))
        print(f"| {count:,} taxels, 32,768 triangles | {seconds:.3f} s | Open3D {peer['seconds']:.2f} s | "
              f"{peer['seconds'] / seconds:.1f} | least {least:.2f}, mean {mean:.2f} | least {peer['least']:.2f}, mean "
              f"{peer['mean']:.2f} | {peer['mib']:.0f} MiB |")
    seconds, radial = map(float, re.search(
        r"log map of 20480 triangles: ([\d.]+) s, radial error ([\d.e-]+)", own).groups())
    peer = alone("heat")
    print(f"| log map, 20,480 triangles, to 1 rad | {seconds * 1e3:.1f} ms | vector heat {peer['seconds']:.2f} s "
          f"({peer['again']:.3f} s once factored) | {peer['seconds'] / seconds:.0f} ({peer['again'] / seconds:.1f}) | "
          f"{radial:.2%} radial | {peer['radial']:.2%} radial | {peer['mib']:.0f} MiB |")
    kib = int(re.search(r"Maximum resident set size.*: (\d+)", own).group(1))
    print(f"\nsomatic's peak memory, all of its bench: {kib / 1024:.0f} MiB")


if __name__ == "__main__":
    main()
