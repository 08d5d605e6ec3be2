"""Where a lag begins to be fitted, and how far from it the tow does the same again.

A squared rest has a minimum at every lag at which measured and simulated swell agree: least squares from a lag of 0
settles in the nearest. So each lag begins where the two are most alike over its whole range. The lag of a signal that
repeats itself, as under a heave of one period, is known up to multiples of that period alone.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from .least_squares import Fit, Nuisance, Problem, scales
from .observed import Observed
from .tow_model import Curve

TRIED = 401  # lags over a range
FINE = 0.2  # of the time in which a signal changes by its own spread: apart at most so far
MOST = 20_000  # samples, evenly taken, that say how alike two signals are
STILL = 1e-12  # of its size, that a signal moves: its round-off
SEEN = float(chi2.ppf(0.999, 1))  # of a likelihood ratio: two lags that are told apart


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
