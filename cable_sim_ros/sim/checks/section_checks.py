"""Checks of the sections and of what hangs on the line between them; problems stop a scene, as those of checks.py."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator

from ...physics.drag_laws import EVERY_ANGLE, LAWS, DragLaw
from ...physics.fairing import Fairing, dressed, fairing_weight
from ...physics.section import Section, material_of
from ..problem import Limit, Problem
from ..scene import Scene
from ..tables.material import section_ends

NAME = re.compile(r"[a-z][a-z0-9_]*")


def name_problems(prefix: str, kind: str, names: Iterable[str]) -> list[Problem]:
    """Names that cannot be parts of parameter names; ``kind``: what they name."""
    return [
        Problem(
            f"{prefix}.{name}",
            f"is not a {kind} name",
            "Use lower-case letters, digits and _, beginning with a letter: names are parts of parameter names",
        )
        for name in names
        if not NAME.fullmatch(name)
    ]


def section_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a section senseless, or a body on the line, whatever the rest of the scene is."""
    sections = scene.cable.sections
    yield from name_problems("cable.sections", "section", sections)
    yield from name_problems("bodies", "body", scene.bodies)
    for name, section in sections.items():
        yield from water_problems(name, section)
        yield from _fairing_problems(scene, name, section)
        yield from _termination_problems(name, section)
    last, taken = list(sections)[-1], Counter(body.at for body in scene.bodies.values())
    for name, body in scene.bodies.items():
        key = f"bodies.{name}.at"
        if body.at not in sections:
            yield Problem(key, f"= '{body.at}' is no section of the cable", f"Give one of {', '.join(sections)}")
        elif body.at == last:
            text = f"= '{body.at}' is the last section, at whose end the towbody is"
            yield Problem(key, text, "Add its numbers to the towbody, or divide the section where the body sits")
        elif taken[body.at] > 1:
            text = f"= '{body.at}' is given to {taken[body.at]} bodies, a section's end carries one"
            yield Problem(key, text, "Make one body of them, or put a short section between")


def water_problems(name: str, section: Section) -> Iterator[Problem]:
    """Coefficients of the water that the section's drag law cannot take, or lacks."""
    own, key = dressed(section), f"cable.sections.{name}"
    law, called = LAWS[own.drag_law], own.drag_law.value
    constant, tangential = own.drag_coefficient, own.tangential_coefficient
    if section.tangential_coefficient is not None and section.friction_coefficient is not None:
        text = (
            f"= {section.friction_coefficient:g} stands beside tangential_coefficient = "
            f"{section.tangential_coefficient:g}: both say what the drag along the cable is, on pi d and on d"
        )
        yield Problem(f"{key}.friction_coefficient", text, "Leave one of the two out")
    if law.per_ct is EVERY_ANGLE and tangential and not constant:
        text = (
            f"= {tangential:g} has no meaning beside drag_coefficient = "
            f"{'none' if constant is None else f'{constant:g}'}: the law {called} takes C_t as a share of a constant "
            "C_D above 0"
        )
        yield Problem(f"{key}.tangential_coefficient", text, "Give drag_coefficient, or leave the tangential one out")
    for kind in ("tangential_coefficient", "friction_coefficient"):
        if law.per_ct is None and getattr(section, kind):
            why = "which is no drag" if own.drag_law is DragLaw.OFF else "whose drag along the cable is of the angle"
            text = f"= {getattr(section, kind):g} has no part in the law {called}, {why}"
            yield Problem(f"{key}.{kind}", text, f"Leave it out, or take drag_law: {DragLaw.CROSSFLOW.value}")
    if law.min_drag > 0.0 and not constant:
        text = (
            f"= {called} needs a constant C_D above 0, and drag_coefficient = "
            f"{'none' if constant is None else f'{constant:g}'}: its source gives {law.min_drag:g} to "
            f"{law.max_drag:g}, no value"
        )
        yield Problem(f"{key}.drag_law", text, "Give drag_coefficient")
    if law.own_fit and section.drag_coefficient is not None:
        text = f"= {section.drag_coefficient:g} takes the place of the C_N(Re) after which the law {called} is named"
        remedy = f"Leave it out, or take drag_law: {DragLaw.CROSSFLOW.value} with this constant"
        yield Problem(f"{key}.drag_coefficient", text, remedy)
    elif (law.own_fit or law.drag_coefficient) and section.drag_coefficient is None and constant is not None:
        text = (
            f"= {called} has a C_N of its own, and so has fairing: {section.fairing.value}, {constant:g} on its "
            "thickness: one of the two would be lost"
        )
        yield Problem(f"{key}.drag_law", text, "Leave drag_law out for that of the fairing, or make fairing none")


