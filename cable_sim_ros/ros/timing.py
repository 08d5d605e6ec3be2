"""When a message arrived, on CLOCK_MONOTONIC, how long after its stamp it was taken in, and how far a tow stays behind
the clock of its motion in real time."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from .overload import STILL, Samples

SECOND = 1_000_000_000
STEP = 2_000_000  # ns; a larger change of wall clock against CLOCK_MONOTONIC between two messages is a step of it
LONGEST_WAIT = 60 * SECOND  # a message that waited longer has a time of reception on another clock
EARLY = 50_000_000  # ns before a standstill that a message may have been on its way
SECONDS = 10  # that Distance goes by
MARGIN = 5_000_000  # ns, over what they needed: it differs by some ms from second to second
NOT_IN_REAL_TIME = (
    "time_mode is realtime: the clock of the motion drives, and does not stand; start the node with "
    "-p time_mode:=lockstep to pause and step"
)


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
