"""The publisher thread: waits for ticks, serialises each channel once, publishes the bytes and records them.

What nobody hears and no recording has is not serialised. What the verdict of a node needs of its tick outputs beside
counts are sums over the ticks, for it keeps no tick outputs.

The rules on watch of a running node: its ticks come one by one in one thread, its report is asked for in another.
"""

from __future__ import annotations

import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from math import cos, degrees, inf, isfinite, nan, sin, sqrt
from typing import Any

import numpy as np
from rclpy._rclpy_pybind11 import RCLError

from ..io.messages.channels import Encoder
from ..io.recordings.journal import Journal
from ..io.recordings.recorder import Recorder
from ..physics.tick_output import TICK_OUTPUT
from ..sim.checks.deviation_checks import PITCHED_OVER, SKIP, deviation_damped, pitch_against
from ..sim.rules.watch import RuleWatch, rule_watch
from ..sim.scene import Scene
from ..sim.tables.attitude import angles_of
from ..sim.verdict import Reason
from .loop import HALT, HEADS_ROWS, Loop, raise_priority
from .overload import Samples

PIECE = 20  # ticks that are judged together: one by one costs ten times as much

AT_ONCE = 1.5  # ticks from one tick output to the next: more is a gap, and no acceleration is taken over it


class RuleKeeper:
    """A RuleWatch that may be asked from any thread."""

    def __init__(self, watch: RuleWatch) -> None:
        self._watch = watch
        self._waiting: list[np.record] = []
        self._lock = threading.Lock()

    def add(self, frame: np.record) -> None:
        """One tick output, a copy."""
        with self._lock:
            self._waiting.append(frame)
            if len(self._waiting) >= PIECE:
                self._judge()

    def report(self) -> dict[str, Any]:
        """As `RuleWatch.report`, of every tick so far."""
        with self._lock:
            self._judge()
            return self._watch.report()

    @property
    def broken(self) -> tuple[str, ...]:
        """Rules broken, by name, up to PIECE ticks ago."""
        with self._lock:
            return self._watch.broken

    def _judge(self) -> None:
        if self._waiting:
            self._watch.add(np.array(self._waiting, self._waiting[0].dtype))
            self._waiting = []


def rule_keeper(scene: Scene) -> RuleKeeper | None:
    """The rules of a scene, None where it watches none."""
    watch = rule_watch(scene)
    return None if watch is None else RuleKeeper(watch)