def _fairing_problems(scene: Scene, name: str, section: Section) -> Iterator[Problem]:
    key, diameter = f"cable.sections.{name}.fairing", material_of(scene.cable, section).diameter
    mass, net = fairing_weight(section, diameter, scene.water.density, scene.gravity)
    if section.fairing is Fairing.NONE and section.fairing_mass and section.fairing_net_weight is None:
        text = (
            f"= {section.fairing_mass:g} kg/m is of no known material, for fairing is none: its buoyancy is not known"
        )
        yield Problem(f"{key}_mass", text, "Give fairing_net_weight, or the fairing")
        return
    if scene.gravity > 0.0:
        dry = "1.02 of the dry weight of the fairing"
        yield from Limit(f"{key}_net_weight", net, "<=", 1.02 * mass * scene.gravity, "N/m", dry).problems(
            "nothing sinks so", "Check the units of it and of fairing_mass"
        )


def _termination_problems(name: str, section: Section) -> Iterator[Problem]:
    key, given = f"cable.sections.{name}.termination_net_weight", section.termination_net_weight
    if given is None or section.termination_mass > 0.0:
        return
    text = f"= {given:g} N belongs to a termination without mass: termination_mass is 0 kg, must be above 0 kg"
    yield Problem(key, text, "Give termination_mass, or leave the net weight out")


def body_problems(scene: Scene, leaves: float) -> Iterator[Problem]:
    """Bodies that hang inboard of the arc length ``leaves`` [m], where the cable leaves the sheave at the start."""
    ends = section_ends(scene.cable)
    for name, body in scene.bodies.items():
        lead, off = f"= '{body.at}' puts it # from the drum end", "where the cable leaves the sheave"
        yield from Limit(f"bodies.{name}.at", ends[body.at], ">", leaves, "m", off, lead).problems(
            "it would hang inboard, and no body passes a sheave",
            "Put it on a section that ends farther out, or make winch.wrap smaller",
        )


def seat_rise(scene: Scene, section: Section) -> float:
    """How much higher [m] than the cable of cable.diameter a section sits in the groove: (D - d) / (2 sin s)."""
    half = math.radians(0.5 * scene.sheave.throat_angle_deg)
    return 0.5 * (material_of(scene.cable, section).diameter - scene.cable.diameter) / math.sin(half)


def seat_problems(scene: Scene, leaves: float) -> Iterator[Problem]:
    """Sections too thick or too thin for the groove among those that lie on it at the start.

    A thicker one has its centreline above the top of the groove where (D - d)/(2 sin s) is the depth of the groove or
    more; a thinner one is off its seat, which is that of cable.diameter, by as much.
    """
    ends = section_ends(scene.cable)
    for name, section in scene.cable.sections.items():
        rise = seat_rise(scene, section)
        if ends[name] - section.length < leaves and abs(rise) >= scene.sheave.groove_depth:
            own = material_of(scene.cable, section).diameter
            text = (
                f"= {own:g} m would sit {abs(rise):.3g} m {'above' if rise > 0.0 else 'below'} the seat of "
                f"cable.diameter = {scene.cable.diameter:g} m on drum or sheave, must be less than "
                f"sheave.groove_depth = {scene.sheave.groove_depth:g} m: it does not fit the groove"
            )
            remedy = "Make the groove deeper, the diameters more alike, or keep this section outboard"
            yield Problem(f"cable.sections.{name}.diameter", text, remedy)
