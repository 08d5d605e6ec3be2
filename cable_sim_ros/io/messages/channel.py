"""What a channel is: one published quantity, live and recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class Context:
    """What a message needs beside the tick output: names of frames, and the namespace of the topics."""

    odom: str = "odom"
    base_link: str = "base_link"
    sheave_link: str = "sheave_link"
    towbody_link: str = "towbody_link"
    namespace: str = "/tow_sim"
    bodies: tuple[float, ...] = ()  # unstretched arc length of each body on the line [m]
    flaps: tuple[tuple[str, int], ...] = ()  # name, and row of the wing of each flap
    vehicle_link: str = "vehicle_link"

    def topic(self, channel: Channel) -> str:
        """Absolute topic of a channel."""
        return f"{self.namespace.rstrip('/')}/{channel.topic}"


class Channel(NamedTuple):
    """One row: name, relative topic, ROS type, function to a message, function back to a dict of fields (None: not read
    back, other channels have all of it), rate [Hz] (0 = every tick), QoS ("reliable", "sensor"); template: makes the
    function to its bytes, in place of one to a message; optional: goes on where its message package is not installed;
    new: bit of readings_new without which a tick has no message."""

    name: str
    topic: str
    msgtype: str
    write: Callable | None
    read: Callable | None
    rate: float = 0.0
    qos: str = "reliable"
    template: Callable | None = None
    optional: bool = False
    new: int = 0

    def every(self, tick_s: float) -> int:
        """Ticks from one message to the next, at least 1."""
        return max(1, round(1.0 / (self.rate * tick_s))) if self.rate else 1
