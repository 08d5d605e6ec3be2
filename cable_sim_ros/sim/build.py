"""Scene -> Model and State: the one place where numbers are coerced, so that every scene has one type signature."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, log2, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..compiler.jit import LANES
from ..physics import ancf
from ..physics.cable_assembly import Cable
from ..physics.contact_surface import SHEAVE_ROW, surfaces_of
from ..physics.integrate import TOLERANCE, Solver
from ..physics.mesh_motion import ABOARD
from ..physics.output import Output
from ..physics.point_mass import BEAD, bead_record
from ..physics.rigid_model import Rigid
from ..physics.sea import Sea
from ..physics.section import CableModel
from ..physics.sensor_models import SENSOR_RULES, SIGNAL, Feedback, SensorModel
from ..physics.state import (
    FEED_NODE,
    LEVELS,
    LINE_SETTINGS,
    LOAD,
    STRUM_RULES,
    STRUM_SECTION,
    STRUT,
    TOW_SETTINGS,
    ZONE,
    Feed,
    LineModel,
    Model,
    State,
    Strum,
    make_state,
    records,
)
from ..physics.substeps import LEAVE_STEP, MAX_TURN
from ..physics.swivel import SWIVEL, swivel_record
from ..physics.tick_output import CONTACT_COLUMNS, MAX_CONTACT_POINTS, STRUMMING, TICK_OUTPUT, TURNED, WIDTH
from ..physics.towbody import BODY, BodyModel, Towbody, body_record
from ..physics.vehicle import VEHICLE
from ..physics.wake_oscillator import WAKE_SECTION
from ..physics.water import Water
from ..physics.winch import DRUM
from ..physics.winch_drive import BALANCED, DRIVE, MODELS, MODES
from .layout import Layout
from .mesh.mesh_kinds import FeedMesh
from .scene import Scene
from .statics.route import DRUM_RESERVE, ROUND_OFF
from .statics.vehicle_shape import max_tension, mean_compliance
from .tables.drum_layers import layered
from .tables.material import arc_lengths, bodies_of, extreme, material_rows, section_ends, termination_weight
from .tables.rigid_tables import added_of, rigid_tables
from .tables.sea_tables import sea_of
from .tables.sensor_tables import remembered, sensor_rules, signal_table
from .tables.viv_tables import strum_rules, strum_sections
from .wake_tables import wake_table

# EI of an element over w L^3 where its end carries no tension: the gradient of a free end has a rotational stiffness of
# -T/30 there (T = w L/2), more than wL^3/240 makes it stable; it vanishes with the third power of the mesh
END_STIFFNESS = 1.0 / 60.0
# errors of one step over those of a run that its steps bring, and the error of the deviation over the square of the
# change of the tension in one step, rms, over its deviation, as measured: docs/theory.md
POSITION_PER_STEP, TENSION_PER_STEP, DEVIATION_PER_STEP = 0.05, 0.2, 0.6
SHIPPED_TICK = Solver().tick
# of the working tension: amplitude of ringing lost to the time steps that is flagged. Shipped scenes lose up to 0.002
# of it where a winch starts or stops; a body in air that rang lost 0.15, and more than half of its deviation
MAX_RINGING = 0.05
MIN_OUTBOARD = 1.0  # m of cable that stay outboard of the sheave when hauling in


class StepRules(NamedTuple):
    """What the stepper does with a step it cannot trust, see physics/substeps.py. NO_LIMIT switches a rule off."""

    max_halvings: int
    max_turn: float = MAX_TURN
    leave_step: float = LEAVE_STEP  # s


def lock(array: np.ndarray, kind: npt.DTypeLike = float) -> np.ndarray:
    """Read-only and C-contiguous: a kernel that writes the Model fails to compile."""
    array = np.ascontiguousarray(array, kind)
    if array.dtype.names:
        array = array.view(np.recarray)
    array.setflags(write=False)
    return array


def element_table(cable: Cable, water: Water, gravity: float, free_ends: tuple[bool, bool]) -> np.ndarray:
    """[groups, ROWS, LANES]; the tail repeats the last element. Lengths are filled from State.arc at gather.

    free_ends: is the first, the last element free of tension at its end? Such an element gets at least END_STIFFNESS.
    """
    columns = []
    for section in cable.sections.values():
        columns += [material_rows(cable, section, water, gravity)] * section.meshed
    lengths = np.diff(arc_lengths(cable))
    for end, free in zip((0, -1), free_ends, strict=True):
        if free and cable.model is CableModel.ANCF:
            columns[end] = columns[end].copy()
            columns[end][ancf.EI] = max(
                columns[end][ancf.EI], END_STIFFNESS * columns[end][ancf.WEIGHT_PER_LENGTH] * lengths[end] ** 3
            )
    groups = -(-len(columns) // LANES)
    columns += [columns[-1]] * (groups * LANES - len(columns))
    return np.stack(columns, 1).reshape(ancf.ROWS, groups, LANES).transpose(1, 0, 2)


def light_end(scene: Scene, mesh: FeedMesh | None) -> bool:
    """Does the towbody pull less than the last element weighs, at the longest that it may become?"""
    if scene.towbody.model is BodyModel.VEHICLE:  # its end is held
        return False
    last = list(scene.cable.sections.values())[-1]
    if mesh is None:
        size = last.length / last.meshed
    else:
        fractions = np.append(0.0, mesh.section_fractions[-1])  # of the last section, from its begin
        size = last.length * (fractions[-1] - fractions[-2])
    rows = material_rows(scene.cable, last, scene.water, scene.gravity)
    return bool(abs(scene.towbody.net_weight) < rows[ancf.MASS_PER_LENGTH] * scene.gravity * size)


def body_table(scene: Scene) -> np.ndarray:
    """The towbody and the bodies on the line [bodies]; what sinks stands on the seabed where there is one."""
    return np.stack([_body_row(scene, body) for body in bodies_of(scene).values()])


def with_attitudes(
    rows: np.ndarray, bodies: Sequence[Towbody], nodes: Sequence[int], gravity: float, density: float
) -> tuple[np.ndarray, Rigid]:
    """BODY records that know which of the bodies have an attitude of their own, and the tables of those."""
    rigid = [(node, body) for node, body in zip(nodes, bodies, strict=True) if body.model is BodyModel.RIGID]
    there = [body.model is BodyModel.RIGID for body in bodies]
    rows["rigid"][there] = np.arange(len(rigid))
    if rigid:  # that of a spheroid where the scene gives none
        rows["added"][there] = [np.diag(added_of(body, gravity, density))[:3] for _, body in rigid]
        rows["entry"][there] = rows["added"][there, 2]
    tables = rigid_tables(rigid, gravity, density)
    tables.bodies["floor_stiffness"] = 0.5 * rows["floor_stiffness"][there]  # it lies on two ends
    return rows, tables


def _body_row(scene: Scene, body: Towbody) -> np.ndarray:
    row = body_record(body, scene.gravity, scene.water.density)
    if body.model is BodyModel.VEHICLE:  # no load of its own, and alike in every direction
        row["mass"], row["slam"] = 0.0, 0.0
    elif scene.seabed.depth is not None and body.net_weight > 0.0:
        row["floor_stiffness"] = abs(body.net_weight) / scene.seabed.penetration**1.5
    return row


def body_nodes(scene: Scene, mesh: FeedMesh | None) -> list[int]:
    """Node of every body: the last for the towbody, that of its section's outboard end for one on the line."""
    sections = scene.cable.sections
    nodes = np.cumsum([s.meshed for s in sections.values()]) if mesh is None else mesh.boundaries
    ends = dict(zip(sections, nodes.tolist(), strict=True))
    return [max(ends.values())] + [ends[body.at] for body in scene.bodies.values()]


