"""What touches have of the other letters by a definition of its own, for `oracle.py`.

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
from slope import Slope

TOUCHES = [
    "total", "shear", "shear_in_chart", "shear_direction", "force_vector", "torsion", "friction", "slip_ratio", "temperature",
    "warmest", "warmest_taxel", "warmest_position", "coldest", "coldest_taxel", "coldest_position", "temperature_gradient",
    "temperature_rate", "friction_sigma",
]
# Those of values, letters and links: `tests/touches` compares others. Recordings are never `stale`, and no skin goes over several links.
FLAGS = {
    "saturated", "faulty_input", "out_of_range", "incomplete", "stale", "no_unit", "still", "no_gradient", "no_previous", "one_pulled",
    "noise_unknown", "one_taxel", "several_links",
}
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
        self.beside = [[] for _ in self.taxels]
        for one, other in listed["edges"]:
            self.beside[self.node_of[one]].append(self.node_of[other])
            self.beside[self.node_of[other]].append(self.node_of[one])
        self.has_sigma = "shear" in recording.letters()
        self.calibrate(recording)
        self.find_warm(recording)
        self.restarts, self.t, self.moved = recording.frames.restarts, recording.frames.t, recording.frames.moved
        self.slopes, self.rates = {}, {}

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
        raw, missing = read(recording, self.taxels)
        self.has_axes = np.array([body.kind[taxel] == "force3" for taxel in self.taxels], bool)
        self.sides, absent = np.full((2, *raw.shape), np.nan), np.zeros((2, *raw.shape), bool)
        for place, axis in enumerate(("u", "v")):
            side, lost = read(recording, [taxel for taxel in self.taxels if body.kind[taxel] == "force3"], axis)
            self.sides[place][:, self.has_axes] = np.where(lost, np.nan, side)
            absent[place][:, self.has_axes] = lost
        known = np.isfinite(self.sides) & (self.sides >= low) & (self.sides <= high)
        self.flag(raw, missing, absent, known)
        self.known = known.all(axis=0)
        self.lateral = self.side_gain[:, None] * (self.sides - self.rest)
        self.large = self.side_gain[:, None] * (np.abs(self.sides) + np.abs(self.rest))
        # What is along the skin is taken out of raw values, which are singles, as far as it is known.
        leak = (self.cross[0, 0] - 1) * (raw - self.baseline)
        leak += np.tensordot(self.cross[0, 1:], np.where(known, self.lateral / self.gain, 0), 1)
        is_leaky = self.has_axes & np.isfinite(leak) & np.any(self.cross[0] != [1, 0, 0])
        self.raw = np.where(is_leaky, raw + np.where(is_leaky, leak, 0), raw).astype(np.float32).astype(float)
        self.most = np.array(of("p_max", every.get("p_max", np.inf)), float) * PRESSURES[every.get("unit")][1]
        # Of raw values.
        self.noise = np.array(of("noise", every.get("noise", np.nan)), float)
        self.side_noise = np.array(of("shear_noise", keys.get("noise", np.nan)), float)
        self.side_noise = np.where(np.isnan(self.side_noise), self.noise, self.side_noise)

    def flag(self, raw, missing, absent, known):
        """By frame and node, what is wrong with a taxel that presses, and with one that cannot press; `absent` and `known` are of both
        sides."""
        file, ids = self.file, [self.body.ids[taxel] for taxel in self.taxels]
        own = lambda key, default: [file.get("taxel", {}).get(str(i), {}).get(key, file.get("all", {}).get(key, default)) for i in ids]
        low, high = np.array(own("raw_range", [-np.inf, np.inf]), float).reshape(-1, 2).T
        masked = np.array(own("mask", False), bool)
        faulty = ~absent & ~np.isfinite(self.sides) & self.has_axes
        off = ~absent & ~faulty & ~known & self.has_axes
        # How it pulls is not known for the first of these reasons; P is corrected by each side that is in it, by itself.
        lost = absent.any(axis=0)
        bad = ~lost & faulty.any(axis=0)
        in_part = (self.cross[0, 1:] != 0)[:, None, None]
        with np.errstate(invalid="ignore"):
            outside = (raw < low) | (raw > high)
        self.pressing = {
            "incomplete": lost | (in_part & absent).any(axis=0),
            "faulty_input": bad | (in_part & faulty).any(axis=0),
            "out_of_range": outside | (~lost & ~bad & off.any(axis=0)) | (in_part & off).any(axis=0),
        }
        self.idle = {"incomplete": missing, "faulty_input": ~missing & (masked | ~np.isfinite(raw))}

    def find_warm(self, recording):
        """By node, the taxels of temperature that are nearest to it on its side of its link."""
        warm = [taxel for taxel, kind in enumerate(self.body.kind) if kind == "temperature"]
        self.warm_at, warm_normals = self.in_body(warm)[:2]
        self.warm_of, self.warm_node = {}, {}
        self.warm_ids = [self.body.ids[taxel] for taxel in warm]
        self.celsius, inside, missing, faulty, _ = sensed(recording, "temperature", warm)
        self.reads = ~missing & ~faulty
        self.warm_flags = {"incomplete": missing, "faulty_input": faulty, "out_of_range": self.reads & ~inside}
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

    def under(self, frame, touch):
        """The taxels of temperature under a touch that have a reading, and all of them."""
        nodes = [self.node_of[taxel] for taxel in touch["taxels"]]
        every = sorted(place for node in nodes for place in self.warm_of.get(node, []))
        return [place for place in every if self.reads[frame, place]], every

    def go_on(self, frame, touches):
        """Takes the touches of the next frame: the rates of their temperatures depend on those before."""
        going = {touch["id"] for touch in touches}
        self.slopes = {} if self.restarts[frame] else {own: slope for own, slope in self.slopes.items() if own in going}
        self.rates = {}
        mean = lambda of: sum(of.values()) / len(of) if of else None
        for touch in touches:
            under, _ = self.under(frame, touch)
            if under:
                now = dict(zip(under, self.celsius[frame, under]))
                slope = self.slopes.setdefault(touch["id"], Slope(self.file.get("temperature", {}).get("window_s", 1.0)))
                self.rates[touch["id"]] = slope.follow(self.t[frame], now, mean, max(map(abs, now.values())) + 300)

    def flags(self, frame, touch, found, under):
        """What is right of `FLAGS`, by what else was `found` of a touch."""
        nodes = [self.node_of[taxel] for taxel in touch["taxels"]]
        around = {other for node in nodes for other in self.beside[node]} - set(nodes)
        flags = {flag for flag, of in self.pressing.items() if of[frame, nodes].any()}
        flags |= {flag for flag, of in self.idle.items() if of[frame, sorted(around)].any()}
        flags |= {flag for flag, of in self.warm_flags.items() if of[frame, under].any()}
        flags |= {"saturated"} if (self.gain[nodes] * (self.raw[frame, nodes] - self.baseline[nodes]) > self.most[nodes]).any() else set()
        flags |= {"one_taxel"} if len(nodes) == 1 else set()
        flags |= {"several_links"} if len({self.body.link[self.taxels[node]] for node in nodes}) > 1 else set()
        flags |= {"no_unit"} if np.isnan(self.newtons[nodes]).any() else set()
        if "temperature" in found:
            flags |= {"no_gradient"} if "temperature_gradient" not in found else set()
            flags |= {"no_previous"} if "temperature_rate" not in found else set()
        if "shear" in found:
            # Around a limb there is no direction at all.
            flags |= {"still"} if "shear_direction" not in found and "wrapped" not in touch["flags"] else set()
            # A touch of one taxel says so.
            is_alone = len(nodes) > 1 and self.has_axes[nodes].sum() == 1
            flags |= {"one_pulled"} if is_alone else set()
            flags |= {"noise_unknown"} if self.has_sigma and "friction_sigma" not in found else set()
        return flags

    def out(self, frame, link):
        """The turn and the step from the body at rest to the world, if the frame has poses, or into `link`."""
        rotation, origin = self.poses[link]
        return (rotation.T, -rotation.T @ origin) if self.moved[frame] is None else [of[link] for of in self.moved[frame]]

    def right(self, frame, touch):
        """What is right of a touch: quantities, and those in each chart that it may have."""
        nodes = np.array([self.node_of[taxel] for taxel in touch["taxels"]])
        turn, step = self.out(frame, self.link_of[touch["link"]])
        p = self.gain[nodes] * (self.raw[frame, nodes] - self.baseline[nodes])
        p_size = np.abs(self.gain[nodes]) * (np.abs(self.raw[frame, nodes]) + np.abs(self.baseline[nodes]))
        found = {"total": Value(p.sum(), p_size.sum())}
        under, _ = self.under(frame, touch)
        if under:
            celsius = self.celsius[frame, under]
            size = np.abs(celsius).max() + 300
            found["temperature"] = Value(celsius.mean(), size)
            for name, place in (("warmest", celsius.argmax()), ("coldest", celsius.argmin())):
                found[name] = Value(celsius[place], size)
                found[f"{name}_taxel"] = Value(self.warm_ids[under[place]])
                found[f"{name}_position"] = Value(turn @ self.warm_at[under[place]] + step, 1)
            if self.rates[touch["id"]]:
                found["temperature_rate"] = self.rates[touch["id"]]
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
        pulls = (weight, p[there], p_size[there], each, terms, along)
        return found, (self.in_chart(frame, touch, base, (own, pulls), under) for base in bases)

    def in_chart(self, frame, touch, base, pulled, under):
        (own, (weight, p, p_size, each, terms, along)), up, link = pulled, self.normal[base], self.link_of[touch["link"]]
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
        # Tangents along the chart, as lengths.
        tangents = [[arc(normal, up, way) for normal, way in zip(self.normal[own], ways)] for ways in (self.first[own], self.second[own])]
        in_chart = None if is_wrapped else (total, np.array(tangents) @ axes.T)
        sigma = self.friction_sigma(frame, own, weight, pull / load, along, in_chart, load)
        if sigma is not None:
            found["friction_sigma"] = Value(sigma[0], sigma[0] * sigma[1] * max(1, found["friction"].size / max(pull / load, 1e-9)))
        if len(own) > 1:
            arms = places - (weight * p) @ places / load
            torsion = scale * weight @ (arms[:, 0] * flat[:, 1] - arms[:, 1] * flat[:, 0])
            found["torsion"] = Value(torsion, 8 * doubt * scale * size * (np.abs(places).max() + np.abs(self.at[own]).max()))
        if is_wrapped:
            return found
        found["shear_in_chart"] = Value(scale * total, doubt * scale * size)
        # Near what rounding may make of nothing there may be a direction or none.
        if pull > 2.0**-20 * size:
            found["shear_direction"] = Value(np.arctan2(total[1], total[0]), 4 * max(1, size / pull))
        elif pull > 0.99 * 2.0**-24 * (weight * np.abs(along).sum(axis=0)).sum():
            found["shear_direction"] = None
        return found

    def friction_sigma(self, frame, own, weight, friction, along, in_chart, load):
        """The standard deviation of `friction`, and how many times its size what rounding moves is; None where noise is not known.
        `in_chart` has the sum and both tangents of each in the chart."""
        noise, side_noise = self.noise[own], self.side_noise[own]
        if not self.has_sigma or np.isnan(noise).any():
            return None
        if in_chart is None:
            # Along what each feels.
            lengths = np.linalg.norm(along, axis=0)
            ways = np.where(lengths > 0, along, [[1.0], [0.0]]) / np.where(lengths > 0, lengths, 1)
        else:
            total, tangents = in_chart
            length = np.linalg.norm(total)
            ways = tangents @ (total / length if length > 0 else np.array([1.0, 0.0]))
        # Raw values vary by themselves: each moves the pull along its way, and P, of which the friction is a share.
        moves = self.cross[1:].T @ ways - friction * self.cross[0][:, None]
        gains = np.vstack([np.abs(self.gain[own]), np.abs(self.side_gain[:, own])])
        sigma = np.sqrt(((weight * moves * gains * np.vstack([noise, side_noise, side_noise])) ** 2).sum()) / load
        # A standard deviation of P is a difference of values.
        in_p = np.hypot(*(self.cross[0, 1:, None] * self.side_gain[:, own] * side_noise / self.gain[own]))
        noises = np.hypot(self.cross[0, 0] * noise, in_p)
        return sigma, ((np.abs(self.raw[frame, own]) + np.abs(self.baseline[own]) + noises) / noises).max()

    def wrong(self, frame, touch, largest):
        """What is wrong with a touch: by quantity what is reported and what is right."""
        found, charts = self.right(frame, touch)
        least = None
        for chart in charts:
            wrong = self.off(frame, touch, found | chart, largest)
            if not wrong:
                return wrong
            least = wrong if least is None or len(wrong) < len(least) else least
        return least

    def off(self, frame, touch, found, largest):
        wrong, over_by = {}, {}
        # What is too close to call has either flag.
        undecided = {"shear_direction": "still", "temperature_gradient": "no_gradient"}
        unsure = {flag for name, flag in undecided.items() if found.get(name, 0) is None}
        told, right = set(touch["flags"]) & FLAGS - unsure, self.flags(frame, touch, found, self.under(frame, touch)[1]) - unsure
        frame_of = "world" if self.moved[frame] else touch["link"]
        if touch["in"] != frame_of:
            wrong["in"] = (touch["in"], frame_of)
        if told != right:
            wrong["flags"] = (sorted(told), sorted(right))
        for name in TOUCHES:
            if name in found and found[name] is None:
                continue
            right, value = found.get(name), touch.get(name)
            if (right is None) != (value is None):
                wrong[name] = (value, right and right.value.tolist())
            elif right is not None:
                away = np.abs(np.asarray(value, float) - right.value)
                away = np.minimum(away, np.abs(2 * np.pi - away)) if name == "shear_direction" else away
                # Temperatures are made in double precision on every backend.
                same = SAME if name.startswith(("temperature", "warmest", "coldest")) else self.same
                over = float(away.max()) / (same * max(right.size, 1e-300)) if away.max() > 0 else 0.0
                over_by[f"touches.{name}"] = over
                if not over <= 1:
                    wrong[name] = (value, right.value.tolist())
        if not wrong:
            for name, over in over_by.items():
                largest[name] = max(largest.get(name, 0.0), over)
        return wrong
