"""Checks of a cable of links (cable.model = segments): what it leaves out, and links too long for drum or sheave."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from ..physics.cable import Cable
from ..physics.section import CableModel, LinkBuoyancy, material_of
from ..physics.winch import DrumModel
from .material import extreme
from .problem import Problem, apart
from .scene import Scene
from .statics import Route

LONGEST_LINK = 1.0  # radii of drum or sheave: a longer link lies on it with one point
# sagitta L^2/8R of a link on drum or sheave over the penetration that contact allows; of 1.8 the full-scale tow has
# the contact force within 0.03 % and a penetration 1.1 times as large, of 4.4 the flag PENETRATION (docs/segments.md)
MOST_SAGITTA = 2.0
BEND_REMEDY = "Where the bend at sheave or body matters, cable.model ancf; else set bending_stiffness to 0"


class Bent(NamedTuple):
    """A surface that links lie on at the start: its key, radius [m], longest link [m] and the section of that."""

    key: str
    radius: float
    size: float
    section: str


def longest_on(radius: float, allowed: float) -> float:
    """Longest link [m] whose sagitta on a ``radius`` [m] is MOST_SAGITTA of the penetration ``allowed`` [m]."""
    return sqrt(8.0 * radius * MOST_SAGITTA * allowed)


def bent_links(scene: Scene, table: list[tuple[float, float, str]], tangent: float, leaves: float) -> list[Bent]:
    """Longest links on the sheave and, where it is a contact surface, on the drum; table: see checks.elements."""
    route, found = Route(scene), []
    places = [("sheave.radius", route.sheave, tangent, max(leaves, tangent))]
    if scene.winch.drum == DrumModel.CONTACT:
        places.append(("winch.drum_radius", route.drum, 0.0, route.wound))
    for key, radius, begin, end in places:
        on = [(last - first, name) for first, last, name in table if first < end and last > begin]
        if on:
            found.append(Bent(key, radius, *max(on)))
    return found


def chain_problems(scene: Scene, table: list[tuple[float, float, str]], tangent: float, leaves: float) -> list[Problem]:
    """Links that cannot lie on what they are to lie on."""
    if scene.cable.model is not CableModel.SEGMENTS:
        return []
    return [
        Problem(
            f"cable.sections.{bent.section}",
            "lies on {} = {:g} m with links of {} m, longer than {} m: a link is straight and would touch it with one "
            "point".format(bent.key, bent.radius, *apart(bent.size, LONGEST_LINK * bent.radius)),
            f"Give it more elements there, links of at most {longest_on(bent.radius, _allowed(scene)):.2g} m",
        )
        for bent in bent_links(scene, table, tangent, leaves)
        if bent.size > LONGEST_LINK * bent.radius * (1 + 1e-9)
    ]


def form_problems(cable: Cable) -> list[Problem]:
    """A form of links' buoyancy for elements that are none."""
    if cable.model is CableModel.SEGMENTS or cable.link_buoyancy is LinkBuoyancy.FULL:
        return []
    return [
        Problem(
            "cable.link_buoyancy",
            f"= {cable.link_buoyancy.value} is of links, but cable.model = {cable.model.value}: it has no effect",
            "Leave it out, or give cable.model segments",
        )
    ]


def chain_cautions(scene: Scene, table: list[tuple[float, float, str]], tangent: float, leaves: float) -> list[Problem]:
    """What links leave out, and where their corners show."""
    if scene.cable.model is not CableModel.SEGMENTS:
        return []
    found = []
    key, stiffness = extreme(scene.cable, "bending_stiffness", max)
    if stiffness > 0.0:
        length = sqrt(stiffness / scene.contact.working_tension)
        found.append(
            Problem(
                key,
                f"= {stiffness:g} N m^2 is left out, a cable of links (cable.model = segments) has none: the cable "
                f"follows drum and sheave as if limp and leaves them without a lever, which shifts what hangs below by "
                f"up to sqrt(EI/T) = {length:.2g} m at contact.working_tension; reactions at the ends of the contact "
                "are not those of a stiff cable",
                BEND_REMEDY,
            )
        )
    for bent in bent_links(scene, table, tangent, leaves):
        longest = longest_on(bent.radius, _allowed(scene))
        if bent.size > longest * (1 + 1e-9):
            found.append(
                Problem(
                    f"cable.sections.{bent.section}",
                    "lies on {} = {:g} m with links of {} m, longer than {} m, whose middle is {:g} contact "
                    "penetrations below their ends: the load sits on the middles, penetration and tension will "
                    "ripple".format(bent.key, bent.radius, *apart(bent.size, longest), MOST_SAGITTA),
                    f"Give it more elements there, links of at most {longest:.2g} m",
                )
            )
    if scene.cable.link_buoyancy is LinkBuoyancy.NORMAL:
        found.append(
            Problem(
                "cable.link_buoyancy",
                "= normal is the printed form: tensions are wall tensions, and the cable is too limp by pA/T, the "
                "pressure on its cross-section over its effective tension",
                "For anything but a comparison with the source, link_buoyancy full",
            )
        )
    return found


def _allowed(scene: Scene) -> float:
    """Penetration [m] that contact allows at the working tension."""
    thinnest = min(material_of(scene.cable, section).diameter for section in scene.cable.sections.values())
    return scene.contact.penetration_limit * thinnest