def bead_table(cable: Cable, water: Water, gravity: float) -> np.ndarray:
    """The terminations of the sections [beads]."""
    ends = section_ends(cable)
    rows = [
        bead_record(ends[name], section.termination_mass, termination_weight(section, gravity), gravity, water.density)
        for name, section in cable.sections.items()
        if section.termination_mass > 0.0
    ]
    return np.array(rows, BEAD)


def drum_record(layout: Layout, mesh: FeedMesh | None) -> np.ndarray:
    """Winch as numbers; the lengths that may be paid out and hauled in follow from the route, and from the mesh."""
    scene, route, row = layout.scene, layout.route, np.zeros((), DRUM)
    w = scene.winch
    for key in set(DRUM.names or ()) & set(type(w).model_fields):  # a number that kernels take as it is given
        if getattr(w, key) is not None:
            row[key] = getattr(w, key)
    row["centre"] = w.position
    row["radius"], row["angle_0"], row["side"] = route.drum, w.wrap, route.side
    layers = layered(scene)
    for key in ("lay_pitch", "lay_rise", "lay_turns"):
        row[key] = layers[key]
    row["gain_p"], row["gain_d"] = w.proportional_gain, w.derivative_gain
    row["max_accel"] = w.max_acceleration
    row["timeout"], row["delay"] = w.command_timeout, round(w.command_delay * 1e9)
    row["ramp"] = min(w.command_acceleration or w.max_acceleration, w.max_acceleration)
    row["total"], row["payout_0"], row["inboard"] = route.total, route.total - route.wound, route.inboard
    row["feeds"], row["tangent"] = route.feeds, route.tilt
    row["exact"] = scene.solver.tension_error is not None
    row["max_length"] = route.wound - w.dead_length - DRUM_RESERVE * route.drum
    row["min_length"] = -(route.total - route.wound - route.span - MIN_OUTBOARD)
    cubic = scene.cable.model is CableModel.ANCF
    if mesh is not None:
        row["blend"] = mesh.blend
        row["min_length"] = hauled_in(scene, mesh) - row["payout_0"]
        row["end_stiffness"] = END_STIFFNESS if cubic and light_end(scene, mesh) else 0.0
    inboard = route.inboard - row["payout_0"]
    row["min_limit"] = row["min_length"] if w.least_scope is None else w.least_scope + inboard
    row["max_limit"] = row["max_length"] if w.most_scope is None else w.most_scope + inboard
    row["min_limit"] = max(row["min_limit"], row["min_length"])  # beyond an end stop it limits nothing
    row["max_limit"] = min(row["max_limit"], row["max_length"])
    row["min_reach"], row["max_reach"] = row["min_limit"], row["max_limit"]
    if mesh is None:  # a coarse element on the sheave ends in a run that cannot be solved
        paid, hauled = layout.fine_zone
        row["min_reach"] = max(row["min_reach"], -hauled if hauled > 0.0 else -np.inf)
        row["max_reach"] = min(row["max_reach"], paid if paid > 0.0 else np.inf)
    return row


