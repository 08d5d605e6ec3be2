"""Static start of a tow: first guesses from its integrated static shape, settled on its sheave.

A guess lays the stretched cable along the route to the sheave, as deep in its groove as its tension presses it, and
outboard along the shape by integration (static_shape.py); where that does not settle, straight. What settles beside the
sheave is no start, unless the cable by its shape passes clear of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from math import atan2, cos, degrees, hypot, sin
from typing import NamedTuple, Protocol

import numpy as np

from ..physics.contact_surface import FLOOR, GROOVE, SHEAVE_ROW, Seabed
from ..physics.flaps import clear_attitudes
from ..physics.section import material_of
from ..physics.state import FLOW, NOW, Model, State
from ..physics.swivel import leads, rolled
from ..physics.tick_output import Flag
from ..physics.towbody import BodyModel
from .layout import Layout, layout_of
from .scene import Scene
from .statics.route import MAX_PUSH, MAX_STEPS, Route, StartError, first_angle, first_strain, laid_angle
from .statics.static_shape import TowShape
from .statics.vehicle_shape import attachment_of, reach_problem, vehicle_shape
from .tables.current import flow_of
from .tables.elementary import product
from .tables.material import extreme, section_ends

MIN_FLOW = 1e-6  # m/s
IN_PLANE = 1e-3  # rad, from the plane of a block that swivels to the cable that leaves it
MAX_FLEET = 0.1  # rad to one side of the sheave: more may be why the cable does not stay in its groove


CREEPS = 3e-4  # of contact.working_tension: residual with which slack cable to a vehicle may begin
SPREADS = 0.02, 0.1, 0.2  # of the length: how far the legs of a bight stand apart in a first guess, at least
PAID_OUT = 3e-4  # of the scope, to either side, for the slope of the tension: more is a start of its own


class Tow(Protocol):
    """What a start needs of a Simulator."""

    scene: Scene
    layout: Layout
    model: Model
    state: State

    @property
    def frame(self) -> np.record: ...

    @property
    def tolerance(self) -> float: ...

    @property
    def stiffness(self) -> str: ...

    def bring_to_rest(self, steps: int) -> int: ...

    def snapshot(self) -> dict[str, np.ndarray]: ...

    def restore(self, saved: dict[str, np.ndarray]) -> None: ...


class Departure(NamedTuple):
    """How the cable leaves the sheave by its static shape, rad: from the downward vertical, aft positive, in the plane
    of the sheave; out of that plane; and what of it wraps the sheave."""

    angle: float
    fleet: float
    wrap: float


def turned(yaw: float) -> np.ndarray:
    """Rotation [3, 3] of base_link into the world at ``yaw`` [rad]."""
    return np.array([[cos(yaw), -sin(yaw), 0.0], [sin(yaw), cos(yaw), 0.0], [0.0, 0.0, 1.0]])


def outward(shape: TowShape, yaw: float) -> tuple[float, ...]:
    """Unit vector in base_link along which the cable of a shape leaves its sheave."""
    return tuple((-product(shape.force[-1], turned(yaw)) / shape.tension[-1]).tolist())


def in_block(sim: Tow, vector: np.ndarray | tuple[float, ...], back: bool = False) -> np.ndarray:
    """A vector of base_link turned with the block of the sheave, or back, where that swivels."""
    swivel, angle = sim.model.settings[0].swivel, float(sim.state.now.swung.angle)
    return np.array(rolled(swivel, -angle if back else angle, vector) if swivel.on else vector)


def signed_departure(sim: Tow, shape: TowShape, yaw: float) -> Departure:
    """How the cable of a shape leaves its sheave."""
    route, down = sim.layout.route, in_block(sim, outward(shape, yaw), back=True)
    angle = atan2(-route.side * down[0], -down[2])
    fleet = atan2(down[1], hypot(down[0], down[2]))
    return Departure(angle, fleet, route.on_sheave(angle) / route.sheave)


def strains(scene: Scene, shape: TowShape) -> np.ndarray:
    """Strain [n] at every row of the shape."""
    cable = scene.cable
    stiffness = np.array([material_of(cable, section).axial_stiffness for section in cable.sections.values()])
    return shape.tension / stiffness[shape.section]


def along_shape(sim: Tow, shape: TowShape, yaw: float) -> np.ndarray:
    """Nodes [nodes, 6] in axes of the world about base_link: stretched along the route, then along the shape."""
    route, arc = copy(sim.layout.route), sim.state.arc - sim.state.arc[0]
    departure, strain = signed_departure(sim, shape, yaw), strains(sim.scene, shape)
    stretch = 1.0 + strain[-1]
    press(route, sim.state.surfaces, float(shape.tension[-1]))
    leaves = min((route.on_drum + route.span + route.on_sheave(departure.angle)) / stretch, arc[-1])
    aboard = arc <= leaves
    q, turn = np.zeros((len(arc), 6)), turned(yaw)
    r, g = swung(sim, route, stretch * arc[aboard], departure.angle)
    q[aboard, :3], q[aboard, 3:] = product(r, turn.T), stretch * product(g, turn.T)
    off, _ = swung(sim, route, np.array([stretch * leaves]), departure.angle)
    longer = max(arc[-1] - leaves, 1e-9) / shape.s[-1]  # by what the cable inboard is stretched
    up = (arc[-1] - arc[~aboard]) / longer
    tangent = -((1.0 + strain) / shape.tension)[:, None] * shape.force
    way = longer * (shape.place - shape.place[-1])
    for k in range(3):
        q[~aboard, k] = product(off, turn.T)[0, k] + np.interp(up, shape.s, way[:, k])
        q[~aboard, 3 + k] = np.interp(up, shape.s, tangent[:, k])
    return q


def swung(sim: Tow, route: Route, arc: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and unit tangents of `Route.nodes`, turned with the block of the sheave where that swivels."""
    r, g = route.nodes(arc, angle)
    point = sim.model.settings[0].swivel.point
    for i in np.flatnonzero(arc > route.on_drum + route.span):
        r[i], g[i] = point + in_block(sim, r[i] - point), in_block(sim, g[i])
    return r, g


