"""Bags of others, made here: ROS 1 record by record, SQLite as rosbag2 lays it out, MCAP by its library."""

import json
import sqlite3
import struct

import lz4.frame
import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SECOND = 1_000_000_000
START = 1_406_851_200 * SECOND
u32 = struct.Struct("<I").pack
LOAD_PIN = "std_msgs/Header header\nfloat64 tension\nuint8[3] flags\nfloat32[] raw\n"


def store(ros_version=2):
    """ROS types with one of a user's own, rig_msgs/msg/LoadPin."""
    made = get_typestore(Stores.ROS2_JAZZY if ros_version == 2 else Stores.ROS1_NOETIC)
    made.register(get_types_from_msg(LOAD_PIN, "rig_msgs/msg/LoadPin"))
    return made


def header(types, k, ros_version=2):
    """Stamped 20 ms before START + k tenths of a second."""
    time = types["builtin_interfaces/msg/Time"](1_406_851_199 + (k + 9) // 10, (k + 9) % 10 * 100_000_000 + 80_000_000)
    first = () if ros_version == 2 else (k,)
    return types["std_msgs/msg/Header"](*first, time, "rig")


def load_pin(types, k, ros_version=2):
    raw = np.arange(k % 3, dtype=np.float32)
    kind = types["rig_msgs/msg/LoadPin"]
    return kind(header(types, k, ros_version), 1000.0 + k, np.array([1, 2, 3], np.uint8), raw)


def joint_state(types, k, names):
    values = np.arange(float(len(names))) + k
    kind = types["sensor_msgs/msg/JointState"]
    return kind(header(types, k), list(names), values, values[:0], values[:0])


def ros1_record(fields, data):
    head = b"".join(u32(len(key) + 1 + len(value)) + key.encode() + b"=" + value for key, value in fields.items())
    return u32(len(head)) + head + u32(len(data)) + data


def ros1_bag(messages, definitions, compression=b"none", chunk=8, indexed=True):
    """Bytes of a ROS 1 bag; messages: (topic, type, ns, data); definitions: type -> text."""
    numbers, chunks = {}, []
    for at in range(0, len(messages), chunk):
        inner = b""
        for topic, kind, time, data in messages[at : at + chunk]:
            if topic not in numbers:
                numbers[topic] = len(numbers)
                said = {"topic": topic.encode(), "type": kind.encode(), "md5sum": b"*" * 32}
                body = ros1_record(said | {"message_definition": definitions[kind].encode()}, b"")
                body = body[4:-4]  # fields only
                inner += ros1_record({"op": b"\x07", "conn": u32(numbers[topic]), "topic": topic.encode()}, body)
            stamp = struct.pack("<II", time // SECOND, time % SECOND)
            inner += ros1_record({"op": b"\x02", "conn": u32(numbers[topic]), "time": stamp}, data)
        packed = lz4.frame.compress(inner) if compression == b"lz4" else inner
        chunks.append(ros1_record({"op": b"\x05", "compression": compression, "size": u32(len(inner))}, packed))
    place = 13 + 4096 + sum(map(len, chunks))
    index_at = struct.pack("<Q", place if indexed else 0)
    counts = {"conn_count": u32(len(numbers)), "chunk_count": u32(len(chunks))}
    head = ros1_record({"op": b"\x03", "index_pos": index_at} | counts, b"")
    filling = 4096 - len(head)
    head = head[:-4] + u32(filling) + b" " * filling
    index = b"".join(ros1_record({"op": b"\x06", "ver": u32(1)}, b"") for _ in chunks) if indexed else b""
    return b"#ROSBAG V2.0\n" + head + b"".join(chunks) + index


def sqlite_bag(path, messages, definitions):
    """A database of rosbag2, schema 4; messages: (topic, type, ns, data)."""
    database = sqlite3.connect(path)
    database.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT,"
        " offered_qos_profiles TEXT, type_description_hash TEXT);"
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT,"
        " encoded_message_definition TEXT, type_description_hash TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    )
    numbers = {}
    for topic, kind, time, data in messages:
        if topic not in numbers:
            numbers[topic] = len(numbers) + 1
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '', '')", (numbers[topic], topic, kind))
        database.execute(
            "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", (numbers[topic], time, bytes(data))
        )
    for kind, text in definitions.items():
        database.execute("INSERT INTO message_definitions VALUES (NULL, ?, 'ros2msg', ?, '')", (kind, text))
    database.commit()
    database.close()


def mcap_bag(path, messages, definitions, encoding="cdr", schema_encoding="ros2msg"):
    """An MCAP file; messages: (topic, type, ns, data)."""
    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=1024, compression=CompressionType.ZSTD)
        writer.start()
        schemas, channels = {}, {}
        for topic, kind, time, data in messages:
            if kind not in schemas:
                schemas[kind] = writer.register_schema(kind, schema_encoding, definitions.get(kind, "").encode())
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, encoding, schemas[kind])
            writer.add_message(channels[topic], time, bytes(data), time)
        writer.finish()


def load_pins(n, ros_version=2):
    """Messages of the user's own type and its definition, for the three above."""
    types = store(ros_version)
    kind = "rig_msgs/msg/LoadPin" if ros_version == 2 else "rig_msgs/LoadPin"
    write = types.serialize_cdr if ros_version == 2 else types.serialize_ros1
    text = types.generate_msgdef("rig_msgs/msg/LoadPin", ros_version=ros_version)[0]
    pins = (write(load_pin(types.types, k, ros_version), "rig_msgs/msg/LoadPin") for k in range(n))
    return [("/load_pin", kind, START + k * SECOND // 10, bytes(pin)) for k, pin in enumerate(pins)], {kind: text}


def json_messages(n):
    fish = [{"timestamp": {"sec": 5 + k, "nsec": 7}, "depth": 1.5 * k, "ok": True, "name": "a"} for k in range(n)]
    return [("/fish", "rig.Fish", START + k * SECOND, json.dumps(one).encode()) for k, one in enumerate(fish)]
