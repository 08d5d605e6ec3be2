"""Scene -> Model and State: the one place where numbers are coerced, so that every scene has one type signature."""

from __future__ import annotations

from math import radians, sqrt

import numpy as np

from ..physics import ancf, setpoint, winch
from ..physics.cable import POWERS, Cable, make_work
from ..physics.contact import stiffness
from ..physics.drag import element_rows
from ..physics.frame import CONTACT_COLUMNS, FRAME, MAX_STATIONS, SHAPE_COLUMNS
from ..physics.jit import LANES
from ..physics.line import HEALTH, LOAD_COLUMNS, STRUT_COLUMNS
from ..physics.observe import Output
from ..physics.setpoint import LAWS
from ..physics.ship import SHIP_STATE
from ..physics.surface import SURFACE_COLUMNS, surface_row
from ..physics.tow import Model, State
from ..physics.towbody import body_table
from ..physics.water import Water
from .checks import ROUND_OFF
from .scene import Scene
from .statics import DRUM_RESERVE, Route

# EI of an element over w L^3 where its end carries no tension: the gradient of a free end has a rotational stiffness of
# -T/30 there (T = w L/2), more than wL^3/240 makes it stable; it vanishes with the third power of the mesh
END_STIFFNESS = 1.0 / 60.0
LEAST_OUTBOARD = 1.0  # m of cable that stay outboard of the sheave when hauling in


def lock(array: np.ndarray, kind: type = float) -> np.ndarray:
    """Read-only and C-contiguous: a kernel that writes the Model fails to compile."""
    array = np.ascontiguousarray(array, kind)
    array.setflags(write=False)
    return array


def arc_lengths(cable: Cable) -> np.ndarray:
    """Unstretched arc length of every node from the drum end [m]."""
    lengths = [np.full(s.elements, s.length / s.elements) for s in cable.sections.values()]
    return np.concatenate(([0.0], np.cumsum(np.concatenate(lengths))))


