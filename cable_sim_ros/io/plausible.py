"""Do the parts of motion messages fit each other? Wrong units and axes found from the data alone, by name.

What must hang together is compared: attitude with the integral of the angular velocity, position with that of the
velocity, specific force with gravity, odometry with the IMU. Both sides are averaged in blocks of 0.1 s, and over windows
of 1, 3 and 8 s the squares that each guess (`io.doubts`) leaves unexplained are found from one matrix of moments.
A guess convicts where it explains 85 % of both what moves and what does not fit, several times in a row. So noise and
slow errors, which no guess explains, convict nobody, a ship at rest tells nothing, and a window is long enough as soon as
the motion in it tells. What is convicted is refused until the parts have fitted each other again for a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, hypot, nan, pi, sin, sqrt

import numpy as np

from ..sim.attitude import angle_rates, to_world
from .doubts import ROWS, attitude_guesses, heave_guesses, rate_guesses, velocity_guesses

BLOCK = 0.1  # s
WINDOWS = ((10, 1, 3), (30, 3, 2), (80, 8, 2))  # blocks in it, looked at every so many, times in a row that convict
FIRST = 5  # blocks of the first look
UNEXPLAINED = 0.15  # of the squares, that a guess may leave
GOOD = 10  # short windows that fit acquit; a long one counts for as many as lie between its looks
GAP = 1.6  # s; a longer gap begins anew
LEAK, MISFIT = 0.5, (0.035, 0.5)  # s; rad and share of the rms of the angle: misfit of attitude and rates that is refused
UNSEEN = 0.35  # rad/s: a first sample that turns faster waits for the second
SWELL = 20.0 / (2.0 * pi)  # s/rad of the longest swell


class Comparison:
    """Block means of columns and the guesses on how they hang together. `cause`: "" or that of the best guess.

    moving, apart: rms that the first three columns, and what does not fit, must have for a look to count.
    """

    def __init__(self, guesses: Sequence[ROWS], moving: float, apart: float) -> None:
        self.causes = [cause for cause, _ in guesses]
        self.columns = guesses[0][1].shape[1]
        self._squares = np.array([(rows.T @ rows).ravel() for _, rows in guesses])
        self._own = min(3, self.columns // 2)
        self._floor = moving * moving, apart * apart
        self.cause, self.gain = "", nan
        self._rows = np.zeros((4 * WINDOWS[-1][0], self.columns))
        self.begin()

    def begin(self) -> None:
        """Forget the window, not the cause."""
        self._count = self._end = 0
        self._sum, self._in_block, self._time = [0.0] * self.columns, 0, 0.0
        self._against: list[tuple[str, int]] = [("", 0)] * len(WINDOWS)
        self._for = 0

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
        self._sum, self._in_block, self._time = [0.0] * self.columns, 0, self._time % BLOCK
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
                    self.cause = ""
            elif same >= times and not (self.cause and k):  # a long window still holds what has been mended
                self.cause, self._for = found, 0
        return self.cause != before

    def _look(self, count: int) -> str | None:
        """The cause that convicts, "" where the parts fit, None where nothing can be told."""
        rows = self._rows[self._end - count : self._end]
        rows = rows - rows.mean(axis=0)
        moments = rows.T @ rows
        n = self._own
        moving, driven = float(np.trace(moments[:n, :n])), float(np.trace(moments[n:, n:]))
        left = self._squares @ moments.ravel()
        apart = float(left[0])
        if moving < self._floor[0] * count:
            return None
        if driven == 0.0:
            steps = np.diff(rows[:, :n], axis=0)
            smooth = float((steps * steps).sum()) < moving  # of noise it is twice that
            return "absent" if smooth and moving > 9.0 * self._floor[1] * count else None
        if apart <= UNEXPLAINED * moving:
            return "" if moving > self._floor[1] * count else None
        if apart < self._floor[1] * count:
            return None
        best = float(left.min())
        if best > UNEXPLAINED * min(apart, moving):
            return None
        self.gain = sqrt(float(np.trace(moments[n : 2 * n, n : 2 * n])) / moving)
        within = 1.5 * best + 0.01 * moving
        return next(cause for cause, rest in zip(self.causes, left) if rest <= within)


class Turning:
    """Attitude against angular velocity: the comparison, and a quick guard against gross misfits of single samples."""

    def __init__(self, world: bool) -> None:
        self.compared = Comparison(rate_guesses(world), moving=3e-4, apart=2.5e-3)
        self._world = world
        self.begin()

    def begin(self) -> None:
        self.compared.begin()
        self._angles: tuple[float, float, float] | None = None
        self._before: tuple[float, ...] = ()
        self._integral = [0.0] * (6 if self._world else 3)
        self._misfit = [0.0] * 3
        self._mean, self._square = [0.0] * 3, [0.0] * 3

    def take(self, angles, rate, dt: float) -> bool:
        """Angles [rad], yaw unwrapped, and rates as sent [rad/s]. True where a sample must be refused by itself."""
        rates = angle_rates(angles[0], angles[1], rate)
        if self._world:
            rates += angle_rates(angles[0], angles[1], to_body(angles, rate))
        if self._angles is None:
            self._angles, self._before, self._mean = angles, rates, list(angles)
            self.compared.add((*angles, *self._integral), 0.0)
            return max(map(abs, rate)) > UNSEEN
        moved = [0.5 * dt * (a + b) for a, b in zip(self._before, rates)]
        self._integral = [a + b for a, b in zip(self._integral, moved)]
        fade, share, bad = exp(-dt / LEAK), min(1.0, dt / 5.0), False
        for i in range(3):
            off = self._misfit[i] = fade * self._misfit[i] + angles[i] - self._angles[i] - moved[i]
            self._mean[i] += share * (angles[i] - self._mean[i])
            self._square[i] += share * ((angles[i] - self._mean[i]) ** 2 - self._square[i])
            bad |= abs(off) > MISFIT[0] and abs(off) > MISFIT[0] + MISFIT[1] * sqrt(self._square[i])
        self._angles, self._before = angles, rates
        self.compared.add((*angles, *self._integral), dt)
        return bad


class Moving:
    """Position against the integral of the velocity, and height against its reference."""

    def __init__(self, reference: float, most: float) -> None:
        self.compared = Comparison(velocity_guesses(), moving=0.03, apart=0.1)
        self.reference, self.most = reference, most
        self.high = False
        self.begin()

    def begin(self) -> None:
        self.compared.begin()
        self._before: tuple[float, ...] = ()
        self._first = (0.0, 0.0, 0.0)
        self._integral = [0.0] * 12
        self._age = self._mean = self._rise = self._bend = 0.0
        self._up: float | None = None
        self._crest, self._trough, self._turns = -np.inf, np.inf, 0

    def take(self, position, angles, velocity, dt: float) -> None:
        parts = (*_columns(angles, velocity), *velocity)
        if not self._before:
            self._before, self._first = parts, position
        self._integral = [s + 0.5 * dt * (a + b) for s, a, b in zip(self._integral, self._before, parts)]
        self._before = parts
        self.compared.add((*(p - q for p, q in zip(position, self._first)), *self._integral), dt)
        self._height(position[2] - self.reference, parts[2] + parts[5] + parts[8], dt)

    def _height(self, z: float, up: float, dt: float) -> None:
        """Does z keep away from the reference? Told by the mean, or by crest and trough, or at once in a calm."""
        if self._up is not None and dt > 0.0:
            self._age += dt
            fast = min(1.0, dt / min(1.0, self._age))
            self._mean += min(1.0, dt / min(60.0, self._age)) * (z - self._mean)
            self._rise += fast * (abs(up) - self._rise)
            self._bend += fast * (abs(up - self._up) / dt - self._bend)
            self._turns += (up > 0.0) != (self._up > 0.0)
        self._up = up
        self._crest, self._trough = max(self._crest, z), min(self._trough, z)
        if self._age < 0.8:
            return
        swing = SWELL * hypot(1.6 * self._rise, SWELL * 1.6 * self._bend)
        half = 0.5 * (self._crest - self._trough)
        calm = abs(z) > self.most + 1.25 * swing
        swung = self._turns >= 3 and abs(self._crest - half) > self.most + 0.5 * half
        long = self._age >= 20.0 and abs(self._mean) > self.most + 0.1 * half
        if calm or swung or long:
            self.high = True
        elif self._age >= 2.0 and abs(z) <= self.most:
            self.high = False
        if self._turns >= 3 + 2 * self.high:
            self._turns, self._crest, self._trough = 1, z, z


class Weighing:
    """Specific force against gravity, over blocks of 0.1 s in the last second."""

    def __init__(self, gravity: float) -> None:
        self.gravity, self.cause = gravity, ""
        self.begin()

    def begin(self) -> None:
        self._age, self._size, self._up, self._held = 0.0, 0.0, 0.0, (self.cause, 0.0)

    def take(self, angles, force, dt: float) -> bool:
        """Force in body axes [m/s^2]. True where the cause has changed."""
        self._age += dt
        share = min(1.0, dt / max(1e-9, min(0.5, self._age)))
        self._size += share * (sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2) - self._size)
        self._up += share * (to_world(angles, force)[2] - self._up)
        cause, since = self._now(), self._held[1] + dt
        self._held = (cause, since) if cause == self._held[0] else (cause, 0.0)
        if cause == self.cause or self._age < 0.4 or self._held[1] < (0.2 if cause else 1.0):
            return False
        self.cause = cause
        return True

    def _now(self) -> str:
        size, up, g = self._size, self._up, self.gravity
        if size < 0.5 * g:
            return "gravity_units" if abs(abs(up) - 1.0) < 0.35 and size < 1.5 else "gravity_removed"
        if up < -0.5 * size:
            return "gravity_sign"
        return "gravity_direction" if up < 0.5 * size else ""


def to_body(angles, vector) -> tuple[float, float, float]:
    """The inverse of `to_world`."""
    (roll, pitch, yaw), (x, y, z) = angles, vector
    x, y = x * cos(yaw) + y * sin(yaw), y * cos(yaw) - x * sin(yaw)
    x, z = x * cos(pitch) - z * sin(pitch), z * cos(pitch) + x * sin(pitch)
    return x, y * cos(roll) + z * sin(roll), z * cos(roll) - y * sin(roll)


def _columns(angles, v) -> tuple[float, ...]:
    """The parts of a velocity along body x, y, z, each in the world: 9 numbers."""
    (roll, pitch, yaw), (vx, vy, vz) = angles, v
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw), sin(yaw)
    return (
        *(cy * cp * vx, sy * cp * vx, -sp * vx),
        *((cy * sp * sr - sy * cr) * vy, (sy * sp * sr + cy * cr) * vy, cp * sr * vy),
        *((cy * sp * cr + sy * sr) * vz, (sy * sp * cr - cy * sr) * vz, cp * cr * vz),
    )


__all__ = ["Comparison", "Moving", "Turning", "Weighing", "attitude_guesses", "heave_guesses", "to_body"]