def swivel_of(layout: Layout) -> np.ndarray:
    """Swivel of the sheave as numbers; the inboard cable is that of the start."""
    wheel, route = layout.scene.sheave, layout.route
    if not wheel.swivel:
        return np.zeros((), SWIVEL)
    ends, _ = route.nodes(route.on_drum + np.array([0.0, route.span]), 0.0)
    return swivel_record(ends, np.array(wheel.position), route.sheave, wheel.swivel_friction, wheel.swivel_time)


def vehicle_record(scene: Scene) -> np.ndarray:
    """Vehicle as numbers; all zero where there is none."""
    row, v, ship = np.zeros((), VEHICLE), scene.vehicle, scene.ship
    row["on"] = scene.towbody.model is BodyModel.VEHICLE
    if not row["on"]:
        return row
    row["attachment"] = v.attachment
    row["max_tension"] = max_tension(scene)
    row["max_strain"] = row["max_tension"] * mean_compliance(scene)
    row["bottom"] = -np.inf if scene.seabed.depth is None else -scene.seabed.depth
    own = {key: getattr(v, key) for key in ("stale_after", "stale_decay", "start_blend", "source_blend")}
    times = {key: getattr(ship, key) if value is None else value for key, value in own.items()}
    times["stale_after"] = v.max_gap if v.stale_after is None else v.stale_after
    row["times"] = (*(times[key] for key in own), v.max_speed)
    return row


