"""Compares a table in Parquet with the NDJSON of the same run, value for value, in pyarrow and in polars.

compare.py PERCEPTS.parquet PERCEPTS.ndjson [TOUCHES.parquet]
"""

import json
import struct
import sys

import polars
import pyarrow.parquet

VECTORS = {2: "uv", 3: "xyz"}
LISTS = ("flags", "links", "fields", "taxels")


def flat(field):
    """A field's object of NDJSON as a row: a key for each component."""
    row = {}
    for key, value in field.items():
        if key == "touches":
            continue
        if key == "spread":
            row.update(zip(("spread_along", "spread_across"), value))
        elif key in LISTS:
            row[key] = [str(name) for name in value]
        elif isinstance(value, list):
            row.update({f"{key}_{VECTORS[len(value)][i]}": v for i, v in enumerate(value)})
        else:
            row[key] = value
    return row


def single(number):
    return struct.unpack("f", struct.pack("f", number))[0]


def rows_of(lines):
    percepts, touches = [], []
    for line in lines:
        for field in line["fields"]:
            percepts.append({"t": line["t"], "frame": line["frame"]} | flat(field))
        for touch in line.get("touches", []):
            touches.append({"t": line["t"], "frame": line["frame"], "touch": touch.pop("id")} | flat(touch))
    return percepts, touches


def compare(path, wanted):
    table = pyarrow.parquet.read_table(path)
    singles = {field.name for field in table.schema if pyarrow.types.is_float32(field.type)}
    for row in wanted:
        assert row.keys() <= set(table.column_names), row.keys() - set(table.column_names)
    for name, read in (("pyarrow", table.to_pylist()), ("polars", polars.read_parquet(path).to_dicts())):
        assert len(read) == len(wanted), (name, len(read), len(wanted))
        for got, want in zip(read, wanted):
            for column, value in got.items():
                expected = want.get(column)
                if column in singles and expected is not None:
                    expected = single(expected)
                assert value == expected, (name, column, value, expected, want)
    return table


def main():
    parquet, ndjson, *more = sys.argv[1:]
    with open(ndjson) as file:
        percepts, touches = rows_of([json.loads(line) for line in file])
    table = compare(parquet, percepts)
    if more:
        compare(more[0], touches)
        assert touches, "there is no touch to compare"
    about = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    print(json.dumps({
        "rows": table.num_rows,
        "about": about,
        "units": {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in table.schema},
        "types": {field.name: str(field.type) for field in table.schema},
    }))


main()
