"""Checks of the sections and of what hangs on the line between them; problems stop a scene, as those of checks.py."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable

from ..physics.drag import TANGENTIAL
from ..physics.fairing import Fairing, dressed, fairing_weight
from ..physics.section import Section, material_of
from .material import section_ends
from .problem import Problem
from .scene import Scene

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


def section_problems(scene: Scene) -> list[Problem]:
    """What makes a section senseless, or a body on the line, whatever the rest of the scene is."""
    sections = scene.cable.sections
    found = name_problems("cable.sections", "section", sections) + name_problems("bodies", "body", scene.bodies)
    for name, section in sections.items():
        found += water_problems(name, section)
        found += _fairing_problems(scene, name, section) + _termination_problems(name, section)
    last, taken = list(sections)[-1], Counter(body.at for body in scene.bodies.values())
    for name, body in scene.bodies.items():
        key = f"bodies.{name}.at"
        if body.at not in sections:
            text = f"= '{body.at}' is no section of the cable"
            found.append(Problem(key, text, f"Give one of {', '.join(sections)}"))
        elif body.at == last:
            text = f"= '{body.at}' is the last section, at whose end the towbody is"
            remedy = "Add its numbers to the towbody, or divide the section where the body sits"
            found.append(Problem(key, text, remedy))
        elif taken[body.at] > 1:
            text = f"= '{body.at}' is given to {taken[body.at]} bodies, a section's end carries one"
            found.append(Problem(key, text, "Make one body of them, or put a short section between"))
    return found


def water_problems(name: str, section: Section) -> list[Problem]:
    """Coefficients of the water that the section's drag law cannot take."""
    own, found = dressed(section), []
    if own.drag_law in TANGENTIAL and own.tangential_coefficient and not own.drag_coefficient:
        found.append(
            Problem(
                f"cable.sections.{name}.tangential_coefficient",
                f"= {own.tangential_coefficient:g} has no meaning beside drag_coefficient = "
                f"{'none' if own.drag_coefficient is None else f'{own.drag_coefficient:g}'}: the law "
                f"{own.drag_law.value} takes C_t as a share of a constant C_D above 0",
                "Give drag_coefficient, or leave the tangential one out",
            )
        )
    return found


def _fairing_problems(scene: Scene, name: str, section: Section) -> list[Problem]:
    key, diameter = f"cable.sections.{name}.fairing", material_of(scene.cable, section).diameter
    mass, net = fairing_weight(section, diameter, scene.water.density, scene.gravity)
    if section.fairing is Fairing.NONE and section.fairing_mass and section.fairing_net_weight is None:
        text = (
            f"= {section.fairing_mass:g} kg/m is of no known material, for fairing is none: its buoyancy is not known"
        )
        return [Problem(f"{key}_mass", text, "Give fairing_net_weight, or the fairing")]
    if net > 1.02 * mass * scene.gravity and scene.gravity > 0.0:
        text = (
            f"= {net:g} N/m is more than the dry weight {mass * scene.gravity:.4g} N/m of the fairing: nothing sinks so"
        )
        return [Problem(f"{key}_net_weight", text, "Check the units of it and of fairing_mass")]
    return []


def _termination_problems(name: str, section: Section) -> list[Problem]:
    key, given = f"cable.sections.{name}.termination_net_weight", section.termination_net_weight
    if given is None or section.termination_mass > 0.0:
        return []
    text = f"= {given:g} N belongs to a termination without mass: termination_mass is 0 kg, must be above 0 kg"
    return [Problem(key, text, "Give termination_mass, or leave the net weight out")]


def body_problems(scene: Scene, leaves: float) -> list[Problem]:
    """Bodies that hang inboard of the arc length ``leaves`` [m], where the cable leaves the sheave at the start."""
    ends, found = section_ends(scene.cable), []
    for name, body in scene.bodies.items():
        if ends[body.at] <= leaves:
            text = (
                f"= '{body.at}' puts it at {ends[body.at]:.4g} m from the drum end, must be above {leaves:.4g} m: it "
                "would hang inboard of where the cable leaves the sheave, and no body passes a sheave"
            )
            remedy = "Put it on a section that ends farther out, or make winch.wrap smaller"
            found.append(Problem(f"bodies.{name}.at", text, remedy))
    return found


def seat_rise(scene: Scene, section: Section) -> float:
    """How much higher [m] than the cable of cable.diameter a section sits in the groove: (D - d) / (2 sin s)."""
    half = math.radians(0.5 * scene.sheave.throat_angle_deg)
    return 0.5 * (material_of(scene.cable, section).diameter - scene.cable.diameter) / math.sin(half)


def seat_problems(scene: Scene, leaves: float) -> list[Problem]:
    """Sections too thick or too thin for the groove among those that lie on it at the start.

    A thicker one has its centreline above the top of the groove where (D - d)/(2 sin s) is the depth of the groove or
    more; a thinner one is off its seat, which is that of cable.diameter, by as much.
    """
    ends, found = section_ends(scene.cable), []
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
            found.append(Problem(f"cable.sections.{name}.diameter", text, remedy))
    return found
