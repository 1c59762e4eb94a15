"""Compares the cells and edges of taxels with Voronoi cells that are computed here in another way.

    compare.py make SHAPE FILE.obj                  writes a mesh; SHAPE is plane, sphere or cylinder
    compare.py shape SHAPE LISTED.json              compares taxels on that mesh with the exact cells of the shape
    compare.py body BODY.glb LISTED.json [FINE]     compares taxels on any body with cells on a fine mesh

LISTED.json is what `somatic inspect BODY.glb --json` prints. The two comparisons print a JSON object:

    taxels              number of taxels
    areas_median        median of the difference in area, as a share of the area computed here
    areas_worst         the largest difference
    areas_off           number of taxels whose area differs by more than 3 %
    edges, edges_here   number of edges listed, and of edges computed here
    edges_equal         number of edges that are in both lists, as a share of those in at least one
    degree              mean number of edges per taxel
    degree_open         the same for taxels whose cells do not reach the end of the surface
    without, few        number of taxels without an edge, and with fewer than three (those without included)

`body` also prints:

    off_surface_m       the largest distance of a taxel from the surface
    unclear             share of the surface where the fine mesh is too coarse to say whose cell it is
    worst               the taxels with the largest differences in area: id, listed, computed here
    only_listed, only_here      up to ten edges that only one of the two has

How `body` works. The surface is cut into triangles with edges of at most the mean spacing of taxels / FINE (default 8), and
the taxels become vertices. pygeodesic gives exact distances along the surface from taxels to all vertices. Taxels of one colour
are far apart from each other, so that one run per colour gives the distance from each taxel to all vertices around its cell. In
each triangle the squared distances are interpolated between the corners. On a flat triangle that is exact if one straight path
leads to each point. Errors shrink with the size of the triangles: run it with FINE 8, 16 and 32 to see how far they are.

It follows docs/reference/layout.md ("Edges between taxels"). Only the reader of GLB files is shared with another test. All skinned meshes
count as one surface, and no two taxels may be at the same point.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import SphericalVoronoi, Voronoi, cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

# An edge is at most this many times the square root of the larger cell.
LENGTH_PER_ROOT = 2.0
# A border that is shorter than this share of the root of the smaller cell is a point where cells meet.
SHORTEST_BORDER = 1e-3
# Vertices of a mesh that are this close count as one, as a share of the largest coordinate.
WELD = 2.0**-22
# A taxel is moved by up to this share of its fine triangle, away from the triangle's sides.
MARGIN = 0.005

PLANE_SIZE = (0.3, 0.2)
SPHERE_RADIUS = 0.1
CYLINDER_RADIUS, CYLINDER_HEIGHT, CYLINDER_SIDES = 0.05, 0.3, 96


# Report.


def pair(a, b):
    return (int(min(a, b)), int(max(a, b)))


def listed_edges(listed, index):
    return {pair(index[a], index[b]) for a, b in listed["edges"] if a in index and b in index}


def report(listed_areas, areas, edges, edges_here, is_open):
    """The figures that both comparisons print."""
    count = len(areas)
    off = np.abs(listed_areas / areas - 1)
    degree = np.bincount(np.array(sorted(edges), int).ravel(), minlength=count)
    return {
        "taxels": count,
        "areas_median": float(np.median(off)),
        "areas_worst": float(off.max()),
        "areas_off": int((off > 0.03).sum()),
        "edges": len(edges),
        "edges_here": len(edges_here),
        "edges_equal": len(edges & edges_here) / max(len(edges | edges_here), 1),
        "degree": float(degree.mean()),
        "degree_open": float(degree[is_open].mean()) if is_open.any() else None,
        "without": int((degree == 0).sum()),
        "few": int((degree < 3).sum()),
    }


# Shapes with exact cells.


def grid_faces(columns, rows):
    """Triangles of a grid with (columns + 1) × (rows + 1) vertices."""
    c, r = np.meshgrid(np.arange(columns), np.arange(rows))
    a = (r * (columns + 1) + c).ravel()
    b, d, e = a + 1, a + columns + 2, a + columns + 1
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, e], 1)])


def plane_mesh():
    columns, rows = 21, 13
    x, y = np.meshgrid(np.linspace(0, PLANE_SIZE[0], columns + 1), np.linspace(0, PLANE_SIZE[1], rows + 1))
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1), grid_faces(columns, rows)


def cylinder_corners():
    angles = np.arange(CYLINDER_SIDES + 1) * (2 * np.pi / CYLINDER_SIDES)
    # Counter-clockwise seen from +y, the axis.
    return CYLINDER_RADIUS * np.stack([np.sin(angles), np.cos(angles)], 1)


def cylinder_mesh():
    rows = 31
    around, heights = cylinder_corners(), np.linspace(0, CYLINDER_HEIGHT, rows + 1)
    vertices = [(x, height, z) for height in heights for x, z in around]
    return np.array(vertices), grid_faces(CYLINDER_SIDES, rows)


def sphere_mesh():
    """An octahedron, each triangle cut into four five times, with all vertices on the sphere."""
    axes = np.eye(3)
    triangles = []
    for x in (1, -1):
        for y in (1, -1):
            for z in (1, -1):
                corners = [axes[0] * x, axes[1] * y, axes[2] * z]
                triangles.append(corners if x * y * z > 0 else corners[::-1])
    triangles = np.array(triangles)
    for _ in range(5):
        a, b, c = triangles.transpose(1, 0, 2)
        ab, bc, ca = (unit(p + q) for p, q in ((a, b), (b, c), (c, a)))
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, 1) for part in parts])
    vertices, faces = np.unique(np.round(triangles.reshape(-1, 3), 12), axis=0, return_inverse=True)
    return SPHERE_RADIUS * unit(vertices), faces.reshape(-1, 3)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def make(shape, path):
    vertices, faces = {"plane": plane_mesh, "sphere": sphere_mesh, "cylinder": cylinder_mesh}[shape]()
    lines = ["v {:.12g} {:.12g} {:.12g}".format(*vertex) for vertex in vertices]
    lines += ["f {} {} {}".format(*(face + 1)) for face in faces]
    Path(path).write_text("\n".join(lines) + "\n")


def flat_cells(points, size, wraps):
    """Areas, edges, and which cells do not reach the ends, in a rectangle from (0, 0) to size. With `wraps` its left and right
    sides are joined.

    Mirror images beyond the sides make the sides borders of cells; copies beyond joined sides continue the pattern.
    """
    width, height = size
    count = len(points)
    x, y = points.T
    ways = [(x - width, y), (x + width, y)] if wraps else [(-x, y), (2 * width - x, y)]
    ways += [(x, -y), (x, 2 * height - y)]
    if wraps:
        ways += [(x + step, new_y) for step in (-width, width) for new_y in (-y, 2 * height - y)]
    images = np.concatenate([points] + [np.stack(way, 1) for way in ways])
    # Each image is a copy of a point, or a mirror image.
    is_copy = np.zeros(len(images), bool)
    is_copy[: 3 * count if wraps else count] = True
    diagram = Voronoi(images)
    areas = np.zeros(count)
    for index in range(count):
        corners = diagram.vertices[diagram.regions[diagram.point_region[index]]] - points[index]
        corners = corners[np.argsort(np.arctan2(corners[:, 1], corners[:, 0]))]
        after = np.roll(corners, -1, axis=0)
        areas[index] = np.sum(corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]) / 2
    edges, is_open = set(), np.ones(count, bool)
    for (a, b), ridge in zip(diagram.ridge_points, diagram.ridge_vertices):
        if min(a, b) >= count:
            continue
        if not (is_copy[a] and is_copy[b]):
            is_open[min(a, b)] = False
            continue
        border = np.linalg.norm(diagram.vertices[ridge[0]] - diagram.vertices[ridge[1]])
        own = areas[[a % count, b % count]]
        way = np.linalg.norm(images[a] - images[b])
        if is_edge(border, way, own) and a % count != b % count:
            edges.add(pair(a % count, b % count))
    return areas, edges, is_open


def is_edge(border, way, cells):
    """Whether two cells with a border of that length, a way that long from taxel to taxel, are neighbours."""
    return border > SHORTEST_BORDER * np.sqrt(min(cells)) and way <= LENGTH_PER_ROOT * np.sqrt(max(cells))


def unrolled_cylinder(points):
    """Places on the cylinder's flat sides, side by side."""
    corners = cylinder_corners()
    side = (np.arctan2(points[:, 0], points[:, 2]) % (2 * np.pi) / (2 * np.pi) * CYLINDER_SIDES).astype(int)
    side = np.minimum(side, CYLINDER_SIDES - 1)
    start, way = corners[side], corners[side + 1] - corners[side]
    width = np.linalg.norm(way[0])
    along = np.sum((points[:, [0, 2]] - start) * way, axis=1) / width
    return np.stack([side * width + along, points[:, 1]], 1), (CYLINDER_SIDES * width, CYLINDER_HEIGHT)


