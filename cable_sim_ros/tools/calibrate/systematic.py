"""Errors that averaging does not take out, and by how much they move calibrated numbers, linear about a fit.

An interval knows of the scatter of the rests alone. What is the same in all samples, as a rounding that the signal does
not cross, an offset that no free number explains, or a mesh that is not that of the numbers, is told here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..compare.comparison import reason
from .confidence import QUANTILE, Confidence
from .least_squares import KINDS, Fit, Problem, lasting, scales
from .result import Calibration
from .tow_model import TowModel, TrialError

TAKEN = {"bias": 1.0, "gain": 0.01, "lag": 0.1}  # unit of the signal, 1, s: the error of an instrument that is told of
OFFSET = 4.0  # standard errors of a mean rest, from which it is no chance
MOVES = 0.5  # of the half width of an interval: an error that moves a number by more is a reason
CROSSED = 0.5  # of a rounding: a signal that varies by less does not average it out
BESIDE = 2.5  # deviations of a prior, that a number may lie beside it
FAST, SHARE = 0.2, 0.05  # of the rate of simulated values; of the variance of a signal, that may be faster


class Taken(NamedTuple):
    """An instrument's bias, gain or lag that is not fitted; moves: change of each parameter, in its unit, by such an
    error of it, None: not known."""

    quantity: str
    kind: str
    error: float
    unit: str
    moves: list[float] | None


def moved(problem: Problem, found: Fit, errors: Mapping[str, np.ndarray]) -> np.ndarray:
    """Change of the parameters by errors of signals over the fitted part, [n] by quantity in their units."""
    scale = scales(problem, found.noise, found.correlated)
    error, at = np.zeros(len(found.rest)), 0
    for one in problem.signals:
        part = slice(at, at + int(one.fitted.sum()))
        at = part.stop
        if one.quantity in errors:
            error[part] = errors[one.quantity] / scale[one.quantity]
    return np.linalg.lstsq(found.slope, error, rcond=None)[0]


def _told(problem: Problem, shift: np.ndarray) -> str:
    by = (f"{free.key} by {x * (free.high - free.low):.2g} {free.unit}" for free, x in zip(problem.free, shift))
    return ", ".join(text.rstrip() for text in by)


def taken_as_true(problem: Problem, found: Fit, steady: bool, apart: bool) -> list[Taken]:
    """Bias, gain and lag of instruments that are not free: what every interval takes as exact.

    apart: some parameters cannot be told apart, so that no shift of one of them is known.
    """
    curves, out = problem.simulate(problem.values(found.x)), []
    freed = {(one.kind, one.quantity) for one in problem.nuisances}
    size = np.array([one.high - one.low for one in problem.free] + [1.0] * len(problem.nuisances))
    for one in problem.signals:
        for kind in KINDS:
            if (kind, one.quantity) in freed or (kind == "lag" and steady):
                continue
            error = TAKEN[kind] * problem.by_instrument(found.x, one, curves, kind)
            shift = None if apart else (size * moved(problem, found, {one.quantity: error})).tolist()
            unit = {"bias": one.unit, "gain": "", "lag": "s"}[kind]
            out.append(Taken(one.quantity, kind, TAKEN[kind], unit, shift))
    return out


def systematic(out: Calibration, problem: Problem, found: Fit, known: Confidence, model: TowModel) -> None:
    """Put into ``out`` the reasons of what moves its numbers and is in no interval."""
    half = QUANTILE**0.5 * known.deviation[: len(problem.free)]

    def matters(shift: np.ndarray) -> bool:
        return bool((np.abs(shift[: len(half)]) > MOVES * half).any())

    def tell(flag: str, text: str, *names: str) -> None:
        out.reasons.append(reason(flag, text, *names))

    curves, tick = problem.simulate(problem.values(found.x)), model.scene.solver.tick
    freed = {one.quantity for one in problem.nuisances if one.kind == "bias"}
    for one in problem.signals:
        count = int(one.fitted.sum())
        if one.step > 0.0 and one.spread < CROSSED * one.step and one.quantity not in freed:
            error = one.step / 12.0**0.5
            shift = moved(problem, found, {one.quantity: np.full(count, error)})
            text = (
                f"{one.quantity} is rounded to {one.step:.3g} {one.unit} and varies by {one.spread:.3g} only, so that "
                f"the rounding does not average out: {error:.2g} {one.unit} of it, its usual size, moves "
                f"{_told(problem, shift)}, and no interval has it"
            )
            tell("ROUNDED", text, one.quantity)
        rest = problem.rest(found.x, one, curves, one.fitted)
        mean = float(rest.mean())
        error = float(rest.std()) * (lasting(rest) / count) ** 0.5
        shift = moved(problem, found, {one.quantity: np.full(count, mean)})
        if one.quantity not in freed and abs(mean) > OFFSET * error and matters(shift):
            text = (
                f"{one.quantity}: calibrated, the scene is {mean:+.3g} {one.unit} beside it in the mean, "
                f"{abs(mean) / max(error, 1e-300):.3g} times what chance leaves: the signals, or a prior, contradict "
                f"each other. So much of a bias moves {_told(problem, shift)}; free it (--bias {one.quantity}), or "
                "find what is off"
            )
            tell("OFFSET", text, one.quantity)
        if not model.steady and (share := _faster(curves[one.quantity].value, out.fitted_s, tick)) > SHARE:
            text = (
                f"{one.quantity}: {100.0 * share:.2g} % of the simulated variance is faster than {FAST:g} of the rate "
                f"of simulated values, one each {tick:g} s: lag and gain come out wrong. Give a smaller --every"
            )
            tell("COARSE", text, one.quantity)
    _priors(problem, found, tell)
    try:
        error_of = _mesh(problem, found, model)
    except TrialError as error:
        tell(
            "MESH",
            f"the found numbers cannot be simulated on their own mesh, the fit holds that of the start ({error})",
        )
        return
    if error_of and matters(shift := moved(problem, found, error_of)):
        sizes = ", ".join(f"{name} by {np.mean(error):.3g}" for name, error in error_of.items())
        text = (
            f"the fit holds the mesh of the start; on that of the found numbers the scene shows other signals ({sizes} "
            f"in the mean), which moves {_told(problem, shift)}. Begin nearer: --set with these numbers, and fit again"
        )
        tell("MESH", text)


def _faster(value: Callable[[np.ndarray], np.ndarray], span: tuple[float, float], tick: float) -> float:
    """Share of the variance of a simulated signal that is faster than FAST of the rate of its values."""
    if not tick > 0.0 or span[1] - span[0] < 10.0 * tick:
        return 0.0
    at = value(np.arange(span[0], span[1], tick))
    power = np.abs(np.fft.rfft((at - at.mean()) * np.hanning(len(at)))) ** 2
    total = float(power.sum())
    fast = float(power[np.fft.rfftfreq(len(at)) > FAST].sum())
    return fast / total if total > 0.0 else 0.0


def _priors(problem: Problem, found: Fit, tell: Callable[..., Any]) -> None:
    """Reasons where the data are far from what a prior says."""
    rests = iter(problem.priors(found.x)[0].tolist())
    every = [*((one.key, one.sd) for one in problem.free), *((one.name, one.sd) for one in problem.nuisances)]
    for name in (name for name, sd in every if sd is not None):
        if abs(rest := next(rests)) > BESIDE:
            text = f"{name} lies {abs(rest):.2g} deviations beside its prior: data and prior contradict each other"
            tell("PRIOR", text, name)


def _mesh(problem: Problem, found: Fit, model: TowModel) -> dict[str, np.ndarray]:
    """What the signals change by over the fitted part, on the mesh of the found numbers; empty where it is the same."""
    values = problem.values(found.x)
    own = model.on_own_mesh(values)
    if own is None:
        return {}
    curves = problem.simulate(values)
    return {
        one.quantity: problem.shown(found.x, one, own, time) - problem.shown(found.x, one, curves, time)
        for one in problem.signals
        for time in (one.time[one.fitted],)
    }
