"""Curves through the columns of a table of motion: exact numbers are interpolated, rounded ones are smoothed.

The tick's acceleration is the second derivative of what goes in, so rounding is not small: 1 cm at 10 Hz makes
0.7 m/s^2. What is rounded is found from the numbers (`rounding.py`) and goes in as the smoothest spline within the
rounding (`smoothing.py`); numbers that are not rounded, or so finely that it does not matter, stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, sin
from typing import NamedTuple

import numpy as np

from ...sim.flag_rules import MIN_ROUNDED, ROUNDED
from ...sim.verdict import Reason, check
from .rounding import noise, resolution

HARMLESS = 0.02  # of the acceleration of a column: rounding that makes no more of it is left alone
Curve = Callable[..., np.ndarray]  # of times [s] and the order of the derivative
Part = tuple[np.ndarray, np.ndarray, "np.ndarray | None"]  # times [s], values, rates or none


class Samples(NamedTuple):
    """Motion at stamps: int64 [n] ns, coordinates [n, 6] m and rad, their rates [n, 6] per s."""

    time: np.ndarray
    value: np.ndarray
    rate: np.ndarray


class Given(NamedTuple):
    """A column: name, unit, factor to m or rad, is it an angle?"""

    name: str
    unit: str
    scale: float
    angle: bool


class Rounding(NamedTuple):
    """What was found of a rounded column; accelerations are rms in m/s^2 or rad/s^2.

    resolution: in the unit of the column; cutoff: of the smoothing [Hz]; raw: false acceleration of the rounded
    numbers; left: what smoothing leaves wrong, estimated; motion: acceleration of the smooth motion.
    """

    column: Given
    resolution: float
    cutoff: float
    raw: float
    left: float
    motion: float

    def as_dict(self) -> dict[str, object]:
        """For the JSON."""
        return {
            "column": self.column.name,
            "resolution": self.resolution,
            "unit": self.column.unit,
            "cutoff_hz": self.cutoff,
            "acceleration_rounded": self.raw,
            "acceleration_left": self.left,
            "acceleration_motion": self.motion,
        }

    def __str__(self) -> str:
        unit = "rad/s^2" if self.column.angle else "m/s^2"
        return (
            f"{self.column.name} is rounded to {self.resolution:.3g} {self.column.unit}, which by itself makes "
            f"{self.raw:.2g} {unit} (rms) where the motion has {self.motion:.2g}: smoothed within its rounding, "
            f"cut-off {self.cutoff:.2g} Hz, which leaves {self.left:.2g} {unit} wrong"
        )


def through(column: Given, parts: list[Part]) -> tuple[list[Curve], Rounding | None]:
    """Curves of the stretches of a column in m or rad, and what was smoothed, None: nothing.

    Numbers that are not rounded get a cubic spline (C2), with rates beside them a cubic Hermite spline (C1). Rates that
    are rounded beside values that are not are left out: the values give them.
    """
    increment = resolution(np.concatenate([values for _, values, _ in parts]))
    rates = [rate for _, _, rate in parts if rate is not None]
    rate_increment = resolution(np.concatenate(rates)) if rates else 0.0
    curves = [_interpolated(*part) for part in parts]
    if increment == 0.0:
        if rate_increment > 0.0:
            curves = [_interpolated(t, values, None) for t, values, _ in parts]
        return curves, None
    from .smoothing import smooth

    rate = 1.0 / float(np.median(np.concatenate([np.diff(t) for t, _, _ in parts])))
    deviation, seen = noise([values for _, values, _ in parts], increment, rate)
    smoothed = smooth(parts, increment, deviation, rate_increment / 12.0**0.5, seen)
    between = [np.concatenate([t[:-1] + part * np.diff(t) for part in (1 / 6, 1 / 2, 5 / 6)]) for t, _, _ in parts]
    rough = [curve(t, 2) - even(t, 2) for t, curve, even in zip(between, curves, smoothed.curves)]
    raw = float(np.sqrt(np.mean(np.concatenate(rough) ** 2)))
    if raw <= HARMLESS * smoothed.signal:
        return curves, None
    found = Rounding(column, increment / column.scale, smoothed.cutoff, raw, smoothed.left, smoothed.signal)
    return list(smoothed.curves), found


def _interpolated(t: np.ndarray, values: np.ndarray, rates: np.ndarray | None) -> Curve:
    from scipy.interpolate import CubicHermiteSpline, CubicSpline  # not at each start: a run by a bag needs none

    return CubicSpline(t, values) if rates is None else CubicHermiteSpline(t, values, rates)


def judged(
    where: str, found: dict[int, Rounding], motion: Samples, sheave: tuple[float, float, float]
) -> tuple[list[dict[str, object]], list[str], list[Reason]]:
    """What smoothing gives to the JSON, to the notes and to the verdict of a run.

    found: by coordinate; motion: as it goes in; sheave: in base_link, m. The acceleration that is left there is held
    against that of the motion in the vertical plane of the tow: across it a tow hardly feels either.
    """
    if not found:
        return [], [], []
    left = [found[k].left if k in found else 0.0 for k in range(6)]
    x, y, z = sheave
    wrong = hypot(*left[:3], z * left[4], y * left[5], x * left[5], z * left[3], x * left[4], y * left[3])
    moving = _in_plane(motion, sheave)
    reasons = []
    if wrong > max(ROUNDED * moving, MIN_ROUNDED):
        coarse = ", ".join(f"{one.column.name} to {one.resolution:.3g} {one.column.unit}" for one in found.values())
        reasons.append(
            check(
                "MOTION_ROUNDED",
                f"{where} is rounded ({coarse}); smoothed within that, it still leaves {wrong:.2g} m/s^2 (rms) wrong "
                f"of the {moving:.2g} m/s^2 with which the sheave moves ({100.0 * wrong / max(moving, 1e-9):.0f} %, "
                f"limit {100.0 * ROUNDED:g} %). Write the motion with more digits, or take a finer sensor",
            )
        )
    return [one.as_dict() for one in found.values()], [f"{where}: {one}" for one in found.values()], reasons


def _in_plane(motion: Samples, sheave: tuple[float, float, float]) -> float:
    """Rms acceleration of the sheave up and along the mean heading [m/s^2], angles taken as small."""
    t = (motion.time - motion.time[0]) * 1e-9
    steps = np.diff(t)
    near = steps < 1.5 * np.median(steps)  # no differences over gaps
    a = (np.diff(motion.rate, axis=0) / steps[:, None])[near]
    x, y, z = sheave
    yaw = float(np.median(motion.value[:, 5]))
    ahead = a[:, 0] * cos(yaw) + a[:, 1] * sin(yaw) + z * a[:, 4] - y * a[:, 5]
    up = a[:, 2] + y * a[:, 3] - x * a[:, 4]
    return float(np.sqrt(np.mean(ahead**2 + up**2)))