def press(route: Route, surfaces: np.ndarray, tension: float) -> None:
    """Lay the route as deep in sheave and drum as ``tension`` [N] presses it: at a gap of zero contact has no
    stiffness, and the first correction would lead through the sheave."""
    for surface in surfaces:
        slope, halves = float(surface["slope_sin"]), 2 if surface["kind"] == GROOVE else 1
        if surface["kind"] == FLOOR or surface["stiffness"] <= 0.0:
            continue
        load = tension / (float(surface["radius"]) * halves * slope)
        depth = (load / float(surface["stiffness"])) ** (2.0 / 3.0) / slope
        if surface["kind"] == GROOVE:
            route.sheave -= depth
        else:
            route.drum -= depth


def straight(sim: Tow, angle: float, strain: float, yaw: float) -> np.ndarray:
    """The same of a cable that leaves the sheave in a straight line, ``angle`` [rad] from the vertical."""
    r, g = swung(sim, sim.layout.route, (sim.state.arc - sim.state.arc[0]) * (1.0 + strain), angle)
    turn = turned(yaw)
    return np.concatenate((product(r, turn.T), (1.0 + strain) * product(g, turn.T)), axis=1)


def guesses(sim: Tow, shape: TowShape, yaw: float) -> Iterator[np.ndarray]:
    """Nodes [nodes, 6] about base_link to begin with, best first."""
    if sim.scene.towbody.model is BodyModel.VEHICLE:
        yield from to_vehicle(sim, yaw)
        return
    if shape.closed:
        yield along_shape(sim, shape, yaw)
    angle = laid_angle(sim.scene, sim.layout.route, first_angle(sim.scene, shape.speed))
    for strain in (0.0, first_strain(sim.scene)):
        yield straight(sim, angle, strain, yaw)


def to_vehicle(sim: Tow, yaw: float) -> Iterator[np.ndarray]:
    """The same of a cable whose far end is where its vehicle is: catenaries, what they miss it by spread along them."""
    scene, route, arc = sim.scene, sim.layout.route, sim.state.arc - sim.state.arc[0]
    end = attachment_of(scene, sim.state.now.vehicle.motion.coord.tolist())
    drum = sim.model.settings[0].drum
    for spread in SPREADS:
        shape = vehicle_shape(scene, route, float(drum.payout_0 - drum.inboard), yaw, end, spread)
        q = along_shape(sim, shape, yaw)
        leaves = route.on_drum + route.span + route.on_sheave(shape.angle)
        part = np.clip((arc - leaves) / max(arc[-1] - leaves, 1e-9), 0.0, 1.0)
        q[:, :3] += part[:, None] * (end - (0.0, 0.0, scene.ship.reference_height) - q[-1, :3])
        yield q


def out_of_reach(sim: Tow) -> str:
    """ "" or why the cable cannot begin where its vehicle is."""
    if sim.scene.towbody.model is not BodyModel.VEHICLE:
        return ""
    now, drum = sim.state.now, sim.model.settings[0].drum
    end = attachment_of(sim.scene, now.vehicle.motion.coord.tolist())
    strain = float(sim.model.settings[0].vehicle.max_strain)
    return reach_problem(sim.scene, end, float(now.ship.mean_coord[5]), float(drum.payout_0 - drum.inboard), strain)


