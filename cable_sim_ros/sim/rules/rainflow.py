"""Cycles of a history that comes in pieces: rainflow of ASTM E1049-85, 5.4.4, and bendings of a cable over a sheave.

Both keep bounded memory and give the same however the history is cut. A cycle is closed as soon as the standard closes
it; what is still open counts as half cycles, as at the end of a history. The residue of open ranges is short, the
logarithm of the length in a sea; one of a motion that dies out slowly may not be: from LONGEST on its oldest range is
counted as half a cycle then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import floor, inf

import numpy as np

LONGEST = 4096  # reversals of the residue
PIECE = 0.1  # m of cable whose bendings are counted together, and the way that makes one


class Rainflow:
    """Ranges counted by ``weight(range)``, the damage of one cycle; least: smaller ranges are left out; bin_width: of
    the histogram."""

    def __init__(self, weight: Callable[[float], float], least: float = 0.0, bin_width: float = 1.0) -> None:
        self.weight, self.least, self.bin_width = weight, least, bin_width
        self.points: list[float] = []  # reversals that are still open, the newest value last
        self.closed = 0.0  # damage
        self.largest = 0.0  # range
        self.halves: dict[int, int] = {}  # half cycles by bin
        self.shed = 0  # ranges that were counted because the residue was full

    def add(self, values: Iterable[float], limit: float = inf) -> int | None:
        """Take more of the history; index of the value behind the reversal at which the damage was above a limit."""
        found, points = None, self.points
        for index, value in enumerate(values):
            if len(points) < 2:
                if not points or value != points[0]:
                    points.append(value)
                continue
            way = points[-1] - points[-2]
            step = value - points[-1]
            if step == 0.0:
                continue
            if (step > 0.0) == (way > 0.0):
                points[-1] = value
                continue
            self._close()
            if found is None and limit < inf and self.damage > limit:
                found = index
            points.append(value)
        return found

    def _close(self) -> None:
        """The newest point has become a reversal: take out what it closes."""
        points = self.points
        while len(points) >= 3:
            before = abs(points[-2] - points[-3])
            if abs(points[-1] - points[-2]) < before:
                break
            if len(points) == 3:  # the range has the start of the history
                self._count(before, 1)
                del points[0]
            else:
                self._count(before, 2)
                del points[-3:-1]
        if len(points) > LONGEST:
            self._count(abs(points[1] - points[0]), 1)
            del points[0]
            self.shed += 1

    def _count(self, size: float, halves: int) -> None:
        if size < self.least:
            return
        self.closed += 0.5 * halves * self.weight(size)
        self.largest = max(self.largest, size)
        place = floor(size / self.bin_width)
        self.halves[place] = self.halves.get(place, 0) + halves

    def _ended(self) -> Rainflow:
        """As at the end of the history: the newest point is a reversal, and what is open counts as half cycles."""
        end = Rainflow(self.weight, self.least, self.bin_width)
        end.points, end.closed, end.largest = list(self.points), self.closed, self.largest
        end.halves, end.shed = dict(self.halves), self.shed
        if len(end.points) > 1:
            end._close()
            for one, other in zip(end.points, end.points[1:]):
                end._count(abs(other - one), 1)
        return end

    @property
    def damage(self) -> float:
        """Sum over the history so far, open ranges as half cycles."""
        return self._ended().closed

    def totals(self) -> tuple[float, float, list[tuple[float, float]]]:
        """Cycles, largest range, and (upper end of a bin, cycles) of the history so far."""
        end = self._ended()
        table = [((place + 1) * self.bin_width, 0.5 * count) for place, count in sorted(end.halves.items())]
        return sum(count for _, count in table), end.largest, table


class Bends:
    """Bendings of each PIECE of cable over a sheave on which it lies over ``wrap`` [m].

    A piece is straight, bent, straight again as it runs on and off: one bending. Each crossing of one of the two
    ends of the contact is half of it. Pieces are known by the pay-out at which they run onto the sheave. Motion of less
    than a PIECE to and fro bends nothing.
    """

    def __init__(self, wrap: float) -> None:
        self.apart = max(1, round(wrap / PIECE))  # pieces on the sheave
        self.low = 0  # piece of row 0
        self.halves = np.zeros(0, np.int64)
        self.most = 0
        self.most_at = 0  # piece
        self._edge: float | None = None  # m, the lower edge of the play that the pay-out moves in

    def add(self, payout: Iterable[float]) -> list[tuple[int, int]]:
        """Take more of the pay-out [m]; (index, largest count of half bendings) where that has grown."""
        grown = []
        for index, value in enumerate(payout):
            if self._edge is None:
                self._edge = value
                continue
            edge = value if value < self._edge else max(self._edge, value - PIECE)
            if edge == self._edge:
                continue
            first, last = sorted((floor(self._edge / PIECE), floor(edge / PIECE)))
            self._edge = edge
            if first != last and self._crossed(first + 1, last + 1):
                grown.append((index, self.most))
        return grown

    def moved(self) -> None:
        """The pay-out of the next tick follows from no motion."""
        self._edge = None

    def _crossed(self, first: int, last: int) -> bool:
        """The ends of the contact have passed over pieces [first, last); has the largest count grown?"""
        before = self.most
        for begin, end in ((first, last), (first - self.apart, last - self.apart)):
            self._room(begin, end)
            part = self.halves[begin - self.low : end - self.low]
            part += 1
            top = int(part.max())
            if top > self.most:
                self.most, self.most_at = top, begin + int(part.argmax())
        return self.most > before

    def _room(self, begin: int, end: int) -> None:
        if not len(self.halves):
            self.low = begin
        more = max(256, len(self.halves) // 4)
        if begin < self.low:
            grow = self.low - begin + more
            self.halves, self.low = np.concatenate((np.zeros(grow, np.int64), self.halves)), self.low - grow
        if end > self.low + len(self.halves):
            grow = end - self.low - len(self.halves) + more
            self.halves = np.concatenate((self.halves, np.zeros(grow, np.int64)))
