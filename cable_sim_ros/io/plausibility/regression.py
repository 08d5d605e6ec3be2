"""Squares that guesses leave unexplained: how columns of measured and integrated numbers hang together.

Both sides of a comparison are averaged in blocks of 0.1 s. Over windows of 0.8, 3 and 8 s the squares that each guess
(`io.doubts`) leaves are found from one matrix of moments, less the means. A guess convicts where it explains 85 % both
of what moves and of what does not fit, several times in a row. So noise and slow errors, which no guess explains,
convict nobody, a ship at rest tells nothing, and the shortest window decides in which there is motion enough to tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan, sqrt

import numpy as np

from ..messages.fault_hypotheses import ROWS

BLOCK = 0.1  # s
WINDOWS = ((8, 1, 2), (30, 3, 2), (80, 8, 2))  # blocks in it, looked at every so many, times in a row that convict
FIRST = 5  # blocks of the first look
UNEXPLAINED = 0.15  # of the squares, that a guess may leave
GOOD = 10  # short windows that fit acquit; a long one counts for as many as lie between its looks


class Comparison:
    """Block means of columns and the guesses on how they hang together. `cause`: "" or that of the best guess.

    moving, apart: rms that the first three columns, and what does not fit, must have for a look to count. drift: an
    integral that may drift (a bias of the accelerometer): straight lines are left out of the long windows, and the
    short one needs twice as much.
    """

    def __init__(self, guesses: Sequence[ROWS], moving: float, apart: float, drift: bool = False) -> None:
        self.causes = [cause for cause, _ in guesses]
        self.columns = guesses[0][1].shape[1]
        own = self._own = min(3, self.columns // 2)
        what = np.arange(self.columns)
        sums = [np.diag(1.0 * which) for which in (what < own, what >= own, (what >= own) & (what < 2 * own))]
        squares = [rows.T @ rows for _, rows in guesses]
        self._squares = np.array([matrix.ravel() for matrix in (*sums, *squares)])
        self._floor = moving * moving, apart * apart
        self._drift = drift
        self.cause, self.gain, self._guess = "", nan, 0  # guess: index of what was found last
        self._rows = np.zeros((4 * WINDOWS[-1][0], self.columns))
        self._for = 0
        self.begin()

    @property
    def agreed(self) -> int:
        """Short windows that have fitted since the last finding; a long one counts for several."""
        return self._for

    def begin(self) -> None:
        """Forget the window, not the cause."""
        self._count = self._end = 0
        self._sum, self._in_block, self._time = [0.0] * self.columns, 0, 0.0
        self._against: list[tuple[str, int]] = [("", 0)] * len(WINDOWS)
        self._for = self._for if self.cause == "" else 0

    def add(self, values: Sequence[float], dt: float) -> bool:
        """Take a sample, `dt` s after the one before. True where the cause has changed."""
        self._sum = [a + b for a, b in zip(self._sum, values)]
        self._in_block += 1
        self._time += dt
        if self._time < BLOCK * 0.999:
            return False
        return self._block()

    def _block(self) -> bool:
        if self._end == len(self._rows):
            keep = WINDOWS[-1][0]
            self._rows[:keep] = self._rows[-keep:]
            self._end = keep
        self._rows[self._end] = self._sum
        self._rows[self._end] /= self._in_block
        self._end, self._count = self._end + 1, self._count + 1
        over = self._time - BLOCK
        self._sum, self._in_block, self._time = [0.0] * self.columns, 0, over if 0.0 < over < BLOCK else 0.0
        if self._count < FIRST:
            return False
        before = self.cause
        for k, (length, every, times) in enumerate(WINDOWS):
            if self._count % every or self._count < (FIRST if k == 0 else length):
                continue
            found = self._look(min(length, self._count))
            if found is None:
                continue
            same = self._against[k][1] + 1 if found == self._against[k][0] else 1
            self._against[k] = found, same
            if not found:
                self._for += every
                if self.cause and self._for >= GOOD:
                    self.cause, self._guess, self._count = "", 0, 0  # the long windows hold what was wrong
                    break
            elif same >= times and not (self.cause and k):
                self.cause, self._for = found, 0
        return self.cause != before

    def _look(self, count: int) -> str | None:
        """The cause that convicts, "" where the parts fit, None where nothing can be told."""
        rows = self._rows[self._end - count : self._end]
        rows = rows - np.add.reduce(rows) * (1.0 / count)
        long = self._drift and count > WINDOWS[0][0]
        if long:
            slope = np.arange(count) - 0.5 * (count - 1)
            rows -= np.outer(slope, slope @ rows * (12.0 / (count**3 - count)))
        moving, driven, follower, *left = (self._squares @ (rows.T @ rows).ravel()).tolist()
        apart = left[0]
        if moving < self._floor[0] * count:
            return None
        if driven == 0.0:
            steps = np.diff(rows[:, : self._own], axis=0)
            smooth = float((steps * steps).sum()) < 0.3 * moving  # of noise it is twice that, of a slope a sixth
            return "absent" if smooth and moving > self._floor[1] * count else None
        minimum = self._floor[1] * count * (4.0 if self._drift and not long else 1.0)
        best = min(left)
        if apart >= minimum and best <= UNEXPLAINED * min(apart, moving):
            within = 1.5 * best + 0.01 * apart
            if not (self.cause and left[self._guess] <= within):  # a finding stays while it does as well as any
                self._guess = next(i for i, rest in enumerate(left) if rest <= within)
                self.gain = sqrt(follower / moving)
            return self.causes[self._guess]
        doubted = left[self._guess] if self._guess else moving  # what speaks for good must speak against that
        return "" if doubted >= minimum and apart <= UNEXPLAINED * min(doubted, moving) else None
