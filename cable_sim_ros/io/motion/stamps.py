"""Regular stamps for a stream that is nominally periodic, from its stamps alone: live and replay decide alike.

A line (phase and period) is fitted to the stamps by recursive least squares with an expanding memory, and a stamp that
fits it is replaced by the line. A stamp that does not fit is used as it is; three of them (another rate, a shift of
phase) end the fit, and it is sought anew. So dropped samples and gaps keep their time.
"""

from __future__ import annotations

from math import nan, sqrt
from statistics import median

SOUGHT = 16  # stamps from which a fit is begun
MEMORY = 200  # stamps, the memory of the fit
EXACT = 1_000  # ns; a stamp so near to the line is used as it is: an exactly periodic stream stays untouched
WIDEST = 0.45  # periods off the line that can still be distinguished from a dropped sample
MIN = 0.02  # periods; a stamp further off than this and five times the rms does not fit
MISFITS = 3  # end the fit
FORGIVEN = 0.1  # misfits that a stamp which fits takes off
LONGEST = 50  # periods without a stamp end the fit


class RegularStamps:
    """Regular stamps of one topic. largest: jitter rms in periods up to which stamps are replaced, 0 = never."""

    def __init__(self, largest: float) -> None:
        self.largest = largest
        self.reset()

    def reset(self) -> None:
        """Forget the fit; the next stamp is the first."""
        self.period = self.jitter = nan  # ns; jitter: rms off the line
        self._recent: list[int] = []  # stamps, while a fit is sought
        self._line = self._last = 0  # ns: the line at the newest stamp that fits, newest stamp given out
        self._count = 0  # stamps in the fit, 0 = none
        self._misfits = 0.0

    @property
    def active(self) -> bool:
        """True while there is a fit and stamps are off it by more than what is passed as exact."""
        return self._count > 0 and self.jitter > EXACT

    def take(self, stamp: int) -> int:
        """The stamp to use, ns; it advances if the stamps do."""
        if self.largest <= 0.0:
            return stamp
        used = self._fitted(stamp) if self._count else self._seek(stamp)
        if self._last and used <= self._last:  # from the line back to the stamps
            used = self._last + max(1, round(0.1 * self.period)) if self.period > 0.0 else self._last + 1
        self._last = used
        return used

    def _fitted(self, stamp: int) -> int:
        ahead = (stamp - self._line) / self.period
        if ahead > LONGEST:
            return self._anew(stamp)
        steps = max(1, int(ahead + 0.3))  # too few heal with the next stamp, too many would not
        line = self._line + round(steps * self.period)
        off = stamp - line
        if abs(off) > self.period * WIDEST or abs(off) > max(5.0 * self.jitter, MIN * self.period):
            self._misfits += 1
            return stamp if self._misfits < MISFITS else self._anew(stamp)
        self._misfits = max(0.0, self._misfits - FORGIVEN)
        return self._learn(line, off, steps)

    def _learn(self, line: int, off: int, steps: int) -> int:
        self._count = min(self._count + 1, MEMORY)
        n = self._count
        self._line = line + round(off * 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)))
        self.period += off / steps * 6.0 / (n * (n + 1.0))
        self.jitter = sqrt(self.jitter**2 + (off * off - self.jitter**2) / n)
        if self.jitter > self.largest * self.period:
            return self._anew(line + off)
        return line + off if abs(off) <= EXACT else self._line

    def _anew(self, stamp: int) -> int:
        self._count, self._misfits, self._recent = 0, 0.0, []
        return self._seek(stamp)

    def _seek(self, stamp: int) -> int:
        recent = self._recent
        recent.append(stamp)
        if len(recent) < SOUGHT:
            return stamp
        period = median(b - a for a, b in zip(recent, recent[1:]))
        index = [0]
        for a, b in zip(recent, recent[1:]):
            index.append(index[-1] + max(1, int((b - a) / period + 0.5)))
        mean_i, mean_s = sum(index) / SOUGHT, sum(s - recent[0] for s in recent) / SOUGHT
        slope = sum((i - mean_i) * (s - recent[0] - mean_s) for i, s in zip(index, recent)) / sum(
            (i - mean_i) ** 2 for i in index
        )
        off = [s - recent[0] - mean_s - slope * (i - mean_i) for i, s in zip(index, recent)]
        jitter = sqrt(sum(o * o for o in off) / (SOUGHT - 2))
        if jitter > self.largest * slope or max(map(abs, off)) > WIDEST * slope:
            del recent[0]
            return stamp
        self.period, self.jitter, self._count, self._recent = slope, jitter, SOUGHT, []
        self._line = stamp - round(off[-1])
        return stamp if abs(off[-1]) <= EXACT else self._line
