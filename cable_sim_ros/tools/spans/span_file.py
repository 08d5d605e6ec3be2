"""What a span file holds: a span of cable in a cross wind, computed in time or in the frequency domain.

The cable lies over two fixed sheaves, a mass on each end, or is pinned, one end free to move along and pulled. The wind
blows level, straight across; vertical is across the flow, level across the span along it. Westin (2018), appendix A.
"""

from __future__ import annotations

from enum import Enum
from math import pi, radians, sin, sqrt
from typing import Any

from pydantic import field_validator, model_validator

from ...physics.drag_laws import DragLaw
from ...physics.fluid import Fluid
from ...physics.parameter import REQUIRED, Block, again, choice, quantity
from ...physics.section import Material
from ...physics.wake_oscillator import MIN_RE, Wake, WakeLaw
from .in_frequency.span import Correlation, LiftBlock, Reading, ResponseBlock

LEAD_ELEMENTS = 2
MAX_ELEMENTS = 1000  # of the rest of the span
LEAD = 0.3  # rad beyond the top of the sheave that the finer mesh goes on: sag wraps the cable farther than the top


class SpanEnds(str, Enum):
    """What holds a span."""

    SHEAVES = "sheaves"
    PINNED = "pinned"


class SpanDragLaw(str, Enum):
    """Drag laws of a span: those of a section (physics/drag_laws.py), less the one of a fairing, which sheds nothing,
    and the one that has no C_D of its own."""

    OFF = DragLaw.OFF.value
    DRISCOLL_NAHON = DragLaw.DRISCOLL_NAHON.value
    DRISCOLL_NAHON_PRINTED = DragLaw.DRISCOLL_NAHON_PRINTED.value
    CROSSFLOW = DragLaw.CROSSFLOW.value
    PODE = DragLaw.PODE.value
    CHOO_CASARELLA = DragLaw.CHOO_CASARELLA.value
    HUSTON_KAMMAN_6 = DragLaw.HUSTON_KAMMAN_6.value
    HUSTON_KAMMAN_10 = DragLaw.HUSTON_KAMMAN_10.value
    HUSTON_KAMMAN_10_ROW_2_PRINTED = DragLaw.HUSTON_KAMMAN_10_ROW_2_PRINTED.value
    CAPOZUCCA = DragLaw.CAPOZUCCA.value


def _as_of(block: type[Block], name: str) -> Any:
    """The declaration of a number of another Block."""
    return block.model_fields[name]


class SpanFluid(Block):
    """What blows past a span: a Fluid whose velocity is the wind of the case."""

    density: float = _as_of(Fluid, "density")
    viscosity: float = _as_of(Fluid, "viscosity")

    @model_validator(mode="before")
    @classmethod
    def _blows_by_case(cls, value: Any) -> Any:
        if isinstance(value, dict) and "current" in value:
            raise ValueError(
                f"has current = {value['current']}, and what blows past a span is the wind of each case, straight "
                "across it, alone. Leave current out and give span.cases.<name>.wind"
            )
        return value


class SpanCase(Block):
    """One span in one wind."""

    length: float = quantity(REQUIRED, "m", 0.1, 1000.0, "length of the span", "Westin Table A2")
    tension: float = quantity(REQUIRED, "N", 1.0, 1e7, "tension: the weight of each end mass", "Westin Table A2")
    wind: float = quantity(REQUIRED, "m/s", 0.0, 100.0, "speed of the wind across the span", "Westin Table A2")


class SpanSheave(Block):
    """Both sheaves."""

    radius: float = quantity(0.18, "m", 0.005, 10.0, "radius at the root of the groove", "Westin Table A1")
    throat_angle_deg: float = quantity(30.0, "deg", 5.0, 170.0, "angle between the flanks", "Westin Table A1")
    groove_depth: float = quantity(0.04, "m", 1e-4, 1.0, "depth of the groove", "no source: two diameters")
    stiffness: float = quantity(
        1.5e7,
        "N/m^2.5",
        1e5,
        1e14,
        "of the contact: line load of a flank over its penetration to the power 1.5",
        "Westin (A15)",
    )
    tail: float = quantity(1.0, "m", 0.05, 1000.0, "cable between a sheave and its mass", "no source")


class SpanLift(Block):
    """Lift spectrum of the frequency domain, as in a file for `cable-sim viv`."""

    reading: Reading = _as_of(LiftBlock, "reading")
    mean_squares: tuple[float, ...] | None = again(LiftBlock, "mean_squares", "that of the wake behind a held cable")
    correlation: Correlation = _as_of(LiftBlock, "correlation")
    correlation_length: float | None = _as_of(LiftBlock, "correlation_length")