def settle(sim: Tow, shape: TowShape, yaw: float) -> dict[str, float]:
    """Bring a cleared Simulator to rest at its mean pose: steps, iterations and residual [N]. Raises StartError."""
    scene, health, block = sim.scene, sim.state.now.health, sim.state.now.swung
    swivel, driven = sim.model.settings[0].swivel, scene.towbody.model is BodyModel.VEHICLE
    if swivel.on:
        block.angle = leads(swivel, outward(shape, yaw))[0]
    departure = signed_departure(sim, shape, yaw)
    solid = float(sim.state.surfaces[SHEAVE_ROW].stiffness) > 0.0
    clear = not solid or (shape.closed and departure.wrap <= 0.0)  # it passes above the sheave: the scene has it so
    tried, iterations, beside, left = 0, 0, False, np.inf
    for guess in guesses(sim, shape, yaw):
        sim.state.q[:] = guess
        sim.state.q[:, :3] += sim.state.now.ship.mean_coord[:3]
        level_bodies(sim)
        again = 2
        while again > 0:
            steps = sim.bring_to_rest(MAX_STEPS)
            tried, iterations, left = tried + abs(steps), iterations + int(health.iterations), float(health.residual)
            if steps >= 0 and swivel.on and abs(block.cable - block.angle) > IN_PLANE and tried < MAX_STEPS:
                block.angle = block.cable
                continue
            if steps >= 0 or not left <= sim.tolerance:
                break
            again -= 1  # its steps became too short to tell, and what they led to is balanced: begin from there
        if driven and steps < 0 and left <= CREEPS * scene.contact.working_tension:
            steps = abs(steps)  # slack cable without weight has no one place: it goes on from here
        resting = steps >= 0 and bool(np.isfinite(sim.state.q).all())
        if resting and (clear or not int(sim.frame.status) & Flag.DETACHED):
            check_push(sim)
            return {"steps": tried, "iterations": iterations, "residual_n": left}
        beside = beside or resting
    raise off_sheave(scene, departure, left) if beside else no_equilibrium(sim, departure, tried, iterations, left)


def tension_slope(sim: Tow) -> float:
    """dT/dL [N/m] of a tow at rest: tension at the sheave to the pay-out, by the tows beside it. Raises StartError."""
    here, now = sim.snapshot(), sim.state.now
    step, ends = PAID_OUT * float(sim.frame.scope), [float(now.measured.tension)]
    for length in (step, -step):
        now.winch.length = length
        if sim.bring_to_rest(MAX_STEPS) >= 0:
            ends.append(float(now.measured.tension))
        sim.restore(here)
    if len(ends) < 3:
        raise StartError(
            f"{sim.scene.name}: setpoint.algorithm = constant_tension needs to know how the tension at rest answers to "
            f"pay-out, and {step:.3g} m more or less of it do not come to rest; nothing was started. Remedy: a smaller "
            "solver.tolerance, or a finer mesh on the sheave",
            float(now.health.residual),
        )
    return (ends[1] - ends[2]) / (2.0 * step)


def check_push(sim: Tow) -> None:
    """Refuse a rest in which the cable pushes. Raises StartError."""
    state = sim.state
    pushed, maximum = int(state.tension.argmin()), float(state.tension.max())
    if sim.scene.towbody.model is BodyModel.VEHICLE:  # a slack bight is held by its bending stiffness, and may push
        maximum = max(maximum, sim.scene.contact.working_tension)
    if state.tension[pushed] < -MAX_PUSH * maximum:
        raise StartError(
            f"{sim.scene.name}: at rest the cable would have to push with {-state.tension[pushed]:.4g} N at arc length "
            f"{state.arc[pushed]:.4g} m, more than {100.0 * MAX_PUSH:g} % of its largest tension {maximum:.4g} N: it "
            f"folds there, and where it would come to lie is not known; nothing was started. Remedy: more weight "
            f"at the body (towbody.net_weight), or a ship under way (ship.tow_speed)",
            float(state.now.health.residual),
        )


def way(scene: Scene, departure: Departure) -> str:
    """How the cable would leave the sheave, in words."""
    side = "port" if departure.fleet > 0.0 else "starboard"
    return (
        f"by its static shape it wraps the sheave by {degrees(departure.wrap):.3g} deg and leads "
        f"{degrees(abs(departure.fleet)):.3g} deg to {side} of its plane, in a groove of sheave.groove_depth = "
        f"{scene.sheave.groove_depth:g} m"
    )


def from_drum(scene: Scene) -> float:
    """Fleet angle between drum and sheave, rad."""
    ahead, aside, _ = np.subtract(scene.sheave.position, scene.winch.position)
    return atan2(abs(aside), abs(ahead))


