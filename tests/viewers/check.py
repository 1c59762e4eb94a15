"""Reads a recording as viewers do, and says what they would show; fails where that is not what lies in it."""

import math
import struct
import sys

from foxglove_schemas_protobuf import FrameTransforms_pb2, PointCloud_pb2, SceneUpdate_pb2
from google.protobuf import descriptor_pb2, descriptor_pool
from mcap.reader import make_reader
from rerun.chunk import McapReader

PUBLISHED = {
    "foxglove.PointCloud": PointCloud_pb2.PointCloud,
    "foxglove.SceneUpdate": SceneUpdate_pb2.SceneUpdate,
    "foxglove.FrameTransforms": FrameTransforms_pb2.FrameTransforms,
}


def shape(message, seen):
    """Every field of a message and of those within it: what decides how bytes are read."""
    if message.full_name in seen:
        return
    fields = seen.setdefault(message.full_name, {})
    for field in message.fields:
        of = field.message_type or field.enum_type
        values = tuple((v.name, v.number) for v in field.enum_type.values) if field.enum_type else None
        fields[field.number] = (field.name, field.type, field.is_repeated, of and of.full_name, values)
        if field.message_type:
            shape(field.message_type, seen)


def checked(schema):
    """Whether the schema that lies in the file is the published one."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    ours, theirs = {}, {}
    shape(pool.FindMessageTypeByName(schema.name), ours)
    shape(PUBLISHED[schema.name].DESCRIPTOR, theirs)
    for name, fields in ours.items():
        for number, field in fields.items():
            assert theirs[name].get(number) == field, (name, number, field, theirs[name].get(number))
        for number in theirs[name].keys() - fields.keys():
            print(f"  {name}.{theirs[name][number][0]} is published, and not checked here")
    print(f"{schema.name}: {len(ours)} messages as Foxglove publishes them")


def messages(path):
    """Topics with their messages, decoded by the published schemas."""
    said, known = {}, set()
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if schema.name in PUBLISHED:
                if schema.name not in known:
                    checked(schema)
                    known.add(schema.name)
                decoded = PUBLISHED[schema.name].FromString(message.data)
                said.setdefault(channel.topic, []).append((message.log_time, decoded))
    assert known == PUBLISHED.keys(), known
    return said


def points(cloud):
    """Places, and colours as Rerun has them."""
    at = {field.name: field.offset for field in cloud.fields}
    rows = [cloud.data[i:i + cloud.point_stride] for i in range(0, len(cloud.data), cloud.point_stride)]
    places = [[struct.unpack_from("<f", row, at[axis])[0] for axis in "xyz"] for row in rows]
    parts = ("red", "green", "blue", "alpha")
    return places, [int.from_bytes(bytes(row[at[part]] for part in parts), "big") for row in rows]


said = messages(sys.argv[1])
rows, fields = {}, {}
for chunk in McapReader(sys.argv[1]).stream():
    listed = chunk.to_record_batch().to_pylist()
    if any(name.startswith(("Points3D", "Transform3D")) for name in (listed[0] if listed else [])):
        rows.setdefault(chunk.entity_path, []).extend(listed)
    if str(chunk.entity_path).startswith("/somatic/fields/"):
        fields.setdefault(str(chunk.entity_path), []).extend(listed)

clouds, shown = said["/somatic/taxels"], rows["/somatic/taxels"]
assert len(shown) == len(clouds) > 50
for row, (time, cloud) in zip(shown, clouds):
    places, colours = points(cloud)
    assert row["Points3D:positions"] == places and row["Points3D:colors"] == colours
    assert row["CoordinateFrame:frame"] == [cloud.frame_id] == ["world"]
many = {colour for row in shown for colour in row["Points3D:colors"]}
assert len(many) > 20, "what is pressed has another colour"
surfaces = [entity for _, update in said["/somatic/body"] for entity in update.entities]
corners = {entity.frame_id: len(entity.triangles[0].points) for entity in surfaces}
assert len(surfaces) == 5 and all(count > 0 and count % 3 == 0 for count in corners.values()), corners
print(f"the surfaces of {', '.join(corners)} lie in the recording, {sum(corners.values()) // 3} triangles in all")
# One row more describes the channel.
hand = [row for row in fields["/somatic/fields/hand"] if "message_log_time" in row]
totals = [row["somatic.Field:message"][0]["total"] for row in hand]
# Of every frame of the bundled touch.
assert len(totals) == 280 and max(totals) > 100 and min(totals) == 0, totals
print(f"Rerun lists {len(totals)} totals of the field hand, up to {max(totals)}")
print(f"Rerun shows {len(clouds)} clouds of {len(places)} taxels, in {len(many)} colours")

told = [(link.parent_frame_id, link.child_frame_id, [link.translation.x, link.translation.y, link.translation.z])
        for _, links in said["/somatic/links"] for link in links.transforms]
shown = [(row["Transform3D:parent_frame"][0], row["Transform3D:child_frame"][0], row["Transform3D:translation"][0])
         for row in rows["/somatic/links"]]
assert len(told) == len(shown) > 5
for (parent, child, place), (above, below, at) in zip(told, shown):
    assert (parent, child) == (above, below) and math.dist(place, at) < 1e-6, (parent, child, place, above, below, at)
print(f"Rerun knows {len({child for _, child, _ in told})} links in `{told[0][0]}`")

frames = {child for _, child, _ in told} | {"world"}
entities = [entity for _, update in said["/somatic/touches"] for entity in update.entities]
assert entities and all(entity.frame_id in frames for entity in entities), "every touch is in a frame that is told"
assert all(entity.spheres for entity in entities)
arrows = sum(len(entity.arrows) for entity in entities)
print(f"Foxglove reads {len(entities)} touches, {arrows} with an arrow, each in a frame that is told")
