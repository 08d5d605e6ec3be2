"""A span of cable in a cross wind: what a span file holds, and the line it is; Westin (2018), appendix A.

The cable lies over two fixed sheaves, a mass on each end, or is pinned, one end free to move along and pulled. The wind
blows level, straight across; vertical is across the flow, level across the span along it. Vortices are shed by the
span, not by what lies on the sheaves and hangs from them.
"""

from __future__ import annotations

from enum import Enum
from math import pi, radians, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from pydantic import field_validator, model_validator

from ..physics.contact_surface import surface_row
from ..physics.drag_laws import DragLaw
from ..physics.fluid import Fluid
from ..physics.integrate import Solver
from ..physics.parameter import REQUIRED, Block, quantity
from ..physics.section import Material
from ..physics.wake_oscillator import Wake
from .build import lock
from .rig.rig import Rig, cable_of, load_of

# largest residual over the tension, for the vibration of a span in air moves forces of a millionth of it; and over EA,
# below which round-off leaves it: places count from the middle of the span, which keeps that small
RESIDUAL, ROUND_OFF = 5e-10, 4e-14
ARC_ELEMENTS, LEAD_ELEMENTS, TAIL_ELEMENTS = 6, 2, 2
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


def _of_fluid(name: str) -> Any:
    """The declaration of a number of Fluid."""
    return Fluid.model_fields[name]


class SpanFluid(Block):
    """What blows past a span: a Fluid whose velocity is the wind of the case."""

    density: float = _of_fluid("density")
    viscosity: float = _of_fluid("viscosity")

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


class Span(Block):
    name: str = quantity(REQUIRED, "", None, None, "name of the span")
    gravity: float = quantity(9.81, "m/s^2", None, 30.0, "gravitational acceleration", above=0.0)
    fluid: SpanFluid = quantity(SpanFluid(), "", None, None, "what blows; its velocity is the wind of the case")
    cable: Material = quantity(REQUIRED, "", None, None, "cable")
    drag_law: SpanDragLaw = quantity(
        SpanDragLaw.CROSSFLOW, "", None, None, "loading functions of the span", "Westin (A16)"
    )
    wake: Wake = quantity(REQUIRED, "", None, None, "vortices that the span sheds")
    damping_ratio: float = quantity(
        0.1, "1", 0.0, 1.0, "of critical at the natural frequency (A24) of the case, by mass damping", "Westin Table A1"
    )
    ends: SpanEnds = quantity(SpanEnds.SHEAVES, "", None, None, "what holds the span")
    sheave: SpanSheave = quantity(SpanSheave(), "", None, None, "sheaves")
    elements: int = quantity(
        16, "1", 4, MAX_ELEMENTS, "elements of the span; even, for one node is in the middle", "Westin A.3"
    )
    steps: int = quantity(60, "1", 30, 10000, "steps a period of shedding")
    cases: dict[str, SpanCase] = quantity(REQUIRED, "", None, None, "cases by name")

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

    span: Span = quantity(REQUIRED, "", None, None, "a span of cable in a cross wind")


class SpanLine(NamedTuple):
    """A span at rest in its wind, and the numbers of its nodes in the middle and where it meets the first sheave."""

    rig: Rig
    middle: int
    end: int


def natural_frequency(span: Span, case: SpanCase) -> float:
    """First natural frequency [Hz] of a pinned beam under tension, Westin (A24), with the added mass of the fluid."""
    k, own = pi / case.length, span.cable
    mass = own.mass_per_length + own.added_mass_coefficient * span.fluid.density * 0.25 * pi * own.diameter**2
    return k * sqrt((case.tension + own.bending_stiffness * k * k) / mass) / (2.0 * pi)


def shedding_frequency(span: Span, case: SpanCase) -> float:
    """Strouhal's frequency St U/d [Hz], Westin (A25)."""
    return span.wake.strouhal * case.wind / span.cable.diameter


def span_line(span: Span, case: SpanCase) -> SpanLine:
    """The line of a case, settled in its wind without vortices. Raises RigError."""
    build = _over_sheaves if span.ends is SpanEnds.SHEAVES else _pinned
    line = build(span, case)
    settings = line.rig.model.settings.copy()
    settings["tolerance"] = max(RESIDUAL * case.tension, ROUND_OFF * span.cable.axial_stiffness)
    line.rig.model = line.rig.model._replace(settings=lock(settings, settings.dtype))
    line.rig.settle(steps=2000)
    return line


