"""Span files: `span:` at the top, SI units, checked as scenes are."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator
from math import ceil
from typing import Any

from ...io.scenes import document
from ...io.scenes.document import Document, SceneError
from ...physics.wake_oscillator import WakeLaw
from ...sim.problem import Limit, Problem
from ...sim.wake_tables import ELEMENTS, wave_length
from .span_file import (
    LEAD_ELEMENTS,
    MAX_ELEMENTS,
    Span,
    SpanCase,
    SpanEnds,
    SpanFile,
    seat_of,
    shedding_frequency,
    wet_lengths,
)

Check = Callable[[Span], list[Problem]]
# of the radius that the cable may be pressed into the groove: found by trial, at 0.45 no rest is found any more
MAX_DEPTH = 0.4
MIN_REST = 0.05  # of what lies near the sheaves: length of the rest of the span
# least tension at the end of a span over half its weight: min cosh(x)/x, that of the lightest catenary. The span is
# shorter by no more than the two sheaves, and what hangs beside it longer by no more than the radius of one
LIGHTEST = 1.5088795615


def span_problems(span: Span) -> list[Problem]:
    """What of a span cannot be run in time, case by case: what cannot be a line, or is too coarse for its vortices."""
    found: list[Problem] = []
    for name, case in span.cases.items():
        lines = list(_sheave_problems(span, case, name)) if span.ends is SpanEnds.SHEAVES else []
        found += lines or _element_problems(span, case, name)
    return found


def load_span(path_or_name: str | os.PathLike, check: Check = span_problems) -> Span:
    """Span of a YAML file, or of the name of a shipped one (``span_in_wind``). Raises SceneError with every problem.

    check: what finds cases that cannot be computed, in time where none is given.
    """
    return _spans(check).load(path_or_name).span


def span_from_dict(data: Any, origin: str, check: Check = span_problems) -> Span:
    """Span of plain data ``{"span": {...}}``; origin names it in errors. Raises SceneError with every problem."""
    return _spans(check).check(data, origin).span


def checked_span(span: Span, origin: str) -> Span:
    """The span itself where each of its cases can be a line. Raises SceneError with every problem."""
    return _spans(span_problems).checked(SpanFile(span=span), origin).span


def _spans(check: Check) -> Document[SpanFile]:
    def problems(file: SpanFile) -> list[Problem]:
        if not file.span.cases:
            return [Problem("span.cases", "has no case", "Give length, tension and wind of one")]
        return check(file.span)

    find, shipped = document.find_span, document.shipped_spans
    return Document(SpanFile, "a span in a wind", "span", "span: {name: mine, ...}", find, shipped, problems)


def known_cases(span: Span, names: Collection[str]) -> None:
    """Raises SceneError where a name is of no case."""
    unknown = [name for name in names if name not in span.cases]
    if unknown:
        text = f"case '{unknown[0]}' is not in {span.name}; nothing was run. Known: {', '.join(span.cases)}"
        raise SceneError([text])


def _sheave_problems(span: Span, case: SpanCase, name: str) -> Iterator[Problem]:
    """Why a case does not lie over its sheaves, if it does not."""
    key = f"span.cases.{name}"
    (seat, depth), lead = seat_of(span, case), wet_lengths(span, case)[0]
    pressed = f"= {case.tension:g} N presses the cable # into the groove of a sheave"
    of_seat = f"{100.0 * MAX_DEPTH:g} % of the radius {seat:.4g} m on which it lies"
    minimum = span.sheave.stiffness * (depth / (MAX_DEPTH * seat)) ** 1.5
    deep = Limit(f"{key}.tension", depth, "<=", MAX_DEPTH * seat, "m", of_seat, pressed).problems(
        "no rest is found there",
        f"Make span.sheave.stiffness at least {minimum:.3g} N/m^2.5, span.sheave.radius larger, or the tension less",
    )
    near = f"{2.0 + MIN_REST:g} of what lies near a sheave (span.sheave.radius = {span.sheave.radius:g} m)"
    short = Limit(f"{key}.length", case.length, ">=", (2.0 + MIN_REST) * lead, "m", near).problems(
        "no span is left between them", "Make it longer, span.sheave.radius smaller, or span.ends pinned"
    )
    yield from deep or short or _hanging_problems(span, case, key, seat)


def _hanging_problems(span: Span, case: SpanCase, key: str, seat: float) -> Iterator[Problem]:
    """A case whose masses do not hold it up, if they do not; seat: radius at which it lies on a sheave [m]."""
    weight = span.cable.mass_per_length * span.gravity
    pull = 0.5 * LIGHTEST * weight * (case.length - 2.0 * seat)
    minimum = pull - weight * (span.sheave.tail + seat)
    yield from Limit(f"{key}.tension", case.tension, ">=", minimum, "N").problems(
        f"with span.sheave.tail = {span.sheave.tail:g} m of cable beside it, such a mass does not hold "
        f"{case.length:g} m of {weight:.4g} N/m, of which the lightest catenary pulls {pull:.4g} N, and runs up to the "
        "sheave",
        "Make it larger, much so for a taut span, or the length less",
    )


def _element_problems(span: Span, case: SpanCase, name: str) -> Iterator[Problem]:
    """Elements too long for the waves that the shedding of a case drives."""
    if span.wake.law is WakeLaw.OFF:
        return
    frequency = shedding_frequency(span, case)
    bound = wave_length(span.cable, span.fluid.density, frequency, case.tension) / ELEMENTS
    lead, rest = wet_lengths(span, case)
    wave = (
        f"1/{ELEMENTS} of a wave of this cable at the {frequency:.4g} Hz that case {name} sheds at {case.wind:g} m/s "
        f"under {case.tension:g} N"
    )
    why, at_sheave = (
        "the mesh does not carry the vibration",
        f"= {case.wind:g} m/s with elements next to the sheaves of",
    )
    wind = Limit(f"span.cases.{name}.wind", lead / LEAD_ELEMENTS, "<=", bound, "m", wave, at_sheave)
    needed, top = 2 * ceil(0.5 * rest / bound), MAX_ELEMENTS
    remedy = f"Give at least {needed}" if needed <= top else f"It would take {needed}, above {top}: give less wind"
    mesh = Limit("span.elements", rest / span.elements, "<=", bound, "m", wave, f"= {span.elements} makes elements of")
    yield from wind.problems(why, "Give less wind, or a smaller span.sheave.radius") or mesh.problems(why, remedy)
