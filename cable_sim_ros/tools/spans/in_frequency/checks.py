"""Numbers of a span that contradict each other although each is in its range, and results that cannot be trusted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....sim.problem import Limit, Problem
from .grid import MAX_STEPS, even_steps, lift_range, uneven
from .response import Vibration, correlation_length, count_modes, modes_shed
from .span import MAX_SEGMENTS, Line, Span

COARSE = 4.0  # parts of the cable per half wave of its top mode
STEP_TOO_LONG = 2.0  # half widths of the narrowest resonance
MIN_STEPS = 4  # up to the top of the lift at the shedding frequency: fewer are no spectrum
LARGE = 0.75  # of the diameter: rms of a motion of about one diameter, where real cables stop
WKB_APART = 0.01
MAX_MODES = 2000


def problems(span: Span) -> list[Problem]:
    """What makes a computation impossible, in the order of the file."""
    if found := [*_tension(span), *_table(span), *_lift(span)]:
        return found
    line = Line(span)
    tension = line.tension(line.knots)
    lead = f"= {span.tension.gradient:g} N/m leaves a tension of # at s = {line.knots[tension.argmin()]:g} m"
    slack = Limit("tension.gradient", tension.min(), ">", 0.0, "N", lead=lead).problems(
        "a slack cable carries no waves", "Raise tension.start, or correct the sign of the gradient"
    )
    return slack or [*_flow(line), *_modes(span, line), *_place(span)] or list(_grids(span, line))


def _tension(span: Span) -> Iterator[Problem]:
    start, gradient, table = span.tension.start, span.tension.gradient, span.profile.tension
    if table and start is not None:
        text = f"= {start:g} N and profile.tension both say the tension"
        yield Problem("tension.start", text, "Leave one of the two out")
    elif not table and start is None:
        remedy = "Give tension.start [N], or a table profile.tension"
        yield Problem("tension.start", "is missing: the tension is nowhere given", remedy)
    elif table and gradient:
        text = f"= {gradient:g} N/m has no effect beside the table profile.tension"
        yield Problem("tension.gradient", text, "Leave it out")


def _table(span: Span) -> Iterator[Problem]:
    """Columns as long as their arc, arcs from one end of the cable to the other."""
    profile = {name: getattr(span.profile, name) for name in ("tension", "mass_per_length", "diameter")}
    given = {name: column for name, column in profile.items() if column}
    if span.profile.arc and not given:
        remedy = "Give tension, mass_per_length or diameter, or no profile"
        yield Problem("profile.arc", "has no column beside it", remedy)
    tables = [("flow", span.flow.arc, {"speed": span.flow.speed})]
    if given:
        tables.append(("profile", span.profile.arc, given))
    for block, arc, columns in tables:
        for name, column in columns.items():
            if len(column) != len(arc):
                text = f"has {len(column)} numbers, {block}.arc has {len(arc)} places"
                yield Problem(f"{block}.{name}", text, "Give one number for each place")
        key, length = f"{block}.arc", span.cable.length
        if len(arc) < 2:
            yield Problem(key, f"has {len(arc)} places", "Give two at least: 0 and cable.length")
        elif np.any(np.diff(arc) <= 0.0):
            i = int(np.flatnonzero(np.diff(arc) <= 0.0)[0])
            text = f"does not ascend: {arc[i]:g} m, then {arc[i + 1]:g} m"
            yield Problem(key, text, "Sort the table by arc, each once")
        elif arc[0] != 0.0 or abs(arc[-1] - length) > 1e-6 * length:
            text = f"goes from {arc[0]:g} to {arc[-1]:.8g} m, the cable from 0 to cable.length = {length:.8g} m"
            yield Problem(key, text, "Nothing is guessed beyond a table: begin at 0 and end at cable.length")


def _lift(span: Span) -> Iterator[Problem]:
    squares = span.lift.mean_squares
    if not any(squares):
        remedy = "Leave it out for those of the source, or give a mean square above 0"
        yield Problem("lift.mean_squares", f"= {list(squares)} is a lift of zero: nothing would move", remedy)


def _flow(line: Line) -> Iterator[Problem]:
    if line.shedding_range[1] <= 0.0:
        yield Problem("flow.speed", "is zero everywhere: nothing is shed", "Give the speed normal to the cable [m/s]")


def _modes(span: Span, line: Line) -> Iterator[Problem]:
    given, asked = span.damping.ratios, span.response.modes
    if given and asked and len(given) != asked:
        text = f"has {len(given)} numbers for response.modes = {asked}"
        yield Problem("damping.ratios", text, "Give one ratio for each mode, or leave response.modes out")
        return
    count = count_modes(span, line) if line.shedding_range[1] > 0.0 else 1
    lead = f"sheds up to {line.shedding_range[1]:.4g} Hz, that of mode"
    yield from Limit("flow.speed", count, "<=", MAX_MODES, "", "the last that is computed", lead).problems(
        "", "Check length, tension and diameter; a longer cable behaves as an infinite one: take a part of it"
    )


def _place(span: Span) -> Iterator[Problem]:
    if (place := span.response.place) is not None:
        end = Limit("response.place", place, "<=", span.cable.length, "m", "cable.length")
        yield from end.problems("", "Give a place on it")


def _grids(span: Span, line: Line) -> Iterator[Problem]:
    from . import modes

    count, asked = count_modes(span, line), span.response
    f = modes.frequencies(line, count)
    ratios = np.array(
        span.damping.ratios or modes.damping(line, span.damping, count, correlation_length(span, line)).ratios
    )
    found = lift_range(span, line)
    of_lift = f"1/{MIN_STEPS} of the {found.shed:.4g} Hz up to which the lift reaches at the shedding frequency"
    own = Limit("response.frequency_step", asked.frequency_step or 0.0, "<=", found.shed / MIN_STEPS, "Hz", of_lift)
    if long := own.problems("its sum means nothing", "Leave it out: steps are chosen"):
        yield from long
        return
    step, number = even_steps(span, line, f, ratios)
    if asked.frequencies or number <= MAX_STEPS:
        return
    longer = _up(found.top / MAX_STEPS)
    remedy = f"response.frequency_step: {longer:g} or longer, or the number of equal steps as response.frequencies"
    top = f"steps to the top of the lift spectrum, more than {MAX_STEPS}"
    if asked.frequency_step:
        text = f"= {step:.3g} Hz takes {number} {top}"
        yield Problem("response.frequency_step", text, f"Give {remedy}, or leave it out: steps are chosen")
        return
    number = len(uneven(span, line, f, ratios).frequency)
    if number > MAX_STEPS:
        text = (
            f"= {asked.steps_per_half_width:g} takes {number} {top}; the narrowest resonance has a damping ratio of "
            f"{ratios.min():.3g}, the narrowest lift peak a standard deviation of {found.narrowest:.3g} Hz"
        )
        yield Problem("response.steps_per_half_width", text, f"Give fewer, or more flow.turbulence; or give {remedy}")


def _up(value: float) -> float:
    """Rounded up to two digits."""
    digit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(np.ceil(value / digit) * digit)


def _finer(count: int, shed: int) -> str:
    """Remedy for segments that are too long for a number of modes."""
    maximum, needed = MAX_SEGMENTS, int(np.ceil(2.0 * COARSE * count))
    if needed <= maximum:
        return f"Give {needed} or more"
    if COARSE * count <= maximum:
        return f"Give {maximum}, the most"
    if shed < count:
        enough = int(maximum / COARSE)
        return f"Leave response.modes out: {shed} modes are shed; {maximum} segments are enough for {enough}"
    return f"Give {maximum}, the most; they are enough for {int(maximum / COARSE)} modes: take a part of the cable"


def warnings(span: Span, result: Vibration) -> Iterator[Problem]:
    """What is doubtful about a result: number, threshold, remedy."""
    first, top, count = result.frequencies[0], result.shedding[1], len(result.frequencies)
    if first * (1.0 - result.damping_ratios[0]) > top:  # the resonance is half a width wide on either side
        text = f"sheds up to {top:.4g} Hz, below the first frequency {first:.4g} Hz: no mode is driven at resonance"
        yield Problem("flow.speed", text, "The response is that to the tails of the lift spectrum")
    segments = span.response.segments
    lead = f"= {segments} are # for each half wave of mode {count}"
    finer = _finer(count, modes_shed(Line(span)))
    yield from Limit("response.segments", segments / count, ">=", COARSE, lead=lead).problems("", finer)
    lead, end = f"= {len(result.frequency)} steps end at", float(result.frequency[-1])
    yield from Limit("response.frequencies", end, ">=", top, "Hz", "the top shedding frequency", lead).problems(
        "the lift above is left out", "Leave it out: as many are taken as the lift needs"
    )
    half = float((result.damping_ratios * result.frequencies).min())
    narrow, longest = f"{STEP_TOO_LONG:g} half widths of the narrowest resonance", STEP_TOO_LONG * half
    yield from Limit("response.frequency_step", result.frequency_step, "<=", longest, "Hz", narrow).problems(
        "", "Leave it out: a step is chosen"
    )
    largest, lead = float(result.diameters.max()), "gives an rms displacement of"
    yield from Limit("lift.mean_squares", largest, "<=", LARGE, "diameters", lead=lead).problems(
        "the lift does not grow weaker with the motion here, as that of a real cable does",
        "Take the result as an upper bound; a flow that locks in with one mode is outside this model",
    )
    exact = result.frequencies_exact
    off = 100.0 * float(np.abs(result.frequencies[: len(exact)] / exact - 1.0).max())
    lead = f"= {result.method}, whose frequencies (WKB) are up to # from the exact ones"
    yield from Limit("response.method", off, "<=", 100.0 * WKB_APART, "%", lead=lead).problems(
        "", "Give response.method: exact; the damping ratios stay those of WKB"
    )