class Moments:
    """Means, variances and covariance of two values, updated pair by pair (Welford)."""

    def __init__(self) -> None:
        self.count = 0
        self.mean = [0.0, 0.0]
        self._squares, self._products = [0.0, 0.0], 0.0

    def add(self, one: float, other: float) -> None:
        self.count += 1
        a, b = one - self.mean[0], other - self.mean[1]
        self.mean[0] += a / self.count
        self.mean[1] += b / self.count
        self._squares[0] += a * (one - self.mean[0])
        self._squares[1] += b * (other - self.mean[1])
        self._products += a * (other - self.mean[1])

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviations."""
        return sqrt(self._squares[0] / max(self.count, 1)), sqrt(self._squares[1] / max(self.count, 1))

    @property
    def correlation(self) -> float:
        """NaN where one of them does not change."""
        size = sqrt(self._squares[0] * self._squares[1])
        return self._products / size if size > 0.0 else nan


class RunningSums:
    """Takes every tick output that was published; tick: s; slow: m/s, pay-out below it is counted. `reasons` are
    those that a run over all of them would have.

    The first 20 s are left out, as in the summary: there the motion is taken up.
    """

    def __init__(self, tick: float, slow: float = 0.0) -> None:
        self.tick, self.slow = tick, slow
        self._seen = self._slow = 0
        self._tension = Moments()  # N, and the square of what was damped away, N^2
        self._ship = Moments()  # acceleration ahead, m/s^2, and pitch, deg
        self._before: tuple[int, float, float] = 0, nan, nan  # time [ns], velocity ahead [m/s], pitch [deg]
        self.least_scope = inf  # m
        self.max_slam = 0.0  # N

    def add(self, frame: np.record) -> None:
        """One tick output."""
        self._seen += 1
        self._slow += abs(float(frame["payout_rate"])) < self.slow
        self.least_scope = min(self.least_scope, float(frame["scope"]))
        self.max_slam = max(self.max_slam, float(frame["slam_estimate"]))
        _, pitch, yaw = angles_of(*frame["ship_quaternion"].tolist())
        velocity = frame["ship_velocity"]
        ahead = float(velocity[0]) * cos(yaw) + float(velocity[1]) * sin(yaw)
        now = int(frame["time"]), ahead, degrees(pitch)
        (time, speed, angle), self._before = self._before, now
        if self._seen * self.tick <= SKIP:
            return
        lost = float(frame["tension_damped"])
        self._tension.add(float(frame["tension"]), lost * lost if isfinite(lost) else 0.0)
        since = (now[0] - time) * 1e-9
        if 0.0 < since < AT_ONCE * self.tick and isfinite(speed):
            self._ship.add((ahead - speed) / since, 0.5 * (now[2] + angle))

    @property
    def slow_fraction(self) -> float:
        """Part of the ticks in which the cable ran slower than ``slow``."""
        return self._slow / max(self._seen, 1)

    def reasons(self) -> list[Reason]:
        """Pitch of the wrong sign, and ringing that the steps damped away and the deviation misses."""
        found: list[Reason] = []
        if self._ship.count * self.tick >= PITCHED_OVER:
            surge, pitch = self._ship.deviations
            found += pitch_against(pitch, surge, self._ship.correlation)
        if self._tension.count:
            there, (mean, lost) = self._tension.deviations[0], self._tension.mean
            text = f"{sqrt(0.5 * lost):.3g} N rms or more beside a deviation of {there:.4g} N"
            damped = deviation_damped(mean, there * there, 0.5 * lost)
            found += [reason._replace(text=f"{reason.text}; {text}") for reason in damped]
        return found


class TickPublisher:
    """Follows the ring of a Loop from `start` to `close`, in a thread of its own.

    publishers: absolute topic -> rclpy publisher, of the topics whose messages are installed; offset(): monotonic time
    less time of the data's clock, ns, or None; log_time(): the time at which a recording has a message, ns; unrecorded:
    absolute topics that are only published; slow: see `RunningSums`; parts: each takes every tick output that was
    published, and leaves it unchanged; rules: on watch, or None. A recording may be begun and ended at any time.
    """

    def __init__(
        self,
        loop: Loop,
        encoder: Encoder,
        publishers: dict,
        offset: Callable[[], int | None],
        log_time: Callable[[], int] = time.time_ns,
        unrecorded: tuple[str, ...] = (),
        slow: float = 0.0,
        parts: Sequence[Callable[[np.record], None]] = (),
        rules: RuleKeeper | None = None,
    ) -> None:
        self.loop, self.encoder, self.publishers, self.offset = loop, encoder, publishers, offset
        self.log_time, self.unrecorded, self.parts = log_time, unrecorded, parts
        self._recorder: Recorder | None = None
        self._journal: Journal | None = None
        self._recording = threading.Lock()  # held while a tick is being recorded
        self.next = loop.count
        self.published = self.skipped = 0
        self.latest: np.record | None = None  # newest tick output that was published, a copy
        self.statuses: Counter[int] = Counter()  # ticks with each status word
        self.max_tension = 0.0  # N
        self.sums = RunningSums(1e-9 * loop.period_ns, slow)
        self.rules = rules
        self.fault = ""  # why the newest frame could not be published, or ""
        self.failure: BaseException | None = None
        self.lateness, self.work, self.latency = Samples(), Samples(), Samples()  # ms
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to publish."""
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)
        self._thread.start()

    def is_alive(self) -> bool:
        """Does it publish? False before the start, after the end, and after a fault."""
        return self._thread is not None and self._thread.is_alive()

    def _run(self) -> None:
        if self.loop.priority:
            raise_priority()
        try:
            while not self._stopping.is_set():
                os.eventfd_read(self.loop.eventfd)  # blocks without the interpreter lock
                self.drain()
        except RCLError as error:
            # a signal shuts the context down while we publish; anything else is a fault worth showing
            if not self._stopping.is_set() and "context is" not in str(error):
                self.failure = error
        except Exception as error:
            self.failure = error

    def drain(self) -> None:
        """Publish every tick that is done and still in the ring."""
        loop, rows = self.loop, self.loop.rows
        while self.next < loop.count and not self._stopping.is_set():
            if loop.count - self.next >= rows:  # overtaken: go on with the newer half
                target = loop.count - rows // 2
                self.skipped += target - self.next
                self._skip(target)
            self._one(self.next)
            self.next += 1

    def _one(self, index: int) -> None:
        loop, slot = self.loop, index % self.loop.rows
        row = loop.row(index)
        if row.flags & HALT:
            self._note(index, "halted")
            return  # the tick was rolled back: there is nothing new to say
        frame = np.frombuffer(loop.output.frame[slot].tobytes(), TICK_OUTPUT)[0]  # copy() goes by fields, 26 us
        try:
            messages = self.encoder.encode(frame, loop.output.shape[slot], loop.output.contact[slot], self._wanted)
        except ValueError as error:  # a number that is not finite
            self.fault = str(error)
            self._note(index)
            return
        if loop.count >= index + loop.rows:  # the loop came round while we read
            self.skipped += 1
            self._note(index)
            return
        for _, topic, data in messages:
            if topic in self.publishers:
                self.publishers[topic].publish(data)
        for part in self.parts:
            part(frame)
        with self._recording:
            self._noted(index)
            if self._recorder is not None and self._journal is not None and self._journal.covers(index):
                for channel, topic, data in messages:
                    if topic in self.unrecorded:
                        continue
                    self._recorder.put(topic, channel.msgtype, self.log_time(), data, row.time)
        offset = self.offset()
        if offset is not None:
            self.latency.add((time.monotonic_ns() - offset - row.time) * 1e-6)
        self.lateness.add((row.wake - row.deadline) * 1e-6)
        self.work.add((row.done - row.wake) * 1e-6)
        self.published += 1
        self.statuses[int(frame["status"])] += 1
        self.max_tension = max(self.max_tension, float(frame["tension_most"]))
        self.sums.add(frame)
        if self.rules is not None:
            self.rules.add(frame)
        self.fault = ""
        self.latest = frame

    def _wanted(self, topic: str) -> bool:
        """Does anybody hear this topic, or is it recorded?"""
        if self._recorder is not None and topic not in self.unrecorded:
            return True
        return topic in self.publishers and self.publishers[topic].get_subscription_count() > 0

    def _skip(self, target: int) -> None:
        """Ticks that are not published any more; what they saw goes into the journal."""
        known = self.loop.count - HEADS_ROWS + self.loop.rows
        if self.next < known:
            with self._recording:
                if self._journal is not None:
                    self._journal.lose(self.next, min(known, target) - self.next)
        for index in range(max(self.next, known), target):
            self._note(index)
        self.next = target

    def _note(self, index: int, end: str = "") -> None:
        """What a tick saw, and that it was the last, for the journal."""
        with self._recording:
            self._noted(index)
            if end and self._journal is not None:
                self._journal.end(index, end)

    def _noted(self, index: int) -> None:
        if self._journal is not None:
            self._journal.tick(index, *self.loop.heads[index % HEADS_ROWS].tolist())

    def record(self, recorder: Recorder, journal: Journal) -> None:
        """Record the ticks from the journal's first one on."""
        with self._recording:
            self._recorder, self._journal = recorder, journal

    def end_recording(self) -> None:
        """Record the ticks that are done, and no more."""
        self.catch_up(0.2)
        with self._recording:
            if self._journal is not None:
                self._journal.end(self.next, "recording ended")
            self._recorder = self._journal = None

    def catch_up(self, timeout: float) -> None:
        """Wait until every tick that is done now is published, at most ``timeout`` [s]."""
        count, deadline = self.loop.count, time.monotonic() + timeout
        while self.next < count and self.is_alive() and time.monotonic() < deadline:
            time.sleep(0.005)

    def close(self, timeout: float = 1.0) -> None:
        """Publish what is left, then end; call it before the loop's descriptor is closed."""
        if self.is_alive():
            self.catch_up(timeout / 2)
            self._stopping.set()
            self.loop.wake_reader()
            if self._thread is not None:
                self._thread.join(timeout)


class DirectPublisher(TickPublisher):
    """Publishes when `drain` is called, in the thread that calls it: for lockstep, a step ends with its messages."""

    _open = False

    def start(self) -> None:
        self._open = True

    def is_alive(self) -> bool:
        return self._open and self.failure is None

    def drain(self) -> None:
        try:
            super().drain()
        except RCLError as error:
            if "context is" not in str(error):
                self.failure = error
        except Exception as error:
            self.failure = error

    def catch_up(self, timeout: float) -> None:
        self.drain()

    def close(self, timeout: float = 1.0) -> None:
        if self.is_alive():
            self.drain()
        self._open = False