def sphere_cells(points):
    diagram = SphericalVoronoi(SPHERE_RADIUS * unit(points), SPHERE_RADIUS)
    areas = diagram.calculate_areas()
    shared = defaultdict(list)
    for site, region in enumerate(diagram.regions):
        for corner in region:
            shared[corner].append(site)
    borders = defaultdict(list)
    for corner, sites in shared.items():
        for a in sites:
            for b in sites:
                if a < b:
                    borders[a, b].append(diagram.vertices[corner])
    edges = set()
    for (a, b), ends in borders.items():
        if len(ends) == 2:
            way = SPHERE_RADIUS * np.arccos(np.clip(unit(points[a]) @ unit(points[b]), -1, 1))
            if is_edge(np.linalg.norm(ends[0] - ends[1]), way, areas[[a, b]]):
                edges.add((a, b))
    return areas, edges, np.ones(len(points), bool)


def compare_shape(shape, listed_path):
    listed = json.loads(Path(listed_path).read_text())
    points = np.array([taxel["position"] for taxel in listed["taxels"]])
    index = {taxel["id"]: position for position, taxel in enumerate(listed["taxels"])}
    if shape == "plane":
        areas, edges, is_open = flat_cells(points[:, :2], PLANE_SIZE, wraps=False)
    elif shape == "cylinder":
        flat, size = unrolled_cylinder(points)
        areas, edges, is_open = flat_cells(flat, size, wraps=True)
    else:
        areas, edges, is_open = sphere_cells(points)
    listed_areas = np.array([taxel["area"] for taxel in listed["taxels"]])
    return report(listed_areas, areas, listed_edges(listed, index), edges, is_open)


