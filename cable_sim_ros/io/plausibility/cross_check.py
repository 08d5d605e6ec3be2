"""Odometry held against the IMU: attitude and heave, also where the IMU itself has been convicted.

An IMU that reads -g has its axes down, or its force reversed; both make its vertical acceleration that of z down.
Odometry whose vertical velocity fits that is down as well: all of the motion is in NED axes, and none of it is used. An
IMU that is convicted of something else still has an attitude: odometry that turns with it has a witness.

Squares that guesses leave unexplained: how columns of measured and integrated numbers hang together.

Both sides of a comparison are averaged in blocks of 0.1 s. In windows of 0.8, 3 and 8 s the squares that each guess of
`fault_hypotheses.py` leaves are found from one matrix of moments, less the means. A guess convicts where it explains
85 % both of what moves and of what does not fit, several times in a row. So noise and slow errors, which no guess
explains, convict nobody, a ship at rest tells nothing, and the shortest window decides that has motion enough to tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan, sqrt

import numpy as np

from ...sim.tables.attitude import to_world
from ..messages.fault_hypotheses import ROWS, attitude_guesses, heave_guesses, ned_guesses
from ..messages.messages import Odometry

BLOCK = 0.1  # s
WINDOWS = ((8, 1, 2), (30, 3, 2), (80, 8, 2))  # blocks in it, looked at every so many, times in a row that convict
FIRST = 5  # blocks of the first look
UNEXPLAINED = 0.15  # of the squares, that a guess may leave
GOOD = 10  # short windows that fit acquit; a long one counts for as many as lie between its looks

NEAR = 100_000_000  # ns between an IMU message and the odometry that is held against it
DOWN = "gravity_sign"  # the finding of an IMU whose vertical is reversed
NO_ATTITUDE = ("gravity_direction",)  # findings after which the IMU's attitude says nothing


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


class CrossCheck:
    """imu and odometry take each message in turn; `causes`: findings against the odometry, "" for none.

    gravity: m/s^2; arm: IMU in base_link, m. `witnessed`: the odometry has been seen to fit the IMU.
    """

    def __init__(self, gravity: float, arm: Sequence[float]) -> None:
        self.gravity, self.arm = gravity, arm
        self._turned = Comparison(attitude_guesses(), moving=1e-3, apart=2.5e-3)
        self._heaved = Comparison(heave_guesses(), moving=0.02, apart=0.05, drift=True)
        self._down = Comparison(ned_guesses(), moving=0.02, apart=0.05, drift=True)
        self._witness = Comparison(attitude_guesses(), moving=1e-3, apart=2.5e-3)
        self.reset()

    def reset(self) -> None:
        """A jump of the clock: forget the times, not the findings."""
        self._imu: tuple[int, tuple, float] | None = None  # stamp, angles, vertical specific force
        self._climbed = self._sunk = 0.0  # m/s: integrals of it, read with z up and with z down

    @property
    def causes(self) -> tuple[str, ...]:
        """What is found against the odometry; "" each where nothing is."""
        return self._turned.cause, self._heaved.cause, self._down.cause

    @property
    def witnessed(self) -> bool:
        """Has the odometry been seen to fit the IMU, and does nothing speak against it?"""
        compared = (self._turned, self._heaved, self._down, self._witness)
        return not any(one.cause for one in compared) and any(one.agreed >= GOOD for one in compared)

    def imu(self, stamp: int, angles, force, dt: float) -> None:
        """An IMU message: stamp [ns], angles [rad], specific force in body axes [m/s^2]; dt: s since the one before."""
        if not dt:
            self._imu = None
        up = to_world(angles, force)[2]
        if self._imu is not None:
            mean = 0.5 * dt * (up + self._imu[2])
            self._climbed += mean - dt * self.gravity
            self._sunk += mean + dt * self.gravity
        self._imu = stamp, angles, up

    def odometry(self, stamp: int, angles, message: Odometry, climb: float, dt: float, doubted: str) -> None:
        """An odometry message; climb: its vertical velocity [m/s]; doubted: finding against the IMU, "" for none."""
        near = self._imu is not None and dt > 0.0 and abs(stamp - self._imu[0]) <= NEAR
        if near and message.twist:
            (ax, ay, az), (p, q, r) = self.arm, message.rate
            climb += to_world(angles, (q * az - r * ay, r * ax - p * az, p * ay - q * ax))[2]
        for compared, meant in (
            (self._turned, not doubted),
            (self._heaved, not doubted),
            (self._down, doubted == DOWN),
            (self._witness, bool(doubted) and doubted not in (DOWN, *NO_ATTITUDE)),
        ):
            if not (near and meant):
                compared.begin()
                continue
            assert self._imu is not None
            if compared in (self._turned, self._witness):
                compared.add((*angles, *self._imu[1]), dt)
            else:
                compared.add((climb, self._sunk if compared is self._down else self._climbed), dt)
