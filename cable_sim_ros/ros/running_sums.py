"""What the verdict of a node needs of its tick outputs beside counts: sums over the ticks, for it keeps no tick
outputs."""

from __future__ import annotations

from math import asin, atan2, cos, degrees, inf, isfinite, nan, sin, sqrt

import numpy as np

from ..sim.checks.deviation_checks import PITCHED_OVER, SKIP, deviation_damped, pitch_against
from ..sim.verdict import Reason

AT_ONCE = 1.5  # ticks from one tick output to the next: more is a gap, and no acceleration is taken over it


class Moments:
    """Means, variances and covariance of two values, updated pair by pair (Welford)."""

    def __init__(self) -> None:
        self.count = 0
        self.mean = [0.0, 0.0]
        self._squares, self._products = [0.0, 0.0], 0.0

    def add(self, one: float, other: float) -> None:
        self.count += 1
        a, b = one - self.mean[0], other - self.mean[1]
        self.mean[0] += a / self.count
        self.mean[1] += b / self.count
        self._squares[0] += a * (one - self.mean[0])
        self._squares[1] += b * (other - self.mean[1])
        self._products += a * (other - self.mean[1])

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviations."""
        return sqrt(self._squares[0] / max(self.count, 1)), sqrt(self._squares[1] / max(self.count, 1))

    @property
    def correlation(self) -> float:
        """NaN where one of them does not change."""
        size = sqrt(self._squares[0] * self._squares[1])
        return self._products / size if size > 0.0 else nan


class RunningSums:
    """Takes every tick output that was published; tick: s; slow: m/s, pay-out below it is counted. `reasons` are
    those that a run over all of them would have.

    The first 20 s are left out, as in the summary: there the motion is taken up.
    """

    def __init__(self, tick: float, slow: float = 0.0) -> None:
        self.tick, self.slow = tick, slow
        self._seen = self._slow = 0
        self._tension = Moments()  # N, and the square of what was damped away, N^2
        self._ship = Moments()  # acceleration ahead, m/s^2, and pitch, deg
        self._before: tuple[int, float, float] = 0, nan, nan  # time [ns], velocity ahead [m/s], pitch [deg]
        self.least_scope = inf  # m
        self.max_slam = 0.0  # N

    def add(self, frame: np.record) -> None:
        """One tick output."""
        self._seen += 1
        self._slow += abs(float(frame["payout_rate"])) < self.slow
        self.least_scope = min(self.least_scope, float(frame["scope"]))
        self.max_slam = max(self.max_slam, float(frame["slam_estimate"]))
        x, y, z, w = (float(part) for part in frame["ship_quaternion"])
        yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        pitch = degrees(asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))))
        velocity = frame["ship_velocity"]
        ahead = float(velocity[0]) * cos(yaw) + float(velocity[1]) * sin(yaw)
        now = int(frame["time"]), ahead, pitch
        (time, speed, angle), self._before = self._before, now
        if self._seen * self.tick <= SKIP:
            return
        lost = float(frame["tension_damped"])
        self._tension.add(float(frame["tension"]), lost * lost if isfinite(lost) else 0.0)
        since = (now[0] - time) * 1e-9
        if 0.0 < since < AT_ONCE * self.tick and isfinite(speed):
            self._ship.add((ahead - speed) / since, 0.5 * (pitch + angle))

    @property
    def slow_fraction(self) -> float:
        """Part of the ticks in which the cable ran slower than ``slow``."""
        return self._slow / max(self._seen, 1)

    def reasons(self) -> list[Reason]:
        """Pitch of the wrong sign, and ringing that the steps damped away and the deviation misses."""
        found: list[Reason] = []
        if self._ship.count * self.tick >= PITCHED_OVER:
            surge, pitch = self._ship.deviations
            found += pitch_against(pitch, surge, self._ship.correlation)
        if self._tension.count:
            there, (mean, lost) = self._tension.deviations[0], self._tension.mean
            text = f"{sqrt(0.5 * lost):.3g} N rms or more beside a deviation of {there:.4g} N"
            damped = deviation_damped(mean, there * there, 0.5 * lost)
            found += [reason._replace(text=f"{reason.text}; {text}") for reason in damped]
        return found