class FrequencyDomain(Block):
    """What `cable-sim viv` takes beyond the rest of the file; without effect in time."""

    turbulence_intensity: float = quantity(
        0.1,
        "1",
        None,
        1.0,
        "standard deviation of the wind over its speed: width of the lift spectrum",
        "a choice; 0.12 in Capozucca (1988) fig. 5.5",
        above=0.0,
    )
    lift: SpanLift = choice(SpanLift(), "lift spectrum")
    response: ResponseBlock = choice(ResponseBlock(), "grids and method")


class Span(Block):
    name: str = choice(REQUIRED, "name of the span")
    gravity: float = quantity(9.81, "m/s^2", None, 30.0, "gravitational acceleration", above=0.0)
    fluid: SpanFluid = choice(SpanFluid(), "what blows; its velocity is the wind of the case")
    cable: Material = choice(REQUIRED, "cable")
    drag_law: SpanDragLaw = choice(SpanDragLaw.CROSSFLOW, "loading functions of the span", "Westin (A16)")
    wake: Wake = choice(REQUIRED, "vortices that the span sheds")
    damping_ratio: float = quantity(
        0.1, "1", 0.0, 1.0, "of critical at the natural frequency (A24) of the case, by mass damping", "Westin Table A1"
    )
    ends: SpanEnds = choice(SpanEnds.SHEAVES, "what holds the span")
    sheave: SpanSheave = choice(SpanSheave(), "sheaves")
    elements: int = quantity(
        16, "1", 4, MAX_ELEMENTS, "elements of the span; even, for one node is in the middle", "Westin A.3"
    )
    steps: int = quantity(60, "1", 30, 10000, "steps a period of shedding")
    frequency_domain: FrequencyDomain = choice(
        FrequencyDomain(), "what `cable-sim viv` takes beyond the rest; without effect in time"
    )
    cases: dict[str, SpanCase] = choice(REQUIRED, "cases by name")

    @field_validator("elements")
    @classmethod
    def _even(cls, value: int) -> int:
        if value % 2:
            raise ValueError(
                f"= {value} is odd, and must be even, for one node is in the middle. Give {value - 1} or {value + 1}"
            )
        return value


class SpanFile(Block):
    """A file with one key."""

    span: Span = choice(REQUIRED, "a span of cable in a cross wind")


def mass_in_fluid(span: Span) -> float:
    """Mass per length [kg/m] with the added mass of the fluid."""
    own = span.cable
    return own.mass_per_length + own.added_mass_coefficient * span.fluid.density * 0.25 * pi * own.diameter**2


def natural_frequency(span: Span, case: SpanCase) -> float:
    """First natural frequency [Hz] of a pinned beam under tension, Westin (A24), with the added mass of the fluid."""
    k = pi / case.length
    return k * sqrt((case.tension + span.cable.bending_stiffness * k * k) / mass_in_fluid(span)) / (2.0 * pi)


def shedding_frequency(span: Span, case: SpanCase) -> float:
    """Strouhal's frequency St U/d [Hz], Westin (A25)."""
    return span.wake.strouhal * case.wind / span.cable.diameter


def reynolds(span: Span, wind: float) -> float:
    """Reynolds number of a wind [m/s] on the diameter."""
    return span.fluid.density * wind * span.cable.diameter / span.fluid.viscosity


def sheds(span: Span, wind: float) -> bool:
    """Are vortices shed in a wind [m/s]?"""
    return span.wake.law is not WakeLaw.OFF and reynolds(span, wind) > MIN_RE


def seat_of(span: Span, case: SpanCase) -> tuple[float, float]:
    """Radius [m] of the centreline that touches the flanks of a sheave, and how much less it is pressed in by the
    tension, for a contact that only touches has no stiffness."""
    sheave = span.sheave
    seat, half = sheave.radius + 0.5 * span.cable.diameter, radians(0.5 * sheave.throat_angle_deg)
    return seat, (case.tension / (2.0 * seat * sin(half) * sheave.stiffness)) ** (2.0 / 3.0) / sin(half)


def wet_lengths(span: Span, case: SpanCase) -> tuple[float, float]:
    """Lengths [m] of the lead at each sheave, which has the finer mesh, and of the rest of the span between them."""
    if span.ends is SpanEnds.PINNED:
        return 0.0, case.length
    seat, depth = seat_of(span, case)
    return LEAD * (seat - depth), case.length - 2.0 * LEAD * (seat - depth)
