#!/usr/bin/env python3
"""A recording to percepts as one would write it with pandas and NumPy: the program that end_to_end.py times.

    with_pandas.py RECORDING.csv LAYOUT.json DEAD_BAND OUT.ndjson

LAYOUT.json is what `somatic inspect BODY --json` prints. The output is that of `somatic run --outputs
total,peak,active,centroid,orientation`: a line a frame, the fields in contact, flags as docs and README have them.
"""

import json
import sys

import numpy as np
import pandas as pd

NEAR = 2.0**-14


def read_pressures(path, dead_band):
    """Times (T,), and pressures (T, N) by column, 0 up to the dead band."""
    frame = pd.read_csv(path)
    values = frame.drop(columns="t").to_numpy(np.float64)
    return frame["t"].to_numpy(), np.where(values > dead_band, values, 0.0), [int(name) for name in frame.columns[1:]]


def of_field(pressures, uv):
    """A field's percepts in the frames that touch it: `pressures` (T, M), `uv` (M, 2), or None without a chart."""
    total = pressures.sum(axis=1)
    frames = np.flatnonzero(total)
    pressures, total = pressures[frames], total[frames]
    found = {"frames": frames, "total": total, "peak": pressures.max(axis=1, initial=0)}
    found["active"] = np.count_nonzero(pressures, axis=1)
    if uv is None:
        return found
    found["centroid"] = centroid = pressures @ uv / total[:, None]
    points = (uv - centroid[:, None, :]) * pressures[..., None]
    reach = np.hypot(points[..., 0], points[..., 1])
    reach[pressures == 0] = -1.0
    if reach.shape[1] < 3:
        missing = 3 - reach.shape[1]
        reach = np.pad(reach, ((0, 0), (0, missing)), constant_values=-1.0)
        points = np.pad(points, ((0, 0), (0, missing), (0, 0)))
    # The three farthest, in order.
    three = np.argpartition(reach, reach.shape[1] - 3, axis=1)[:, -3:]
    far = np.take_along_axis(reach, three, axis=1)
    order = np.argsort(-far, axis=1)
    three, found["reach"] = np.take_along_axis(three, order, axis=1), np.take_along_axis(far, order, axis=1)
    first, second, third = found["reach"].T
    ends = np.take_along_axis(points, three[:, :2, None], axis=1)
    found["line"] = line = ends[:, 0] - ends[:, 1]
    found["one_taxel"] = found["active"] == 1
    found["coincident"] = ~found["one_taxel"] & (np.hypot(line[:, 0], line[:, 1]) <= NEAR * first)
    found["tie"] = (third >= 0) & (second - third <= NEAR * first)
    angle = np.mod(np.arctan2(line[:, 1], line[:, 0]), np.pi)
    found["orientation"] = np.where(found["one_taxel"] | found["coincident"], np.nan, angle)
    return found


def members(field, column_of):
    """Columns and (u, v) of a field's taxels."""
    columns = [column_of[member["taxel"]] for member in field["members"]]
    uv = np.array([member["uv"] for member in field["members"]]) if field["chart"] else None
    return columns, uv


def main():
    recording, layout, dead_band, out = sys.argv[1:]
    times, pressures, ids = read_pressures(recording, float(dead_band))
    column_of = {taxel: column for column, taxel in enumerate(ids)}
    with open(layout) as file:
        fields = json.load(file)["fields"]
    listed = [[] for _ in times]
    for field in fields:
        columns, uv = members(field, column_of)
        found = of_field(pressures[:, columns], uv)
        head = {"field": field["name"], "link": field["anchor"], "contact": True}
        numbers = zip(*(found[name].tolist() for name in ["frames", "total", "peak", "active"]))
        if uv is None:
            for frame, total, peak, active in numbers:
                listed[frame].append({**head, "total": total, "peak": peak, "active": active, "flags": ["no_chart"]})
            continue
        names = ["centroid", "orientation", "one_taxel", "tie", "coincident"]
        lines = zip(*(found[name].tolist() for name in names))
        for (frame, total, peak, active), (centroid, orientation, *why) in zip(numbers, lines):
            percept = {**head, "total": total, "peak": peak, "active": active, "centroid": centroid}
            if orientation == orientation:
                percept["orientation"] = orientation
            percept["flags"] = [name for name, holds in zip(names[2:], why) if holds]
            listed[frame].append(percept)
    with open(out, "w") as file:
        for number, (t, percepts) in enumerate(zip(times.tolist(), listed)):
            line = {"t": t, "frame": number, "fields": percepts}
            file.write(json.dumps(line, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
