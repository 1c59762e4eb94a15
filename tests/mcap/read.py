"""Reads a recording with the format's own Python library and says what is in it, as JSON."""

import json
import math
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


class Json:
    def decoder_for(self, encoding, schema):
        return json.loads if encoding == "json" else None


def frame(message):
    missing, present = set(message.missing), list(message.present)
    values = list(message.values)
    if present:
        values = dict(zip(present, values))
    else:
        values = {i: v for i, v in enumerate(values) if i not in missing}
    # What JSON has no number for is faulty.
    return {"t": message.t, "values": {i: None if math.isnan(v) else v for i, v in values.items()},
            "poses": {p.link: list(p.pose) for p in message.poses}}


def points(message):
    fields = {f.name: (f.offset, f.type) for f in message.fields}
    letters = {1: "<B", 7: "<f"}
    rows = []
    for at in range(0, len(message.data), message.point_stride):
        rows.append({name: struct.unpack_from(letters[kind], message.data, at + offset)[0] for name, (offset, kind) in fields.items()})
    return {"frame_id": message.frame_id, "points": rows, "ns": message.timestamp.ToNanoseconds()}


def vector(v):
    return [v.x, v.y, v.z]


def scene(message):
    assert [d.type for d in message.deletions] == [1], "everything before is taken away"
    return [{"id": e.id, "frame_id": e.frame_id, "sphere": vector(e.spheres[0].pose.position),
             "diameter": e.spheres[0].size.x, "arrows": len(e.arrows)} for e in message.entities]


def surface(message):
    return {e.frame_id: [vector(point) for point in e.triangles[0].points] for e in message.entities}


def scalars(message):
    name, field = message
    return {"field": name, "total": field.total, "area": field.area, "ns": field.timestamp.ToNanoseconds()}


def links(message):
    return [{"parent": t.parent_frame_id, "child": t.child_frame_id, "translation": vector(t.translation),
             "rotation": [t.rotation.x, t.rotation.y, t.rotation.z, t.rotation.w]} for t in message.transforms]


said = {"schemas": {}, "frames": [], "percepts": [], "taxels": [], "touches": [], "links": [], "body": [], "fields": []}
decoders = {"frames": frame, "percepts": lambda m: m, "taxels": points, "touches": scene, "links": links, "body": surface, "fields": scalars}
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory(), Json()])
    for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
        name = channel.topic.removeprefix("/somatic/")
        if name.startswith("fields/"):
            name, decoded = "fields", (name.removeprefix("fields/"), decoded)
        said["schemas"][channel.topic] = [schema.name, schema.encoding]
        said[name].append(decoders[name](decoded))
    said["attached"] = {a.name: [a.media_type, len(a.data)] for a in reader.iter_attachments()}
    said["statistics"] = reader.get_summary().statistics.message_count
json.dump(said, sys.stdout)
