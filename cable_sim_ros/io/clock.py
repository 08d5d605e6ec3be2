"""The clock of the motion data, seen from that of the arrivals: offset = running minimum of (arrival - stamp).

The minimum over the last half minute is free of transport and queueing delays and follows the drift of the
sender's clock. Live, arrivals are CLOCK_MONOTONIC; in a replay they are the log times of the bag, which the node
writes a constant apart from them. Only differences of arrivals count, so a replay maps and decides as the run did.
"""

from __future__ import annotations

SECOND = 1_000_000_000
BUCKET = SECOND
BUCKETS = 30
JUMP = SECOND  # ns; a larger step of the stamps against arrival is a jump of the clock
CONFIRM = 5  # stamps in a row that must agree before a jump is believed


class DataClock:
    """Map of stamps to times of arrival [ns]. Not thread safe: one writer; `offset` may be read anywhere."""

    def __init__(self) -> None:
        self.jumps = 0
        self.reset()

    def reset(self) -> None:
        """Forget the mapping; the next stamp starts a new one."""
        self.offset: int | None = None
        self.last_stamp: int | None = None
        self.first: int | None = None  # arrival of the first stamp
        self._buckets: dict[int, int] = {}
        self._suspects: list[tuple[int, int]] = []

    def suspicious(self, stamp: int, arrival: int) -> bool:
        """True while a stamp is more than a second off the clock: the message is to be dropped, see `jumped`."""
        if self.offset is None or abs(arrival - stamp - self.offset) <= JUMP:
            self._suspects.clear()
            return False
        return True

    def jumped(self, stamp: int, arrival: int) -> bool:
        """Count a suspicious stamp; True once enough of them agree that the clock has jumped."""
        suspects = self._suspects
        if suspects:
            before, came = suspects[-1]
            if not (stamp >= before and abs((arrival - came) - (stamp - before)) <= JUMP):
                suspects.clear()
        suspects.append((stamp, arrival))
        if len(suspects) < CONFIRM:
            return False
        self.jumps += 1
        return True

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
