"""Why calibrated numbers cannot be taken as they are: bounds, correlations, what was held out or measured beside."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...sim.verdict import Reason
from ..compare.comparison import reason
from ..compare.pairing import GAP, clean
from ..logs.own_signals import Signal
from .confidence import APART, Confidence, Interval
from .least_squares import Fit, Problem, repeats
from .result import Calibration
from .systematic import systematic
from .tow_model import TowModel

NEAR = 1e-3  # of its range: so near a bound it is at it
RISE = 0.2  # of what was asked for, that the likelihood at the end of an interval may be beside it
WORSE = 1.05  # times the rms on what was held out: more is no calibration
MISFIT = 2.0  # times the stated noise, that a calibrated scene may leave
WORTH = 1.2  # times the spread of a signal about its own mean, that a calibrated scene may leave
TINY = 1e-3  # of the spread: what a solver leaves of a log without noise
MAD = 1.4826  # of a median absolute deviation, to a standard deviation
FAR, DECIDE = 6.0, 0.5  # deviations of the usual rest, from which a value is alone; share of the squares of such values
ENOUGH = 36.0  # independent samples: from there on none are told as few
SPEED, PAYOUT = 0.05, 0.01  # of what is simulated, that the measured one may be beside it


def judge(
    out: Calibration,
    problem: Problem,
    found: Fit,
    known: Confidence,
    model: TowModel,
    signals: Sequence[Signal],
    intervals: Sequence[Interval],
) -> None:
    """Put into ``out`` the reasons that its numbers cannot be taken as they are; signals: all of the recording;
    intervals: of the parameters, in the order of the problem."""
    if not found.converged:
        text = f"the fit has not converged ({found.said}): its numbers are where it stopped"
        out.reasons.append(reason("UNCONVERGED", text))
    out.reasons += _of_parameters(out, known)
    _repeated(out, problem, found, known)
    out.reasons += _of_intervals(out, problem, known, intervals)
    out.reasons += _of_signals(out)
    _unlike(out, problem, found, known)
    if not known.apart:
        systematic(out, problem, found, known, model)
    if out.held_s is None:
        out.notes.append("nothing was held out (--hold-out 0): no part of the record has judged the fit")
    ran, warned = model.told(problem.values(found.x))
    out.reasons += [one._replace(text=f"the calibrated run: {one.text}") for one in ran.reasons]
    out.notes += [f"the calibrated run: {text}" for text in warned]
    _beside(out, problem, found, model, signals)


def _of_parameters(out: Calibration, known: Confidence) -> Iterator[Reason]:
    """Numbers at an end of their range, of which the data say nothing, or that they cannot tell apart."""
    for one in out.parameters:
        low, high = one.limits
        near = NEAR * (high - low)
        edge = low if one.value - low < near else high if high - one.value < near else None
        if edge is not None:
            text = f"{one.name} = {one.value:.6g} {one.unit} is at the end of its range, {edge:g}: the best lies beyond"
            yield reason("AT_BOUND", text.replace("  ", " "), one.name)
        elif one.number and one.interval == (None, None):
            text = (
                f"the data say nothing of {one.name}: its interval is all of its range [{low:g}, {high:g}], and the "
                "scene keeps the value it has. Record a tow that shows it, or leave it out"
            )
            yield reason("UNKNOWN", text, one.name)
        elif one.number and None in one.interval:
            out.notes.append(f"the interval of {one.name} ends at its range: the data give no bound on that side")
    for group in [names for names in known.apart if len(names) > 1]:  # of one alone UNKNOWN says it
        text = (
            f"the data cannot tell {' and '.join(group)} apart (correlation above {APART:g}): along a line of them, as "
            "long as their intervals, all fit nearly as well; fix one, give it a prior, or record a tow that separates "
            "them"
        )
        yield reason("NOT_APART", text, *group)


def _of_intervals(
    out: Calibration, problem: Problem, known: Confidence, intervals: Sequence[Interval]
) -> Iterator[Reason]:
    """Intervals that are rough."""
    if known.few:
        few = {name: count for name, count in known.independent.items() if count < ENOUGH} or known.independent
        told = ", ".join(f"{name} {count:.0f}" for name, count in few.items())
        yield reason("FEW_SAMPLES", f"independent samples are few ({told}): the intervals themselves are uncertain")
    for one in out.parameters:
        if beside := [rise for rise in one.rise if rise is not None and abs(rise - 1.0) > RISE]:
            text = (
                f"{one.name}: at an end of its interval the likelihood rises {beside[0]:.2g} times what it should: the "
                "tow bends more than second order over it, and the interval is rough"
            )
            yield reason("INTERVAL", text, one.name)
    for name, interval in zip(problem.names, intervals, strict=True):
        if interval.linear:
            text = f"{name}: Minuit found no profile, its interval is linear and may be rough"
            yield reason("INTERVAL", text, name)


def _of_signals(out: Calibration) -> Iterator[Reason]:
    """Signals that the calibrated scene leaves beyond their noise, or leaves worse where it was not fitted."""
    for shown in out.signals:
        left = shown.calibrated.fitted[1]
        if shown.noise_stated and left > MISFIT * shown.noise:
            text = (
                f"{shown.quantity}: calibrated, the scene leaves {left:.4g} {shown.unit} rms, stated is a noise of "
                f"{shown.noise:.4g}: the model is not within it, and what it lacks may have moved the numbers"
            )
            yield reason("NOISE", text, shown.quantity)
    for shown in out.signals:
        alone, whose = shown.instrument or shown.given, "with the instrument alone" if shown.instrument else "as given"
        held, before = shown.calibrated.held, alone.held
        if held is not None and before is not None and held[1] > WORSE * before[1]:
            text = (
                f"{shown.quantity}: calibrated, the scene leaves {held[1]:.4g} {shown.unit} rms on the part held out, "
                f"{whose} {before[1]:.4g}: what was fitted does not hold there"
            )
            yield reason("HOLD_OUT", text, shown.quantity)


def _unlike(out: Calibration, problem: Problem, found: Fit, known: Confidence) -> None:
    """Reasons where a signal is no measurement of this tow with some noise: what is left is more than the signal
    varies, or is that of single values."""
    curves = problem.simulate(problem.values(found.x))
    for one in problem.signals:
        steps = np.diff(one.time[one.fitted])
        holes = float(steps[steps > GAP * np.median(steps)].sum()) if len(steps) else 0.0
        if holes > 0.0:
            span = out.fitted_s[1] - out.fitted_s[0]
            out.notes.append(f"{one.quantity}: {holes:.3g} s of the {span:.3g} s that are fitted have no values")
        rest, spread = problem.rest(found.x, one, curves, one.fitted), float(np.std(one.value[one.fitted]))
        left = float(np.sqrt(np.mean(rest**2)))
        # of a mean of few windows more is left by chance
        chance = (1.0 + 9.0 / known.independent[one.quantity]) ** 0.5 if out.steady else 1.0
        if left > spread * max(WORTH, chance):
            text = (
                f"{one.quantity}: calibrated, the scene leaves {left:.4g} {one.unit} rms, where its own mean would "
                f"leave {spread:.4g}: another sign, unit, clock or tow; cable-sim compare looks for the first three"
            )
            out.reasons.append(reason("MISFIT", text, one.quantity))
        off = np.abs(rest - np.median(rest))
        alone = off > max(FAR * MAD * float(np.median(off)), TINY * spread)
        if one.noise is None and alone.any() and float(np.sum(off[alone] ** 2)) > DECIDE * float(np.sum(off**2)):
            text = (
                f"{one.quantity}: {int(alone.sum())} of {len(rest)} values are more than {FAR:g} times the usual rest "
                f"of {MAD * float(np.median(off)):.3g} {one.unit} away, up to {off.max():.3g}, and make most of its "
                "noise: spikes, which `range` of the mapping leaves out, or a part of the record that is another tow"
            )
            out.reasons.append(reason("OUTLIERS", text, one.quantity))


def _repeated(out: Calibration, problem: Problem, found: Fit, known: Confidence) -> None:
    """Reasons, or notes, where a lag is known up to multiples of a time alone."""
    for name, again in repeats(problem, found, known.inflation).items():
        one = next(one for one in out.parameters if one.name == name)
        beside = [lag for lag in (one.value - again, one.value + again) if one.limits[0] <= lag <= one.limits[1]]
        text = f"{name}: the simulated signal does the same again after {again:.4g} s, so that"
        if beside:
            text += (
                f" {beside[0]:.4g} s fits as well as {one.value:.4g} s. A motion that does not repeat itself tells "
                f"them apart; a --max-lag below {0.5 * again:.3g} takes the one nearest 0: give it where the latency "
                "is known to be below that"
            )
            out.reasons.append(reason("LAG", text, name))
        else:
            out.notes.append(
                f"{text} it is known up to multiples of that: {one.value:.4g} s is the one within --max-lag "
                f"{one.limits[1]:g}, and a latency beyond would show as this"
            )


def _beside(out: Calibration, problem: Problem, found: Fit, model: TowModel, signals: Sequence[Signal]) -> None:
    """Reasons where the recording shows another winch or another speed than what was simulated."""
    curves = model(problem.values(found.x))

    def pair(quantity: str, simulated: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Measured and simulated, of what is fitted; None where either is missing."""
        measured = next((one for one in signals if one.quantity == quantity and len(one.time)), None)
        if measured is None or simulated not in curves:
            return None
        series = clean(measured, model.origin)
        first, last = (-np.inf, np.inf) if model.steady else out.fitted_s
        inside = (series.time >= first) & (series.time <= last)
        return (series.value[inside], curves[simulated].value(series.time[inside])) if inside.any() else None

    if (both := pair("payout", "payout")) is not None:
        off, mean = float(np.sqrt(np.mean((both[0] - both[1]) ** 2))), float(np.mean(both[1]))
        if off > PAYOUT * abs(mean):
            text = (
                f"measured pay-out is {off:.3g} m rms beside that simulated, {mean:.4g} m in the mean: the winch moved "
                "otherwise, or winch.scope is another (--winch PLAN, --set winch.scope)"
            )
            out.reasons.append(reason("PAYOUT", text))
    over_ground = pair("speed", "speed")
    if (both := (pair("water_speed", "speed") if model.steady else None) or over_ground) is not None:
        measured, simulated = float(np.mean(both[0])), abs(float(np.mean(both[1])))
        if abs(measured - simulated) > SPEED * simulated:
            text = (
                f"measured speed {measured:.3g} m/s, simulated {simulated:.3g} m/s: a tow without the motion of the "
                "record has that of the scene (--set ship.tow_speed)"
            )
            out.reasons.append(reason("SPEED", text))