def remedy(scene: Scene, departure: Departure) -> str:
    """What helps a cable that leaves the sheave so."""
    comes = from_drum(scene)
    if abs(comes) > MAX_FLEET:
        return (
            f"it comes {degrees(comes):.3g} deg aslant from the drum: bring winch.position and sheave.position into "
            f"line (the same y)"
        )
    if abs(departure.fleet) > MAX_FLEET:
        return "a flow from ahead (ship.heading_deg, water.current, ship.tow_speed), or a deeper sheave.groove_depth"
    stiffness = extreme(scene.cable, "axial_stiffness")[0]
    return f"a stiffer cable ({stiffness}), a sheave higher above the drum (sheave.position), or a finer mesh on it"


def off_sheave(scene: Scene, departure: Departure, left: float) -> StartError:
    """The error of a cable that comes to rest only beside its sheave, with the cause."""
    return StartError(
        f"{scene.name}: at rest the cable is not in the groove of its sheave: {way(scene, departure)}, and does not "
        f"stay there; nothing was started, for contact and tension of such a tow are not those of a cable on its "
        f"sheave. Remedy: {remedy(scene, departure)}",
        left,
    )


def no_equilibrium(sim: Tow, departure: Departure, tried: int, iterations: int, left: float) -> StartError:
    """The error of a tow that does not come to rest."""
    scene = sim.scene
    aside = f": {way(scene, departure)}" if abs(departure.fleet) > MAX_FLEET else ""
    helps = (
        remedy(scene, departure)
        if aside
        else "check weight and drag of towbody and cable, or begin with a shorter cable or a coarser mesh"
    )
    if scene.towbody.model is BodyModel.VEHICLE:
        helps = (
            "a drum and a sheave nearer to each other and to the water, for slack light cable does not stay on its "
            "sheave; a cable no lighter than water, for one that floats to the surface finds no rest; or less "
            "winch.scope"
        )
    if len(sim.model.line.rigid.bodies):
        helps += (
            "; a body of model rigid may have no trim that it keeps: a lower centre_of_gravity, less wing, more fin, "
            "or model: level"
        )
    ground = "; cable that lies slack on the seabed has no one place: a ship under way (ship.tow_speed) draws it tight"
    return StartError(
        f"{scene.name}: no static equilibrium after {tried} steps and {iterations} iterations, residual "
        f"{left:.3g} N, allowed {sim.tolerance:.3g} N, with {sim.stiffness}{aside}; nothing was started. "
        f"Remedy: {helps}" + ("" if scene.seabed.depth is None else ground),
        left,
    )


def sunk(sim: Tow, error: StartError) -> StartError | None:
    """The error of a start that found no rest because its towbody, with an attitude, would begin in the seabed."""
    scene, bed = sim.scene, sim.scene.seabed.depth
    if bed is None or scene.towbody.model is not BodyModel.RIGID:
        return None
    depth = -float(layout_of(scene.model_copy(update={"seabed": Seabed()})).shape().place[0, 2])
    if depth <= bed:
        return None
    return StartError(
        f"{scene.name}: towbody, of model rigid, would begin {depth:.4g} m deep, {depth - bed:.3g} m in the seabed of "
        f"seabed.depth = {bed:g} m, and finds no rest on it; nothing was started. Remedy: begin with less cable "
        f"(winch.scope = {scene.winch.scope:g} m) or faster (ship.tow_speed = {scene.ship.tow_speed:g} m/s) and lower "
        "it onto the ground, or model: level, which begins there",
        error.residual,
    )


def turn_bodies(sim: Tow, shape: TowShape, yaw: float) -> None:
    """Turn every body into the water that passes it at its depth, one in still water ahead with the ship."""
    scene, state, ends = sim.scene, sim.state, section_ends(sim.scene.cable)
    total = max(ends.values())
    flow = flow_of(scene.water, yaw, tuple(state.now.frame.velocity.tolist()))
    places = [0.0, *(total - ends[body.at] for body in scene.bodies.values())]  # m from the towbody
    for node, place in zip(sim.model.line.body_nodes, places, strict=True):
        z = float(np.interp(place, shape.s, shape.place[:, 2]))
        past = flow(z)
        if hypot(*past) < MIN_FLOW:
            past = (-cos(yaw), -sin(yaw))
        state.nodes[NOW, FLOW, node, :2] = past


def level_bodies(sim: Tow) -> None:
    """Level the bodies with an attitude, each facing the water that passes it."""
    clear_attitudes(sim.state, sim.model.line.rigid)
    for i, row in enumerate(sim.model.line.rigid.bodies):
        x, y = sim.state.nodes[NOW, FLOW, row.node, :2].tolist()
        facing = atan2(-y, -x)
        sim.state.attitude["quaternion"][:, i] = 0.0, 0.0, sin(0.5 * facing), cos(0.5 * facing)