# The fine mesh of a body.


class Mesh:
    """Triangles that are connected across edges which exactly two of them share, running in opposite ways."""

    def __init__(self, corners, groups):
        """`corners` n × 3 × 3; triangles of different `groups` are never connected."""
        places = weld(corners.reshape(-1, 3), np.repeat(groups, 3)).reshape(-1, 3)
        a, b, c = places.T
        _, first = np.unique(np.sort(places, axis=1), axis=0, return_index=True)
        keep = np.zeros(len(places), bool)
        keep[first] = True
        keep &= (a != b) & (b != c) & (c != a)
        self.groups, places, corners = groups[keep], places[keep], corners[keep]
        # One vertex per fan of connected triangles around a place.
        vertex = joined_corners(places)
        self.faces = vertex.reshape(-1, 3)
        self.vertices = np.zeros((vertex.max() + 1, 3))
        self.vertices[vertex] = corners.reshape(-1, 3)

    def corners(self):
        return self.vertices[self.faces]

    def cut(self, longest):
        """Cuts edges in two until none is longer. In each pass, those that are the longest in all of their triangles."""
        while True:
            edges, of_face = edges_of(self.faces)
            lengths = np.linalg.norm(self.vertices[edges[:, 0]] - self.vertices[edges[:, 1]], axis=1)
            rank = np.empty(len(edges), int)
            rank[np.argsort(lengths, kind="stable")] = np.arange(len(edges))
            side = rank[of_face].argmax(axis=1)
            own = of_face[np.arange(len(of_face)), side]
            sharing = np.bincount(of_face.ravel(), minlength=len(edges))
            is_cut = (np.bincount(own, minlength=len(edges)) == sharing) & (lengths > longest)
            if not is_cut.any():
                return
            middle = np.full(len(edges), -1)
            middle[is_cut] = len(self.vertices) + np.arange(is_cut.sum())
            self.vertices = np.concatenate([self.vertices, self.vertices[edges[is_cut]].mean(axis=1)])
            chosen = is_cut[own]
            turned = np.take_along_axis(self.faces, (side[:, None] + [0, 1, 2]) % 3, axis=1)[chosen]
            a, b, c = turned.T
            m = middle[own[chosen]]
            parts = [self.faces[~chosen], np.stack([a, m, c], 1), np.stack([m, b, c], 1)]
            self.faces = np.concatenate(parts)
            self.groups = np.concatenate([self.groups[~chosen], self.groups[chosen], self.groups[chosen]])

    def insert(self, points, triangles):
        """Makes each of `points` a vertex in its triangle, and returns these vertices."""
        if len(set(triangles)) < len(triangles):
            raise SystemExit("two taxels are in one fine triangle; give a larger FINE")
        weights = np.maximum(barycentric(self.corners()[triangles], points), MARGIN)
        weights /= weights.sum(axis=1, keepdims=True)
        added = len(self.vertices) + np.arange(len(points))
        self.vertices = np.concatenate([self.vertices, np.einsum("nk,nki->ni", weights, self.corners()[triangles])])
        a, b, c = self.faces[triangles].T
        self.faces[triangles] = np.stack([a, b, added], 1)
        parts = [self.faces, np.stack([b, c, added], 1), np.stack([c, a, added], 1)]
        self.faces = np.concatenate(parts)
        self.groups = np.concatenate([self.groups, self.groups[triangles], self.groups[triangles]])
        return added

    def end_faces(self):
        """Which triangles have an edge at the end of the surface."""
        _, of_face = edges_of(self.faces)
        return (np.bincount(of_face.ravel())[of_face] == 1).any(axis=1)

    def parts(self):
        """Per vertex the number of its connected part."""
        edges, _ = edges_of(self.faces)
        return components(edges, len(self.vertices))


