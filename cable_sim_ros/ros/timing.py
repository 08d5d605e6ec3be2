"""What a session says of time and its control; here as in real time, ros/stepped.py has lockstep."""

from __future__ import annotations

import time

from ..io.motion.clock import DataClock

NOT_IN_REAL_TIME = (
    "time_mode is realtime: the clock of the motion drives, and does not stand; start the node with "
    "-p time_mode:=lockstep to pause and step"
)


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