def element_table(cable: Cable, water: Water, gravity: float, free_ends: tuple[bool, bool]) -> np.ndarray:
    """[groups, ROWS, LANES]; the tail repeats the last element. Lengths are filled from State.arc at gather.

    free_ends: is the first, the last element free of tension at its end? Such an element gets at least END_STIFFNESS.
    """
    columns = []
    for section in cable.sections.values():
        rows = np.zeros(ancf.ROWS)
        rows[ancf.MASS_PER_LENGTH] = cable.mass_per_length
        rows[ancf.EA], rows[ancf.EI] = cable.axial_stiffness, cable.bending_stiffness
        rows[ancf.COMPRESSION] = cable.compression_share
        rows[ancf.AXIAL_DAMPING] = cable.axial_damping
        if cable.bending_stiffness > 0.0:
            rows[ancf.BENDING_TIME] = cable.bending_damping / cable.bending_stiffness
        rows[ancf.WEIGHT_PER_LENGTH] = cable.mass_per_length * gravity
        hydro = element_rows(
            section.drag_law,
            section.drag_coefficient,
            section.drag_amplification,
            cable.diameter,
            water.density,
            water.viscosity,
            cable.added_mass_coefficient,
            gravity,
            section.tangential_coefficient,
        )
        for row, value in hydro.items():
            rows[row] = value
        columns += [rows] * section.elements
    lengths = np.diff(arc_lengths(cable))
    for end, free in zip((0, -1), free_ends, strict=True):
        if free:
            columns[end] = columns[end].copy()
            columns[end][ancf.EI] = max(
                columns[end][ancf.EI], END_STIFFNESS * columns[end][ancf.WEIGHT_PER_LENGTH] * lengths[end] ** 3
            )
    groups = -(-len(columns) // LANES)
    columns += [columns[-1]] * (groups * LANES - len(columns))
    return np.stack(columns, 1).reshape(ancf.ROWS, groups, LANES).transpose(1, 0, 2)


def light_end(scene: Scene) -> bool:
    """Does the towbody pull less than the last element weighs?"""
    last = list(scene.cable.sections.values())[-1]
    weight = scene.cable.mass_per_length * scene.gravity * last.length / last.elements
    return abs(scene.towbody.net_weight) < weight


def surface_table(scene: Scene) -> np.ndarray:
    """Drum and sheave, stiffness from the penetration limit."""
    c, d = scene.contact, scene.cable.diameter
    depth = c.penetration_limit * d
    drum, sheave = scene.winch.drum_radius + 0.5 * d, scene.sheave.radius + 0.5 * d
    throat = radians(scene.sheave.throat_angle_deg)
    half, rim = np.sin(0.5 * throat), scene.sheave.rim_radius + 0.5 * d
    return np.stack(
        [
            surface_row(
                scene.winch.position, drum, None, 0.0, 0.0, stiffness(c.working_tension, drum, 1.0, 1, depth), c.damping
            ),
            surface_row(
                scene.sheave.position,
                sheave,
                throat,
                scene.sheave.groove_depth,
                rim,
                stiffness(c.working_tension, sheave, half, 2, depth),
                c.damping,
            ),
        ]
    )


def winch_table(scene: Scene, route: Route, total: float) -> np.ndarray:
    """Winch as numbers; the lengths that may be paid out and hauled in follow from route and total length [m]."""
    w, row = scene.winch, np.zeros(winch.WINCH_ROWS)
    row[winch.CENTRE : winch.CENTRE + 3] = w.position
    row[winch.SEAT], row[winch.ANGLE_0], row[winch.SIDE] = route.drum, w.wrap, route.side
    row[winch.GAIN_P], row[winch.GAIN_D] = w.proportional_gain, w.derivative_gain
    row[winch.RATE_MOST], row[winch.ACCEL_MOST] = w.max_rate, w.max_acceleration
    row[winch.TIMEOUT] = w.command_timeout
    row[winch.PAYOUT_0] = total - route.on_drum
    row[winch.LENGTH_MOST] = route.on_drum - DRUM_RESERVE * route.drum
    row[winch.LENGTH_LEAST] = -(total - route.on_drum - route.span - LEAST_OUTBOARD)
    return row


def build_model(scene: Scene) -> Model:
    """The scene as numbers for kernels."""
    arc = arc_lengths(scene.cable)
    nodes, total = len(arc), float(arc[-1])
    held = np.zeros((nodes, 6))
    held[0, :3] = 1.0
    route = Route(scene)
    points = np.zeros(setpoint.SETPOINT_ROWS)
    points[setpoint.ALGORITHM] = LAWS.index(scene.setpoint.algorithm)
    points[setpoint.ANGLE] = radians(scene.setpoint.nominal_angle_deg or 0.0)
    points[setpoint.WASHOUT] = scene.setpoint.washout_period
    tension = scene.contact.working_tension
    return Model(
        elements=lock(element_table(scene.cable, scene.water, scene.gravity, (False, light_end(scene)))),
        surfaces=lock(surface_table(scene)),
        held=lock(held),
        bodies=lock(body_table(scene.towbody, scene.gravity, scene.water.density)[None]),
        seats=lock(np.array([nodes - 1]), np.int64),
        loads=np.zeros((0, LOAD_COLUMNS)),
        struts=lock(np.zeros((0, STRUT_COLUMNS))),
        winch=lock(winch_table(scene, route, total)),
        setpoint=points,
        mean=np.zeros(6),
        sheave=1,
        tick_ns=int(round(scene.solver.tick * 1e9)),
        max_iterations=int(scene.solver.max_iterations),
        max_halvings=int(scene.solver.max_halvings),
        gravity=float(scene.gravity),
        rho_inf=float(scene.solver.rho_inf),
        tolerance=max(scene.solver.tolerance * tension, ROUND_OFF * scene.cable.axial_stiffness),
        stale_after=float(scene.ship.stale_after),
        stale_decay=float(scene.ship.stale_decay),
        start_blend=float(scene.ship.start_blend),
        source_blend=float(scene.ship.source_blend),
        penetration_limit=float(scene.contact.penetration_limit * scene.cable.diameter),
        groove_depth=float(scene.sheave.groove_depth),
        reseat_ns=int(round(scene.contact.reseat_time * 1e9)),
        bending_length=sqrt(scene.cable.bending_stiffness / tension),
    )


def build_state(scene: Scene) -> State:
    """Preallocated state for the scene's mesh, everything zero."""
    arc = arc_lengths(scene.cable)
    n = len(arc)

    def nodes():
        return np.zeros((n, 6))

    z = np.zeros
    return State(
        time=z(4, np.int64),
        halted=z(1, np.int64),
        events=z(3, np.int64),
        frame=z(4),
        current=z(4),
        arc=arc,
        q=nodes(),
        v=nodes(),
        a=nodes(),
        x=nodes(),
        kept=z((2, 4, n, 6)),
        gain=nodes(),
        tension=z(n - 1),
        reaction=nodes(),
        ship=z(SHIP_STATE),
        ship_work=z(SHIP_STATE),
        sheave=z(6),
        surfaces=surface_table(scene).reshape(-1, SURFACE_COLUMNS).copy(),
        winch=z(winch.WINCH_STATE),
        setpoint=z(setpoint.SETPOINT_STATE),
        controls=z((2, 2, 16)),
        flow=z((1, 6)),
        measured=z(3),
        account=z(POWERS + 1),
        before=z(POWERS),
        health=z(HEALTH),
        work=make_work(n),
    )


def make_output(model: Model, nodes: int, rows: int) -> Output:
    """A ring of ``rows`` Frames with their shape and contact tables."""
    return Output(
        np.zeros(rows, FRAME),
        np.zeros((rows, nodes, len(SHAPE_COLUMNS))),
        np.zeros((rows, MAX_STATIONS, len(CONTACT_COLUMNS))),
    )
