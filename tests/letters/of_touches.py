"""What touches feel beside pressure by a definition of its own, for `oracle.py`.

Which taxels a touch has, its link, and whether it goes around a limb are taken as reported; `tests/touches` compares these. Its chart is
at one of its taxels: all that is in the chart must be right for one of them.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "touches"))
from calibrated import PRESSURES, SAME, Value, arc, gradient_within, read, sensed
from definition import unrolled
from made import ALONG, unit

TOUCHES = [
    "total", "shear", "shear_in_chart", "shear_direction", "force_vector", "torsion", "friction", "slip_ratio", "temperature",
    "warmest", "warmest_taxel", "warmest_position", "coldest", "coldest_taxel", "coldest_position", "temperature_gradient",
]
# P is of single precision on the CPU: some units of the terms that it is made of.
SAME_ON_CPU = 4 * 2.0**-24
# How far a taxel of temperature may be from the nearest one of pressure, in widths of that one's cell.
REACH = 1.5


class TouchesOf:
    """The right quantities of touches of `recording`; `listed` is what `somatic inspect --json` prints of its body."""

    def __init__(self, recording, listed):
        body, file = recording.body, recording.calibration
        self.body, self.file = body, file
        self.same = SAME if recording.backend == "reference" else SAME_ON_CPU
        self.taxels = [taxel for taxel, kind in enumerate(body.kind) if kind in ("pressure", "force3")]
        self.node_of = {body.ids[taxel]: node for node, taxel in enumerate(self.taxels)}
        self.poses = [body.pose(link) for link in range(len(body.links))]
        self.link_of = {name: link for link, (name, *_) in enumerate(body.links)}
        self.at, self.normal, self.first, self.second = self.in_body(self.taxels)
        cells = {taxel["id"]: taxel["cell"] for taxel in listed["taxels"]}
        self.cell = np.array([cells[body.ids[taxel]] for taxel in self.taxels], float)
        self.calibrate(recording)
        self.find_warm(recording)

    def in_body(self, taxels):
        """Places, normals and both tangents on the body at rest."""
        columns = []
        for taxel in taxels:
            rotation, origin = self.poses[self.body.link[taxel]]
            normal, wanted = unit(self.body.normal[taxel]), self.body.tangent[taxel]
            first = self.across(normal, wanted) if wanted.any() else self.default_u(normal)
            at = origin + rotation @ self.body.at[taxel]
            columns.append((at, rotation @ normal, rotation @ first, rotation @ np.cross(normal, first)))
        return [np.array(column) for column in zip(*columns)] if columns else [np.zeros((0, 3))] * 4

    @staticmethod
    def across(normal, wanted):
        return unit(wanted - normal * (wanted @ normal))

    def default_u(self, normal):
        return self.across(normal, np.array([0.0, 0, 1]) if abs(normal[0]) > ALONG else np.array([1.0, 0, 0]))

    def calibrate(self, recording):
        body, file = self.body, self.file
        every, keys = file.get("all", {}), file.get("shear", {})
        quantity, unit_of_p = PRESSURES[every.get("unit")]
        unit_of_p *= every.get("scale", 1.0)
        own = lambda taxel: file.get("taxel", {}).get(str(body.ids[taxel]), {})
        of = lambda key, default: [own(taxel).get(key, default) for taxel in self.taxels]
        both = lambda key, default: np.array([np.broadcast_to(two, 2) for two in of(key, default)], float).reshape(-1, 2).T
        self.baseline = np.array(of("baseline", every.get("baseline", 0.0)), float)
        self.gain = np.array(of("gain", every.get("gain", 1.0)), float) * unit_of_p
        self.gain *= np.where(of("invert", every.get("invert", False)), -1, 1)
        # Of u and of v.
        own_gain = both("shear_gain", keys.get("gain", np.nan)) * unit_of_p
        self.side_gain = np.where(np.isnan(own_gain), np.abs(self.gain), own_gain)
        self.rest = both("shear_baseline", keys.get("baseline", 0.0))[:, None]
        low, high = both("shear_raw_range", keys.get("raw_range", [-np.inf, np.inf]))
        cross = np.array(keys.get("cross_axis", np.eye(3)), float)
        self.cross = np.vstack([np.eye(3)[: 3 - len(cross)], cross])
        self.slips_at = keys.get("slips_at")
        # A sensor that measures a force has added up over its cell.
        self.weight = np.ones(len(self.taxels)) if quantity == "N" else self.cell
        area = body.area[self.taxels]
        self.newtons = {
            "N": np.ones(len(area)), "Pa": np.where(area > 0, area, np.nan), None: np.full(len(area), np.nan),
        }[quantity]
        raw, _ = read(recording, self.taxels)
        self.has_axes = np.array([body.kind[taxel] == "force3" for taxel in self.taxels], bool)
        self.sides = np.full((2, *raw.shape), np.nan)
        for place, axis in enumerate(("u", "v")):
            side, missing = read(recording, [taxel for taxel in self.taxels if body.kind[taxel] == "force3"], axis)
            self.sides[place][:, self.has_axes] = np.where(missing, np.nan, side)
        known = np.isfinite(self.sides) & (self.sides >= low) & (self.sides <= high)
        self.known = known.all(axis=0)
        self.lateral = self.side_gain[:, None] * (self.sides - self.rest)
        self.large = self.side_gain[:, None] * (np.abs(self.sides) + np.abs(self.rest))
        # What is along the skin is taken out of raw values, which are singles, as far as it is known.
        leak = (self.cross[0, 0] - 1) * (raw - self.baseline)
        leak += np.tensordot(self.cross[0, 1:], np.where(known, self.lateral / self.gain, 0), 1)
        is_leaky = self.has_axes & np.isfinite(leak) & np.any(self.cross[0] != [1, 0, 0])
        self.raw = np.where(is_leaky, raw + np.where(is_leaky, leak, 0), raw).astype(np.float32).astype(float)

    def find_warm(self, recording):
        """By node, the taxels of temperature that are nearest to it on its side of its link."""
        warm = [taxel for taxel, kind in enumerate(self.body.kind) if kind == "temperature"]
        self.warm_at, warm_normals = self.in_body(warm)[:2]
        self.warm_of, self.warm_node = {}, {}
        self.warm_ids = [self.body.ids[taxel] for taxel in warm]
        self.celsius, _, missing, faulty, _ = sensed(recording, "temperature", warm)
        self.reads = ~missing & ~faulty
        for place, (taxel, at) in enumerate(zip(warm, self.warm_at)):
            on_link = [node for node, own in enumerate(self.taxels) if self.body.link[own] == self.body.link[taxel]]
            on_link = [node for node in on_link if self.normal[node] @ warm_normals[place] > 0]
            if not on_link:
                continue
            away = np.linalg.norm(self.at[on_link] - at, axis=1)
            node = on_link[away.argmin()]
            if away.min() <= REACH * np.sqrt(self.cell[node]):
                self.warm_of.setdefault(node, []).append(place)
                self.warm_node[place] = node

    def right(self, frame, touch):
        """What is right of a touch: quantities, and those in each chart that it may have."""
        nodes = np.array([self.node_of[taxel] for taxel in touch["taxels"]])
        rotation, origin = self.poses[self.link_of[touch["link"]]]
        turn = rotation.T
        p = self.gain[nodes] * (self.raw[frame, nodes] - self.baseline[nodes])
        p_size = np.abs(self.gain[nodes]) * (np.abs(self.raw[frame, nodes]) + np.abs(self.baseline[nodes]))
        found = {"total": Value(p.sum(), p_size.sum())}
        under = sorted(place for node in nodes for place in self.warm_of.get(int(node), []) if self.reads[frame, place])
        if under:
            celsius = self.celsius[frame, under]
            size = np.abs(celsius).max() + 300
            found["temperature"] = Value(celsius.mean(), size)
            for name, place in (("warmest", celsius.argmax()), ("coldest", celsius.argmin())):
                found[name] = Value(celsius[place], size)
                found[f"{name}_taxel"] = Value(self.warm_ids[under[place]])
                found[f"{name}_position"] = Value(turn @ (self.warm_at[under[place]] - origin), 1)
        # The nearest to its middle first: it is mostly that.
        load = self.weight[nodes] * p
        away = np.linalg.norm(self.at[nodes] - load @ self.at[nodes] / load.sum(), axis=1)
        bases = nodes[away.argsort(kind="stable")]
        there = self.has_axes[nodes] & self.known[frame, nodes]
        own = nodes[there]
        # What was measured along the normal, of which the matrix makes P.
        lateral, large = self.lateral[:, frame, own], self.large[:, frame, own]
        measured = (p[there] - self.cross[0, 1:] @ lateral) / self.cross[0, 0]
        size = (p_size[there] + np.abs(self.cross[0, 1:]) @ large) / self.cross[0, 0]
        along = self.cross[1:] @ np.vstack([measured, lateral])
        terms = (np.abs(self.cross[1:]) @ np.vstack([size, large])).sum(axis=0)
        each = along[0][:, None] * self.first[own] + along[1][:, None] * self.second[own]
        force = (self.newtons[own, None] * each).sum(axis=0) - (self.newtons[nodes] * p) @ self.normal[nodes]
        if self.has_axes[nodes].any() and np.isfinite(force).all():
            sizes = (self.newtons[own] * terms).sum() + (self.newtons[nodes] * p_size).sum()
            found["force_vector"] = Value(turn @ force, sizes)
        weight = self.weight[own]
        if len(own):
            # In the unit of the touch's total.
            scale = p[there].sum() / (weight @ p[there])
            found["shear"] = Value(turn @ (scale * weight @ each), scale * weight @ terms * p_size.sum() / p.sum())
        pulls = (weight, p[there], p_size[there], each, terms)
        return found, (self.in_chart(frame, touch, base, (own, pulls), under) for base in bases)

    def in_chart(self, frame, touch, base, pulled, under):
        (own, (weight, p, p_size, each, terms)), up, link = pulled, self.normal[base], self.link_of[touch["link"]]
        rotation, is_wrapped = self.poses[link][0], "wrapped" in touch["flags"]
        u = rotation @ self.default_u(rotation.T @ up)
        axes, found = np.array([u, np.cross(up, u)]), {}
        if len(under) >= 3 and not is_wrapped:
            normals = self.normal[[self.warm_node[place] for place in under]]
            away = unrolled(self.warm_at[under] - self.at[base], up, normals)[0] @ axes.T
            away, celsius = away - away.mean(axis=0), self.celsius[frame, under]
            least, most = np.linalg.eigvalsh(away.T @ away)
            share = least * most / (least + most) ** 2
            if share > 1.001e-6:
                gradient = np.linalg.lstsq(away, celsius - celsius.mean(), rcond=None)[0]
                found["temperature_gradient"] = gradient_within(gradient, celsius, np.ones(len(under)), least, most)
            elif share > 0.999e-6:
                found["temperature_gradient"] = None
        if len(own) == 0:
            return found
        load, offsets = weight @ p, self.at[own] - self.at[base]
        scale, doubt = p.sum() / load, p_size.sum() / p.sum()
        # Around a limb there is no chart: its plane.
        turned = each if is_wrapped else np.array([arc(normal, up, pull) for normal, pull in zip(self.normal[own], each)])
        places = (offsets if is_wrapped else unrolled(offsets, up, self.normal[own])[0]) @ axes.T
        flat, size = turned @ axes.T, weight @ terms
        total = weight @ flat
        pull = weight @ np.linalg.norm(each, axis=1) if is_wrapped else np.linalg.norm(total)
        # The sum of P may be off by as much as its terms.
        found["friction"] = Value(pull / load, doubt * (size + pull) / load)
        if self.slips_at is not None:
            found["slip_ratio"] = Value(pull / load / self.slips_at, found["friction"].size / self.slips_at)
        if len(own) > 1:
            arms = places - (weight * p) @ places / load
            torsion = scale * weight @ (arms[:, 0] * flat[:, 1] - arms[:, 1] * flat[:, 0])
            found["torsion"] = Value(torsion, 8 * doubt * scale * size * (np.abs(places).max() + np.abs(self.at[own]).max()))
        if is_wrapped:
            return found
        found["shear_in_chart"] = Value(scale * total, doubt * scale * size)
        # Near what rounding may make of nothing there may be a direction or none.
        told = pull > 2.0**-20 * size
        found["shear_direction"] = Value(np.arctan2(total[1], total[0]), 4 * max(1, size / pull)) if told else None
        return found

    def wrong(self, frame, touch, largest):
        """What is wrong with a touch: by quantity what is reported and what is right."""
        found, charts = self.right(frame, touch)
        least = None
        for chart in charts:
            wrong = self.off(touch, found | chart, largest)
            if not wrong:
                return wrong
            least = wrong if least is None or len(wrong) < len(least) else least
        return least

    def off(self, touch, found, largest):
        wrong, over_by = {}, {}
        for name in TOUCHES:
            if name in found and found[name] is None:
                continue
            right, value = found.get(name), touch.get(name)
            if (right is None) != (value is None):
                wrong[name] = (value, right and right.value.tolist())
            elif right is not None:
                away = np.abs(np.asarray(value, float) - right.value)
                away = np.minimum(away, np.abs(2 * np.pi - away)) if name == "shear_direction" else away
                over = float(away.max()) / (self.same * max(right.size, 1e-300)) if away.max() > 0 else 0.0
                over_by[f"touches.{name}"] = over
                if not over <= 1:
                    wrong[name] = (value, right.value.tolist())
        if not wrong:
            for name, over in over_by.items():
                largest[name] = max(largest.get(name, 0.0), over)
        return wrong
