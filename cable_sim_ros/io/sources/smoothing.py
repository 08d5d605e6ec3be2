"""A smoothing spline through coarse numbers whose misfit is their coarseness.

Cubic B-splines with a penalty on the third derivative (P-splines: Eilers and Marx 1996, Statistical Science 11, 89),
as smooth as the misfit allows (discrepancy principle: Reinsch 1967, Numerische Mathematik 10, 177-183): what is left
between spline and numbers has the variance of the rounding, increment^2/12. That takes a part of the motion with it, so
the rest is smoothed once more and added (twicing: Tukey 1977; Stuetzle and Mittal 1979). For even steps the whole is a
low-pass without phase of gain 1 - (1 - H)^2, H = 1 / (1 + (f / cut-off)^6): 0.9995 at half the cut-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log, pi

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array, diags  # diags_array came with scipy 1.12

DEGREE, PENALTY = 3, 3  # of the spline; derivative that is kept small
LONGEST = 60.0  # s, period of the lowest cut-off
KNOTS = 0.4  # s between knots to begin with, halved until the cut-off is KNOT_FRACTION of what they can follow
KNOT_FRACTION = 0.3
HALVINGS = 14  # of the logarithm of the cut-off: to 0.1 %
REPEATED = 0.17  # of the increment: largest rms that the rounding of a regular wave has at the frequency of the wave
STIFF = 100.0  # rates that are exact weigh as if they were off by this part of what the values are, over 10 s


@dataclass(frozen=True)
class Curve:
    """A spline about a straight line: call it with times [s] and the order of the derivative."""

    spline: BSpline
    offset: float
    slope: float

    def __call__(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        line = self.offset + self.slope * t if order == 0 else self.slope if order == 1 else 0.0
        return self.spline(t, order) + line


@dataclass(frozen=True)
class Smooth:
    """Curves of the stretches of one coordinate. cutoff: Hz; left: rms of the acceleration [unit/s^2] that rounding and
    smoothing leave wrong, estimated; signal: rms of that of the curves."""

    curves: list[Curve]
    cutoff: float
    left: float
    signal: float


class _Stretch:
    """Normal equations of a stretch without a gap: values, and rates or None, in units of their deviation."""

    def __init__(self, t, values, rates, weights: tuple[float, float], spacing: float) -> None:
        count = max(1, round((t[-1] - t[0]) / spacing))
        self.h = (t[-1] - t[0]) / count
        self.knots = t[0] + self.h * np.arange(-DEGREE, count + DEGREE + 1)
        inside = np.clip(t, self.knots[DEGREE], self.knots[-DEGREE - 1])
        rows = BSpline.design_matrix(inside, self.knots, DEGREE)
        self.slope, self.offset = np.polyfit(t - t[0], values, 1)
        self.offset -= self.slope * t[0]
        self.t, self.weights = t, weights
        self.rows, self.data = [csr_array(rows)], [values - self.offset - self.slope * t]
        n = rows.shape[1]
        if rates is not None:
            lower = BSpline.design_matrix(inside, self.knots[1:-1], DEGREE - 1)
            step = csr_array(diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n))) / self.h
            self.rows.append(csr_array(lower @ step))
            self.data.append(rates - self.slope)
        binomial = np.array([-1.0, 3.0, -3.0, 1.0])
        third = csr_array(diags([c * np.ones(n - PENALTY) for c in binomial], range(4), shape=(n - PENALTY, n)))
        self.penalty = _banded((third.T @ third) / self.h ** (2 * PENALTY - 1))
        self.normal = sum(_banded(w * (a.T @ a)) for w, a in zip(weights, self.rows))

    def solve(self, stiffness: float, data: list[np.ndarray] | None = None) -> np.ndarray:
        """Coefficients for a penalty of this weight."""
        right = sum(w * (a.T @ b) for w, a, b in zip(self.weights, self.rows, self.data if data is None else data))
        return solveh_banded(self.normal + stiffness * self.penalty, right, check_finite=False)

    def misfit(self, stiffness: float, counted: tuple[bool, bool]) -> tuple[float, int]:
        """Sum of squares between data and spline over their variance, and the number of them."""
        c = self.solve(stiffness)
        kept = [(w, b - a @ c) for w, a, b, count in zip(self.weights, self.rows, self.data, counted) if count]
        return sum(w * float(rest @ rest) for w, rest in kept), sum(len(rest) for _, rest in kept)

    def twice(self, stiffness: float) -> tuple[Curve, np.ndarray]:
        """The curve, and the acceleration at the times that the same does to what is smooth: what it took away."""
        c = self.solve(stiffness)
        c = c + self.solve(stiffness, [b - a @ c for a, b in zip(self.rows, self.data)])
        lost = c
        for _ in range(2):
            lost = lost - self.solve(stiffness, [a @ lost for a in self.rows])
        return (
            Curve(BSpline(self.knots, c, DEGREE), self.offset, self.slope),
            BSpline(self.knots, lost, DEGREE)(self.t, 2),
        )


def _banded(matrix) -> np.ndarray:
    """Upper bands of a symmetric sparse matrix, as `solveh_banded` takes them."""
    bands = np.zeros((DEGREE + 1, matrix.shape[0]))
    for k in range(DEGREE + 1):
        bands[DEGREE - k, k:] = matrix.diagonal(k)
    return bands


def smooth(
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray | None]],
    increment: float,
    noise: float,
    rate_noise: float = 0.0,
    seen: float = 0.0,
) -> Smooth:
    """The smoothest spline of each stretch that lies within the noise of the data, with one cut-off for all.

    parts: of each stretch its times [n, s], even but for rows left out, values [n] and rates [n] or None; increment: of
    the values; noise, rate_noise: standard deviations of values and rates, 0 of rates: they are exact; seen: that of
    the values for the estimate of what is left, where it is larger than what may be smoothed away.
    """
    dt = float(np.median(np.concatenate([np.diff(t) for t, _, _ in parts])))
    with_rates = parts[0][2] is not None
    fast = (rate_noise or noise / (10.0 * STIFF)) if with_rates else inf
    weights, counted = (noise**-2, fast**-2), (True, rate_noise > 0.0)
    spacing = max(dt, KNOTS)
    while True:
        stretches = [_Stretch(*part, weights, spacing) for part in parts]
        low, high = log(2.0 * pi / LONGEST), log(pi / spacing)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            misfits = [s.misfit(_stiffness(middle, weights, dt), counted) for s in stretches]
            if sum(square for square, _ in misfits) > sum(count for _, count in misfits):
                low = middle
            else:
                high = middle
        cutoff = float(np.exp(high))
        if spacing <= dt * 1.001 or cutoff < KNOT_FRACTION * pi / spacing:
            break
        spacing = max(dt, 0.5 * spacing)
    stiffness = _stiffness(high, weights, dt)
    found = [s.twice(stiffness) for s in stretches]
    curves = [curve for curve, _ in found]
    bent = np.concatenate([curve(s.t, 2) for curve, s in zip(curves, stretches)])
    moving = np.concatenate([curve(s.t, 1) for curve, s in zip(curves, stretches)])
    bias = np.concatenate([lost for _, lost in found])
    repeated = REPEATED * increment * (_rms(bent) / max(_rms(moving - moving.mean()), 1e-300)) ** 2
    # values that stay on one increment for several rows err together: their error is as if they came that seldom
    apart = max(dt, min(0.5 * increment / max(_rms(moving), 1e-300), LONGEST))
    spread = _left_by_noise(stiffness, weights, apart) ** 0.5 * max(1.0, seen / noise)
    return Smooth(curves, cutoff / (2.0 * pi), float(np.hypot(max(spread, repeated), _rms(bias))), _rms(bent))


def _stiffness(log_cutoff: float, weights: tuple[float, float], dt: float) -> float:
    """Weight of the penalty that halves a wave of this frequency [log of rad/s]."""
    w2 = np.exp(2.0 * log_cutoff)
    return (weights[0] + w2 * weights[1]) / dt / w2**PENALTY


def _left_by_noise(stiffness: float, weights: tuple[float, float], dt: float) -> float:
    """Variance of the curve's acceleration that noise of the data leaves, which are dt apart [s]."""
    w = np.linspace(0.0, pi / dt, 2001)[1:]
    data = (weights[0] + w * w * weights[1]) / dt
    gain = 1.0 - (stiffness * w**6 / (data + stiffness * w**6)) ** 2
    return float(np.sum(w**4 * gain * gain / data)) * (w[1] - w[0]) / pi


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values * values)))
