"""The clock of the motion data, seen from that of the arrivals: offset = running minimum of (arrival - stamp).

The minimum over the last half minute is free of transport and queueing delays and follows the drift of the sender's
clock. Live, arrivals are CLOCK_MONOTONIC; of a bag they are its log times. Only differences of arrivals count.

A stamp that does not fit the clock is not used: one more than 1 s off, or more than 0.2 s ahead of any message of the
last half minute. Five in a row that agree with each other are a jump of the clock. Stamps that stay 0.2 to 1 s behind
are used, and are a jump after a second of it.
"""

from __future__ import annotations

from enum import Enum

SECOND = 1_000_000_000
BUCKET = SECOND
BUCKETS = 30
FAR = SECOND  # ns; a stamp further off the clock is not used
STEP = SECOND // 5  # ns; no delay of a transport comes or goes by more and stays
SETTLING = SECOND  # ns from the first arrival in which the minimum is still being found
CONFIRM = 5  # stamps in a row that must agree before a jump is believed


class Stamp(Enum):
    """What a stamp is to the clock."""

    FITS = "fits"
    OFF = "off"  # not to be used
    JUMPED = "jumped"  # as OFF, and the clock has jumped: reset it


class DataClock:
    """Map of stamps to times of arrival [ns]. Not thread safe: one writer; `offset` may be read anywhere."""

    def __init__(self) -> None:
        self.jumps = 0
        self.jump = 0  # ns, by how much the stamps moved against the arrivals in the last jump; positive: ahead
        self.reset()

    def reset(self) -> None:
        """Forget the mapping; the next stamp starts a new one."""
        self.offset: int | None = None
        self.last_stamp: int | None = None
        self.first: int | None = None  # arrival of the first stamp
        self._buckets: dict[int, int] = {}
        self._suspects: list[tuple[int, int]] = []
        self._behind: list[int] = []  # arrivals of stamps that stay behind

    def fits(self, stamp: int, arrival: int) -> bool:
        """Does a stamp fit the clock so far?"""
        if self.offset is None or self.first is None:
            return True
        late = arrival - stamp - self.offset
        return abs(late) <= FAR and (late >= -STEP or arrival - self.first <= SETTLING)

    def judge(self, stamp: int, arrival: int) -> Stamp:
        """What a stamp is to the clock; counts jumps. Call it once for each message, in order of arrival."""
        if self.offset is None:
            return Stamp.FITS
        if self.fits(stamp, arrival):
            self._suspects.clear()
            if not self._stays_behind(stamp, arrival):
                return Stamp.FITS
        elif not self._agree(stamp, arrival):
            return Stamp.OFF
        self.jumps += 1
        self.jump = self.offset - (arrival - stamp)
        return Stamp.JUMPED

    def _agree(self, stamp: int, arrival: int) -> bool:
        suspects = self._suspects
        if suspects:
            before, came = suspects[-1]
            if not (stamp >= before and abs((arrival - came) - (stamp - before)) <= STEP):
                suspects.clear()
        suspects.append((stamp, arrival))
        return len(suspects) >= CONFIRM

    def _stays_behind(self, stamp: int, arrival: int) -> bool:
        assert self.offset is not None
        if arrival - stamp - self.offset <= STEP:
            self._behind.clear()
            return False
        self._behind = [*self._behind[:CONFIRM], arrival]
        return len(self._behind) > CONFIRM and arrival - self._behind[0] >= SECOND

    def update(self, stamp: int, arrival: int) -> None:
        """Take in an accepted stamp and its arrival, ns."""
        self.last_stamp = stamp
        self.first = arrival if self.first is None else self.first
        bucket = (arrival - self.first) // BUCKET
        delay = arrival - stamp
        best = self._buckets.get(bucket)
        if best is None:
            self._buckets[bucket] = delay
            for old in [key for key in self._buckets if key <= bucket - BUCKETS]:
                del self._buckets[old]
            self.offset = min(self._buckets.values())
        elif delay < best:
            self._buckets[bucket] = delay
            self.offset = min(self._buckets.values())

    def now(self, arrival: int) -> int | None:
        """Time on the data's clock, ns, at a time of the clock of the arrivals; None before the first stamp."""
        return None if self.offset is None else arrival - self.offset