def components(pairs, count):
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    return connected_components(graph, directed=False)[1]


def weld(points, groups):
    """Per point the number of its place; points of one group that are close are at one place."""
    within = WELD * np.abs(points).max()
    # The group as a fourth coordinate keeps groups apart.
    spread = np.concatenate([points, groups[:, None] * 10.0 * (1 + np.abs(points).max())], axis=1)
    unique, which = np.unique(spread, axis=0, return_inverse=True)
    close = cKDTree(unique).query_pairs(within, output_type="ndarray")
    return components(close, len(unique))[which.reshape(-1)]


def joined_corners(places):
    """Per corner of the triangles the number of its vertex."""
    count = len(places)
    start, end = places.ravel(), np.roll(places, -1, axis=1).ravel()
    corner = np.arange(3 * count)
    next_corner = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()
    key = np.sort(np.stack([start, end], 1), axis=1)
    order = np.lexsort((key[:, 1], key[:, 0]))
    _, first, sharing = np.unique(key[order], axis=0, return_index=True, return_counts=True)
    one, other = order[first[sharing == 2]], order[first[sharing == 2] + 1]
    opposite = start[one] != start[other]
    one, other = one[opposite], other[opposite]
    same = [np.stack([corner[one], next_corner[other]], 1), np.stack([next_corner[one], corner[other]], 1)]
    return components(np.concatenate(same), 3 * count)


def edges_of(faces):
    """All edges, and per triangle the numbers of its three."""
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, of_side = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return edges, of_side.reshape(-1, 3)


def barycentric(corners, points):
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    return np.stack([np.sum(part * normal, axis=1) for part in parts], 1) / np.sum(normal * normal, axis=1)[:, None]


def face_areas(corners):
    return np.linalg.norm(face_normals(corners), axis=1) / 2


