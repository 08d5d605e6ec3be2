"""Sudden misfits, message by message: a velocity or a height that leaves what its own stream has been doing.

`io.comparison` needs half a second and more to name what is wrong. The cubic between samples makes an acceleration of
4 (change of velocity) / dt out of a velocity that steps, so not one such message may be used. What is usual is learnt
from the stream itself: a noisy one is allowed more.
"""

from __future__ import annotations

from math import dist, exp, hypot

LEARN, LEARN_MESSAGES = 1.0, 10  # s and messages before a stream is judged
MEMORY = 60.0  # s, decay of the largest usual value
OVER = 1.5  # times the largest usual change, that is still usual
FRACTION = 0.5  # of a step, that the positions must leave unexplained
WINDOW = 0.2  # s, memory of the misfit while messages are refused
AGAIN = 0.1  # s for which it must fit to be used again
GIVE_UP = 5.0  # s; a step that lasts so long without a name is the stream's new way
GIVE_UP_HEIGHT = 20.0  # s, longer than a height takes to be named


class RateGuard:
    """Three coordinates and their rates. A step of the rates that the coordinates do not follow is refused.

    floor: step that is always usual (m/s or rad/s); ramp: what a ship may accelerate by beside it, per s.
    """

    def __init__(self, floor: float, ramp: float) -> None:
        self.floor, self.ramp = floor, ramp
        self._peak = 0.0  # largest usual change per second
        self._forget()
        self.begin()

    def _forget(self) -> None:
        self._age, self._seen = 0.0, 0

    def begin(self) -> None:
        """After a gap: no message before; what is usual is kept."""
        self._before: tuple[tuple[float, ...], tuple[float, ...]] | None = None
        self._kept: tuple[float, ...] = ()  # newest rates that were used
        self._refused = self._step = self._fits = self._span = 0.0
        self._off = (0.0, 0.0, 0.0)

    def take(self, x, v, dt: float) -> bool:
        """Is this message to be refused? x: coordinates, v: their rates, dt: s since the message before."""
        before, self._before = self._before, (x, v)
        if before is None or not dt > 0.0:
            self._kept = v
            return False
        x0, v0 = before
        off = [b - a - 0.5 * dt * (p + q) for a, b, p, q in zip(x0, x, v0, v)]
        misfit = 2.0 * hypot(*off) / dt  # what the newest rate alone would be off by
        if self._refused:
            return self._still(v, off, misfit, dt)
        step = dist(v, self._kept)
        judged = self._age >= LEARN and self._seen >= LEARN_MESSAGES
        if judged and step > self.floor + (self.ramp + OVER * self._peak) * dt and misfit > FRACTION * step:
            self._refused, self._step, self._fits = dt, step, 0.0
            self._off, self._span = (0.0, 0.0, 0.0), 0.0
            return True
        self._age, self._seen = self._age + dt, self._seen + 1
        self._peak = max(self._peak * exp(-dt / MEMORY), step / dt)
        self._kept = v
        return False

    def _still(self, v, off, misfit: float, dt: float) -> bool:
        """While messages are refused: until the rates have fitted the moved coordinates again for a while."""
        self._refused += dt
        fade = exp(-dt / WINDOW)
        self._off, self._span = tuple(fade * a + b for a, b in zip(self._off, off)), fade * self._span + dt
        fits = min(misfit, 2.0 * hypot(*self._off) / self._span) <= FRACTION * self._step
        self._fits = self._fits + dt if fits else 0.0
        if self._refused > GIVE_UP:
            self._forget()
        elif self._fits < AGAIN:
            return True
        self._refused, self._kept = 0.0, v
        return False


class HeightGuard:
    """z against the integral of its velocity since the message before, or since the last that was used.

    most: step that is always usual, m.
    """

    def __init__(self, maximum: float) -> None:
        self.maximum = maximum
        self._peak = self._age = 0.0
        self._seen = 0
        self.begin()

    def begin(self) -> None:
        """After a gap; what is usual is kept."""
        self._before: tuple[float, float] | None = None  # z that is expected, vertical velocity
        self._refused = 0.0

    def take(self, z: float, climb: float, dt: float) -> bool:
        """Is this message to be refused? z: m, climb: m/s, dt: s since the message before."""
        if self._before is None or not dt > 0.0:
            self._before, self._refused = (z, climb), 0.0
            return False
        expected = self._before[0] + 0.5 * dt * (self._before[1] + climb)
        off = abs(z - expected)
        judged = self._age >= LEARN and self._seen >= LEARN_MESSAGES
        if judged and off > self.maximum + 2.0 * self._peak + 0.1 * self._refused:
            self._refused += dt
            if self._refused <= GIVE_UP_HEIGHT:
                self._before = expected, climb
                return True
            self._age, self._seen = 0.0, 0
        elif not self._refused:
            self._age, self._seen = self._age + dt, self._seen + 1
            self._peak = max(self._peak * exp(-dt / MEMORY), off)
        self._before, self._refused = (z, climb), 0.0
        return False