def drive_record(scene: Scene) -> np.ndarray:
    """Drive as numbers. Gains of a motor: poles of the rate loop at drive.bandwidth and damping, on its own inertia."""
    d, row = scene.drive, np.zeros((), DRIVE)
    for key in set(DRIVE.names or ()) & set(type(d).model_fields) - {"curve_speed", "curve_pull"}:
        if isinstance(getattr(d, key), float):
            row[key] = getattr(d, key)
    row["model"], row["mode"] = MODELS.index(d.model), MODES.index(d.mode)
    row["length_gain"] = 0.25 * d.bandwidth if d.length_gain is None else d.length_gain
    row["max_power"] = np.inf if d.max_power is None else d.max_power
    row["mass"] = d.inertia / (scene.winch.drum_radius + 0.5 * scene.cable.diameter) ** 2
    row["cable"] = extreme(scene.cable, "mass_per_length", max)[1]
    mass = row["mass"] if d.controller_mass is None else d.controller_mass
    row["gain_p"] = 2.0 * d.damping * d.bandwidth * mass
    row["gain_i"] = d.bandwidth**2 * mass
    row["points"], row["peak"] = len(d.curve_speed), max(d.curve_pull, default=0.0)
    row["curve_speed"][: len(d.curve_speed)] = d.curve_speed
    row["curve_pull"][: len(d.curve_pull)] = d.curve_pull
    return row


def delayed_rows(scene: Scene) -> int:
    """Rows of State.delayed: the ticks of drive.dead_time and two more; none without it."""
    return int(scene.drive.dead_time / scene.solver.tick) + 3 if scene.drive.dead_time > 0.0 else 0


def hauled_in(scene: Scene, mesh: FeedMesh) -> float:
    """Pay-out [m] at which hauling in ends: the towbody or a body on the line is next to the mesh at the sheave."""
    ends, last = section_ends(scene.cable), mesh.aboard[-1]
    minimum = dict(zip(ends, mesh.minimum[mesh.last_zones] + mesh.blend, strict=True))
    total = max(ends.values())
    stops = [last + mesh.minimum[-1]]
    return float(max(stops + [total - ends[body.at] + last + minimum[body.at] for body in scene.bodies.values()]))


def feed_of(scene: Scene, mesh: FeedMesh | None) -> Feed:
    """What the winch feeds, as numbers for kernels; empty where the mesh is fixed to the material."""
    cable, zones, nodes = scene.cable, np.zeros(0, ZONE), np.zeros(0, FEED_NODE)
    materials = np.array([material_rows(cable, s, scene.water, scene.gravity) for s in cable.sections.values()])
    if mesh is not None:
        zones, nodes = np.zeros(len(mesh.fractions), ZONE), np.zeros(mesh.nodes, FEED_NODE)
        zones["end"], zones["minimum"] = mesh.ends, mesh.minimum
        materials = materials[mesh.sections]
        aboard = len(mesh.aboard)
        nodes["zone"] = np.repeat([ABOARD, *range(len(zones))], [aboard, *map(len, mesh.fractions)])
        nodes["place"] = np.concatenate([mesh.aboard, *mesh.fractions])
    return Feed(
        lock(nodes, FEED_NODE), lock(zones, ZONE), lock(materials), np.full(max(len(nodes) - 1, 0), -1, np.int64)
    )


def halvings(solver: Solver) -> int:
    """Halvings of a tick: where its steps are chosen, twice as many of a tick of the default length.

    They resolve what a fixed step passes over: short cable that goes slack and snaps on hard elements of a centimetre.
    """
    if solver.tension_error is None:
        return solver.max_halvings
    more = 2 * solver.max_halvings + max(0, ceil(log2(solver.tick / SHIPPED_TICK)))
    return min(more, LEVELS - 1)  # each has its count


