"""When a message arrived, on CLOCK_MONOTONIC, and how long after its stamp it was taken in."""

from __future__ import annotations

import time
from collections.abc import Callable

from .overload import STILL, Samples

SECOND = 1_000_000_000
STEP = 2_000_000  # ns; a larger change of wall clock against CLOCK_MONOTONIC between two messages is a step of it
LONGEST_WAIT = 60 * SECOND  # a message that waited longer has a time of reception on another clock
EARLY = 50_000_000  # ns before a standstill that a message may have been on its way


class Arrivals:
    """Turns the middleware's time of reception, which is wall time, into CLOCK_MONOTONIC.

    `steps` counts steps of the wall clock, `last_step` is the newest [s]: for a second after one, a message may have
    been received before it, so the time of the callback counts, which is right within the queueing delay.
    A process that stood still receives everything that was sent meanwhile in one moment: such a message is taken to
    have arrived when its stamp says that it was sent, or the clock of the data would seem to have jumped.
    """

    def __init__(self) -> None:
        self.steps = 0
        self.last_step = 0.0
        self.taken = Samples()  # ms from the stamp, on the clock of the data, to the sample being in the ring
        self._newest: int | None = None
        self._wall: int | None = None
        self._trusted_from = 0
        self._awake: int | None = None
        self._hole = (0, 0)  # ns, from and to: nothing ran in between

    def awake(self) -> int:
        """This thread runs; call it 20 times a second. Returns the time, ns."""
        now = time.monotonic_ns()
        if self._awake is not None and now - self._awake > STILL:
            self._hole = self._awake, now
        self._awake = now
        return now

    def of(self, info: dict, stamp: int | None = None, offset: int | None = None) -> int:
        """Arrival [ns]; info: what rclpy hands over; stamp: of the message, ns; offset: as for `took`."""
        now, wall_now = self.awake(), time.time_ns()
        wall, before = wall_now - now, self._wall
        self._wall = wall
        if before is not None and abs(wall - before) > STEP:
            self.steps += 1
            self.last_step = (wall - before) / SECOND
            self._trusted_from = now + SECOND
        waited = wall_now - int(info.get("received_timestamp", 0))
        arrival = now - waited if now >= self._trusted_from and 0 <= waited < LONGEST_WAIT else now
        begun, ended = self._hole
        if stamp and offset is not None and now - ended < SECOND and arrival >= ended - EARLY:
            sent = stamp + offset
            if begun - EARLY <= sent < ended:
                return min(sent, arrival)
        return arrival

    def took(self, stamp: int | None, offset: int | None) -> None:
        """The newest sample in the ring has this stamp [ns]; offset: CLOCK_MONOTONIC less the clock of the data, ns."""
        if stamp is not None and offset is not None and stamp != self._newest:
            self._newest = stamp
            self.taken.add((time.monotonic_ns() - offset - stamp) * 1e-6)


class StampArrivals(Arrivals):
    """In lockstep: a message arrives when its stamp says; now(): /clock, for one whose stamp says nothing, ns."""

    def __init__(self, now: Callable[[], int]) -> None:
        super().__init__()
        self._now = now

    def of(self, info: dict, stamp: int | None = None, offset: int | None = None) -> int:
        now = self._now()
        return stamp if stamp and abs(stamp - now) <= LONGEST_WAIT else now

    def took(self, stamp: int | None, offset: int | None) -> None:
        """Wall time says nothing of a stamp."""
