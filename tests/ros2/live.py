"""A node of ROS 2 in all but name: cyclonedds with ROS's names of topics and types, by rosbags' definitions.

    live.py receive TOPIC=TYPE:reliable|best_effort[:stamps] ...
    live.py send TOPIC TYPE reliable|best_effort [FILE.msg]
    live.py node NAME COUNT

The domain is that of ROS_DOMAIN_ID. `receive` prints `matched` each time every topic has a writer and `unmatched` each time one
has none, and `received` with the first message, until a line comes on its standard input; then a line of JSON: [topic, when it
came in ns, message] each; with `stamps` the header's stamp in ns is all that is kept of a message. `send` prints `matched` once
its topic has a reader, and sends each line of its standard input, a message as JSON; FILE.msg defines TYPE. `node` waits until the node NAME has COUNT
writers and readers and all are found, and prints as JSON which topics of DDS it writes and reads; then `gone` once it says that
it is no more.
"""

import json
import os
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import read

WITHIN_S = 60

def topic(participant, name, typename, reliability):
    reliable = Policy.Reliability.Reliable(duration(seconds=2))
    qos = Qos(
        {"reliable": reliable, "best_effort": Policy.Reliability.BestEffort}[reliability],
        Policy.Durability.Volatile,
        Policy.History.KeepAll,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
    return Topic(participant, "rt" + name, read.cyclonedds_type(typename), qos=qos), qos


def ns(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def kept(message, only_stamps):
    if not only_stamps:
        return read.plain(message)
    header = message.header if hasattr(message, "header") else message.markers[0].header
    return ns(header.stamp)


def receive(topics):
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    readers = []
    for given in topics:
        name, _, rest = given.partition("=")
        typename, reliability, *how = rest.split(":")
        made, qos = topic(participant, name, typename, reliability)
        readers.append((name, DataReader(participant, made, qos=qos), how == ["stamps"]))
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.readline(), ended.set()), daemon=True).start()
    print("listening", flush=True)
    messages, was_matched = [], False
    until = None
    while until is None or time.monotonic() < until:
        if until is None and ended.is_set():
            # What is on its way still comes.
            until = time.monotonic() + 1.0
        is_matched = all(reader.get_matched_publications() for _, reader, _ in readers)
        if is_matched != was_matched:
            print("matched" if is_matched else "unmatched", flush=True)
            was_matched = is_matched
        found = False
        for name, reader, only_stamps in readers:
            for message in reader.take(N=1000):
                # Where a writer has gone there is a sample without data.
                if hasattr(message, "__dataclass_fields__") and message.sample_info.valid_data:
                    found = True
                    if not messages:
                        print("received", flush=True)
                    messages.append([name, time.time_ns(), kept(message, only_stamps)])
        if not found:
            time.sleep(0.001)
    json.dump(messages, sys.stdout)


def made(kind, values):
    """A message of the type `kind` of cyclonedds, of plain values."""
    from cyclonedds.idl import types

    if isinstance(values, dict):
        hints = kind.__annotations__
        return kind(**{name: made(hints[name], value) for name, value in values.items()})
    if isinstance(values, list):
        inner = kind.__metadata__[0].subtype if hasattr(kind, "__metadata__") else kind
        return [made(inner, value) for value in values]
    return values


def send(name, typename, reliability):
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    kind = read.cyclonedds_type(typename)
    made_topic, qos = topic(participant, name, typename, reliability)
    writer = DataWriter(participant, made_topic, qos=qos)
    while not writer.get_matched_subscriptions():
        time.sleep(0.01)
    print("matched", flush=True)
    for line in sys.stdin:
        writer.write(made(kind, json.loads(line)))
    time.sleep(0.5)


def node(full_name, count):
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription

    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=2)),
        Policy.Durability.TransientLocal,
        # As ROS 2 reads it: it has no keys, and of two nodes the last to tell would be kept.
        Policy.History.KeepAll,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
    kind = read.cyclonedds_type("rmw_dds_common/msg/ParticipantEntitiesInfo")
    told = DataReader(participant, Topic(participant, "ros_discovery_info", kind, qos=qos), qos=qos)
    found = [BuiltinDataReader(participant, kind) for kind in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)]
    topics, entities = {}, None
    until = time.monotonic() + WITHIN_S
    while time.monotonic() < until:
        for reader in found:
            topics.update({sample.key.bytes: sample.topic_name for sample in reader.take(N=1000) if sample.key})
        for message in told.take(N=100):
            if not hasattr(message, "__dataclass_fields__") or not message.sample_info.valid_data:
                continue
            nodes = {f"{own.node_namespace.rstrip('/')}/{own.node_name}": own for own in message.node_entities_info_seq}
            if full_name in nodes:
                own = nodes[full_name]
                entities = [[bytes(gid.data) for gid in gids] for gids in (own.writer_gid_seq, own.reader_gid_seq)]
            elif entities == []:
                return print("gone", flush=True)
        if entities and sum(map(len, entities)) == count and all(gid in topics for gids in entities for gid in gids):
            print(json.dumps([sorted(topics[gid] for gid in gids) for gids in entities]), flush=True)
            entities = []
        time.sleep(0.01)
    raise SystemExit(f"{full_name}: after {WITHIN_S} s it has {entities}")


match sys.argv[1:]:
    case ["receive", *topics]:
        receive(topics)
    case ["send", name, typename, reliability, *definitions]:
        for path in definitions:
            read.define(typename, path)
        send(name, typename, reliability)
    case ["node", name, count]:
        node(name, int(count))
    case _:
        raise SystemExit(__doc__)
