"""Spans from YAML, results as data: the fields of ``cable-sim viv --json``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from ....io.scenes import document
from ....io.scenes.document import Document, SceneError
from ....sim.problem import Problem
from . import checks
from .response import Vibration
from .span import Span


class SpanError(SceneError):
    """A span that cannot be computed. ``problems``: one text each, with file, line, key, value, bound and remedy."""


class SpanWarning(UserWarning):
    """A result that is doubtful."""


SPANS = Document(
    Span,
    "a span in a flow",
    "span",
    "cable: {length: 17.45, ...}",
    document.find_viv,
    document.shipped_viv,
    checks.problems,
    error=SpanError,
)
load_span = SPANS.load  # of a YAML file, or of the name of a shipped one (``capozucca_5_5``); SpanError


def span_from_dict(data: Mapping[str, Any], origin: str = "span") -> Span:
    """Span of plain data; origin names it in errors. Raises SpanError with every problem."""
    return SPANS.check(data, origin)


def changed(span: Span, **blocks: Mapping[str, Any]) -> Span:
    """The span with other values, ``changed(span, flow={"strouhal": 0.2})``; checked like a file."""
    data = span.model_dump()
    for block, values in blocks.items():
        data[block] = {**data[block], **values}
    return span_from_dict(data, f"{span.name}, changed")


def text_of(problem: Problem) -> str:
    """A caution in one line."""
    return f"{problem.key} {problem.text}. {problem.remedy}"


class Field(NamedTuple):
    unit: str
    meaning: str
    attribute: str  # of a Vibration
    largest: bool = False  # of that attribute


FIELDS: dict[str, Field] = {
    "name": Field("", "name of the span", "name"),
    "frequencies_hz": Field("Hz", "frequencies of modes 1, 2, ... (WKB, with bending stiffness)", "frequencies"),
    "damping_ratios": Field("", "their damping ratios, as used", "damping_ratios"),
    "arc_m": Field("m", "places s along the cable, from the end s = 0", "arc"),
    "rms_displacement_m": Field("m", "rms displacement across flow and cable at them", "rms_displacement"),
    "rms_acceleration_m_s2": Field("m/s^2", "rms acceleration at them", "rms_acceleration"),
    "max_rms_displacement_m": Field("m", "largest rms displacement", "rms_displacement", True),
    "max_rms_displacement_diameters": Field(
        "", "largest rms displacement over the diameter at its place", "diameters", True
    ),
    "frequencies_exact_hz": Field(
        "Hz", "frequencies by finite differences, of the first 50 modes at most", "frequencies_exact"
    ),
    "damping_ratios_computed": Field("", "damping ratios as computed, where others are given", "damping_computed"),
    "damping_ratios_whole": Field("", "damping ratios if the whole cable damped the mode", "damping_whole"),
    "power_in_m": Field("m", "for each mode the parts [from, to] of the cable that drive it", "driven"),
    "shedding_range_hz": Field("Hz", "least and largest shedding frequency along the cable", "shedding"),
    "correlation_length_m": Field("m", "correlation length of the lift", "correlation_length"),
    "reading": Field("", "reading of the lift spectrum: A, B or C", "reading"),
    "method": Field("", "of the response: wkb or exact", "method"),
    "segments": Field("", "parts of the cable that the lift acts on", "segments"),
    "frequency_step_hz": Field("Hz", "shortest step of the spectra", "frequency_step"),
    "place_m": Field("m", "place of the spectra: `response.place`, else that of the largest rms", "place"),
    "place_rms_displacement_m": Field("m", "rms displacement there", "place_rms_displacement"),
    "place_rms_acceleration_m_s2": Field("m/s^2", "rms acceleration there", "place_rms_acceleration"),
    "frequency_hz": Field("Hz", "frequencies of the spectra", "frequency"),
    "frequency_widths_hz": Field("Hz", "width of the step that each of them stands for", "frequency_width"),
    "displacement_spectrum_m2_hz": Field(
        "m^2/Hz", "one-sided spectrum of the displacement: rms^2 = sum of spectrum times width", "displacement_spectrum"
    ),
    "acceleration_spectrum_m2_s4_hz": Field("m^2/s^4/Hz", "that of the acceleration", "acceleration_spectrum"),
    "modes": Field("", "shapes of the modes along `arc_m`, one list each", "modes"),
}
WARNINGS = "cautions"


def as_data(span: Span, result: Vibration) -> dict[str, Any]:
    """What ``--json`` prints."""

    def plain(field):
        value = getattr(result, field.attribute)
        value = value.max() if field.largest else value
        return value.tolist() if hasattr(value, "tolist") else value

    return {**{name: plain(field) for name, field in FIELDS.items()}, WARNINGS: warnings(span, result)}


def warnings(span: Span, result: Vibration) -> list[str]:
    """What is doubtful about a result, one text each: number, threshold, remedy."""
    return [text_of(problem) for problem in checks.warnings(span, result)]
