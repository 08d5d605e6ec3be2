"""A span in time: the line that a case is, at rest in its wind; Westin (2018), appendix A.

Vortices are shed by the span, not by what lies on the sheaves and hangs from them.
"""

from __future__ import annotations

from math import pi, radians
from typing import NamedTuple

import numpy as np

from ....physics.contact_surface import surface_row
from ....physics.drag_laws import DragLaw
from ....physics.fluid import Fluid
from ....physics.integrate import Solver
from ....sim.build import lock
from ....sim.rig.rig import Rig, cable_of, load_of
from ..span_file import LEAD_ELEMENTS, Span, SpanCase, SpanEnds, natural_frequency, seat_of, wet_lengths

# largest residual over the tension, for the vibration of a span in air moves forces of a millionth of it; and over EA,
# below which round-off leaves it: places count from the middle of the span, which keeps that small
RESIDUAL, ROUND_OFF = 5e-10, 4e-14
ARC_ELEMENTS, TAIL_ELEMENTS = 6, 2


class SpanLine(NamedTuple):
    """A span at rest in its wind, and the numbers of its nodes in the middle and where it meets the first sheave."""

    rig: Rig
    middle: int
    end: int


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
