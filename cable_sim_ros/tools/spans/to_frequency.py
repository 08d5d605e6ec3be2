"""A span file in the frequency domain: each of its cases as a line and a flow, and where every number came from.

The uniform wind of a case is the flow, its tension that of a straight string with pinned ends. What the file says of
its wake is taken: Strouhal number and, of a held cable, the mean square of the lift. What it does not say is told with
the value taken; what the frequency domain cannot serve is refused.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from functools import partial
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

from ...files import read_text
from ...io.scenes import document, yaml12
from ...physics.drag_laws import CHOO_CASARELLA, LAWS, DragLaw, choo_casarella, fitted, smooth
from ...physics.parameter import Block
from ...physics.wake_oscillator import MIN_RE, RE_FULL, SATURATION, WakeLaw
from ...sim.problem import Limit, Problem
from . import load
from .in_frequency import checks, files, modes
from .in_frequency import span as frequency
from .in_frequency.response import Vibration, correlation_length, count_modes
from .in_frequency.sensitivity import DEFAULT, Taken
from .in_frequency.span import Line
from .span_file import Span, SpanCase, SpanEnds, mass_in_fluid, natural_frequency, reynolds, sheds

MAX_SAG = 0.035  # of the length: there the tension of the cable is 1 % larger at the ends than in the middle
MAX_SQUARE = 10.0  # of the lift coefficient, as a file for `cable-sim viv` may have
KEYS = {  # of the frequency domain: where a span file has them; <case> is the name of the case
    "response.": "span.frequency_domain.response.",
    "lift.": "span.frequency_domain.lift.",
    "flow.turbulence": "span.frequency_domain.turbulence_intensity",
    "flow.speed": "span.cases.<case>.wind",
    "cable.length": "span.cases.<case>.length",
}


class FrequencyCase(NamedTuple):
    """A case ready for `vibration`: its span, what was taken for what the file does not say, what is doubtful."""

    span: frequency.Span
    taken: list[Taken]
    doubts: list[Problem]
    of: str = ""  # name of the span of the file, and of the case; of a file for `cable-sim viv` none
    case: str = ""
    hold: float = 0.0  # per cent of its frequency over which a motion of one diameter holds a wake; 0: no oscillator
    intensity: float = 0.0  # standard deviation of the flow over its speed

    def warnings(self, result: Vibration) -> list[str]:
        """What is doubtful about a result, one text each."""
        found = [*self.doubts, *checks.warnings(self.span, result)]
        peak = sqrt(2.0) * float(result.diameters.max())
        lead = f"makes a peak of {peak:.3g} diameters, which holds a wake over # of its frequency"
        wide = Limit("flow.speed", self.hold * peak, "<=", 100.0 * self.intensity, "%", "that of the turbulence", lead)
        found += wide.problems(
            "the span locks in, which the frequency domain does not know", "Take the amplitude of `cable-sim span`"
        )
        if self.case:
            found = [in_span_file(problem, self.case) for problem in found]
        return [files.text_of(problem) for problem in found]


def is_span_file(path_or_name: str | os.PathLike) -> bool:
    """Is it a readable file, or the name of a shipped one, with `span:` at its top?"""
    try:
        data, _ = yaml12.parse(read_text(document.find_span(path_or_name)))
    except (document.ResourceError, yaml12.YamlError, UnicodeDecodeError, OSError):
        return False
    return isinstance(data, Mapping) and "span" in data


def load_cases(path_or_name: str | os.PathLike, cases: Collection[str] = ()) -> dict[str, FrequencyCase]:
    """Cases of a span file by name, all or those named; a file for `cable-sim viv` is one, by its own name.

    Raises SceneError with every problem.
    """
    if not is_span_file(path_or_name):
        line = files.load_span(path_or_name)
        if cases:
            raise files.SpanError(
                [
                    f"{path_or_name}: has no cases, and case '{next(iter(cases))}' is asked for; nothing was computed. "
                    "Leave --case out; cases are in a file with `span:` at its top"
                ]
            )
        return {line.name: FrequencyCase(line, [], [])}
    span = load.load_span(path_or_name, partial(problems, cases=cases))
    return {name: frequency_case(span, name) for name in cases or span.cases}


def problems(span: Span, cases: Collection[str] = ()) -> list[Problem]:
    """What of a span file the frequency domain cannot serve, case by case; all cases or those named."""
    load.known_cases(span, cases)
    if span.wake.law is WakeLaw.OFF:
        text = "= off: nothing is shed, and so nothing vibrates"
        return [Problem("span.wake.law", text, "Give bai_qin or facchinetti")]
    square, given = _wake_square(span), span.wake.lift_coefficient
    if span.frequency_domain.lift.mean_squares is None and not 0.0 < square <= MAX_SQUARE:
        text = f"= {given:g} is a mean square of the lift of {square:.3g}, outside (0, {MAX_SQUARE:g}]"
        return [Problem("span.wake.lift_coefficient", text, "Give another, or span.frequency_domain.lift.mean_squares")]
    found = []
    for name in cases or span.cases:
        case = span.cases[name]
        if not sheds(span, case.wind):
            found.append(
                Problem(
                    f"span.cases.{name}.wind",
                    f"= {case.wind:g} m/s has the Reynolds number {reynolds(span, case.wind):.3g}, not above "
                    f"{MIN_RE:g}: nothing is shed, and so nothing vibrates",
                    "Give more wind, or name the other cases with --case",
                )
            )
            continue
        line = _without_ratios(span, name)
        wrong = checks.problems(line)
        if not wrong and (ratios := damping_ratios(span, case, line)).min() <= 0.0:
            wrong = [
                Problem(
                    "span.damping_ratio",
                    f"= {span.damping_ratio:g} leaves mode {int(ratios.argmin()) + 1} of case {name} without damping: "
                    "the wind drives it all along, and the response has no bound",
                    "Give a damping ratio above 0",
                )
            ]
        wrong = wrong or checks.problems(_line(span, name))
        found += [in_span_file(problem, name) for problem in wrong]
    return found


def frequency_case(span: Span, name: str) -> FrequencyCase:
    """A case of a checked span file."""
    case, line = span.cases[name], _line(span, name)
    taken = [*_said(span, case, line), *_defaults(span)]
    sag = span.cable.mass_per_length * span.gravity * case.length / (8.0 * case.tension)
    key, lead = f"span.cases.{name}.tension", f"= {case.tension:g} N lets the span sag by # of its length"
    doubts = Limit(key, 100.0 * sag, "<=", 100.0 * MAX_SAG, "%", lead=lead).problems(
        "the frequency domain takes a straight string of that tension",
        "Take the frequencies and amplitudes of `cable-sim span`, or give more tension",
    )
    hold = 50.0 * span.wake.coupling * _complete(span, case) / _cycle(span)
    return FrequencyCase(line, taken, doubts, span.name, name, hold, span.frequency_domain.turbulence_intensity)


def in_span_file(problem: Problem, case: str) -> Problem:
    """A problem of the frequency domain with the keys that a span file has."""

    def renamed(text: str) -> str:
        words = "|".join(map(re.escape, KEYS))
        return re.sub(rf"(?<![.\w])({words})", lambda match: KEYS[match[1]].replace("<case>", case), text)

    return problem._replace(key=renamed(problem.key), text=renamed(problem.text), remedy=renamed(problem.remedy))


def drag_coefficient(span: Span, case: SpanCase) -> float:
    """C_D across the span of its drag law, at the wind of a case."""
    law, re_wind = LAWS[DragLaw(span.drag_law.value)], reynolds(span, case.wind)
    constant = law.drag_coefficient
    if constant is None:
        constant = choo_casarella(re_wind)[0] if law.fit == CHOO_CASARELLA else fitted(law.fit, re_wind)[0]
    return float(constant) * (law.normal[0] + law.normal[2] - law.normal[3])  # f_n at a right angle


def mean_squares(span: Span, case: SpanCase) -> tuple[float, ...]:
    """Of C_L at multiples of the shedding rate: given, or that of the wake's cycle behind a held cable, a sine."""
    own = span.frequency_domain.lift.mean_squares
    return (_wake_square(span) * _complete(span, case) ** 2,) if own is None else own


