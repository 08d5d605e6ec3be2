"""/clock of lockstep: published by one node of a graph, or nobody who listens knows the time."""

from __future__ import annotations

import time
from typing import Any

from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from ..graph_monitor import full_name

TOPIC = "/clock"
SECOND = 1_000_000_000
DISCOVERY = 1.0  # s from the making of a node, in which it learns of others on its host


class ClockTaken(RuntimeError):
    """Another node publishes /clock."""


class ClockTopic:
    """Publisher of /clock, from `open` to `close`; in real time none."""

    def __init__(self, node) -> None:
        self.node = node
        self.publisher: Any = None
        self._made = time.monotonic()
        self._message = Clock()

    def open(self, session) -> None:
        """Publish the clock of a session in lockstep. Raises ClockTaken where another node does."""
        if not session.lockstep:
            return
        while not (others := self.taken()) and time.monotonic() - self._made < DISCOVERY:
            time.sleep(0.05)
        if others:
            raise ClockTaken(others)
        self.publisher = self.node.create_publisher(Clock, TOPIC, QoSProfile(depth=1))
        session.publish_clock = self.publish

    def publish(self, clock: int) -> None:
        """Say the time, ns."""
        stamp = self._message.clock
        stamp.sec, stamp.nanosec = divmod(clock, SECOND)
        self.publisher.publish(self._message)

    def taken(self) -> str:
        """Who else publishes /clock, in words; "" where nobody does."""
        own = 0 if self.publisher is None else 1
        if self.node.count_publishers(TOPIC) <= own:
            return ""
        name = full_name(self.node.get_name(), self.node.get_namespace())
        found = [full_name(i.node_name, i.node_namespace) for i in self.node.get_publishers_info_by_topic(TOPIC)]
        if name in found and own:
            found.remove(name)
        if not found:
            return ""
        return (
            f"{TOPIC} is also published by {', '.join(sorted(found))}: in lockstep this node is the clock, and two "
            f"clocks are none; end the other (a bag is played without --clock), or use time_mode:=realtime"
        )

    def close(self) -> None:
        """Publish no more."""
        if self.publisher is not None:
            self.node.destroy_publisher(self.publisher)
            self.publisher = None