def line_settings(
    cable: Cable, solver: Solver, gravity: float, tension: float, rules: StepRules, tolerance: float = TOLERANCE
) -> np.ndarray:
    """LINE_SETTINGS [1]; tension: working tension [N] that scales the tolerance, the one given where the solver has
    none."""
    row = np.zeros(1, LINE_SETTINGS)
    row["gravity"], row["rho_inf"] = gravity, solver.rho_inf
    relative = tolerance if solver.tolerance is None else solver.tolerance
    row["tolerance"] = max(relative * tension, ROUND_OFF * extreme(cable, "axial_stiffness", max)[1])
    row["mean_flow_time"] = cable.mean_flow_time
    row["amplified"] = any(section.drag_amplification != 1.0 for section in cable.sections.values())
    row["max_iterations"] = solver.max_iterations
    row["max_halvings"], row["max_turn"], row["leave_step"] = rules
    alike = extreme(cable, "axial_stiffness")[1] == extreme(cable, "axial_stiffness", max)[1]
    row["jumps"] = not alike or any(section.termination_mass > 0.0 for section in cable.sections.values())
    if solver.tension_error is not None:
        row["step_position"] = POSITION_PER_STEP * solver.position_error
        row["step_tension"] = TENSION_PER_STEP * solver.tension_error * tension
        row["step_deviation"] = sqrt(solver.tension_error / DEVIATION_PER_STEP)
    return row


def air_of(scene: Scene) -> tuple[float, float]:
    """LINE_SETTINGS air: 0 without wind."""
    if not any(scene.air.wind):
        return 0.0, 0.0
    lighter = scene.air.density / scene.water.density
    return lighter * scene.air.drag_coefficient, lighter


def build_line(
    elements: np.ndarray,
    held: np.ndarray,
    bodies: np.ndarray,
    body_nodes: Sequence[int],
    settings: np.ndarray,
    loads: np.ndarray | None = None,
    struts: np.ndarray | None = None,
    beads: np.ndarray | None = None,
    strum: tuple[np.ndarray, np.ndarray] | None = None,
    sea: Sea | None = None,
    wakes: np.ndarray | None = None,
    rigid: Rigid | None = None,
) -> LineModel:
    """A line as numbers for kernels, in the one place that coerces them: every line has one type signature."""
    return LineModel(
        elements=np.require(elements, float, ["C", "W"]),  # written by the drum that feeds: a locked one is copied
        held=lock(held),
        bodies=lock(bodies, BODY),
        body_nodes=lock(np.asarray(body_nodes), np.int64),
        rigid=Rigid(*(lock(table, table.dtype) for table in rigid or rigid_tables([], 0.0, 0.0))),
        beads=lock(np.zeros(0, BEAD) if beads is None else beads, BEAD),
        loads=records(0, LOAD) if loads is None else np.ascontiguousarray(loads, LOAD).view(np.recarray),
        struts=lock(np.zeros(0, STRUT) if struts is None else struts, STRUT),
        settings=lock(settings, LINE_SETTINGS),
        strum=Strum(
            lock(np.zeros(0, STRUM_RULES) if strum is None else strum[0], STRUM_RULES),
            lock(np.zeros(0, STRUM_SECTION) if strum is None else strum[1], STRUM_SECTION),
        ),
        sea=Sea(*(lock(table, table.dtype) for table in sea or sea_of(Water(), 0.0, None))),
        wakes=lock(np.zeros(0, WAKE_SECTION) if wakes is None else wakes, WAKE_SECTION),
    )


