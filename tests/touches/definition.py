"""Touches of the whole body, as docs/explanation/touches.md and the design define them, written plainly: nothing is shared with the crate.

What hangs on a choice that is closer than rounding comes with a doubt: the choice's name.
"""

from dataclasses import dataclass, field

import numpy as np

CANDIDATE, SPLIT, JOIN = 0.85, 0.75, 0.80
# Choices whose two sides are this near to each other are too close to call.
CLOSE = 1e-9
WRAPPED = np.radians(120)
ISOTROPIC = 1e-3
COINCIDENT = 2.0**-14


@dataclass
class Region:
    members: list
    peak: int
    doubts: set = field(default_factory=set)


@dataclass
class Frame:
    """Pressures P by node, 0 where there is no value; `sigma`, the noise of P by node; `weight`, what a P counts times, by node."""

    pressures: np.ndarray
    has_value: np.ndarray
    beside: list


def unrolled(offset, normal, other):
    """Places of points at `offset` with the normals `other` in the chart whose normal is `normal`."""
    flat = offset - np.outer(offset @ normal, normal)
    cos = other @ normal
    tilt = other - np.outer(cos, normal)
    sin = np.linalg.norm(tilt, axis=1)
    angle = np.arctan2(sin, cos)
    tilted = sin > 1e-12
    e = np.where(tilted[:, None], tilt / np.where(tilted, sin, 1)[:, None], 0)
    middle = e * np.cos(angle / 2)[:, None] - normal * np.sin(angle / 2)[:, None]
    dot = lambda a, b: np.einsum("ni,ni->n", a, b)
    bent = flat + e * (dot(offset, middle) / np.sinc(angle / 2 / np.pi) - dot(flat, e))[:, None]
    return np.where(tilted[:, None], bent, flat), angle


def nearest(skin, nodes, place):
    """The nodes that are nearest to `place`, all that are as good as equally near, by ascending number."""
    away = np.linalg.norm(skin.at[nodes] - place, axis=1)
    close = away <= away.min() + CLOSE * skin.spacing
    return sorted(int(node) for node in np.asarray(nodes)[close])


# Regions.