def face_normals(corners):
    """Normals, twice as long as the triangles' areas."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


# The body and its taxels.


class Skin:
    """The pressure taxels of a body, in the body's frame, and its surface."""

    def __init__(self, body_path, listed):
        from presses.compare import Body

        body = Body(body_path)
        taxels = [taxel for taxel in listed["taxels"] if taxel["modality"] == "pressure"]
        self.ids = [taxel["id"] for taxel in taxels]
        self.links = [taxel["link"] for taxel in taxels]
        self.areas = np.array([taxel["area"] for taxel in taxels])
        worlds = np.array([body.world[body.by_name[link]] for link in self.links])
        in_link = np.array([taxel["position"] for taxel in taxels])
        self.points = np.einsum("nij,nj->ni", worlds[:, :3, :3], in_link) + worlds[:, :3, 3]
        self.normals = np.einsum("nij,nj->ni", worlds[:, :3, :3], np.array([taxel["normal"] for taxel in taxels]))
        groups, self.links_of_group = link_groups(body, set(listed["links"]))
        self.mesh = Mesh(body.corners, groups)
        self.spacing = np.sqrt(self.areas.mean())

    def place(self, longest):
        """Makes the taxels vertices of the mesh, whose edges are at most `longest`. Returns these, and the largest distance of
        a taxel from the surface."""
        from presses.compare import nearest_on

        corners, normals = self.mesh.corners(), unit(face_normals(self.mesh.corners()))
        middles = cKDTree(corners.mean(axis=1))
        triangles, off_surface = [], 0.0
        for point, normal, link in zip(self.points, self.normals, self.links):
            near = np.array(middles.query_ball_point(point, longest + 1e-3))
            own = [link in self.links_of_group[group] for group in self.mesh.groups[near]]
            near = near[own]
            away = np.linalg.norm(nearest_on(corners[near], point) - point, axis=1)
            # Of triangles that are as near, the one that faces as the taxel does.
            closest = near[away <= away.min() + 1e-7]
            triangles.append(closest[(normals[closest] @ normal).argmax()])
            off_surface = max(off_surface, away.min())
        return self.mesh.insert(self.points, np.array(triangles)), off_surface


def link_groups(body, links):
    """Per triangle of the body the number of its group, and per group the links that move it."""
    nodes = body.file["nodes"]
    parents = {child: node for node, entry in enumerate(nodes) for child in entry.get("children", [])}

    def link_of(node):
        while nodes[node].get("name") not in links:
            node = parents[node]
        return nodes[node]["name"]

    names = {node: link_of(node) for node in np.unique(body.links)}
    skinned = {names[node] for node in np.unique(body.links[body.skinned])}
    # A joint may be the heaviest of no triangle's first corner.
    for skin in body.file.get("skins", []):
        skinned |= {nodes[joint]["name"] for joint in skin["joints"]}
    moved = [skinned] + [{name} for name in sorted(set(names.values()))]
    number = {next(iter(group)): index for index, group in enumerate(moved) if index > 0}
    groups = [0 if skin else number[names[node]] for node, skin in zip(body.links, body.skinned)]
    return np.array(groups), moved


# Distances.


def colours(labels, faces, sites):
    """A colour per site: two with cells that meet, or with a common neighbour, have different colours."""
    edges, _ = edges_of(faces)
    a, b = labels[edges].T
    differ = (a != b) & (a >= 0) & (b >= 0)
    meets = coo_matrix((np.ones(differ.sum()), (a[differ], b[differ])), (sites, sites)).tocsr()
    meets = meets + meets.T
    near = (meets + meets @ meets).tocsr()
    found = np.full(sites, -1)
    for site in range(sites):
        used = set(found[near.indices[near.indptr[site] : near.indptr[site + 1]]]) - {-1}
        found[site] = next(colour for colour in range(sites) if colour not in used)
    return found


