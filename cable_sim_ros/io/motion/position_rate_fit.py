"""Position and velocity of a motion sample that fit each other, for the cubic between samples.

The cubic through positions and velocities makes a false acceleration of 6 e / dt^2 out of a position that is off its
velocity's integral by e: one millimetre at 50 Hz is 15 m/s^2. Two things are watched for each of the six coordinates
and set right once they are seen, until the next epoch; what fits passes untouched:

* rough rates (differences of third order): a tracker of fourth order takes their place;
* positions that do not fit the integral of the rates: the integral takes their place, drawn to them slowly.

Both are linear observers with all poles in one place, so that their exponential is a polynomial; between samples the
input is a polynomial in time whose motion they follow exactly: exact for any interval. No delay but their phase.
"""

from __future__ import annotations

from math import exp

import numpy as np

from ...sim.tables.elementary import product

LIMIT = np.array([0.05] * 3 + [1.2e-3] * 3)  # m/s^2, rad/s^2 (40 m off): rms of false acceleration that is let pass
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
SLOW_ROUGH, SLOW_MISFIT = 0.1, 0.5  # s; for longer intervals the limit grows: noise does less, differences err more
PLAIN = 10.0  # limits; so large a misfit counts from the second sample on
WATCHED = 5.0  # s of memory of the rms
CORNER = 8.0  # rad/s, poles of the rate tracker: error 4 (omega / CORNER)^3

# rates: v' = a + 1.5 w q, a' = j + w^2 q, j' = w^3 q / 4, q' = 4 w (input - v - q): four poles at -w
_RATE = np.array(
    [
        [0.0, 1.0, 0.0, 1.5 * CORNER],
        [0.0, 0.0, 1.0, CORNER**2],
        [0.0, 0.0, 0.0, CORNER**3 / 4.0],
        [-4.0 * CORNER, 0.0, 0.0, -4.0 * CORNER],
    ]
)


def _powers(matrix: np.ndarray, pole: float) -> list[np.ndarray]:
    """exp(matrix h) = exp(-pole h) sum of these times h^k: matrix + pole is nilpotent."""
    step = matrix + pole * np.eye(len(matrix))
    powers = [np.eye(len(matrix))]
    for k in range(1, len(matrix)):
        powers.append(product(powers[-1], step) / k)
    return powers


def _decay(powers: list[np.ndarray], pole: float, h: float) -> np.ndarray:
    return exp(-pole * h) * sum((power * h**k for k, power in enumerate(powers)), np.zeros_like(powers[0]))


