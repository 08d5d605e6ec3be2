"""How well a fit is known: covariance that allows for correlated rests, correlations, profile likelihood.

The weights count a rest as so many independent samples as its correlation time says. Where derivative and rest vary
together, that is too many still: the covariance is then that of the sums over blocks of the record (sandwich: White
1982, Econometrica 50, 1; blocks: Kunsch 1989, Ann. Statist. 17, 1217), and the likelihood ratio of a parameter is
divided by the ratio of the two variances (Kent 1982, Biometrika 69, 19); it is never multiplied.

The profile is of a response surface: curves of second order in the free numbers, of runs at the ends of the linear
intervals and at their corners. Minuit (iminuit; James and Roos 1975, Comput. Phys. Commun. 10, 343) finds where it
rises by the quantile of 95 %; the tow is simulated at each end again, and what it rises by is told.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student

from ...errors import told_as
from ..compare.spectra import LEVEL, blocks
from .free import CalibrateError
from .least_squares import Fit, Problem, scales
from .observed import Observed

QUANTILE = float(chi2.ppf(LEVEL, 1))
APART = 0.95  # of a correlation: above, the data cannot tell two parameters apart
RANK = 1e-6  # of the largest singular value
INVOLVED = 0.2  # of a direction that the data do not see: share of a parameter in it
FEWEST = 6  # blocks
LEAST, MOST = 0.02, 0.45  # of the range, of a step of the response surface
NEEDS = (
    "profile likelihood needs iminuit; nothing was simulated. pip install 'cable_sim_ros[calibrate]', or take "
    "--intervals linear"
)


class Interval(NamedTuple):
    """95 % interval of a parameter in the units of x; None: it ends at a bound. rise: of the likelihood ratio at either
    end, simulated, over what was asked for; None: not simulated. linear: Minuit found none."""

    low: float | None
    high: float | None
    rise: tuple[float | None, float | None] = (None, None)
    linear: bool = False


class Confidence(NamedTuple):
    """Standard deviations of the parameters, inflation of each variance over independent rests, correlations, pairs and
    groups that cannot be told apart, independent samples by signal, are they too few?"""

    deviation: np.ndarray
    inflation: np.ndarray
    correlation: np.ndarray
    apart: list[tuple[str, ...]]
    independent: dict[str, float]
    few: bool


def confidence(problem: Problem, found: Fit) -> Confidence:
    """Of a fit, linear about it."""
    names, slope = problem.names, found.slope
    size = np.sqrt((slope**2).sum(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    _, values, ways = np.linalg.svd(slope / size, full_matrices=False)
    apart = []
    for value, way in zip(values, ways):
        if value <= RANK * values[0] or not values[0] > 0.0:
            apart.append(tuple(name for name, part in zip(names, way) if abs(part) > INVOLVED))
    if len(values) < len(names):
        apart.append(tuple(names))
    inverse = (ways.T / np.maximum(values, RANK * (values[0] or 1.0)) ** 2) @ ways / np.outer(size, size)
    meat, few, independent = _meat(problem, found)
    linear, robust = np.diag(inverse), np.diag(inverse @ meat @ inverse)
    inflation = np.maximum(1.0, robust / np.where(linear > 0.0, linear, 1.0))
    deviation = np.sqrt(linear * inflation)
    root = np.sqrt(np.where(linear > 0.0, linear, 1.0))
    correlation = (inverse / np.outer(root, root)).clip(-1.0, 1.0)
    for i, j in combinations(range(len(names)), 2):
        if abs(correlation[i, j]) > APART and not any({names[i], names[j]} <= set(group) for group in apart):
            apart.append((names[i], names[j]))
    return Confidence(deviation, inflation, correlation, apart, independent, few)


def _meat(problem: Problem, found: Fit) -> tuple[np.ndarray, bool, dict[str, float]]:
    """Variance of the derivative of half the sum of squares, by blocks; few samples?; independent samples."""
    p = len(found.x)
    total, few, at = np.zeros((p, p)), False, 0
    independent = {}
    for one in problem.signals:
        n = int(one.fitted.sum())
        part = slice(at, at + n)
        at += n
        score = found.slope[part] * found.rest[part, None]
        correlated = found.correlated[one.quantity]
        independent[one.quantity] = n / correlated
        block = blocks(n, correlated)
        if block is None or block[-1] + 1 < FEWEST:
            few = True
            block = np.arange(n) * min(FEWEST, n) // n
        count = int(block[-1]) + 1
        sums = np.stack([score[block == k].sum(axis=0) for k in range(count)])
        rest = sums - sums.mean(axis=0)
        # quantile of Student's t over that of the normal one: blocks are few
        wide = (student.ppf(0.5 + 0.5 * LEVEL, count - 1) ** 2) / QUANTILE
        total += wide * count / (count - 1) * rest.T @ rest
    slope = found.slope[at:]
    return total + slope.T @ slope, few, independent


def linear_intervals(problem: Problem, found: Fit, known: Confidence) -> list[Interval]:
    """From the standard deviations; an end beyond a bound is None."""
    half = QUANTILE**0.5 * known.deviation
    out = []
    for k, x in enumerate(found.x):
        low, high = x - half[k], x + half[k]
        inside = float(low) if low > problem.low[k] else None, float(high) if high < problem.high[k] else None
        out.append(Interval(*inside))
    return out


def minuit() -> Any:
    """The class Minuit; CalibrateError where iminuit is not installed."""
    with told_as(CalibrateError, NEEDS, of=ImportError):
        from iminuit import Minuit
    return Minuit


class Surface:
    """Signals as functions of second order in the free numbers about a fit."""

    def __init__(self, problem: Problem, x: np.ndarray, half: np.ndarray) -> None:
        self.problem, self.count = problem, len(problem.free)
        self.scale = np.array([float(np.clip(half[k], LEAST, MOST)) for k in range(self.count)])
        self.centre = np.array([np.clip(x[k], self.scale[k], 1.0 - self.scale[k]) for k in range(self.count)])
        eye = np.eye(self.count)
        self.middle = self._at(0.0 * eye[0])
        self.below, self.above = [self._at(-way) for way in eye], [self._at(way) for way in eye]
        self.pairs = list(combinations(range(self.count), 2))
        self.corners = [self._at(eye[i] + eye[j]) for i, j in self.pairs]

    def _at(self, way: np.ndarray) -> Any:
        return self.problem.simulate(self.problem.values(self.centre + self.scale * way))

    def rest(self, x: np.ndarray, one: Observed) -> np.ndarray:
        """Simulated less measured over the fitted part."""
        bias, gain, lag = self.problem.instrument(x, one.quantity)
        time, name = one.time[one.fitted] - lag, one.quantity
        z = (x[: self.count] - self.centre) / self.scale
        middle = self.middle[name].value(time)
        below = [curves[name].value(time) - middle for curves in self.below]
        above = [curves[name].value(time) - middle for curves in self.above]
        value = middle + sum(
            0.5 * z[k] * (above[k] - below[k]) + 0.5 * z[k] ** 2 * (above[k] + below[k]) for k in range(self.count)
        )
        for (i, j), curves in zip(self.pairs, self.corners):
            value = value + z[i] * z[j] * (curves[name].value(time) - middle - above[i] - above[j])
        return gain * value + bias - one.value[one.fitted]


def profile(problem: Problem, found: Fit, known: Confidence) -> list[Interval]:
    """95 % intervals by profile likelihood, of each parameter over all others. CalibrateError without iminuit."""
    make = minuit()
    half = QUANTILE**0.5 * known.deviation
    surface = Surface(problem, found.x, half)
    scale = scales(problem, found.noise, found.correlated)

    def cost(x: np.ndarray) -> float:
        parts = [surface.rest(x, one) / scale[one.quantity] for one in problem.signals]
        return float(sum((part**2).sum() for part in parts) + (problem.priors(x)[0] ** 2).sum())

    def simulated(x: np.ndarray) -> float:
        return float((problem.weighted(x, scale) ** 2).sum())

    names = [f"x{k}" for k in range(len(found.x))]
    fitter = make(cost, found.x, name=names)
    fitter.errors = [max(0.5 * float(one), 1e-9) for one in half]
    fitter.limits = list(zip(problem.low.tolist(), problem.high.tolist()))
    fitter.errordef, fitter.strategy, fitter.print_level = 1.0, 1, 0
    fitter.migrad()
    least = simulated(found.x)
    best = np.array(fitter.values)
    out = []
    for k, name in enumerate(names):
        fitter.errordef = float(known.inflation[k])
        try:
            fitter.minos(name, cl=LEVEL)
            error = fitter.merrors[name]
        except (RuntimeError, ValueError, KeyError):  # no minimum that Minuit takes for one
            out.append(linear_intervals(problem, found, known)[k]._replace(linear=True))
            continue
        ends: list[float | None] = []
        rises: list[float | None] = []
        rough = False
        for valid, limited, change, bound, way in (
            (error.lower_valid, error.at_lower_limit, error.lower, problem.low[k], -1.0),
            (error.upper_valid, error.at_upper_limit, error.upper, problem.high[k], 1.0),
        ):
            if not valid and not limited:  # Minuit gave up there: that is no bound
                change, rough = way * half[k], True
            # Minuit's minimum of the surface, a hair from that of the fit
            end = float(found.x[k] + change)
            near = abs(best[k] + change - bound) <= 1e-6 * (problem.high[k] - problem.low[k])
            ends.append(None if limited or near or way * end >= way * bound else end)
            rises.append(None)
        if k < len(problem.free):
            for side, place in enumerate(ends):
                if place is not None:
                    rises[side] = (simulated(_others(problem, cost, found.x, k, place)) - least) / (
                        QUANTILE * float(known.inflation[k])
                    )
        out.append(Interval(ends[0], ends[1], (rises[0], rises[1]), rough))
        fitter.values = best
    return out


def _others(problem: Problem, cost: Callable[[np.ndarray], float], x: np.ndarray, k: int, place: float) -> np.ndarray:
    """The parameters with number k at a place and all others where the surface is least."""
    at = np.array(x)
    at[k] = np.clip(place, problem.low[k], problem.high[k])
    if len(x) == 1:
        return at
    fitter = minuit()(cost, at, name=[f"x{i}" for i in range(len(x))])
    fitter.limits = list(zip(problem.low.tolist(), problem.high.tolist()))
    fitter.errordef, fitter.strategy, fitter.print_level = 1.0, 1, 0
    fitter.fixed[f"x{k}"] = True
    fitter.migrad()
    return np.array(fitter.values)
