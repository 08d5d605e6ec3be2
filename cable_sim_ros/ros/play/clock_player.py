"""Plays the motion of a bag by /clock, for a node in lockstep: nothing is sent by wall time.

What is due is what the clock has come to. The first message goes out as soon as there is a clock, for its stamp decides
what that says next where stamps are kept.

/clock of lockstep: published by one node of a graph, or nobody who listens knows the time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from ...io.messages.messages import Event
from ...terminal import say
from ..graph_monitor import full_name
from ..topics import senders

TOPIC = "/clock"
SECOND = 1_000_000_000
DISCOVERY = 1.0  # s from the making of a node, in which it learns of others on its host

SETTLE = 0.3  # s; the other side may learn of us a little later than we of it
PATIENCE = 5.0  # s without a clock, after which it is said


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


def publishers_of(node, items: list[Event]) -> dict:
    """Publishers for the kinds of the items. Reliable is heard by every subscriber, and by the node as best effort."""
    return senders(node, {item.kind for item in items}, QoSProfile(depth=50))


def interval(items: list[Event]) -> int:
    """Typical time between messages of the first kind, ns: what a lap adds at its seam."""
    times = [item.arrival for item in items if item.kind == items[0].kind]
    return (times[-1] - times[0]) // max(1, len(times) - 1)


class Follower:
    """Which items are due at a clock [ns]; `shift` is added to their stamps. Items are those of `player.load`."""

    def __init__(self, items: list[Event], keep_stamps: bool = False, loop: bool = False) -> None:
        stamps = [item.stamp or 0 for item in items]
        first = stamps[0]
        # an odd stamp goes with its time in the bag
        timed = (
            (stamp if abs(stamp - first - i.arrival) <= SECOND else first + i.arrival, n, i)
            for n, (stamp, i) in enumerate(zip(stamps, items))
        )
        self._items = sorted(timed)
        self._length = self._items[-1][0] - first + interval(items)
        self._loop, self._keep = loop, keep_stamps
        self.shift: int | None = 0 if keep_stamps else None
        self._next = 0
        self._clock: int | None = None
        self._begun = False
        self.played = 0  # ns of the bag

    @property
    def done(self) -> bool:
        """Has all been given?"""
        return self._next >= len(self._items)

    def due(self, clock: int) -> list[tuple[Event, int]]:
        """The items that the clock has come to since the call before, with what to add to their stamps."""
        at = self._items[self._next][0] if not self.done else 0
        again = self._clock is not None and clock < self._clock - SECOND  # the node began again: the bag goes on
        if self.shift is None or (again and not self._keep):
            self.shift = clock - at
        elif again:
            self._begun = False
        self._clock = clock
        found = []
        while not self.done and (not self._begun or self._items[self._next][0] + self.shift <= clock):
            at, _, item = self._items[self._next]
            found.append((item, self.shift))
            self.played = at - self._items[0][0]
            self._begun = True
            self._next += 1
            if self._loop and self._next == len(self._items):
                self._next = 0
                self.shift += self._length
        return found


def play_by_clock(node, items: list[Event], *, loop: bool, keep_stamps: bool, alive: Callable, progress) -> int:
    """Send the items as /clock comes to their stamps; returns how many were sent. progress(seconds played)."""
    publishers, follower = publishers_of(node, items), Follower(items, keep_stamps, loop)
    received: list[int] = []

    def hear(message: Clock) -> None:
        received[:] = [message.clock.sec * SECOND + message.clock.nanosec]

    node.create_subscription(Clock, TOPIC, hear, QoSProfile(depth=1))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    sent, begun, said = 0, time.monotonic(), False
    ready: float | None = None
    while alive() and not follower.done:
        executor.spin_once(timeout_sec=0.1)
        now = time.monotonic()
        if not received:
            if now - begun > PATIENCE and not said:
                said = True
                say(f"no {TOPIC} yet: start the node with -p time_mode:=lockstep", err=True)
            continue
        if ready is None:
            if all(publisher.get_subscription_count() for publisher in publishers.values()):
                ready = now + SETTLE
            continue
        if now < ready:
            continue
        for item, shift in follower.due(received[0]):
            publishers[item.kind].publish((item.moved(shift) if shift else item).data)
            sent += 1
        progress(follower.played / SECOND)
    for publisher in publishers.values():
        publisher.wait_for_all_acked()
    executor.shutdown()
    return sent
