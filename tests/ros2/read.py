"""What other programs make of our messages and bags of ROS 2, as JSON.

    read.py messages MESSAGES.json
    read.py bag FOLDER

MESSAGES.json is a list of {"type", "hash", "definition", "bytes"}, bytes as hexadecimal digits. Each message is decoded by
rosbags, mcap-ros2-support and cyclonedds, all by rosbags' own definitions of ROS 2 Jazzy, and written again by each. `hash` is
compared with rosbags' own, and with the one that rosbags computes from `definition`.
"""

import json
import sys
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)


def plain(value):
    """As JSON has it, without the constants of a type."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (np.generic,)):
        return value.item()
    if hasattr(value, "__dataclass_fields__"):
        names = [name for name in value.__dataclass_fields__ if not name.startswith("__")]
    elif hasattr(value, "__slots__"):
        names = list(value.__slots__)
    else:
        return value
    return {name: plain(getattr(value, name)) for name in names if not name.isupper()}


def define(typename, path):
    """Makes the type that a .msg file defines known."""
    STORE.register(get_types_from_msg(Path(path).read_text(), typename))


def cyclonedds_type(typename, known={}):
    """A type of cyclonedds after rosbags' definition."""
    from cyclonedds.idl import make_idl_struct, types

    numbers = {
        "int8": types.int8, "int16": types.int16, "uint16": types.uint16, "int64": types.int64, "uint64": types.uint64,
        "int32": types.int32, "uint32": types.uint32, "float32": types.float32, "float64": types.float64,
        "uint8": types.uint8, "byte": types.uint8, "octet": types.uint8, "char": types.uint8, "bool": bool, "string": str,
    }
    if typename not in known:
        fields = {}
        for name, (kind, detail) in STORE.fielddefs[typename][1]:
            base = lambda kind, detail: numbers[detail[0]] if kind.name == "BASE" else cyclonedds_type(detail)
            if kind.name == "SEQUENCE":
                fields[name] = types.sequence[base(*detail[0])]
            elif kind.name == "ARRAY":
                fields[name] = types.array[base(*detail[0]), detail[1]]
            else:
                fields[name] = base(kind, detail)
        package, _, short = typename.split("/")
        known[typename] = make_idl_struct(short, f"{package}.msg.dds_.{short}_", fields)
    return known[typename]


def by_rosbags(typename, _, data):
    message = STORE.deserialize_cdr(data, typename)
    return plain(message), bytes(STORE.serialize_cdr(message, typename))


def by_mcap_ros2(typename, definition, data):
    from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

    message = generate_dynamic(typename, definition)[typename](data)
    return plain(message), serialize_dynamic(typename, definition)[typename](message)


def by_cyclonedds(typename, _, data):
    message = cyclonedds_type(typename).deserialize(data)
    return plain(message), message.serialize()


def messages(path):
    told = []
    for given in json.loads(Path(path).read_text()):
        typename, data = given["type"], bytes.fromhex(given["bytes"])
        of_rosbags, _ = STORE.generate_msgdef(typename, ros_version=2)
        found = {"type": typename, "decoders": {}}
        for decode in (by_rosbags, by_mcap_ros2, by_cyclonedds):
            values, again = decode(typename, of_rosbags, data)
            # The end of a message may be padded.
            same = again[4:].rstrip(b"\0") == data[4:].rstrip(b"\0") and abs(len(again) - len(data)) < 4
            found["decoders"][decode.__name__] = {"values": values, "same_bytes": same}
        own = get_typestore(Stores.EMPTY)
        own.register(get_types_from_msg(given["definition"], typename))
        found["hash"] = STORE.hash_rihs01(typename) == given["hash"]
        found["hash_of_definition"] = own.hash_rihs01(typename) == given["hash"]
        told.append(found)
    return told


def bag(folder):
    from rosbags.rosbag2 import Reader

    told = {"topics": {}, "times_ns": [], "messages": []}
    with Reader(folder) as reader:
        told["count"], told["duration_ns"], told["start_ns"] = reader.message_count, reader.duration, reader.start_time
        for connection in reader.connections:
            own = get_typestore(Stores.EMPTY)
            own.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            told["topics"][connection.topic] = {
                "type": connection.msgtype,
                "count": connection.msgcount,
                "hash": connection.digest == STORE.hash_rihs01(connection.msgtype) == own.hash_rihs01(connection.msgtype),
            }
        for connection, time_ns, data in reader.messages():
            told["times_ns"].append(time_ns)
            values = plain(STORE.deserialize_cdr(data, connection.msgtype))
            told["messages"].append([connection.topic, time_ns, values])
    # Another reader sees as many.
    from mcap_ros2.reader import read_ros2_messages

    told["by_mcap_ros2"] = sum(1 for path in Path(folder).glob("*.mcap") for _ in read_ros2_messages(path))
    return told


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["messages", path]:
            json.dump(messages(path), sys.stdout)
        case ["bag", folder]:
            json.dump(bag(folder), sys.stdout)
        case _:
            raise SystemExit(__doc__)
