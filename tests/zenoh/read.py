"""Reads what limbs send, with Zenoh's own package and what docs/reference/limbs.md says: a line of JSON for each packet."""

import json
import struct
import sys
import time

import zenoh


def packet(payload: bytes) -> dict:
    if payload[:1] == b"{":
        return json.loads(payload) | {"kind": "percepts"}
    version, kind, boot, zero, sequence, time_us = struct.unpack_from("<BBBBII", payload)
    assert (version, zero) == (1, 0), payload
    told = {"boot": boot, "sequence": sequence, "time_us": time_us}
    if kind == 1:
        layout, *values = struct.unpack_from(f"<I{(len(payload) - 16) // 4}f", payload, 12)
        return told | {"kind": "frame", "layout": layout, "values": values}
    if kind == 2:
        return told | {"kind": "layout", "taxels": struct.unpack_from(f"<{(len(payload) - 12) // 4}I", payload, 12)}
    assert kind == 3, payload
    return told | {"kind": "end"}


session = zenoh.open(zenoh.Config.from_file(sys.argv[1]))


def read(sample: zenoh.Sample) -> None:
    told = {"key": str(sample.key_expr)} | packet(sample.payload.to_bytes())
    print(json.dumps(told), flush=True)


subscriber = session.declare_subscriber("robot/**", read)
print(json.dumps({"kind": "listening"}), flush=True)
time.sleep(float(sys.argv[2]))
session.close()
