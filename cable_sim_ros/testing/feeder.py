"""Sends motion as sensors would: at the pace of the wall clock, or in lockstep as /clock comes to its stamps.

Motion for a node under test, as messages with stamps: of a bag, a CSV table, a sinusoidal heave, or samples.
"""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TowError
from ..io.messages.commands import as_joint_state
from ..io.messages.messages import Event
from ..io.scenes.document import find_bag
from ..io.sources.motion_table import MotionWarning, Samples, odometry_events, read_table, sine_heave
from ..io.sources.recorded_tow import at_speed, read_tow
from ..sim.inputs import ShipMotion
from ..sim.scene import Ship
from .arguments import number, refused

SECOND = 1_000_000_000
INPUTS = ("imu", "odometry", "command", "flaps")  # in this order at one stamp
Source = str | os.PathLike | Sequence[ShipMotion]

AHEAD = SECOND // 50  # ns from now to the first message in real time


def messages(
    source: Source | None,
    ship: Ship,
    *,
    heave: tuple[float, float] | None = None,
    start: float = 0.0,
    duration: float | None = None,
    imu_only: bool = False,
    commands: bool = False,
) -> list[Event]:
    """Messages in order of their stamps. TowError when there are none, or for what cannot be used.

    source: bag (path or name of a shipped one), CSV file, or samples; heave: (m, s) in place of it; ship: of the scene;
    start, duration: part of it, s; commands: those of the bag too.
    """
    if (source is None) == (heave is None):
        raise TowError("give one source of motion: a bag, a CSV file, samples, or heave=(m, s); nothing was sent")
    start = number("start", start, "s", "nothing was sent", "leave it out to begin with the first message", minimum=0.0)
    if duration is not None:
        duration = number("duration", duration, "s", "nothing was sent", "leave it out for all the motion of a source")
    with refused():
        events = _events(source, ship, heave, start, duration, imu_only)
    kept = [as_joint_state(event) for event in events if commands or not event.is_command]
    kept = [event for event in kept if not (imu_only and event.kind == "odometry")]
    kept.sort(key=lambda event: (event.time, INPUTS.index(event.kind)))
    motion = [event.time for event in kept if not event.is_command]
    first = (motion[0] if motion else 0) + round(start * SECOND)
    last = first + round(duration * SECOND) if duration is not None else 2**63 - 1
    found = [event._replace(stamp=event.time) for event in kept if first <= event.time <= last]
    if all(message.is_command for message in found):
        raise TowError(f"no motion in the part asked for (from {start:g} s on): nothing was sent")
    return found


def _events(source: Any, ship: Ship, heave: Any, start: float, duration: float | None, imu_only: bool) -> list[Event]:
    if heave is not None:
        try:
            amplitude, period = (float(part) for part in heave)
        except (TypeError, ValueError):
            raise TowError(
                f"heave = {heave!r} is no pair of numbers: nothing was sent; give heave=(amplitude in m, period in s)"
            ) from None
        if duration is None:
            raise TowError("heave needs duration=... in s: nothing was sent")
        return sine_heave(amplitude, period, start + duration, ship).events
    if isinstance(source, (str, os.PathLike)):
        if Path(source).suffix.lower() == ".csv":
            table = read_table(source, ship)
            for doubt in table.doubts:
                warnings.warn(doubt.text, MotionWarning, stacklevel=4)
            return table.events
        tow = read_tow(find_bag(os.fspath(source)), imu_only=imu_only)
        return at_speed(tow.events, tow.about, ship.tow_speed)
    return _of_samples(source)


def _of_samples(source: Any) -> list[Event]:
    try:
        samples = list(source)
    except TypeError:
        raise TowError(
            f"source = {source!r} is no motion: nothing was sent; give a bag or a CSV file by its path, the name of a "
            f"shipped bag, or a sequence of cable_sim_ros.ShipMotion"
        ) from None
    for k, sample in enumerate(samples):
        if not isinstance(sample, ShipMotion):
            raise TowError(
                f"source[{k}] = {sample!r} is no ShipMotion: nothing was sent; give a sequence of "
                f"cable_sim_ros.ShipMotion, each with its time_ns"
            )
        if k and sample.time_ns <= samples[k - 1].time_ns:
            raise TowError(
                f"source[{k}].time_ns = {sample.time_ns} ns is not behind that of the sample before: nothing was sent; "
                f"give the samples in order of their time_ns, each time once"
            )
    if not samples:
        return []
    rows = np.array([sample.row(1.0) for sample in samples])
    times = np.array([sample.time_ns for sample in samples], np.int64)
    return odometry_events(Samples(times, rows[:, :6], rows[:, 6:12]), "samples of motion")


class Feeder:
    """A queue of messages; `send(message)` is called when each is due.

    In lockstep by the thread that says the clock, or adds what is due already; in real time by one of its own.
    """

    def __init__(self, send: Callable[[Event], None], lockstep: bool) -> None:
        self._send, self.lockstep = send, lockstep
        self._queue: deque[Event] = deque()
        self._changed = threading.Condition()  # held while something is sent: what is sent is in order
        self._now: int | None = None  # what /clock said last, ns
        self._closed = False
        self.end: int | None = None  # stamp of the last message that was given, ns
        self.sent = 0
        self.kinds: set[str] = set()  # of motion, sent
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="cable_sim_feed", daemon=True)
        if not lockstep:
            self._thread.start()

    def add(self, messages: Sequence[Event], first: int | None) -> int:
        """Queue messages behind what is there; returns the stamp of the first, ns.

        first: where that stamp goes, ns; None: stamps as they are. Behind earlier messages it is never less than one
        interval after them.
        """
        stamps = [message.time for message in messages]
        with self._changed:
            if first is not None and self.end is not None and first <= self.end:
                same = [stamp for message, stamp in zip(messages, stamps) if message.kind == messages[0].kind]
                first = self.end + (same[1] - same[0] if len(same) > 1 else AHEAD)
            shift = 0 if first is None else first - stamps[0]
            self._queue.extend(message.moved(shift) if shift else message for message in messages)
            self.end = stamps[-1] + shift
            self._changed.notify_all()
            if self._now is not None:
                self._send_until(self._now, self._now)
        return stamps[0] + shift

    def clock(self, now: int, ahead: int = 0) -> None:
        """What /clock says, ns: in lockstep, messages up to it are sent, and motion up to `ahead`."""
        with self._changed:
            self._now = now
            self._send_until(now, max(now, ahead))

    @property
    def waiting(self) -> int:
        """Events that have not been sent."""
        return len(self._queue)

    def close(self) -> None:
        """Send nothing more; bounded."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join(5.0)

    def _send_until(self, now: int, ahead: int) -> None:
        """What is due, in order: commands up to now, motion up to `ahead`, ns."""
        try:
            while self._queue and not self._closed and self.failure is None:
                message = self._queue[0]
                if message.time > (now if message.is_command else ahead):
                    break
                self._queue.popleft()
                self._send(message)
                self.sent += 1
                if not message.is_command:
                    self.kinds.add(message.kind)
        except BaseException as error:
            self.failure = error

    def _run(self) -> None:
        with self._changed:
            while not self._closed and self.failure is None:
                now = time.time_ns()
                self._send_until(now, now)
                self._changed.wait((self._queue[0].time - time.time_ns()) / SECOND if self._queue else None)