def dip(skin, frame, a, b):
    """The mean pressure between the peaks of two regions, its minimum and its lower end, per choice of the chart's base and of the
    number of samples: on grids both are often too close to call."""
    own = set(a.members) | set(b.members)
    around = sorted(own.union(*(frame.beside[node] for node in own)))
    nodes = np.array(around)
    # Of an even number the upper median.
    d = np.sqrt(np.sort(skin.cell[nodes])[len(nodes) // 2])
    for base in nearest(skin, nodes, (skin.at[a.peak] + skin.at[b.peak]) / 2):
        places, _ = unrolled(skin.at[nodes] - skin.at[base], skin.mean_normal[base], skin.mean_normal[nodes])
        start, end = places[around.index(a.peak)], places[around.index(b.peak)]
        length = np.linalg.norm(end - start)
        way = (end - start) / length
        along = (places - start) @ way
        across = np.linalg.norm(places - start - np.outer(along, way), axis=1)
        beside = across <= 1.2 * d
        quarters = length / (0.25 * d)
        for count in {max(5, int(quarters * share) + 1) for share in (1 - CLOSE, 1 + CLOSE)}:
            steps = np.linspace(0, length, count)
            away = np.abs(along[beside][None] - steps[:, None])
            weights = np.where(away <= 3 * d, np.exp(-0.5 * (away / (0.4 * d)) ** 2), 0)
            # Places without a taxel as near as that say nothing.
            known = weights.sum(axis=1) > 0
            means = weights[known] @ frame.pressures[nodes[beside]] / weights[known].sum(axis=1)
            yield (means.min(), min(means[0], means[-1])) if known[0] and known[-1] else (np.inf, 0.0)


def are_two(skin, frame, sigma, a, b, saddle, were_two):
    """Whether two regions that meet at the pressure `saddle` are two, and doubts."""
    low = min(a.peak, b.peak, key=lambda node: (frame.pressures[node], -node))
    peak, doubts = frame.pressures[low], set()
    limit = CANDIDATE * peak - 3 * sigma[low]
    if not were_two:
        if abs(saddle - limit) <= CLOSE * peak:
            doubts.add("candidate")
        if saddle >= limit:
            return False, doubts
    share = JOIN if were_two else SPLIT
    answers = set()
    for least, end in dip(skin, frame, a, b):
        if abs(least - share * end) <= CLOSE * end:
            doubts.add("dip")
        answers.add(least <= share * end if were_two else least < share * end)
    if len(answers) > 1:
        doubts.add("way of a dip")
    return answers.pop(), doubts


def regions(skin, frame, sigma, were_two):
    """Regions of pressed taxels, and pairs of those that met and are two. `were_two` says of two nodes whether they were."""
    pressures = frame.pressures
    key = lambda node: (-pressures[node], node)
    home, pairs = {}, []
    for node in sorted((int(n) for n in np.flatnonzero(pressures > 0)), key=key):
        met = {id(home[other]): home[other] for other in frame.beside[node] if other in home}
        if not met:
            home[node] = Region([node], node)
            continue
        own = home[min((other for other in frame.beside[node] if other in home), key=key)]
        own.members.append(node)
        home[node] = own
        for other in sorted((r for r in met.values() if r is not own), key=lambda r: key(r.peak)):
            if any({id(a), id(b)} == {id(own), id(other)} for a, b, _ in pairs):
                continue
            two, doubts = are_two(skin, frame, sigma, own, other, pressures[node], were_two(own.peak, other.peak))
            # What either might hold as well changes what is between them.
            doubts |= own.doubts | other.doubts
            if two:
                pairs.append((own, other, doubts))
                own.doubts |= doubts
                other.doubts |= doubts
                continue
            keeps, goes = sorted((own, other), key=lambda r: key(r.peak))
            keeps.members += goes.members
            keeps.doubts |= goes.doubts | doubts
            for member in goes.members:
                home[member] = keeps
            # A region is known by its peak: what was found of a peak that is gone is found anew of the one that stays.
            pairs = [(a, b, d) for a, b, d in pairs if a is not goes and b is not goes]
            own = keeps
    found = list({id(region): region for region in home.values()}.values())
    return found, pairs


# Quantities.


def normal_at(skin, nodes, position):
    """The mean of the taxels' normals around a place of the skin."""
    nodes = np.array(sorted(nodes))
    away = np.linalg.norm(skin.at[nodes] - position, axis=1)
    normal = np.exp(-0.5 * away**2 / (0.25 * skin.cell[nodes])) @ skin.mean_normal[nodes]
    return normal / np.linalg.norm(normal)


def measure(skin, frame, weight, nodes, link):
    """Quantities of a touch on `nodes`, one set per base that its chart may have."""
    nodes = np.array(sorted(nodes))
    loads = weight[nodes] * frame.pressures[nodes]
    mean = loads @ skin.at[nodes] / loads.sum()
    found = []
    for base in nearest(skin, nodes, mean):
        normal = skin.mean_normal[base]
        places, angles = unrolled(skin.at[nodes] - skin.at[base], normal, skin.mean_normal[nodes])
        one = {"mean": mean, "base": base, "doubts": set()}
        if abs(angles.max() - WRAPPED) < CLOSE:
            one["doubts"].add("wrapped")
        one["wrapped"] = angles.max() > WRAPPED
        if one["wrapped"]:
            places = skin.at[nodes]
        one |= moments(places, loads)
        if "axis" in one and not one["wrapped"]:
            one["angle"] = angle(skin, link, normal, one["axis"])
        one |= {} if one["wrapped"] else farthest(skin, places, loads, link, normal)
        found.append(one)
    return found


def moments(places, loads):
    if len(loads) == 1:
        return {"why": "one_taxel"}
    middle = loads @ places / loads.sum()
    offsets = places - middle
    values, vectors = np.linalg.eigh((offsets * loads[:, None]).T @ offsets / loads.sum())
    across, along = np.maximum(values[1:], 0)
    if along <= (1e-12 * np.abs(places).max()) ** 2:
        return {"why": "coincident"}
    found = {"anisotropy": (along - across) / (along + across), "spread": np.sqrt([along, across])}
    if found["anisotropy"] < ISOTROPIC:
        return found | {"why": "isotropic"}
    return found | {"axis": vectors[:, 2]}


def angle(skin, link, normal, direction):
    u = skin.u(link, normal)
    return np.arctan2(direction @ np.cross(normal, u), direction @ u) % np.pi


def farthest(skin, places, loads, link, normal):
    """The line through the two farthest of the points at P |x − c|, per choice of the two."""
    if len(loads) == 1:
        return {"lines": []}
    middle = loads @ places / loads.sum()
    points = (places - middle) * loads[:, None] / loads.max()
    away = np.linalg.norm(points, axis=1)
    order = sorted(range(len(away)), key=lambda k: (-away[k], k))
    close = CLOSE * max(away.max(), 1e-300)
    first = [k for k in order if away[k] >= away[order[0]] - close]
    second = [k for k in order if away[k] >= away[order[1]] - close]
    lines = []
    for a, b in {(min(a, b), max(a, b)) for a in first for b in second if a != b}:
        way = points[a] - points[b]
        length = np.linalg.norm(way)
        if length > COINCIDENT * away[order[0]]:
            way = way / length
            lines.append((way, angle(skin, link, normal, way)))
        else:
            lines.append(None)
    return {"lines": lines}
