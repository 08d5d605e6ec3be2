"""CDR bytes of a visualization_msgs/MarkerArray. A message object a point costs 1 ms; this, with arrays, a tenth."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

ADD, DELETE = 0, 2
SECOND = 1_000_000_000
NOTHING = np.zeros((0, 3))
_NUMBERS = struct.Struct("<10d4fiI?")  # pose, scale, colour, lifetime, frame_locked


EMPTY = b"\1\0\0\0" + bytes(4)  # a string, with what aligns the next
NO_TEXTURE = EMPTY + bytes(8) + EMPTY + EMPTY + bytes(8)  # resource; header, its frame, format, data; uv_coordinates
NO_MESH = EMPTY + EMPTY + bytes(5)  # resource; name and data of the file; use_embedded_materials


class Drawn(NamedTuple):
    """One marker: what varies of visualization_msgs/Marker."""

    ns: str
    id: int
    kind: int
    position: Sequence[float]
    quaternion: tuple[float, float, float, float]
    scale: tuple[float, float, float]
    color: tuple[float, float, float, float]
    points: np.ndarray = NOTHING  # [n, 3]
    colors: np.ndarray = NOTHING  # [n, 4] or none
    text: str = ""

    @property
    def action(self) -> int:
        """A line without points is taken away: tools complain of it."""
        return DELETE if self.kind in (4, 5) and not len(self.points) else ADD


class _Writer:
    """Bytes of plain little-endian CDR; alignment counts from the fourth byte on."""

    def __init__(self) -> None:
        self.out = bytearray(b"\0\1\0\0")

    def align(self, size: int) -> None:
        self.out += bytes((4 - len(self.out)) % size)

    def pack(self, layout: str, *values) -> None:
        self.align(4)
        self.out += struct.pack("<" + layout, *values)

    def string(self, text: str) -> None:
        data = text.encode() + b"\0"
        self.pack("I", len(data))
        self.out += data

    def array(self, rows: np.ndarray, kind: str, size: int) -> None:
        self.pack("I", len(rows))
        if len(rows):
            self.align(size)
            self.out += np.ascontiguousarray(rows, kind).tobytes()


@cache
def _head(places: int, frame_id: str, ns: str, number: int, kind: int, action: int) -> bytes:
    """From behind the stamp up to the pose; places: bytes of the message before it, modulo 8."""
    w = _Writer()
    w.out += bytes(places)
    begin = len(w.out)
    w.string(frame_id)
    w.string(ns)
    w.pack("3i", number, kind, action)
    w.align(8)
    return bytes(w.out[begin:])


def encode(items: list[Drawn], time: int, frame_id: str, lifetime: int) -> bytes:
    """Bytes of the array; time: ns of every header; lifetime: ns."""
    w = _Writer()
    w.pack("I", len(items))
    for item in items:
        w.pack("iI", *divmod(time, SECOND))
        w.out += _head((len(w.out) - 4) % 8, frame_id, item.ns, item.id, item.kind, item.action)
        w.out += _NUMBERS.pack(
            *item.position, *item.quaternion, *item.scale, *item.color, *divmod(lifetime, SECOND), False
        )
        w.array(item.points, "<f8", 8)
        w.array(item.colors, "<f4", 4)
        w.out += NO_TEXTURE
        w.string(item.text)
        w.align(4)
        w.out += NO_MESH
    return bytes(w.out)