def damping_ratios(span: Span, case: SpanCase, line: frequency.Span) -> np.ndarray:
    """Of modes 1, 2, ...: mass damping, which acts on the mass in air, at mode 1 with the ratio of the file; bending
    damping; the drag of the parts that do not drive the mode."""
    string = Line(line)
    count, mass = count_modes(line, string), mass_in_fluid(span)
    drag = modes.damping(string, line.damping, count, correlation_length(line, string)).ratios
    dry, wave = span.cable.mass_per_length / mass, pi * np.arange(1, count + 1) / case.length
    frequency = modes.frequencies(string, count)
    own = span.damping_ratio * dry * natural_frequency(span, case) / frequency
    bending = span.cable.bending_damping * wave**4 / (4.0 * pi * frequency * mass)
    return drag - line.damping.structural + own + bending


def _wake_square(span: Span) -> float:
    """Mean square of C_L behind a held cable, vortices complete."""
    return (0.5 * span.wake.lift_coefficient * _cycle(span)) ** 2 / 2.0


def _complete(span: Span, case: SpanCase) -> float:
    """Fraction of the force of complete vortices at the wind of a case, as in time."""
    return float(smooth(reynolds(span, case.wind), MIN_RE, RE_FULL)[0])


def _cycle(span: Span) -> float:
    """Amplitude of q behind a held cable."""
    wake = span.wake
    return 2.0 / sqrt(3.0 * (SATURATION[wake.law] if wake.saturation is None else wake.saturation))


