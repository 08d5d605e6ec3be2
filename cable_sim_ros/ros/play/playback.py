"""What both players share: publishers of the messages to send, and the time between these.

The arrival of a message to send is counted from the first [ns]: it is when it is due.
"""

from __future__ import annotations

from ...io.messages.messages import KINDS, Event
from ..topics import message_class

SECOND = 1_000_000_000


def publishers_of(node, items: list[Event]) -> dict:
    """Publishers for the kinds of the items. Reliable is heard by every subscriber, and by the node as best effort."""
    from rclpy.qos import QoSProfile

    return {
        kind: node.create_publisher(message_class(KINDS[kind][0]), KINDS[kind][1], QoSProfile(depth=50))
        for kind in {item.kind for item in items}
    }


def interval(items: list[Event]) -> int:
    """Typical time between messages of the first kind, ns: what a lap adds at its seam."""
    times = [item.arrival for item in items if item.kind == items[0].kind]
    return (times[-1] - times[0]) // max(1, len(times) - 1)
