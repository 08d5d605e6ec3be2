"""Pieces of CDR messages: headers, point clouds, and JointStates patched into a template.

rosbags serializes a JointState of 70 names in 80 us, mostly strings that never change. `JointTemplate` lets it do so
once and then only writes the numbers; the bytes are the same.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from ..bags.typestore import STORE


def store_type(msgtype: str) -> Any:
    """Message class of the typestore; made at run time, so no type checker knows its fields."""
    return STORE.types[msgtype]


Time = store_type("builtin_interfaces/msg/Time")
Header = store_type("std_msgs/msg/Header")
JointState = store_type("sensor_msgs/msg/JointState")
PointCloud2 = store_type("sensor_msgs/msg/PointCloud2")
PointField = store_type("sensor_msgs/msg/PointField")
SECOND = 1_000_000_000


def header(time_ns: int, frame_id: str):
    """Header with the exact stamp."""
    return Header(Time(*divmod(time_ns, SECOND)), frame_id)


def header_time(message_header) -> int:
    """Stamp of a header [ns]."""
    return message_header.stamp.sec * SECOND + message_header.stamp.nanosec


def cloud(time_ns: int, frame_id: str, columns: tuple, table: np.ndarray, name: str):
    """PointCloud2 of float32 fields: one point a row of ``table`` [n, len(columns)].

    columns: (name, unit) pairs; name: what to call it in an error. ValueError names a value that is not finite.
    """
    data = np.ascontiguousarray(table, dtype="<f4")
    refuse_not_finite(data, columns, name, time_ns)
    fields = [PointField(label, 4 * k, PointField.FLOAT32, 1) for k, (label, _) in enumerate(columns)]
    step, raw = 4 * len(columns), data.reshape(-1).view(np.uint8)
    return PointCloud2(header(time_ns, frame_id), 1, len(data), fields, False, step, step * len(data), raw, True)


def refuse_not_finite(table: np.ndarray, columns: tuple, name: str, time_ns: int) -> None:
    """ValueError that names the first value of a table [n, columns] that is not finite."""
    if not np.isfinite(table).all():
        row, column = np.argwhere(~np.isfinite(table))[0]
        raise ValueError(
            f"'{columns[column][0]}' of {name}, row {row}, is {table[row, column]} at time {time_ns} ns: "
            f"nothing of this tick is published; the tick must roll back and set NOT_FINITE instead"
        )


def cloud_table(message, columns: tuple) -> np.ndarray:
    """Table [points, len(columns)], float64, of a float32 cloud; fields are found by name, absent ones are NaN."""
    points = message.height * message.width
    raw = np.asarray(message.data).reshape(points, message.point_step) if points else np.zeros((0, 0), np.uint8)
    table = np.full((points, len(columns)), np.nan)
    order = ">f4" if message.is_bigendian else "<f4"
    for field in message.fields:
        for k, (label, _) in enumerate(columns):
            if field.name == label and field.datatype == PointField.FLOAT32 and points:
                table[:, k] = raw[:, field.offset : field.offset + 4].copy().view(order)[:, 0]
    return table


class JointTemplate:
    """CDR bytes of a JointState with fixed names: only the stamp and the numbers are written.

    names: joints; arrays: how many of position, velocity, effort have a number for each joint, the rest are empty.
    One per thread.
    """

    def __init__(self, names: tuple[str, ...], arrays: int) -> None:
        full, empty = np.zeros(len(names)), np.zeros(0)
        message = JointState(header(0, ""), list(names), *[full if k < arrays else empty for k in range(3)])
        self._bytes = bytearray(STORE.serialize_cdr(message, JointState.__msgtype__, little_endian=True))
        self._count = len(names)
        # From the end: an empty array is its length (4 bytes). A full one is its length and its numbers, and the length
        # of the next one sits in 8 bytes, because the numbers after it are aligned to 8.
        block = 8 * self._count
        first = len(self._bytes) - 4 * (3 - arrays) - arrays * block - 8 * (arrays - 1)
        self._starts = [first + k * (block + 8) for k in range(arrays)]
        self._numbers = struct.Struct(f"<{self._count}d")
        self._head = bytes(self._bytes[12:first])

    def write(self, time_ns: int, *numbers: float) -> bytes:
        """Bytes with this stamp; numbers: all of position, then of velocity, then of effort."""
        struct.pack_into("<iI", self._bytes, 4, *divmod(time_ns, SECOND))
        for k, start in enumerate(self._starts):
            self._numbers.pack_into(self._bytes, start, *numbers[k * self._count : (k + 1) * self._count])
        return bytes(self._bytes)

    def read(self, data: bytes) -> tuple[int, np.ndarray] | None:
        """Stamp [ns] and positions of a message with the same names; None if it has others."""
        start = self._starts[0]
        if len(data) != len(self._bytes) or data[:4] != self._bytes[:4] or data[12:start] != self._head:
            return None
        sec, nanosec = struct.unpack_from("<iI", data, 4)
        return sec * SECOND + nanosec, np.frombuffer(data, "<f8", self._count, start)
