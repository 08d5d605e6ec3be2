"""Calibration of a scene on a recording: fit on its first part, intervals, judgement on the rest, verdict."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...io.scenes.winch_plan import WinchPlan
from ...io.sources.recorded_tow import RecordedTow
from ...runs.offline import start_up
from ...sim.scene import Scene
from ..compare.pairing import SECOND
from ..logs.own_signals import Signal
from .confidence import Confidence, Interval, confidence, linear_intervals, minuit, profile
from .free import CONSEQUENCE, CalibrateError, flat, free_of
from .least_squares import MAX_GAIN, Fit, Nuisance, Problem, first_lags, fit
from .limits import HOLD_OUT, MAX_LAG
from .observed import Observed, chosen, observed
from .reasons import judge
from .result import Calibration, Left, Parameter, Shown
from .systematic import taken_as_true
from .tow_model import TowModel

AFTER = 5.0  # s that are simulated past the last measured value
BIASES = 10.0  # spreads of a signal, that a bias may be
Progress = Callable[[str, int], None]


class Options(NamedTuple):
    """What is fitted beside the free numbers, and how. bias, gain, lag: quantity (or all) -> prior deviation, None."""

    signals: Mapping[str, float | None] = {}
    bias: Mapping[str, float | None] = {}
    gain: Mapping[str, float | None] = {}
    lag: Mapping[str, float | None] = {}
    max_lag: float = MAX_LAG
    hold_out: float = HOLD_OUT
    profile: bool = True
    steady: bool = False


def calibrate(
    scene: Scene,
    signals: Sequence[Signal],
    name: str,
    free: Sequence[str],
    tow: RecordedTow | None = None,
    *,
    duration: float | None = None,
    plan: WinchPlan | None = None,
    options: Options | None = None,
    progress: Progress = lambda what, runs: None,
) -> Calibration:
    """Fit the free numbers of a scene to measured signals under a motion; free: as of `free_of`.

    Raises CalibrateError, SceneError, TrialError (a tow within the ranges that cannot be simulated).
    """
    options = options or Options()
    if options.profile:
        minuit()
    numbers = free_of(free, scene)
    used = chosen(signals, options.signals, name)
    begun = clock.process_time()
    duration = duration or _measured(used, tow, options.max_lag, start_up(scene, True))
    model = TowModel(scene, numbers, tow, duration, plan, options.steady, lambda runs: progress("simulating", runs))
    model.check_ends()
    model(tuple(one.start for one in numbers))
    nuisances = _instruments(used, options)
    origin, window = _window(used, model, options, bool(options.lag))
    parts = observed(used, options.signals, origin, window, options.hold_out, model.scene.solver.tick, options.steady)
    problem = Problem(model, numbers, parts, nuisances)
    problem.check_effect()
    found = fit(problem, first_lags(problem, problem.start()))
    known = confidence(problem, found)
    out = Calibration(name, scene, converged=found.converged, solver=found.said, steady=options.steady)
    out.profile = options.profile and found.converged and not known.apart
    intervals = profile(problem, found, known) if out.profile else linear_intervals(problem, found, known)
    _fill(out, problem, found, known, intervals)
    out.fitted_s = window[0], window[1] - options.hold_out * (window[1] - window[0])
    out.held_s = (out.fitted_s[1], window[1]) if options.hold_out > 0.0 else None
    judge(out, problem, found, known, model, signals, intervals)
    unknown = {one.name for one in out.parameters if one.interval == (None, None)}  # of which the data say nothing
    values = zip((one.key for one in numbers), problem.values(found.x), strict=True)
    out.values = flat(scene, {key: value for key, value in values if key not in unknown})
    out.notes += [f"{q}: {text.removeprefix(f'{q}: ')}" for q, signal in used.items() for text in signal.assumed]
    out.runs, out.cpu_s = model.runs, clock.process_time() - begun
    return out


def _measured(used: Mapping[str, Signal], tow: RecordedTow | None, lag: float, least: float) -> float | None:
    """Seconds of the motion until nothing more was measured, at least so many; None: all of it."""
    if tow is None or len(tow.spans) != 1:
        return None
    first, last = tow.spans[0][:2]
    needed = (max(int(one.time[-1]) for one in used.values()) - first) * SECOND + lag + AFTER
    return needed if least < needed < (last - first) * SECOND else None


def _window(
    used: Mapping[str, Signal], model: TowModel, options: Options, lags: bool
) -> tuple[int, tuple[float, float]]:
    if options.steady:
        origin = min(int(one.time[0]) for one in used.values())
        return origin, (0.0, max((int(one.time[-1]) - origin) * SECOND for one in used.values()))
    first, last = model.window
    for one in used.values():  # both ends that all have
        first = max(first, (int(one.time[0]) - model.origin) * SECOND)
        last = min(last, (int(one.time[-1]) - model.origin) * SECOND)
    return model.origin, (first, last - (options.max_lag if lags else 0.0))


def _instruments(used: Mapping[str, Signal], options: Options) -> list[Nuisance]:
    """Bias, gain and lag that were asked for."""
    found = []
    for kind, asked in (("bias", options.bias), ("gain", options.gain), ("lag", options.lag)):
        for name in asked:
            if name != "all" and name not in used:
                raise CalibrateError(
                    f"--{kind} {name}: is no signal that is fitted; {CONSEQUENCE}. Give one of {', '.join(used)} or all"
                )
        for name, signal in used.items():
            if name not in asked and "all" not in asked:
                continue
            sd = asked.get(name, asked.get("all"))
            if kind == "bias":
                value = signal.value[np.isfinite(signal.value)]
                most = BIASES * float(np.std(value)) + float(np.abs(np.mean(value))) + (5.0 * sd if sd else 0.0)
                low, high = -most, most
            elif kind == "gain":
                low, high = MAX_GAIN
            else:
                low, high = -options.max_lag, options.max_lag
                if options.steady:
                    raise CalibrateError(
                        f"--lag {name}: a steady tow has no lag; {CONSEQUENCE}. Leave --lag or --steady out"
                    )
            found.append(Nuisance(kind, name, sd, low, high))
    return found


UNITS = {"gain": "", "lag": "s"}


def _fill(out: Calibration, problem: Problem, found: Fit, known: Confidence, intervals: list[Interval]) -> None:
    units = {one.quantity: one.unit for one in problem.signals}
    taken = taken_as_true(problem, found, out.steady, bool(known.apart))
    for k, name in enumerate(problem.names):
        interval = intervals[k]
        number = k < len(problem.free)
        if number:
            free = problem.free[k]
            low, high = (None if end is None else free.at(end) for end in (interval.low, interval.high))
            unit, start, value, limits = free.unit, free.start, free.at(float(found.x[k])), (free.low, free.high)
        else:
            other = problem.nuisances[k - len(problem.free)]
            low, high, unit = interval.low, interval.high, UNITS.get(other.kind, units[other.quantity])
            start, value, limits = other.neutral, float(found.x[k]), (other.low, other.high)
        exact = tuple((*one[:4], None if one.moves is None else one.moves[k]) for one in taken)
        out.parameters.append(Parameter(name, unit, start, value, (low, high), limits, number, interval.rise, exact))
    out.correlation, out.apart = known.correlation.tolist(), known.apart
    begin = problem.start()
    before, after = problem.simulate(problem.values(begin)), problem.simulate(problem.values(found.x))
    alone = None
    if problem.nuisances:
        given = problem.values(begin)
        instrument = Problem(lambda _: problem.simulate(given), [], problem.signals, problem.nuisances)
        alone = instrument, fit(instrument, first_lags(instrument, instrument.start())).x
    for one in problem.signals:

        def left(at: Problem, x: np.ndarray, curves: Any, one: Observed = one) -> Left:
            rests = [at.rest(x, one, curves, part) for part in (one.fitted, ~one.fitted)]
            told = [(float(rest.mean()), float(np.sqrt(np.mean(rest**2)))) if len(rest) else None for rest in rests]
            assert told[0] is not None
            return Left(told[0], told[1])

        out.signals.append(
            Shown(
                one.quantity,
                one.unit,
                found.noise[one.quantity],
                one.noise is not None,
                int(one.fitted.sum()),
                known.independent[one.quantity],
                left(problem, begin, before),
                None if alone is None else left(alone[0], alone[1], before),
                left(problem, found.x, after),
                one,
                problem.shown(begin, one, before, one.time),
                problem.shown(found.x, one, after, one.time),
            )
        )
