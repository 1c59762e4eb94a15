"""What raw values mean by a calibration, for `oracle.py`: readings, and the parts of what taxels of pressure and of three axes feel."""

import numpy as np

# Rounding of double precision: hundreds of units, as a share of the terms that are summed.
SAME = 1e-13


class Value:
    """What is right, and the size of the terms that it is made of: it is right within SAME of that."""

    def __init__(self, value, size=None):
        self.value = np.asarray(value, float)
        self.size = float(np.abs(self.value).max() if size is None else size)


def gradient_within(gradient, celsius, weights, least, most):
    """`gradient` of temperatures, K/m, by moments A with the eigenvalues `least` and `most`. Rounding moves A by a share of `most`
    and A's right side by a share of sqrt(most * Σw) |T|; both come into the gradient divided by `least`. The share is some 20 roundings,
    a twentieth of SAME, so that a millionth is told also where taxels are nearly in a line."""
    size = np.abs(celsius).max() + 300
    moved = np.sqrt(most * weights.sum()) * size / least + most / least * np.linalg.norm(gradient)
    return Value(gradient, moved / 20)


def interpolated(curve, x):
    raw, p = np.array(curve["raw"], float), np.array(curve["p"], float)
    return np.interp(x, raw, p)


UNITS = {
    "temperature": {"°C": (1.0, 0.0), "K": (1.0, -273.15), "°F": (5 / 9, -160 / 9)},
    "proximity": {"mm": (1e-3, 0.0), "cm": (1e-2, 0.0), "m": (1.0, 0.0), "in": (0.0254, 0.0)},
}
PRESSURES = {"N": ("N", 1.0), "mN": ("N", 1e-3), "kPa": ("Pa", 1e3), "Pa": ("Pa", 1.0), None: (None, 1.0)}


def read(recording, taxels, axis=""):
    """Raw values by frame and taxel, and which are missing: codes of [all] are so on every channel."""
    raw, missing = recording.frames.of(taxels, axis)
    codes = recording.calibration.get("all", {}).get("missing", [])
    return raw, missing | np.isin(raw, np.array(codes, np.float32).astype(float))


def sensed(recording, letter, taxels):
    """By frame and taxel: the value, whether it is in the sensor's range, which are missing, which are faulty; and -1 where it lies beyond
    the end of a curve with the least values, 1 beyond that with the greatest."""
    file, body = recording.calibration, recording.body
    raw, missing = read(recording, taxels)
    keys = file.get(letter, {})
    factor, offset = UNITS[letter][keys.get("unit", "°C" if letter == "temperature" else "mm")]
    every = {"baseline": 0.0, "gain": 1.0, "raw_range": [-np.inf, np.inf]} | keys
    values, inside, faulty = np.full(raw.shape, np.nan), np.ones(raw.shape, bool), ~np.isfinite(raw)
    beyond = np.zeros(raw.shape, int)
    codes = np.isin(raw, np.array(keys.get("missing", []), np.float32).astype(float))
    for column, taxel in enumerate(taxels):
        own = every | file.get("taxel", {}).get(str(body.ids[taxel]), {})
        # What a masked taxel reads is faulty, whatever it is.
        codes[:, column] &= not own.get("mask")
        if "ntc" in own and own.get("invert") and own["baseline"] == 0:
            # Above its resistor.
            own["baseline"] = own["ntc"]["full_raw"]
        above = (own["baseline"] - raw[:, column]) if own.get("invert") else (raw[:, column] - own["baseline"])
        if "ntc" in own and "curve" not in own:
            ntc = own["ntc"]
            with np.errstate(all="ignore"):
                ohm = ntc["series_ohm"] * above / (ntc["full_raw"] - above)
                response = 1 / (1 / 298.15 + np.log(ohm / ntc["ohm_at_25"]) / ntc["b_k"]) - 273.15
            faulty[:, column] |= ~((above > 0) & (above < ntc["full_raw"]))
        elif "curve" in own:
            curve = file["curve"][own["curve"]]
            response = interpolated(curve, above)
            # Raw values are rounded to single precision.
            off, rises = np.abs(raw[:, column]) * 2.0**-23, 1 if curve["p"][-1] > curve["p"][0] else -1
            with np.errstate(invalid="ignore"):
                beyond[:, column] = rises * ((above - off > curve["raw"][-1]).astype(int) - (above + off < curve["raw"][0]))
        else:
            response = above
        values[:, column] = own["gain"] * factor * response + offset
        inside[:, column] = (raw[:, column] >= own["raw_range"][0]) & (raw[:, column] <= own["raw_range"][1])
        if letter == "temperature":
            with np.errstate(invalid="ignore"):
                faulty[:, column] |= values[:, column] < -273.15
        if own.get("mask"):
            faulty[:, column] = True
    missing = missing | codes
    faulty &= ~missing
    return values, inside, missing, faulty, beyond


def arc(a, b, x):
    """x, turned as the least turn from a to b does."""
    axis, cosine = np.cross(a, b), a @ b
    return x + np.cross(axis, x) + np.cross(axis, np.cross(axis, x)) / (1 + cosine)
