"""What both players share: a message to send, its publishers, its stamp moved."""

from __future__ import annotations

import struct
from typing import NamedTuple

from ...io.messages.messages import KINDS
from ..topics import message_class

SECOND = 1_000_000_000


class Item(NamedTuple):
    """One message to send: time from the first [ns], kind (imu, odometry), CDR bytes, its stamp [ns]."""

    due: int
    kind: str
    data: bytes
    stamp: int


def restamped(item: Item, shift: int) -> bytes:
    """The message with its stamp moved by shift [ns]."""
    data = bytearray(item.data)
    struct.pack_into("<iI", data, 4, *divmod(item.stamp + shift, SECOND))
    return bytes(data)


def publishers_of(node, items: list[Item]) -> dict:
    """Publishers for the kinds of the items. Reliable is heard by every subscriber, and by the node as best effort."""
    from rclpy.qos import QoSProfile

    return {
        kind: node.create_publisher(message_class(KINDS[kind][0]), KINDS[kind][1], QoSProfile(depth=50))
        for kind in {item.kind for item in items}
    }


def interval(items: list[Item]) -> int:
    """Typical time between messages of the first kind, ns: what a lap adds at its seam."""
    times = [item.due for item in items if item.kind == items[0].kind]
    return (times[-1] - times[0]) // max(1, len(times) - 1)
