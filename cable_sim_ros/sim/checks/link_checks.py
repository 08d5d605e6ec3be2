"""Checks of a cable of links (cable.model = segments): what it leaves out, and links too long for drum or sheave."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import NamedTuple

from ...physics.cable_assembly import Cable
from ...physics.section import CableModel, LinkBuoyancy, material_of
from ...physics.winch import DrumModel
from ..layout import Layout
from ..mesh.mesh_order import MAX_SAGITTA, longest_on
from ..problem import Problem, apart
from ..scene import Scene
from ..tables.material import extreme

LONGEST_LINK = 1.0  # radii of drum or sheave: a longer link lies on it with one point


class Bent(NamedTuple):
    """A surface that links lie on at the start: its key, radius [m], longest link [m] and the section of that."""

    key: str
    radius: float
    size: float
    section: str


def bent_links(layout: Layout) -> list[Bent]:
    """Longest links on the sheave and, where it is a contact surface, on the drum."""
    route, found = layout.route, []
    places = [("sheave.radius", route.sheave, layout.tangent, max(layout.leaves, layout.tangent))]
    if layout.scene.winch.drum == DrumModel.CONTACT:
        places.append(("winch.drum_radius", route.drum, 0.0, route.wound))
    for key, radius, begin, end in places:
        on = [(last - first, name) for first, last, name in layout.elements if first < end and last > begin]
        if on:
            found.append(Bent(key, radius, *max(on)))
    return found


def link_problems(layout: Layout) -> Iterator[Problem]:
    """Links that cannot lie on what they are to lie on."""
    scene = layout.scene
    if scene.cable.model is not CableModel.SEGMENTS:
        return
    yield from [
        Problem(
            f"cable.sections.{bent.section}",
            "lies on {} = {:g} m with links of {} m, longer than {} m: a link is straight and would touch it with one "
            "point".format(bent.key, bent.radius, *apart(bent.size, LONGEST_LINK * bent.radius)),
            f"Give it more elements there, links of at most {longest_on(bent.radius, _allowed(scene)):.2g} m",
        )
        for bent in bent_links(layout)
        if bent.size > LONGEST_LINK * bent.radius * (1 + 1e-9)
    ]


def form_problems(cable: Cable) -> Iterator[Problem]:
    """A form of links' buoyancy for elements that are none."""
    if cable.model is CableModel.SEGMENTS or cable.link_buoyancy is LinkBuoyancy.FULL:
        return
    yield Problem(
        "cable.link_buoyancy",
        f"= {cable.link_buoyancy.value} is of links, but cable.model = {cable.model.value}: it has no effect",
        "Leave it out, or give cable.model segments",
    )


def link_warnings(layout: Layout) -> Iterator[Problem]:
    """What links leave out, and where their corners show."""
    scene = layout.scene
    if scene.cable.model is not CableModel.SEGMENTS:
        return
    key, damping = extreme(scene.cable, "bending_damping", max)
    if damping > 0.0 and extreme(scene.cable, "bending_stiffness", max)[1] > 0.0:
        yield Problem(
            key,
            f"= {damping:g} N m^2 s has no effect on a cable of links (cable.model = segments): their joints are "
            "springs without damping",
            "Leave it out, or cable.model ancf",
        )
    for bent in bent_links(layout):
        longest = longest_on(bent.radius, _allowed(scene))
        if bent.size > longest * (1 + 1e-9):
            yield Problem(
                f"cable.sections.{bent.section}",
                "lies on {} = {:g} m with links of {} m, longer than {} m, whose middle is {:g} contact "
                "penetrations below their ends: the load sits on the middles, penetration and tension will "
                "ripple".format(bent.key, bent.radius, *apart(bent.size, longest), MAX_SAGITTA),
                f"Give it more elements there, links of at most {longest:.2g} m",
            )
    if scene.cable.link_buoyancy is LinkBuoyancy.NORMAL:
        thickest = extreme(scene.cable, "diameter", max)[1]
        pressed = scene.water.density * scene.gravity * 100.0 * 0.25 * pi * thickest**2
        yield Problem(
            "cable.link_buoyancy",
            "= normal is the printed form, which leaves out what pressure does to a curved cable: tensions and "
            f"shape err by what pressure on its cross-section comes to, {pressed:.3g} N at 100 m",
            "For anything but a comparison with the source, link_buoyancy full",
        )


def _allowed(scene: Scene) -> float:
    """Penetration [m] that contact allows at the working tension."""
    thinnest = min(material_of(scene.cable, section).diameter for section in scene.cable.sections.values())
    return scene.contact.penetration_limit * thinnest
