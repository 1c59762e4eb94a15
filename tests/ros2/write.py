"""Writes a bag of ROS 2 by other programs, of the messages in a file.

    write.py HOW MESSAGES.json BAG

HOW is `rosbags`, a folder with chunks in zstd; `rosbags-file`, which is compressed as a file; `rosbags-message`, each message in
zstd; `rosbags-db3` and `rosbags-db3-message`, the same in SQLite, without compression and with it; `mcap-lz4`, an MCAP file with chunks
in LZ4 without checksums; or `mcap-plain`, one without chunks. MESSAGES.json is a list, in the order in which they came, of
{"topic", "log_ns", "stamp_ns", "name", "position"} for joint states, and {"topic", "log_ns", "stamp_ns", "link", "taxel", "value"}
for clouds of points.
"""

import json
import sys
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)


def message(given):
    """Its type, and the message."""
    stamp = STORE.types["builtin_interfaces/msg/Time"](*divmod(given["stamp_ns"], 1_000_000_000))
    header = STORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id=given.get("link", ""))
    if "name" in given:
        position, none = np.array(given["position"], np.float64), np.array([], np.float64)
        kind = "sensor_msgs/msg/JointState"
        return kind, STORE.types[kind](header, given["name"], position, none, none)
    point = np.dtype([("taxel", "<u2"), ("value", "<f4")])
    points = np.array(list(zip(given["taxel"], given["value"])), point)
    field = STORE.types["sensor_msgs/msg/PointField"]
    fields = [field("taxel", 0, 4, 1), field("value", 2, 7, 1)]
    kind = "sensor_msgs/msg/PointCloud2"
    data = np.frombuffer(points.tobytes(), np.uint8)
    step = point.itemsize
    return kind, STORE.types[kind](header, 1, len(points), fields, False, step, step * len(points), data, True)


def by_rosbags(messages, path, mode, plugin="MCAP"):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    writer = Writer(path, version=9, storage_plugin=StoragePlugin[plugin])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        topics = {}
        for given in messages:
            kind, what = message(given)
            if given["topic"] not in topics:
                topics[given["topic"]] = writer.add_connection(given["topic"], kind, typestore=STORE)
            writer.write(topics[given["topic"]], given["log_ns"], STORE.serialize_cdr(what, kind))


def by_mcap(messages, path, **options):
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file, enable_crcs=False, chunk_size=4096, **options)
        writer.start("ros2", "test")
        topics = {}
        for given in messages:
            kind, what = message(given)
            if given["topic"] not in topics:
                definition, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                topics[given["topic"]] = writer.register_channel(given["topic"], "cdr", schema)
            data = bytes(STORE.serialize_cdr(what, kind))
            writer.add_message(topics[given["topic"]], given["log_ns"], data, given["log_ns"])
        writer.finish()


if __name__ == "__main__":
    from mcap.writer import CompressionType

    how, messages, path = sys.argv[1:]
    messages, path = json.loads(Path(messages).read_text()), Path(path)
    match how:
        case "rosbags":
            by_rosbags(messages, path, "STORAGE")
        case "rosbags-file":
            by_rosbags(messages, path, "FILE")
        case "rosbags-message":
            by_rosbags(messages, path, "MESSAGE")
        case "rosbags-db3":
            by_rosbags(messages, path, "NONE", "SQLITE3")
        case "rosbags-db3-message":
            by_rosbags(messages, path, "MESSAGE", "SQLITE3")
        case "mcap-lz4":
            by_mcap(messages, path, compression=CompressionType.LZ4)
        case "mcap-plain":
            by_mcap(messages, path, use_chunking=False)
        case _:
            raise SystemExit(__doc__)
