"""Checks across blocks: what makes a scene senseless although every number is in its range.

``problems`` stop a scene from loading; ``warnings`` are numbers that will show in the results. Lengths are of
unstretched cable counted from its fixed end on the drum; drum, span and sheave are taken in the x-z plane.

Checks of a vehicle at the far end of the cable, ``towbody.model: vehicle``; problems stop a scene.

Checks of a cable of links (cable.model = segments): what it leaves out, and links too long for drum or sheave.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import degrees, pi, radians
from typing import NamedTuple

from ...physics.cable_assembly import Cable
from ...physics.section import CableModel, LinkBuoyancy, material_of
from ...physics.towbody import BodyModel, Towbody
from ...physics.winch import DrumModel
from ..compensation_setup import setpoint_warnings
from ..inputs import MAX_PITCH
from ..layout import FINE_ELEMENT, Layout, layout_of
from ..mesh.mesh_order import MAX_SAGITTA, longest_on
from ..mesh_blocks import SheaveAnswer
from ..problem import Limit, Problem, changed, idle
from ..scene import Scene
from ..statics.route import DRUM_RESERVE, ROUND_OFF
from ..statics.vehicle_shape import attachment_of, max_tension, mean_compliance, pose_of, reach_problem
from ..tables.material import extreme, hung, outboard, wet_weight
from ..wake_tables import amplified_warnings, bare_problems, wake_problems
from .attitude_checks import attitude_problems, attitude_warnings
from .consistency_checks import (
    astern_problems,
    astern_warnings,
    body_warnings,
    density_problems,
    density_warnings,
    height_problems,
    weight_problems,
    wrap_problems,
    wrap_warnings,
)
from .drive_checks import (
    drive_problems,
    drive_warnings,
    feed_forward_problems,
    holding_problems,
    layer_problems,
    pull_warnings,
    setpoint_option_warnings,
)
from .friction_checks import friction_problems, friction_warnings
from .instrument_checks import instrument_problems, instrument_warnings
from .mesh_motion_checks import drum_problems, mesh_problems, wave_warnings
from .rule_checks import rule_problems, rule_warnings
from .scene_warnings import damping_warnings, drag_warnings, part_warnings, swing_warnings
from .sea_checks import sea_problems, sea_warnings
from .section_checks import body_problems, seat_problems, section_problems
from .viv_checks import strum_problems, strum_warnings

LONGEST_LINK = 1.0  # radii of drum or sheave: a longer link lies on it with one point

DRAWN = "length", "diameter"  # of a picture

# longest element on the sheave over the bending length sqrt(EI/T): line load, its edges and the reactions at the ends
# of the contact within 5 % at the shipped contact stiffness, resultant 0.001 %; at 5 they are off by 12 to 86 %, the
# resultant by 0.03 % (cable-sim bench --sheave-mesh, docs/accuracy.md)
RESOLVED = 1.5
FINE_ZONE = 1.0  # m of fine mesh (and of cable on the drum) wanted when a compensation drives the winch
LONGEST_STEP = 0.1  # s, of a tick that is one step
MAX_STRAIN = 0.1  # under the weight of the tow
MAX_FLOOR = 1e-4  # that residual over the working tension
MIN_FLOOR_GAP = 10.0  # penetrations that a seabed must lie below the sheave


class Bent(NamedTuple):
    """A surface that links lie on at the start: its key, radius [m], longest link [m] and the section of that."""

    key: str
    radius: float
    size: float
    section: str

    def limit(self, longest: float, bounds: str = "") -> Limit:
        key = f"cable.sections.{self.section}"
        lies = f"lies on {self.key} = {self.radius:g} m with links of"
        return Limit(key, self.size, "<=", longest, "m", bounds, lies)


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
    for bent in bent_links(layout):
        yield from bent.limit(LONGEST_LINK * bent.radius).problems(
            "a link is straight and would touch it with one point",
            f"Give it more elements there, links of at most {longest_on(bent.radius, _allowed(scene)):.2g} m",
        )


def form_problems(cable: Cable) -> Iterator[Problem]:
    """A form of links' buoyancy for elements that are none."""
    if cable.model is not CableModel.SEGMENTS:
        why = f"it is of links, and cable.model = {cable.model.value}"
        yield from idle("cable", cable, ["link_buoyancy"], why, "cable.model: segments")


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
    sagitta = f"whose middle is {MAX_SAGITTA:g} contact penetrations below their ends"
    for bent in bent_links(layout):
        yield from bent.limit(longest_on(bent.radius, _allowed(scene)), sagitta).problems(
            "the load sits on the middles, penetration and tension will ripple", "Give it more elements there"
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
    return scene.contact.penetration_limit * extreme(scene.cable, "diameter")[1]


def vehicle_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a vehicle senseless, whatever the route of its cable is."""
    for name, body in scene.bodies.items():
        if body.model is BodyModel.VEHICLE:
            yield Problem(
                f"bodies.{name}.model",
                "= vehicle is a body on the line: only the far end of the cable is driven from outside",
                "Give towbody.model: vehicle, or make the cable end here",
            )
    if scene.towbody.model is not BodyModel.VEHICLE:
        why = f"with towbody.model = {scene.towbody.model.value} there is no vehicle"
        yield from idle("vehicle", scene.vehicle, changed(scene.vehicle)[:1], why, "towbody.model: vehicle")
        return
    bare = Towbody.model_validate({"model": "vehicle"})
    if given := [key for key, value in scene.towbody if value != getattr(bare, key) and key not in DRAWN]:
        yield Problem(
            f"towbody.{given[0]}",
            f"is given to a body of model vehicle, of which the pose alone counts: {', '.join(given)} would do nothing",
            "Leave them out; the vehicle's weight and drag are those of its own simulator",
        )
    if scene.vehicle.position is None:
        yield Problem(
            "vehicle.position",
            "is missing (reference point at the start, from the ship: ahead, to port, up from the water surface)",
            "Give three numbers in m, for example `position: [-40.0, 0.0, -30.0]`",
        )
    pitch, bound = abs(scene.vehicle.attitude_deg[1]), degrees(MAX_PITCH)
    yield from Limit("vehicle.attitude_deg", pitch, "<=", bound, "deg", lead="has a pitch of").problems(
        "roll and yaw have no meaning near 90 deg", "Give it in [-80, 80] deg"
    )


def driven_problems(layout: Layout) -> Iterator[Problem]:
    """A vehicle that begins where its cable does not reach, or in the seabed."""
    scene = layout.scene
    if scene.vehicle.position is None:
        return
    yaw = radians(scene.ship.heading_deg)
    strain = max_tension(scene) * mean_compliance(scene)
    found = reach_problem(scene, attachment_of(scene, pose_of(scene, yaw)), yaw, layout.route.scope, strain)
    if found:
        text, _, remedy = found.partition(": ")
        yield Problem("vehicle.position", f"cannot be: {text}", remedy[:1].upper() + remedy[1:])


def downforce(layout: Layout) -> float:
    """Force [N] that pulls the tow down: wet weight of the cable past the sheave, net weights and lifts of what hangs
    there."""
    scene, start = layout.scene, layout.tangent
    pressure = 0.5 * scene.water.density * layout.water_speed**2
    cable = sum(wet_weight(scene, section) * length for length, section in outboard(scene, start))
    things = sum(thing.net_weight for thing in hung(scene) if thing.place > start)
    lift = pressure * sum(body.level_lift_area for body in (scene.towbody, *scene.bodies.values()))
    return cable + things + scene.towbody.net_weight - lift


def _pull(layout: Layout) -> Limit:
    return Limit(
        "towbody.net_weight", downforce(layout), ">", 0.0, "N", lead="and the wet weight of the cable add up to"
    )


def problems(scene: Scene) -> list[Problem]:
    """What makes the scene senseless; empty when it can be started."""
    layout, sections = layout_of(scene), scene.cable.sections
    if not sections:
        return [Problem("cable.sections", "has no section", "Give at least one section, from the drum end outward")]
    found = [*form_problems(scene.cable), *section_problems(scene), *weight_problems(scene), *bare_problems(scene)]
    found += [*strum_problems(scene), *sea_problems(scene), *feed_forward_problems(scene), *attitude_problems(scene)]
    found += vehicle_problems(scene)
    if unit := density_problems(scene):
        return found + unit  # weights and stiffnesses are judged by them
    if any(problem.key.startswith("water.current_") for problem in found):
        return found  # how fast the water passes is not known
    if any(body.at not in sections for body in scene.bodies.values()):
        return found  # where they hang is not known
    found += [*height_problems(scene), *_tick_problems(scene), *_place_problems(scene)]
    if _distance(scene) <= scene.winch.drum_radius + scene.sheave.radius:
        return found  # there is no route to measure along
    found += drum_problems(layout)
    feeds = scene.winch.drum == DrumModel.FEED
    if feeds and found:
        return found
    found += _length_problems(layout)
    for check in (astern_problems, friction_problems, drive_problems, instrument_problems, rule_problems):
        found += check(scene)
    if not found:
        found += layer_problems(layout)
        found += holding_problems(layout) if feeds else wrap_problems(layout)
    found += _stiffness_problems(layout)
    for of_mesh in (mesh_problems, link_problems, wake_problems):
        found = found or list(of_mesh(layout))  # otherwise there may be no mesh
    return found


def _tick_problems(scene: Scene) -> Iterator[Problem]:
    solver = scene.solver
    if solver.tension_error is None:
        longest = "the longest step that is not chosen by its error"
        yield from Limit("solver.tick", solver.tick, "<=", LONGEST_STEP, "s", longest).problems(
            "a cable over a sheave does not follow it",
            "Give a shorter one, or solver.tension_error, so that each tick is divided into steps",
        )


def _distance(scene: Scene) -> float:
    """From the axis of the drum to that of the sheave [m]."""
    return math.hypot(*(scene.sheave.position[i] - scene.winch.position[i] for i in (0, 2)))


def _place_problems(scene: Scene) -> Iterator[Problem]:
    winch, sheave, distance = scene.winch, scene.sheave, _distance(scene)
    key, radii = "sheave.position", f"the radii of drum, {winch.drum_radius:g} m, and sheave, {sheave.radius:g} m"
    need = winch.drum_radius + sheave.radius
    yield from Limit(key, distance, ">", need, "m", radii, "is # from winch.position").problems(
        "", "Move them apart, or make the radii smaller"
    )
    yield from Limit(key, sheave.position[0], "<", winch.position[0], "m", "x of winch.position", "has x =").problems(
        "a winch aft of its sheave is not modelled, for angles of wrap and departure and the set-point laws count from "
        "a cable that leaves aft, and over the bow it would come back under the ship",
        "Give the sheave the smaller x; for a bow sheave describe the ship turned about, its x axis aft, with the "
        "other sign of ship.tow_speed and the motion turned by 180 deg",
    )


def _length_problems(layout: Layout) -> Iterator[Problem]:
    """Too little cable on the drum or off it, nothing that pulls it down, and what hangs where it cannot."""
    scene, winch, route = layout.scene, layout.scene.winch, layout.route
    feeds = winch.drum == DrumModel.FEED
    if not feeds:
        begin = winch.wrap - route.wound / route.drum
        yield from Limit("winch.wrap", winch.wrap, ">", begin, "rad", "where the cable leaves the drum").problems(
            "no cable lies on the drum", "Make it larger, by half a turn or more"
        )
    if route.total <= layout.tangent and not feeds:
        yield Problem(
            "cable.sections",
            f"add up to {route.total:.4g} m, but {layout.tangent:.4g} m are needed to reach the "
            f"sheave ({route.wound:.4g} m on the drum, {layout.tangent - route.wound:.4g} m to the sheave)",
            f"Make the cable longer than {layout.tangent:.4g} m, or winch.wrap smaller",
        )
    elif scene.towbody.model is BodyModel.VEHICLE:
        yield from driven_problems(layout)
    elif layout.water_speed == 0.0:
        yield from _pull(layout).problems(
            "nothing pulls the cable straight while the ship is at rest in the water",
            "Make the body or the cable heavier, or give ship.tow_speed",
        )
    yield from seabed_problems(scene)
    yield from seat_problems(scene, layout.leaves)
    yield from body_problems(scene, layout.leaves)


def _stiffness_problems(layout: Layout) -> Iterator[Problem]:
    """Cable too soft for what it carries, or so stiff that its forces are round-off."""
    scene = layout.scene
    pull, (key, stiffness) = downforce(layout), extreme(scene.cable, "axial_stiffness")
    strain = f"which the {pull:.4g} N that pull the tow down stretch by {100.0 * MAX_STRAIN:g} %"
    yield from Limit(key, stiffness, ">=", pull / MAX_STRAIN, "N", strain).problems(
        f"the element's law is one of small strain, no step (solver.tick = {scene.solver.tick:g} s) makes up for it",
        "Make it stiffer, or the tow lighter; check its unit (EA in N)",
    )
    (key, stiffness), working = extreme(scene.cable, "axial_stiffness", max), scene.contact.working_tension
    floor = f"whose round-off in a force is {100.0 * MAX_FLOOR:g} % of contact.working_tension = {working:g} N"
    yield from Limit(key, stiffness, "<=", MAX_FLOOR * working / ROUND_OFF, "N", floor).problems(
        f"a step (solver.tick = {scene.solver.tick:g} s) cannot be solved to less",
        "Make it smaller; a cable without stretch needs no more",
    )


def seabed_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a seabed senseless."""
    bed = scene.seabed
    if bed.depth is None:
        return
    lowest = scene.sheave.position[2] - scene.sheave.radius + scene.ship.reference_height
    sheave = f"clear of the sheave, whose lowest point is at {lowest:.4g} m"
    yield from Limit("seabed.depth", bed.depth, ">=", MIN_FLOOR_GAP * bed.penetration - lowest, "m", sheave).problems(
        "the cable would leave it through the ground", "Make it deeper"
    )
    wet = min(wet_weight(scene, section) for section in scene.cable.sections.values())
    driven = scene.towbody.model is BodyModel.VEHICLE
    if wet <= 0.0 or (scene.towbody.net_weight <= 0.0 and not driven):
        yield Problem(
            "seabed.depth",
            f"is given, but what floats does not lie on it: the cable weighs {wet:.4g} N/m in "
            f"water, the towbody {scene.towbody.net_weight:g} N; both must be above 0, they set its stiffness",
            "Leave the seabed out, or make cable and towbody heavier than water",
        )


def warnings(scene: Scene) -> Iterator[Problem]:
    """Numbers that can be run but will show in the results; each names number, threshold and remedy."""
    layout = layout_of(scene)
    radius, feeds = scene.sheave.radius, scene.winch.drum == DrumModel.FEED
    size, name = max(
        (
            (last - first, name)
            for first, last, name in layout.elements
            if first <= max(layout.leaves, layout.tangent + FINE_ELEMENT * radius) and last >= layout.tangent
        ),
        default=(0.0, ""),
    )
    key, lead, fine = (
        f"cable.sections.{name}",
        "lies on the sheave with elements of",
        f"{FINE_ELEMENT:g} of sheave.radius",
    )
    more = "mesh.sheave more elements, or leave it out" if feeds else "the part there more elements, or its own section"
    coarse = Limit(key, size, "<=", FINE_ELEMENT * radius, "m", fine, lead).problems(
        "contact and tension will ripple", f"Give {more}"
    )
    yield from coarse
    if not coarse and scene.setpoint.algorithm != "hold":
        yield from travel_warnings(layout, FINE_ZONE, FINE_ZONE)
    stiff = material_of(scene.cable, scene.cable.sections[name]).bending_stiffness if name else 0.0
    resolved = RESOLVED * math.sqrt(stiff / scene.contact.working_tension)
    spread = not feeds or scene.accuracy.sheave is not SheaveAnswer.RESULTANT  # is it asked for?
    if spread and stiff > 0.0 and not coarse:
        bending = f"{RESOLVED:g} bending lengths sqrt(EI/T) at contact.working_tension"
        yield from Limit(key, size, "<=", resolved, "m", bending, lead).problems(
            "how the load spreads along the sheave and what its ends bear is not resolved; tension, resultant and "
            "towbody do not depend on it",
            "Where the spread matters, shorter elements there",
        )
    if scene.towbody.model is not BodyModel.VEHICLE:
        yield from _pull(layout).problems(
            "the tow rises to the surface, where the towbody model does not hold",
            "Make the body heavier or its lift_area negative",
        )
    yield from link_warnings(layout)
    yield from sea_warnings(scene)
    yield from wave_warnings(layout)
    yield from density_warnings(scene)
    yield from astern_warnings(scene)
    yield from wrap_warnings(scene)
    yield from seat_problems(scene, layout.route.total)  # those that may be hauled in
    speed = layout.water_speed
    yield from setpoint_option_warnings(scene)
    yield from setpoint_warnings(scene, speed)
    yield from damping_warnings(scene.cable)
    yield from swing_warnings(scene, speed)
    yield from body_warnings(scene, speed)
    yield from attitude_warnings(scene, speed)
    yield from amplified_warnings(scene.cable)
    yield from strum_warnings(layout)
    yield from drag_warnings(scene, speed)
    yield from part_warnings(scene)
    yield from friction_warnings(scene)
    yield from drive_warnings(scene)
    yield from instrument_warnings(scene)
    yield from rule_warnings(scene)
    yield from pull_warnings(layout)
    for part, name, below in (("sheave", "sheave", radius), ("winch", "drum", scene.winch.drum_radius)):
        height = getattr(scene, part).position[2] + scene.ship.reference_height - below
        lead = f"puts the lowest point of the {name} at"
        yield from Limit(f"{part}.position", height, ">=", 0.0, "m", "the water surface", lead).problems(
            "", "Check the sign of z (up) and ship.reference_height"
        )


def travel_warnings(layout: Layout, hauled: float, paid: float) -> Iterator[Problem]:
    """Cautions for a winch that hauls in and pays out by these lengths [m, both positive] from the start."""
    scene, wound = layout.scene, layout.route.wound
    if scene.winch.drum == DrumModel.FEED:  # the fine mesh stays at the sheave, whatever runs through it
        travel = wound - scene.winch.dead_length - DRUM_RESERVE * layout.route.drum
        key = "winch.cable_on_drum" if scene.winch.scope is None else "winch.scope"
        yield from Limit(key, travel, ">=", paid, "m", "", "leaves # to be paid out").problems(
            "the winch stops at the end", "Leave more cable on the drum"
        )
        return
    inboard, outboard = layout.fine_zone
    sides = ((outboard, hauled, "outboard", "hauling in"), (inboard, paid, "inboard", "paying out"))
    for have, want, side, how in sides:
        yield from Limit("cable.sections", have, ">=", want, "m", f"of {how}", f"have # of fine mesh {side}").problems(
            "a coarser element comes onto the sheave and shows as a false change of tension",
            f"Make the section at the sheave longer {side}, with elements of at most "
            f"{FINE_ELEMENT * scene.sheave.radius:.3g} m",
        )
    lead = f"= {scene.winch.wrap:g} rad leaves # on the drum"
    yield from Limit("winch.wrap", wound, ">=", paid, "m", "of paying out", lead).problems(
        "the winch stops at the cable end", "Make winch.wrap larger, and the first section with it"
    )