def _numbers(span: Span, case: SpanCase) -> dict:
    """What every line is given."""
    return {
        "tension": case.tension,
        "gravity": span.gravity,
        "water": Fluid(**span.fluid.model_dump(), current=(0.0, case.wind)),
        "mass_damping": 4.0 * pi * natural_frequency(span, case) * span.damping_ratio,
        "solver": Solver(max_iterations=50),
    }


def _wet(span: Span) -> dict:
    """What a section in the wind has."""
    return {"wake": span.wake, "drag_law": DragLaw(span.drag_law.value)}


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


def _pinned(span: Span, case: SpanCase) -> SpanLine:
    elements, wet = span.elements, _wet(span)
    cable = cable_of([{"length": case.length, "elements": elements, **wet}], **span.cable.model_dump())
    pull = load_of(elements, (case.tension, 0.0, 0.0))
    rig = Rig(cable, held={0: "r", -1: "yz"}, loads=[pull], **_numbers(span, case))
    rig.straight((-0.5 * case.length, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0 + case.tension / span.cable.axial_stiffness)
    return SpanLine(rig, elements // 2, 0)


def _over_sheaves(span: Span, case: SpanCase) -> SpanLine:
    own, sheave, elements, wet = span.cable, span.sheave, span.elements, _wet(span)
    (seat, depth), (leads, rest), half = seat_of(span, case), wet_lengths(span, case), sheave.throat_angle_deg / 2.0
    lies = seat - depth
    tail = {"length": sheave.tail, "elements": TAIL_ELEMENTS}
    arc = {"length": 0.5 * pi * lies, "elements": ARC_ELEMENTS}
    lead = {"length": leads, "elements": LEAD_ELEMENTS, **wet}
    free = {"length": rest, "elements": elements, **wet}
    cable = cable_of([tail, arc, lead, free, lead, arc, tail], **own.model_dump())
    end = TAIL_ELEMENTS + ARC_ELEMENTS
    middle = end + LEAD_ELEMENTS + elements // 2
    surfaces = [
        surface_row(
            (x, 0.0, -seat), seat, 2.0 * radians(half), sheave.groove_depth, 0.5 * own.diameter, sheave.stiffness, 0.3
        )
        for x in (-0.5 * case.length, 0.5 * case.length)
    ]
    mass = case.tension / span.gravity
    # nothing else keeps the cable from running off to one side; what vibrates alike on both does not move the middle on
    rig = Rig(cable, held={middle: "x"}, bodies={0: mass, -1: mass}, surfaces=surfaces, **_numbers(span, case))
    stretch = 1.0 + case.tension / own.axial_stiffness
    s = (rig.arc - rig.arc[middle]) * stretch
    r, g = _hanging(np.abs(s), case, lies, own.mass_per_length * span.gravity / case.tension)
    side = np.where(s < 0.0, -1.0, 1.0)
    r = np.column_stack((side * r[:, 0], 0.0 * s, r[:, 1] - seat))
    rig.place(r, stretch * np.column_stack((g[:, 0], 0.0 * s, side * g[:, 1])))
    return SpanLine(rig, middle, end)


def _hanging(s: np.ndarray, case: SpanCase, radius: float, per_tension: float) -> tuple[np.ndarray, np.ndarray]:
    """Half of the first shape, at lengths s [m] from the middle: places from the middle and the height of the sheave's
    centre, and directions outward [n, 2]. A catenary, the arc, straight down; per_tension: weight/tension [1/m]."""
    angle = 0.0
    for _ in range(100):  # at which the cable meets the sheave, against the level
        angle = np.arctan(np.sinh(per_tension * (0.5 * case.length - radius * np.sin(angle))))
    hangs = np.tan(angle) / per_tension
    x = np.arcsinh(per_tension * np.minimum(s, hangs)) / per_tension
    on = np.clip((s - hangs) / radius, 0.0, angle + 0.5 * pi) - angle  # place round the sheave, from its top
    down = np.maximum(s - hangs - radius * (angle + 0.5 * pi), 0.0)
    low = radius * np.cos(angle) - (np.cosh(per_tension * x.max()) - 1.0) / per_tension
    free = s < hangs
    z = np.where(free, low + (np.cosh(per_tension * x) - 1.0) / per_tension, radius * np.cos(on) - down)
    x = np.where(free, x, 0.5 * case.length + radius * np.sin(on))
    slope = np.where(free, np.arctan(per_tension * s), -on)
    return np.column_stack((x, z)), np.column_stack((np.cos(slope), np.sin(slope)))