class Distances:
    """Distances from sites to the vertices of all triangles that their cells reach, along the surface."""

    def __init__(self, mesh, sites, longest):
        from pygeodesic.geodesic import PyGeodesicAlgorithmExact

        self.algorithm = PyGeodesicAlgorithmExact(mesh.vertices, mesh.faces)
        self.sites = sites
        self.parts = mesh.parts()
        count = len(mesh.vertices)
        # pygeodesic must not be asked for what cannot be reached.
        reachable = np.flatnonzero(np.isin(self.parts, self.parts[sites]))
        nearest, labels = self.run(np.arange(len(sites)), reachable, count)
        colour = colours(labels, mesh.faces, len(sites))
        # Per vertex and colour: the distance to the nearest site of that colour, and that site.
        runs = []
        for one in range(colour.max() + 1):
            is_member = np.append(colour == one, False)
            members = np.flatnonzero(colour == one)
            around = np.unique(mesh.faces[is_member[labels[mesh.faces]].any(axis=1)])
            runs.append(self.run(members, around, count))
        self.lengths = np.stack([lengths for lengths, _ in runs], 1)
        self.labels = np.stack([found for _, found in runs], 1)
        gap = np.abs(self.lengths.min(axis=1)[reachable] - nearest[reachable]).max()
        if gap > 1e-3 * longest:
            raise SystemExit(f"distances from one taxel and from all differ by {gap} m")

    def run(self, members, targets, count):
        """Per vertex of `targets` the distance to the nearest of the sites `members`, and that site; others: infinite, -1."""
        lengths, labels = np.full(count, np.inf), np.full(count, -1)
        found, best = self.algorithm.geodesicDistances(self.sites[members], targets)
        lengths[targets], labels[targets] = found, members[best]
        return lengths, labels

    def between(self, a, b):
        """The length of the shortest way between two sites on one part."""
        return self.algorithm.geodesicDistances(self.sites[[a]], self.sites[[b]])[0][0]


# Cells.


class Cells:
    """Areas of cells, and their borders: by pair of sites, the length and the shortest way over it."""

    def __init__(self, mesh, distances):
        count = len(distances.sites)
        corners = mesh.corners()
        face_area = face_areas(corners)
        self.areas = np.zeros(count)
        self.borders = defaultdict(lambda: [0.0, np.inf])
        self.is_open = np.ones(count, bool)
        self.unclear = 0.0
        lengths, labels = distances.lengths[mesh.faces], distances.labels[mesh.faces]
        own = np.take_along_axis(labels, lengths.argmin(axis=2)[:, :, None], axis=2)[:, :, 0]
        self.is_reached = (own >= 0).all(axis=1)
        is_whole = self.is_reached & (own == own[:, :1]).all(axis=1)
        np.add.at(self.areas, own[is_whole, 0], face_area[is_whole])
        for face in np.flatnonzero(self.is_reached & ~is_whole):
            self.divide(corners[face], face_area[face], own[face], lengths[face], labels[face])
        ends = mesh.end_faces()
        self.is_open[own[ends][own[ends] >= 0]] = False

    def divide(self, corners, area, own, lengths, labels):
        """Divides one triangle. `lengths` and `labels` are per corner and colour."""
        # The sites whose distances to all three corners are known.
        known = {int(site[0]): length for site, length in zip(labels.T, lengths.T) if site[0] >= 0 and (site == site[0]).all()}
        for corner, site in enumerate(own):
            if int(site) not in known:
                self.areas[site] += area / 3
                self.unclear += area / 3
        share_left = sum(int(site) in known for site in own) / 3
        if not known:
            return
        polygons = {site: part_of(site, known) for site in known}
        shares = {site: share(polygon) for site, polygon in polygons.items()}
        whole = sum(shares.values())
        for site, polygon in polygons.items():
            self.areas[site] += area * share_left * shares[site] / whole
            for index, (start, beyond) in enumerate(polygon):
                if beyond is not None and site < beyond:
                    end = polygon[(index + 1) % len(polygon)][0]
                    border = self.borders[site, beyond]
                    border[0] += np.linalg.norm((end - start) @ corners)
                    middle = (start + end) / 2
                    border[1] = min(border[1], *(2 * place @ known[site] for place in (start, middle, end)))

    def give_away(self, mesh, points, normals):
        """Adds surface that no way leads to: each triangle to the nearest taxel on its side."""
        corners = mesh.corners()[~self.is_reached]
        if len(corners) == 0:
            return
        facing, areas = unit(face_normals(corners)), face_areas(corners)
        _, near = cKDTree(points).query(corners.mean(axis=1), k=min(64, len(points)))
        is_facing = np.einsum("nki,ni->nk", normals[near], facing) > -1e-9
        owner = near[np.arange(len(near)), is_facing.argmax(axis=1)]
        np.add.at(self.areas, owner, areas)


