"""What a session says of time and its control; here as in real time, ros/stepped.py has lockstep."""

from __future__ import annotations

import time
from collections import deque

from ..io.motion.clock import DataClock

SECOND = 1_000_000_000
SECONDS = 10  # that Distance goes by
MARGIN = 5_000_000  # ns, over what they needed: it differs by some ms from second to second
NOT_IN_REAL_TIME = (
    "time_mode is realtime: the clock of the motion drives, and does not stand; start the node with "
    "-p time_mode:=lockstep to pause and step"
)


class Distance:
    """How far the tow stays behind the clock of the motion, so that its ticks find samples, ns.

    A tick past the newest sample is made up, and what it made up dies out over `ship.source_blend`: with one such tick
    every second or two none shows the ship as it moves. What a second needed is the longest time from the stamp of a
    sample to the next sample being there. `delay` is `least` (input_delay) where that suffices, else what eight of the
    last ten seconds needed and a little more, at most `most`: a hold-up or a drop-out now and then does not move it.
    """

    def __init__(self, least: int, most: int) -> None:
        self.least, self.most = least, max(least, most)
        self.reset()

    def reset(self) -> None:
        """Forget the samples: their clock has jumped."""
        self.delay, self.needed = self.least, 0  # needed: in the last whole second
        self._seconds: deque[int] = deque(maxlen=SECONDS)
        self._newest: int | None = None
        self._second = self._worst = 0

    def text(self) -> str:
        """ "" or by how much more than input_delay it is."""
        if self.delay == self.least:
            return ""
        needed, delay, least = (x * 1e-6 for x in (self.needed, self.delay, self.least))
        return (
            f"samples come {needed:.0f} ms after the stamp of the one before: the tow stays {delay:.0f} ms behind the "
            f"motion in place of input_delay, {least:.0f} ms"
        )

    def took(self, stamp: int, now: int) -> None:
        """A sample with this stamp is there; now: the present on the clock of the motion, ns."""
        if self._newest is not None:
            if now // SECOND != self._second:
                self._second, self.needed = now // SECOND, self._worst
                self._seconds.append(min(self._worst, self.most))
                self._worst = 0
                if len(self._seconds) == SECONDS:
                    found = sorted(self._seconds)[-3]
                    self.delay = self.least if found <= self.least else min(found + MARGIN, self.most)
            self._worst = max(self._worst, now - self._newest)
        self._newest = stamp


class Timing:
    """Base of a session."""

    lockstep = False
    clock: DataClock
    wall: int

    def now(self) -> int:
        """The present on the clock of the arrivals, ns: what ages count to."""
        return time.monotonic_ns()

    def log_time(self) -> int:
        """The present for messages that this node stamps, ns."""
        return time.time_ns()

    def record_time(self, arrival: int | None = None) -> int:
        """Time at which a recording has what is said now, ns, it never goes back; arrival: of a message instead."""
        return self.log_time() if arrival is None else arrival + self.wall

    def offset(self) -> int | None:
        """CLOCK_MONOTONIC less the clock of the motion, ns; None: not known."""
        return self.clock.offset

    def advance(self, now: int) -> float:
        """Called between two callbacks, now: CLOCK_MONOTONIC [ns]; returns in how many seconds to call it again."""
        return 0.1

    def hold(self, why: str) -> None:
        """Hold the simulation because of this, or let it go on with ""; real time does not stand."""

    @property
    def paused(self) -> bool:
        """Does simulation time stand because it was asked to?"""
        return False

    @property
    def steps_left(self) -> int:
        """Ticks that a step still has to do."""
        return 0

    def pause(self, on: bool) -> tuple[bool, str]:
        """Let simulation time stand, or go on: (done, text)."""
        return False, NOT_IN_REAL_TIME

    def step(self, count: int) -> tuple[bool, str]:
        """Begin `count` ticks, while paused: (begun, text)."""
        return False, NOT_IN_REAL_TIME
