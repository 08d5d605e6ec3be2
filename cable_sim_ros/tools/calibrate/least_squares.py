"""Least squares of a tow against measured signals: free numbers, and bias, gain and lag of each instrument.

    measured(t) = gain * simulated(t - lag; numbers) + bias + rest

Each rest is divided by its noise times the root of the samples that count as one (its correlation time), so that a
signal that drifts does not outweigh one that does not. Derivatives with respect to bias, gain and lag are exact, those
with respect to the numbers central differences of two runs, STEP of the range to either side.

Where a lag begins to be fitted, and how far from it the tow does the same again.

A squared rest has a minimum at every lag at which measured and simulated swell agree: least squares from a lag of 0
settles in the nearest. So each lag begins where the two are most alike over its whole range. The lag of a signal that
repeats itself, as under a heave of one period, is known up to multiples of that period alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize_scalar
from scipy.stats import chi2
from scipy.stats import t as student

from ..compare.spectra import correlation_time
from .free import CalibrateError, Free
from .observed import Observed
from .tow_model import Curve, Curves

STEP = 0.005  # of the range: far above what the solver leaves, far below where a tow bends
PASSES = 4  # of the noise, which follows from the rest
SAME = 0.1  # change of the weights that needs no other pass
FTOL, XTOL = 1e-5, 1e-4  # a twentieth of a standard deviation of 300 samples; of the range
INSIDE = 1e-3  # of its range, from either end, where a free number begins
MAX_TRIALS = 40  # of a pass
NO_EFFECT = 1e-6  # of the signal, by a step to both sides: less is what a static start leaves
FLOOR = 1e-6  # of the spread of a signal: no instrument is better
SHORTEST = 8  # samples of which a correlation is looked for
CLEAR = 1.645  # of a correlation, in standard deviations of that of white noise: 95 %
KINDS = ("bias", "gain", "lag")
MAX_GAIN = (0.2, 5.0)

Simulate = Callable[[tuple[float, ...]], Curves]

TRIED = 401  # lags over a range
FINE = 0.2  # of the time in which a signal changes by its own spread: apart at most so far
MOST = 20_000  # samples, evenly taken, that say how alike two signals are
STILL = 1e-12  # of its size, that a signal moves: its round-off
SEEN = float(chi2.ppf(0.999, 1))  # of a likelihood ratio: two lags that are told apart


class Nuisance(NamedTuple):
    """What an instrument may add: kind (bias, gain, lag), quantity, prior deviation (None: no prior), bounds."""

    kind: str
    quantity: str
    sd: float | None
    low: float
    high: float

    @property
    def neutral(self) -> float:
        """Of a perfect instrument."""
        return 1.0 if self.kind == "gain" else 0.0

    @property
    def name(self) -> str:
        """For tables."""
        return f"{self.kind} of {self.quantity}"


class Fit(NamedTuple):
    """A fit: parameters (free ones from 0 to 1 of their range, then nuisances), noise and correlation time of each
    signal, weighted rest and derivatives with the priors last; converged, and what the solver says."""

    x: np.ndarray
    noise: dict[str, float]
    correlated: dict[str, float]
    rest: np.ndarray
    slope: np.ndarray
    converged: bool
    said: str


class Problem:
    """What is fitted: parameters in order, signals, and the simulation."""

    def __init__(
        self, simulate: Simulate, free: Sequence[Free], signals: Sequence[Observed], nuisances: Sequence[Nuisance] = ()
    ) -> None:
        self.simulate, self.free, self.signals, self.nuisances = simulate, list(free), list(signals), list(nuisances)
        self.low = np.array([0.0] * len(free) + [one.low for one in nuisances])
        self.high = np.array([1.0] * len(free) + [one.high for one in nuisances])

    @property
    def names(self) -> list[str]:
        """Of the parameters."""
        return [one.key for one in self.free] + [one.name for one in self.nuisances]

    def start(self) -> np.ndarray:
        """The scene as given, perfect instruments."""
        return np.array([one.place(one.start) for one in self.free] + [one.neutral for one in self.nuisances])

    def values(self, x: np.ndarray) -> tuple[float, ...]:
        """The free numbers in their units."""
        return tuple(one.at(float(u)) for one, u in zip(self.free, x))

    def instrument(self, x: np.ndarray, quantity: str) -> tuple[float, float, float]:
        """Bias, gain and lag of a signal."""
        found = {"bias": 0.0, "gain": 1.0, "lag": 0.0}
        for one, value in zip(self.nuisances, x[len(self.free) :], strict=True):
            if one.quantity == quantity:
                found[one.kind] = float(value)
        return found["bias"], found["gain"], found["lag"]

    def shown(self, x: np.ndarray, one: Observed, curves: Curves, time: np.ndarray) -> np.ndarray:
        """What the instrument of a signal would show."""
        bias, gain, lag = self.instrument(x, one.quantity)
        return gain * curves[one.quantity].value(time - lag) + bias

    def rest(self, x: np.ndarray, one: Observed, curves: Curves, part: np.ndarray) -> np.ndarray:
        """Simulated less measured."""
        return self.shown(x, one, curves, one.time[part]) - one.value[part]

    def either_side(self, x: np.ndarray, k: int) -> tuple[Curves, Curves, float]:
        """Curves a step below and above in free number k, within its range, and how far apart."""
        centre = min(max(float(x[k]), STEP), 1.0 - STEP)
        ends = []
        for place in (centre - STEP, centre + STEP):
            at = np.array(x)
            at[k] = place
            ends.append(self.simulate(self.values(at)))
        return ends[0], ends[1], 2.0 * STEP

    def by_instrument(self, x: np.ndarray, one: Observed, curves: Curves, kind: str) -> np.ndarray:
        """Derivative [n] of a signal over the fitted part with respect to its bias, gain or lag."""
        _, gain, lag = self.instrument(x, one.quantity)
        curve, time = curves[one.quantity], one.time[one.fitted] - lag
        if kind == "lag":
            return -gain * curve.rate(time)
        return curve.value(time) if kind == "gain" else np.ones(len(time))

    def slopes(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Derivatives [n, parameters] of each signal over the fitted part."""
        curves = self.simulate(self.values(x))
        out = {one.quantity: np.zeros((int(one.fitted.sum()), len(x))) for one in self.signals}
        for k in range(len(self.free)):
            below, above, apart = self.either_side(x, k)
            for one in self.signals:
                time = one.time[one.fitted]
                change = self.shown(x, one, above, time) - self.shown(x, one, below, time)
                out[one.quantity][:, k] = change / apart
        for k, nuisance in enumerate(self.nuisances, start=len(self.free)):
            one = next(signal for signal in self.signals if signal.quantity == nuisance.quantity)
            out[one.quantity][:, k] = self.by_instrument(x, one, curves, nuisance.kind)
        return out

    def priors(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rest and derivatives of the priors."""
        rest, slope = [], []
        for k, one in enumerate(self.free):
            if one.sd is not None:
                assert one.mean is not None
                rest.append((one.at(float(x[k])) - one.mean) / one.sd)
                slope.append(np.eye(len(x))[k] * (one.high - one.low) / one.sd)
        for k, nuisance in enumerate(self.nuisances, start=len(self.free)):
            if nuisance.sd is not None:
                rest.append((float(x[k]) - nuisance.neutral) / nuisance.sd)
                slope.append(np.eye(len(x))[k] / nuisance.sd)
        return np.array(rest), np.array(slope).reshape(-1, len(x))

    def weighted(self, x: np.ndarray, scale: Mapping[str, float]) -> np.ndarray:
        """Rest of all signals over their scale, then of the priors."""
        curves = self.simulate(self.values(x))
        parts = [self.rest(x, one, curves, one.fitted) / scale[one.quantity] for one in self.signals]
        return np.concatenate([*parts, self.priors(x)[0]])

    def weighted_slope(self, x: np.ndarray, scale: Mapping[str, float]) -> np.ndarray:
        """Derivatives of `weighted`."""
        slopes = self.slopes(x)
        return np.concatenate([*(slopes[q] / scale[q] for q in slopes), self.priors(x)[1]])

    def check_effect(self) -> None:
        """Raise CalibrateError for a free number that changes no signal."""
        x = self.start()
        for k, one in enumerate(self.free):
            below, above, _ = self.either_side(x, k)
            for signal in self.signals:
                time = signal.time[signal.fitted]
                a, b = below[signal.quantity].value(time), above[signal.quantity].value(time)
                if np.abs(b - a).max() > NO_EFFECT * max(np.abs(a).max(), np.abs(b).max()):
                    break
            else:
                told = ", ".join(signal.quantity for signal in self.signals)
                raise CalibrateError(
                    f"--free {one.key}: has no effect on {told} in this tow; nothing was fitted. Free another number, "
                    f"or give a record that shows it"
                )


def lasting(rest: np.ndarray) -> float:
    """Samples that count as one. The autocorrelations of a short record are too small: where neighbours are clearly
    alike, at least what noise of the first order has, its correlation corrected for the length (Marriott and Pope 1954,
    Biometrika 41, 390)."""
    found, n = correlation_time(rest), len(rest)
    y = rest - rest.mean()
    total = float((y**2).sum())
    alike = float((y[1:] * y[:-1]).sum()) / total if total > 0.0 else 0.0
    if n < SHORTEST or alike * n**0.5 < CLEAR:
        return found
    alike = min((n * alike + 1.0) / (n - 3.0), 1.0 - 1.0 / n)
    return min(float(n), max(found, (1.0 + alike) / (1.0 - alike)))


def noise_of(problem: Problem, x: np.ndarray) -> tuple[dict[str, float], dict[str, float]]:
    """Noise and correlation time [samples] of each signal, of what is left at x. Noise that is stated stands."""
    curves = problem.simulate(problem.values(x))
    noise, correlated = {}, {}
    for one in problem.signals:
        rest = problem.rest(x, one, curves, one.fitted)
        floor = FLOOR * max(float(np.std(one.value)), 1e-6 * float(np.abs(one.value).max()), 1e-12)
        noise[one.quantity] = one.noise or max(float(np.sqrt(np.mean(rest**2))), floor)
        correlated[one.quantity] = lasting(rest)
    return noise, correlated


def scales(problem: Problem, noise: Mapping[str, float], correlated: Mapping[str, float]) -> dict[str, float]:
    """What each rest is divided by: noise times the root of the samples that count as one, wider where few are left to
    know both from (quantile of Student's t over that of the normal distribution)."""
    out = {}
    for one in problem.signals:
        worth = float(one.fitted.sum()) / correlated[one.quantity]
        wide = float(student.ppf(0.975, max(1.0, worth - 1.0)) / student.ppf(0.975, np.inf))
        out[one.quantity] = noise[one.quantity] * correlated[one.quantity] ** 0.5 * wide
    return out


def _solve(problem: Problem, x: np.ndarray, scale: Mapping[str, float]) -> Any:
    """From x, which is taken INSIDE of the ranges of the free numbers: at an end the first trust region has no size."""
    count = len(problem.free)
    x = np.array(x, float)
    x[:count] = np.clip(x[:count], INSIDE, 1.0 - INSIDE)
    return least_squares(
        lambda at: problem.weighted(at, scale),
        x,
        jac=lambda at: problem.weighted_slope(at, scale),
        bounds=(problem.low, problem.high),
        method="trf",
        x_scale="jac",
        ftol=FTOL,
        xtol=XTOL,
        gtol=1e-10,
        max_nfev=MAX_TRIALS,
    )


def fit(problem: Problem, begin: np.ndarray | None = None) -> Fit:
    """Fit all parameters; the noise follows from the rest, in passes, where it is not stated."""
    x = problem.start() if begin is None else begin
    x = np.clip(x, problem.low, problem.high)
    first = not problem.free  # of instruments alone
    scale = {one.quantity: one.noise or max(float(np.std(one.value)), FLOOR) for one in problem.signals}
    for _ in range(PASSES):
        given = dict(scale)
        solved = _solve(problem, x, given)
        x = np.clip(solved.x, problem.low, problem.high)
        noise, correlated = noise_of(problem, x)
        scale = scales(problem, noise, correlated)
        change = max(abs(scale[q] / given[q] - 1.0) for q in scale)
        alone = len(problem.signals) == 1 and not len(problem.priors(x)[0])
        if not solved.status > 0 or change < SAME or alone or first:  # the weight of one signal alone changes nothing
            break
    return Fit(
        x,
        noise,
        correlated,
        problem.weighted(x, scale),
        problem.weighted_slope(x, scale),
        bool(solved.status > 0),
        str(solved.message),
    )


def first_lags(problem: Problem, x: np.ndarray) -> np.ndarray:
    """The parameters with each lag where simulated and measured are most alike, whatever their bias and gain; of lags
    that fit alike the least."""
    out = np.array(x, float)
    curves = problem.simulate(problem.values(x))
    for k, nuisance in _lags(problem):
        one = _observed(problem, nuisance)
        time, value = _fewer(one.time[one.fitted]), _fewer(one.value[one.fitted])
        tried = np.linspace(nuisance.low, nuisance.high, TRIED)
        unlike = np.array([_unlike(curves[one.quantity].value(time - lag), value) for lag in tried])
        cost = len(time) * np.log(np.maximum(unlike, 1e-12))
        if nuisance.sd is not None:
            cost += (tried / nuisance.sd) ** 2
        there = np.concatenate([[np.inf], cost, [np.inf]])
        low = (cost < there[:-2]) & (cost <= there[2:]) & (cost < min(cost.min() + SEEN, cost.max()))
        if low.any():  # none where a signal does not move
            out[k] = min(tried[low], key=abs)
    return out


def repeats(problem: Problem, found: Fit, inflation: np.ndarray) -> dict[str, float]:
    """Seconds after which a signal whose lag is fitted does the same again, as far as its noise lets that be seen; by
    name of the lag. Signals that do not are left out."""
    curves = problem.simulate(problem.values(found.x))
    scale = scales(problem, found.noise, found.correlated)
    out = {}
    for k, nuisance in _lags(problem):
        one = _observed(problem, nuisance)
        _, gain, lag = problem.instrument(found.x, one.quantity)
        biased = any(other.kind == "bias" and other.quantity == one.quantity for other in problem.nuisances)
        time = one.time[one.fitted]
        worth = len(time) * (gain / scale[one.quantity]) ** 2 / float(inflation[k])
        again = _again(curves[one.quantity], _fewer(time) - lag, worth, biased)
        if again is not None:
            out[nuisance.name] = again
    return out


def _again(curve: Curve, time: np.ndarray, worth: float, biased: bool) -> float | None:
    """The least shift, up to half of the time, at which the curve is as before after it was not; None: there is none.
    worth: of a mean squared difference, as a likelihood ratio."""

    def change(shift: float) -> float:
        later = time[time >= time[0] + shift]
        apart = curve.value(later - shift) - curve.value(later)
        return worth * float(np.var(apart) if biased else np.mean(apart**2))

    spread, rate = float(np.std(curve.value(time))), float(np.std(curve.rate(time)))
    half = 0.5 * float(time[-1] - time[0])
    if spread <= STILL * float(np.abs(curve.value(time)).max()) or not rate > 0.0:
        return None
    shifts = np.linspace(0.0, half, int(np.clip(half * rate / (FINE * spread), 3, 10 * TRIED)) + 1)
    changes = np.array([change(float(shift)) for shift in shifts])
    left = np.flatnonzero(changes > SEEN)
    for k in range(left[0] if len(left) else len(shifts), len(shifts) - 1):
        if changes[k] <= changes[k - 1] and changes[k] <= changes[k + 1]:
            least = minimize_scalar(change, bounds=(shifts[k - 1], shifts[k + 1]), method="bounded")
            if least.fun < SEEN:
                return float(least.x)
    return None


def _lags(problem: Problem) -> list[tuple[int, Nuisance]]:
    all_of = enumerate(problem.nuisances, start=len(problem.free))
    return [(k, one) for k, one in all_of if one.kind == "lag"]


def _observed(problem: Problem, nuisance: Nuisance) -> Observed:
    return next(one for one in problem.signals if one.quantity == nuisance.quantity)


def _fewer(values: np.ndarray) -> np.ndarray:
    return values[:: len(values) // MOST + 1]


def _unlike(a: np.ndarray, b: np.ndarray) -> float:
    """1 less the square of the correlation; 1 where they go against each other."""
    if min(np.ptp(a) / max(np.abs(a).max(), STILL), np.ptp(b) / max(np.abs(b).max(), STILL)) < STILL:
        return 1.0
    return 1.0 - max(float(np.corrcoef(a, b)[0, 1]), 0.0) ** 2
