"""How far a tow stays behind the clock of its motion in real time."""

from __future__ import annotations

from collections import deque

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