def build_model(layout: Layout, mesh: FeedMesh | None = None) -> Model:
    """The scene as numbers for kernels. mesh: in place of the one made for the scene."""
    scene, mesh = layout.scene, layout.mesh if mesh is None else mesh
    nodes = len(layout.arc) if mesh is None else mesh.nodes
    held = np.zeros((nodes, 6))
    held[0, :3] = 1.0
    if scene.towbody.model is BodyModel.VEHICLE:
        held[-1, :3] = 1.0
    tension, ship = scene.contact.working_tension, scene.ship
    settings = np.zeros(1, TOW_SETTINGS)
    settings["sheave"] = SHEAVE_ROW
    settings["tick_ns"] = round(scene.solver.tick * 1e9)
    settings["reseat_ns"] = round(scene.contact.reseat_time * 1e9)
    settings["penetration_limit"] = scene.contact.penetration_limit * scene.cable.diameter
    settings["groove_depth"] = scene.sheave.groove_depth
    settings["energy_share"] = scene.solver.energy_share
    settings["max_ringing"] = MAX_RINGING * tension
    settings["bending_length"] = sqrt(extreme(scene.cable, "bending_stiffness", max)[1] / tension)
    settings["instrumented"] = scene.instruments.feed is Feedback.INSTRUMENTS
    settings["ship"] = (ship.stale_after, ship.stale_decay, ship.start_blend, ship.source_blend, 0.0)
    settings["drum"] = drum_record(layout, mesh)
    settings["swivel"], settings["vehicle"] = swivel_of(layout), vehicle_record(scene)
    if mesh is None:
        elements = element_table(scene.cable, scene.water, scene.gravity, (False, light_end(scene, None)))
    else:  # filled for the pay-out, see mesh_motion.py
        elements = np.zeros((-(-(nodes - 1) // LANES), ancf.ROWS, LANES))
    rules = StepRules(halvings(scene.solver))
    given = scene.solver.tolerance is not None  # then nothing is asked of a mesh that another stands for
    tolerance = TOLERANCE if given or layout.plan is None else layout.plan.tolerance
    line = line_settings(scene.cable, scene.solver, scene.gravity, tension, rules, tolerance)
    line["jumps"] |= bool(scene.bodies)
    line["air"] = air_of(scene)
    settings["drive"] = drive_record(scene)
    settings["drive"]["balance"] = np.maximum(BALANCED * tension, line["tolerance"])
    strum = strum_rules(scene), strum_sections(scene)
    line["amplified"] |= len(strum[1]) > 0
    at = body_nodes(scene, mesh)
    carried = list(bodies_of(scene).values())
    bodies, rigid = with_attitudes(body_table(scene), carried, at, scene.gravity, scene.water.density)
    rigid.bodies["air"] = air_of(scene)[1]
    return Model(
        line=build_line(
            elements,
            held,
            bodies,
            at,
            line,
            rigid=rigid,
            beads=bead_table(scene.cable, scene.water, scene.gravity),
            strum=strum,
            sea=sea_of(scene.water, scene.gravity, scene.seabed.depth),
            wakes=wake_table(scene.cable, scene.water),
        ),
        settings=lock(settings, TOW_SETTINGS),
        feed=feed_of(scene, mesh),
        sensors=SensorModel(lock(signal_table(scene), SIGNAL), lock(sensor_rules(scene), SENSOR_RULES)),
    )


def build_state(layout: Layout, mesh: FeedMesh | None = None) -> State:
    """Preallocated state for the scene's mesh, or another; everything zero but for arc lengths that stay."""
    scene, mesh = layout.scene, layout.mesh if mesh is None else mesh
    arc = layout.arc if mesh is None else np.zeros(mesh.nodes)
    sea, links = sea_of(scene.water, scene.gravity, scene.seabed.depth), scene.cable.model is CableModel.SEGMENTS
    rigid = sum(body.model is BodyModel.RIGID for body in bodies_of(scene).values())
    return make_state(arc, surfaces_of(scene), sea, links, delayed_rows(scene), remembered(scene), rigid)


def make_output(model: Model, nodes: int, rows: int) -> Output:
    """A ring of ``rows`` tick outputs with their shape and contact tables."""
    width = WIDTH + STRUMMING * len(model.line.strum.rules) + TURNED * (len(model.line.rigid.bodies) > 0)
    return Output(
        np.zeros(rows, TICK_OUTPUT),
        np.zeros((rows, nodes, width)),
        np.zeros((rows, MAX_CONTACT_POINTS, len(CONTACT_COLUMNS))),
    )