def _without_ratios(span: Span, name: str) -> frequency.Span:
    """The line and flow of a case, its damping ratios yet to be computed."""
    case, own, block = span.cases[name], span.cable, span.frequency_domain
    own_ratio = span.damping_ratio * own.mass_per_length / mass_in_fluid(span)
    structural = {"structural": own_ratio} if own_ratio else {}
    return frequency.Span.model_validate(
        {
            "name": f"{span.name}: {name}",
            "cable": {
                "length": case.length,
                "diameter": own.diameter,
                "mass_per_length": own.mass_per_length,
                "added_mass_coefficient": own.added_mass_coefficient,
                "bending_stiffness": own.bending_stiffness,
            },
            "tension": {"start": case.tension},
            "water": {"density": span.fluid.density},
            "flow": {
                "arc": (0.0, case.length),
                "speed": (case.wind, case.wind),
                "turbulence": block.turbulence_intensity * case.wind,
                "strouhal": span.wake.strouhal,
            },
            "damping": {"drag_coefficient": drag_coefficient(span, case), **structural},
            "lift": {**block.lift.model_dump(), "mean_squares": mean_squares(span, case)},
            "response": block.response.model_dump(),
        }
    )


def _line(span: Span, name: str) -> frequency.Span:
    line = _without_ratios(span, name)
    ratios = damping_ratios(span, span.cases[name], line)
    return line.model_copy(update={"damping": line.damping.model_copy(update={"ratios": tuple(ratios.tolist())})})


def _said(span: Span, case: SpanCase, line: frequency.Span) -> list[Taken]:
    """What follows from numbers of the file."""
    block, string = span.frequency_domain, Line(line)
    own = block.lift.mean_squares is None
    ends = "straight between pinned ends"
    if span.ends is SpanEnds.SHEAVES:
        ends += "; what lies on the sheaves and hangs from them does not vibrate"
    structural = "span.damping_ratio on the mass in air; in damping_ratios_computed alone"
    if not span.damping_ratio:
        structural = "default; in damping_ratios_computed alone"
    squares = ", ".join(f"{x:.4g}" for x in line.lift.mean_squares)
    ratios = ", ".join(f"{x:.4g}" for x in line.damping.ratios[:4]) + (", ..." if len(line.damping.ratios) > 4 else "")
    given = "" if "turbulence_intensity" in block.model_fields_set else ", default"
    out = [
        Taken("ends", span.ends.value, ends),
        Taken("tension.gradient", "0 N/m", "the tension of the case all along; cable, flow and fluid are uniform too"),
        Taken(
            "flow.turbulence",
            f"{line.flow.turbulence:.4g} m/s",
            f"{block.turbulence_intensity:g} of the wind: span.frequency_domain.turbulence_intensity{given}",
        ),
        Taken("flow.strouhal", f"{line.flow.strouhal:g}", "span.wake"),
        Taken("lift.mean_squares", squares, "span.wake, behind a held cable" if own else "span.frequency_domain"),
        Taken("damping.ratios", ratios, "span.damping_ratio as mass damping, bending damping, drag where not driven"),
        Taken("damping.structural", f"{line.damping.structural:.4g}", structural),
        Taken(
            "damping.drag_coefficient",
            f"{line.damping.drag_coefficient:.4g}",
            f"span.drag_law at Re = {reynolds(span, case.wind):.4g}",
        ),
    ]
    if line.lift.correlation_length is None:
        found = correlation_length(line, string)
        text = f"default, (4.19); span.wake.phase = {span.wake.phase.value} is of the time domain"
        out.append(Taken("lift.correlation_length", f"{found:.4g} m", text))
    return out


def _defaults(span: Span) -> list[Taken]:
    """Numbers of the frequency domain that nothing in the file sets."""
    told = {"lift.correlation_length", "damping.ratios", "damping.drag_coefficient", "damping.structural"}
    blocks: tuple[tuple[str, Block, Block | None], ...] = (
        ("damping", frequency.DampingBlock(), None),
        ("lift", span.frequency_domain.lift, span.frequency_domain.lift),
        ("response", span.frequency_domain.response, span.frequency_domain.response),
    )
    out = []
    for name, block, given in blocks:
        for key in type(block).model_fields:
            value = getattr(block, key)
            named = f"{name}.{key}"
            if named in told or named == "lift.mean_squares" or (given is not None and key in given.model_fields_set):
                continue
            out.append(Taken(named, "chosen" if value is None else str(getattr(value, "value", value)), DEFAULT))
    return out