class PositionRateFit:
    """Six coordinates and their rates made to fit each other. time: s in which positions draw, 0 = pass everything."""

    def __init__(self, time: float) -> None:
        self.pole = 1.0 / time if time > 0.0 else 0.0
        w = self.pole  # position: d' = b + w q, b' = w^2 q / 3, q' = 3 w (measured - d - q): three poles at -w
        self._position = _powers(np.array([[0.0, 1.0, w], [0.0, 0.0, w * w / 3.0], [-3.0 * w, 0.0, -3.0 * w]]), w)
        self._rate = _powers(_RATE, CORNER)
        self.reset()

    def reset(self) -> None:
        """A new epoch: everything passes until it is seen not to fit."""
        self.smoothed, self.integrated, self._following = np.zeros(6, bool), np.zeros(6, bool), np.zeros(6, bool)
        self._x: np.ndarray | None = None  # newest position: measured
        self._out = np.zeros(6)  # and given out
        self._velocities: list[np.ndarray] = []  # newest first, at most four
        self._steps: list[float] = []  # s between them
        self._roughness, self._misfit = np.zeros(6), np.zeros(6)  # mean squares, (m/s^2)^2
        self._age = 0.0
        self._tracked = np.zeros((4, 6))  # v a j q
        self._drawn = np.zeros((2, 6))  # b q

    @staticmethod
    def names(which: np.ndarray) -> str:
        """Names of coordinates, for the report; "" for none."""
        return " ".join(name for name, yes in zip(COORDINATES, which) if yes)

    def push(self, h: float, row) -> list[float]:
        """Twelve numbers (coordinates, rates) to use for those measured, h seconds after the ones before."""
        if not self.pole:
            return list(row)
        x, v = np.array(row[:6], float), np.array(row[6:12], float)
        self._velocities = [v, *self._velocities[:3]]
        if self._x is None:
            self._x = self._out = x
            return list(row)
        step = x - self._x
        self._steps = [h, *self._steps[:2]]
        slope, curve, third = self._differences()
        h2 = self._steps[1] if len(self._steps) > 1 else 0.0
        moved = h * (v - h * (slope / 2.0 + h * (curve / 6.0 + third * ((h + h2) / 6.0 - h / 12.0))))
        self._watch(h, (step - moved) * (6.0 / (h * h)), third * (1.9 * (sum(self._steps) / 3.0) ** 2))
        if not self.integrated.any():
            self._x = self._out = x
            return list(row)
        before, self._x = self._x, x
        return self._fitted(h, before, x, v, moved, slope + curve * h, 2.0 * curve)

    def _differences(self) -> list[np.ndarray]:
        """Divided differences of first to third order of the velocities, newest first; 0 as yet unknown."""
        steps, now, found = self._steps, self._velocities, []
        for order in range(1, len(now)):
            now = [(a - b) / sum(steps[i : i + order]) for i, (a, b) in enumerate(zip(now, now[1:]))]
            found.append(now[0])
        return found + [np.zeros(6)] * (3 - len(found))

    def _fitted(self, h: float, x0, x, v, moved, slope, bend) -> list[float]:
        """x0, x: measured before, now; moved: integral of the rates; slope, bend: derivatives of their quadratic."""
        v1, zero = self._velocities[1], np.zeros(6)
        new, old = np.array([v, slope, bend, zero]), np.array([v1, slope - bend * h, bend, zero])  # tracked exactly
        calm = np.array([v1, (v - self._velocities[-1]) / sum(self._steps), zero, zero])  # to begin with
        before = np.where(self._following, self._tracked, calm)
        after = new + product(_decay(self._rate, CORNER, h), before - old)
        rate0, rate1 = (s[1] + 1.5 * CORNER * s[3] for s in (before, after))
        smooth = h * (before[0] + after[0]) / 2.0 - h * h * (rate1 - rate0) / 12.0
        self._tracked, self._following = after, self.smoothed.copy()
        moved, v = np.where(self.smoothed, smooth, moved), np.where(self.smoothed, after[0], v)
        z0, z1 = x0 - self._out, x - self._out - moved
        drift = (z1 - z0) / h
        b, q = self._drawn
        d, b, q = np.array([z1, drift, 0.0 * q]) + (
            product(_decay(self._position, self.pole, h), np.array([-z0, b - drift, q]))
        )
        self._drawn = np.where(self.integrated, [b, q], 0.0)
        self._out = np.where(self.integrated, self._out + moved + d, x)
        v = np.where(self.integrated, v + b + self.pole * q, v)
        return [*self._out.tolist(), *v.tolist()]

    def _watch(self, h: float, misfit, roughness) -> None:
        if len(self._steps) < 3:
            self.integrated |= (np.abs(misfit) > PLAIN * LIMIT) & (h <= SLOW_ROUGH)
            return
        self._age = min(self._age + h, WATCHED)
        fraction = min(1.0, h / self._age)
        self._misfit += fraction * (misfit * misfit - self._misfit)
        self._roughness += fraction * (roughness * roughness - self._roughness)
        self.smoothed |= self._roughness > (LIMIT * max(1.0, (h / SLOW_ROUGH) ** 2)) ** 2
        self.integrated |= (self._misfit > (LIMIT * max(1.0, (h / SLOW_MISFIT) ** 4)) ** 2) | self.smoothed
