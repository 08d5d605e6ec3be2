"""Recorded bags as input: motion and commands in order of arrival, and what the bag recorded of the tow.

Inputs are found by `messages.find_topics`. Stamps are those of the messages' headers, arrivals the log times of the
bag. Commands are taken in as the live node does: same decoder, same ingest, same map of arrivals to the clock of the
motion (`io.clock`), so that the same are refused and the others count from the same time.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..physics.heave import Heave, MotionInput
from ..physics.inputs import MOTION_ROWS, Inputs
from ..sim.scene import Scene
from .bag import BagError, read_bag, read_metadata
from .bag_motion import read_motion
from .channels import CHANNELS, channel_of, decode, decode_frames
from .clock import DataClock
from .commands import NEVER, CommandIngest
from .messages import KINDS, stamp_of
from .motion import MotionIngest


class Event(NamedTuple):
    """One input message: stamp of its header and time of arrival [ns], kind (imu, odometry, command), CDR bytes."""

    time: int
    arrival: int
    kind: str
    data: bytes


@dataclass
class RecordedTow:
    """A bag read once: input events in order of arrival, recorded outputs by channel, what the bag says of itself."""

    path: str
    events: list[Event]
    outputs: dict[str, list[bytes]] = field(default_factory=dict)  # name of the channel -> messages in order
    about: dict[str, str] = field(default_factory=dict)  # custom data of the bag

    @cached_property
    def start(self) -> int:
        """Stamp of the first motion message, ns."""
        return min(event.time for event in self.events if event.kind != "command")

    @cached_property
    def end(self) -> int:
        """Stamp of the last motion message, ns."""
        return max(event.time for event in self.events if event.kind != "command")

    @cached_property
    def rate(self) -> float:
        """Motion messages per second."""
        count = sum(event.kind != "command" for event in self.events)
        return count / max(1e-9, (self.end - self.start) * 1e-9)

    def started(self) -> tuple[int, tuple[float, float], float] | None:
        """Time [ns], place [m] and heading [rad] of the recorded static start, None where the bag does not say."""
        try:
            return (
                int(self.about["start_time_ns"]),
                tuple(json.loads(self.about["start_position_m"])),
                float(self.about["start_heading_rad"]),
            )
        except (KeyError, ValueError):
            return None


def read_tow(path: str | os.PathLike, *, imu_only: bool = False) -> RecordedTow:
    """Read a bag. imu_only: leave odometry out. BagError if it cannot be read or holds no motion."""
    path = os.fspath(path)
    events = [
        Event(stamp_of(data) or time, time, kind, data)
        for time, kind, data in read_motion(path)
        if not (imu_only and kind == "odometry")
    ]
    if not any(event.kind != "command" for event in events):
        raise BagError(
            f"bag '{path}' holds no {KINDS['imu'][0]}: nothing was simulated; leave --imu-only out, or give "
            "a bag with an IMU"
        )
    outputs: dict[str, list[bytes]] = {}
    try:
        about = read_metadata(path).get("custom_data") or {}
        for message in read_bag(path):
            channel = channel_of(message.topic, message.msgtype)
            if channel is not None:
                outputs.setdefault(channel.name, []).append(message.data)
    except BagError:  # a lone file or one of ROS 1 can hold nothing of ours
        about = {}
    return RecordedTow(path, events, outputs, about)


class Feeder:
    """Pushes the events of a bag into the rings, in order, up to a time.

    `ingest` and `commands` count what they refuse. Motion that a live node drops because its stamp is off the clock is
    taken here, as a bag's log times need not be arrivals; it does not move the clock.
    """

    def __init__(
        self,
        inputs: Inputs,
        tow: RecordedTow,
        scene: Scene,
        motion: MotionInput | None = None,
        heave: Heave | None = None,
    ) -> None:
        self.ingest = MotionIngest(inputs, scene.ship, heave or Heave(), motion, scene.gravity)
        self.commands = CommandIngest(inputs)
        self.clock = DataClock()
        self.inputs, self.tow = inputs, tow
        self._next = 0

    @property
    def done(self) -> bool:
        """True when every event has been pushed."""
        return self._next >= len(self.tow.events)

    def until(self, time_ns: int, newest: int | None = None) -> list[Event]:
        """Push every event up to this time, but no motion after the sample `newest` [ns]; returns them.

        The time of motion is its stamp, that of a command its arrival on the clock of the motion.
        """
        first = self._next
        events = self.tow.events
        while self._next < len(events) and self._due(events[self._next]) <= time_ns:
            event = events[self._next]
            if newest is not None and event.kind != "command" and self._newest() >= newest:
                break  # a command in a gap of the motion still comes in the gap
            self._next += 1
            if event.kind == "command":
                self.commands.take(event.data, event.arrival, self.clock.now(event.arrival))
            else:
                self._motion(event)
        return events[first : self._next]

    def _newest(self) -> int:
        head = int(self.inputs.motion_head[0])
        return int(self.inputs.motion_time[(head - 1) % MOTION_ROWS]) if head else NEVER

    def _due(self, event: Event) -> int:
        if event.kind != "command":
            return event.time
        now = self.clock.now(event.arrival)
        return NEVER if now is None else now

    def _motion(self, event: Event) -> None:
        stamp = stamp_of(event.data) or 0
        off = stamp != 0 and self.clock.suspicious(stamp, event.arrival)
        if off and self.clock.jumped(stamp, event.arrival):
            self.clock.reset()
            self.commands.reset()
        before = self._newest()
        self.ingest.take(event.kind, event.data, event.arrival)
        if self._newest() != before and not off:
            self.clock.update(self._newest(), event.arrival)


class Residual(NamedTuple):
    """Ours less what the bag recorded, of one quantity: mean, RMS and largest magnitude over `count` times."""

    channel: str
    quantity: str
    unit: str
    mean: float
    rms: float
    largest: float
    count: int  # type: ignore[assignment]  # a tuple's own count() is not used here


COMPARED = (  # channel, quantity, unit, field of the Frame, component or None
    ("sheave/tension", "tension", "N", "tension", None),
    ("towbody/pose", "x", "m", "body_position", 0),
    ("towbody/pose", "y", "m", "body_position", 1),
    ("towbody/pose", "z", "m", "body_position", 2),
    ("winch/state", "payout", "m", "payout", None),
    ("winch/state", "payout rate", "m/s", "payout_rate", None),
    ("winch/state", "tension at the drum", "N", "tension_drum", None),
)
CHANNEL_NAMES = {"sheave/tension": "sheave_tension", "towbody/pose": "towbody_pose", "winch/state": "winch_state"}


def residuals(frames: np.recarray, tow: RecordedTow) -> list[Residual]:
    """What the bag recorded of the tow against the simulated Frames, at equal stamps (ours interpolated linearly).

    Only the time both cover counts. A channel that the bag lacks has no row.
    """
    table = {channel.name: channel for channel in CHANNELS}
    decoded: dict[str, list[dict]] = {}
    rows = []
    ours_time = frames["time"].astype(np.int64)
    for topic, quantity, unit, name, part in COMPARED:
        channel = table[CHANNEL_NAMES[topic]]
        messages = tow.outputs.get(channel.name)
        if not messages:
            continue
        if channel.name not in decoded:
            decoded[channel.name] = [decode(channel, data) for data in messages]
        theirs = decoded[channel.name]
        time = np.array([fields["time"] for fields in theirs], np.int64)
        value = np.array([fields[name] if part is None else fields[name][part] for fields in theirs], float)
        both = (time >= ours_time[0]) & (time <= ours_time[-1])
        if not both.any():
            continue
        ours = frames[name] if part is None else frames[name][:, part]
        origin = ours_time[0]  # differences of nanoseconds are exact in float64, the stamps are not
        rest = np.interp((time[both] - origin).astype(float), (ours_time - origin).astype(float), ours) - value[both]
        rows.append(
            Residual(
                topic,
                quantity,
                unit,
                float(rest.mean()),
                float(np.sqrt(np.mean(rest**2))),
                float(np.abs(rest).max()),
                int(both.sum()),
            )
        )
    return rows


def late_ticks(frames: np.recarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Times of recorded ticks that had no motion sample after them, and the newest one's stamp, int64 ns."""
    if frames is None:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    late = frames[(frames["motion_age"] >= 0.0) & (frames["motion_source"] > 0)]  # source 0: none yet
    time = late["time"].astype(np.int64)
    return time, time - np.round(late["motion_age"] * 1e9).astype(np.int64)


def recorded_frames(tow: RecordedTow) -> np.recarray | None:
    """The Frames the bag recorded (``sim/health``), None if it has none."""
    messages = tow.outputs.get("sim_health")
    return decode_frames(messages) if messages else None