def part_of(own, lengths):
    """The part of a triangle that is nearest to site `own`: per corner of this polygon its barycentric coordinates, and the site
    beyond the side that starts there."""
    polygon = [(corner, None) for corner in np.eye(3)]
    for other in lengths:
        if other == own:
            continue
        farther = lengths[own] ** 2 - lengths[other] ** 2
        excess = [farther @ place for place, _ in polygon]
        if max(excess) <= 0:
            continue
        cut = []
        for index, (place, beyond) in enumerate(polygon):
            after = (index + 1) % len(polygon)
            here, there = excess[index], excess[after]
            if here <= 0:
                cut.append((place, beyond))
            if (here <= 0) != (there <= 0):
                crossing = place + (polygon[after][0] - place) * (here / (here - there))
                cut.append((crossing, other if here <= 0 else beyond))
        polygon = cut
        if len(polygon) < 3:
            return []
    return polygon


def share(polygon):
    """The polygon's area as a share of the triangle."""
    total = 0.0
    for index, (a, _) in enumerate(polygon):
        b = polygon[(index + 1) % len(polygon)][0]
        total += a[1] * b[2] - a[2] * b[1]
    return total


# Edges.


def surface_edges(cells, distances, points):
    """Pairs of taxels with cells that share a border, not too far from each other along the surface."""
    edges = set()
    for (a, b), (length, way) in cells.borders.items():
        own = cells.areas[[a, b]]
        limit = LENGTH_PER_ROOT * np.sqrt(own.max())
        # The way over the border is an upper bound, the straight line a lower one.
        if way > limit and np.linalg.norm(points[a] - points[b]) <= limit:
            way = distances.between(a, b)
        if is_edge(length, way, own):
            edges.add((a, b))
    return edges


def stitches(skin, cells, parts):
    """Pairs of taxels of one link on parts of the surface that no mesh connects."""
    edges = set()
    for link in sorted(set(skin.links)):
        own = np.array([index for index, name in enumerate(skin.links) if name == link])
        tree = cKDTree(skin.points[own])
        for a, b in own[tree.query_pairs(LENGTH_PER_ROOT * np.sqrt(cells.areas[own].max()), output_type="ndarray")]:
            way = np.linalg.norm(skin.points[a] - skin.points[b])
            if (
                parts[a] != parts[b]
                and way <= LENGTH_PER_ROOT * np.sqrt(cells.areas[[a, b]].max())
                and skin.normals[a] @ skin.normals[b] > 0
                and len(tree.query_ball_point((skin.points[a] + skin.points[b]) / 2, way / 2 * (1 - 5e-6))) == 0
            ):
                edges.add(pair(a, b))
    return edges


def compare_body(body_path, listed_path, fine):
    listed = json.loads(Path(listed_path).read_text())
    skin = Skin(body_path, listed)
    longest = skin.spacing / fine
    skin.mesh.cut(longest)
    sites, off_surface = skin.place(longest)
    distances = Distances(skin.mesh, sites, longest)
    cells = Cells(skin.mesh, distances)
    index = {taxel: position for position, taxel in enumerate(skin.ids)}
    edges = listed_edges(listed, index)
    here = surface_edges(cells, distances, skin.points) | stitches(skin, cells, distances.parts[sites])
    cells.give_away(skin.mesh, skin.points, skin.normals)
    found = report(skin.areas, cells.areas, edges, here, cells.is_open)
    off = np.abs(skin.areas / cells.areas - 1)
    named = lambda pairs: [[skin.ids[a], skin.ids[b]] for a, b in sorted(pairs)[:10]]
    return found | {
        "off_surface_m": float(off_surface),
        "unclear": cells.unclear / cells.areas.sum(),
        "vertices": len(skin.mesh.vertices),
        "worst": [[skin.ids[i], float(skin.areas[i]), float(cells.areas[i])] for i in np.argsort(-off)[:5]],
        "only_listed": named(edges - here),
        "only_here": named(here - edges),
    }


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["make", shape, path]:
            make(shape, path)
        case ["shape", shape, listed]:
            json.dump(compare_shape(shape, listed), sys.stdout)
        case ["body", body, listed, *fine]:
            json.dump(compare_body(body, listed, float(fine[0]) if fine else 8.0), sys.stdout)
        case _:
            raise SystemExit(__doc__)
