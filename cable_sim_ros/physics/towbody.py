"""Towbody, and bodies on the line: lumped masses with net weight, drag and added mass per axis, and hydrofoil lift.

Westin (2018) (85)-(92). Axes: x against the horizontal local flow (forward), y left, z up: the body turns into the flow
with a time constant and stays level (5.2: its orientation is constant). Crossing the surface, the wet share of every
hydrodynamic term is a smoothstep in z over the size of the displaced volume.

Added mass is that of axes that turn, Kirchhoff: with the momentum M v of the water, v the velocity through it in these
axes and r their rate, the force is -(M v' + r e_z x M v). The flow past a body is a row of six numbers: the low-passed
flow along x and y of the world, the angle from facing it to the body's heading, and the rate r.
"""

from __future__ import annotations

from enum import StrEnum
from math import atan2, cos, pi, sin, sqrt
from typing import Any

import numpy as np

from ..compiler.jit import driver, inline
from .contact import acts, touch
from .contact_surface import solid
from .drag_laws import smooth
from .parameter import REQUIRED, Block, before_checks, choice, quantity
from .point_mass import half_height
from .sea import ELEVATION, EXTRA, ORBIT, RATE, SHEAR
from .vec import at3, axpy, dot, scale
from .wing import Wing

BODY = np.dtype(
    [
        ("mass", "f8"),  # kg
        ("gravity", "f8"),  # m/s^2
        ("buoyancy", "f8"),  # N
        ("displaced", "f8"),  # kg of water
        ("added", "f8", 3),  # kg
        ("drag", "f8", 3),  # kg/m: rho/2 A C_D
        ("lift", "f8"),  # kg/m
        ("half_height", "f8"),  # m, half of that over which it leaves the water
        ("slam", "f8"),  # kg/m: rho/2 C_s A
        ("entry", "f8"),  # kg of water that gains the velocity of a body that goes under
        ("flow_time", "f8"),  # s
        ("min_flow", "f8"),  # m/s
        ("floor_stiffness", "f8"),  # N/m^1.5 of a floor under it
        ("rigid", "i8"),  # its row among those with an attitude of their own, or -1
    ],
    align=True,
)
SPEED_FLOOR = 1e-3
LAG, TURNING = 2, 5  # columns of a body's flow: its heading less that which faces the flow [rad], turning rate [rad/s]
SLAM = 5.0  # C_s of a body that is no smooth cylinder, DNV-RP-H103 (2011) 4.3.5
MAX_TURN = 0.5 * pi  # rad, by which a body turns at most in one of its time constants


class BodyModel(StrEnum):
    """How much of a body is computed."""

    LEVEL = "level"  # a point that stays level and turns into the flow
    RIGID = "rigid"  # six degrees of freedom
    VEHICLE = "vehicle"  # nothing: its pose is given, see vehicle.py


UNWEIGHED = {"mass": 1e-6, "net_weight": 0.0}  # kg, N: a vehicle has none that counts


class Towbody(Block):
    model: BodyModel = choice(
        BodyModel.LEVEL,
        "a point that stays level and turns into the flow, a body with attitude, or a vehicle whose pose is given",
    )
    mass: float = quantity(REQUIRED, "kg", 1e-6, 1e6, "dry mass", "Westin Table 8")
    net_weight: float = quantity(REQUIRED, "N", -1e6, 1e7, "weight less buoyancy in water", "Westin Table 8")
    added_mass: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "kg", 0.0, 1e7, "added mass along x, y, z: rho V C_m", "Westin (89)"
    )
    drag_area: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m^2", 0.0, 1e4, "drag area A C_D along x, y, z", "Westin (87)"
    )
    lift_area: float = quantity(
        0.0, "m^2", -1e3, 1e3, "lift area S C_L of the hydrofoil, negative pressing down", "Westin 5.2"
    )
    flow_time_constant: float = quantity(
        5.0, "s", 1e-2, 1e3, "time in which the body turns into the local flow", configure=False
    )
    least_flow_speed: float = quantity(
        0.05, "m/s", 1e-6, 5.0, "low-passed flow past the body below which its heading is held"
    )
    slam_coefficient: float | None = quantity(
        None,
        "1",
        0.0,
        20.0,
        "level: C_s of water entry, at half immersion, of drag_area along z; none: that of the added mass as it goes "
        "under",
        "DNV-RP-H103 (2011) 4.3.5",
    )
    length: float | None = quantity(
        None, "m", 1e-3, 100.0, "extent along x, of a level body for drawing alone; none: ten times the diameter"
    )
    diameter: float | None = quantity(
        None,
        "m",
        1e-3,
        100.0,
        "extent across, of a level body for drawing alone; none: that of a cylinder of the displaced volume",
    )
    inertia: tuple[float, float, float] | None = quantity(
        None, "kg m^2", 1e-9, 1e9, "rigid: moments of inertia about the centre of gravity, body axes"
    )
    products_of_inertia: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "kg m^2", -1e9, 1e9, "rigid: integrals of xy, xz and yz over the mass"
    )
    centre_of_gravity: tuple[float, float, float] | None = quantity(
        None, "m", -100.0, 100.0, "rigid: from the tow point, x forward, y to port, z up"
    )
    centre_of_buoyancy: tuple[float, float, float] | None = quantity(
        None, "m", -100.0, 100.0, "rigid: centre of the displaced volume, from the tow point"
    )
    hull_centre: tuple[float, float, float] | None = quantity(
        None,
        "m",
        -100.0,
        100.0,
        "rigid: middle of the hull, where added mass and drag are given, from the tow point; none: that of buoyancy",
    )
    added_inertia: tuple[float, float, float] | None = quantity(
        None,
        "kg m^2",
        0.0,
        1e9,
        "rigid: added inertia about the hull's centre; none: that of a spheroid of length and diameter",
    )
    added_matrix: tuple[float, ...] | None = quantity(
        None,
        "kg, kg m, kg m^2",
        -1e9,
        1e9,
        "rigid: in place of added_mass and added_inertia, six rows of six: forces along x, y, z and moments about them "
        "by accelerations along and about them, symmetric; or the name of a file of them",
        "Newman 1977, 4.13",
    )
    added_matrix_point: tuple[float, float, float] | None = quantity(
        None, "m", -100.0, 100.0, "rigid: point it is about, from the tow point; none: hull_centre"
    )
    crossflow_coefficient: float = quantity(
        1.1,
        "1",
        0.0,
        5.0,
        "rigid: drag across the hull, of length times diameter, where drag_area has 0",
        "Allen and Perkins 1951",
    )
    wings: dict[str, Wing] = choice({}, "rigid: wings and fins")

    @before_checks
    @classmethod
    def _vehicle_is_not_weighed(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("model") == BodyModel.VEHICLE:
            return UNWEIGHED | data
        return data

    @before_checks
    @classmethod
    def _rows_are_one_row(cls, data: Any) -> Any:
        rows = data.get("added_matrix") if isinstance(data, dict) else None
        if isinstance(rows, (list, tuple)) and rows and all(isinstance(row, (list, tuple)) for row in rows):
            if all(len(row) == len(rows) for row in rows):
                return data | {"added_matrix": [number for row in rows for number in row]}
        return data

    @property
    def level_lift_area(self) -> float:
        """Lift area S C_L [m^2] of the body where it is level and heads into the flow, upward."""
        return self.lift_area + sum(wing.level()[0] for wing in self.wings.values())


class LineBody(Towbody):
    """A body on the line: depressor, pod, float. The physics is that of the towbody."""

    at: str = choice(REQUIRED, "section at whose outboard end it sits; not the last one")


def body_record(body: Towbody, gravity: float, density: float) -> np.ndarray:
    """The body as a BODY record: drag and lift areas carry rho/2. It stands on no floor. A rigid one as the level body
    that stands for it in first guesses, with the lift and drag of its wings."""
    row = np.zeros((), BODY)
    row["mass"], row["gravity"], row["rigid"] = body.mass, gravity, -1
    row["buoyancy"] = body.mass * gravity - body.net_weight
    row["displaced"] = max(row["buoyancy"], 0.0) / max(gravity, 1e-9)
    row["added"] = body.added_mass
    row["drag"] = 0.5 * density * np.array(body.drag_area)
    row["drag"][0] += 0.5 * density * sum(wing.level()[1] for wing in body.wings.values())
    row["lift"] = 0.5 * density * body.level_lift_area
    row["half_height"] = half_height(float(row["buoyancy"]), gravity, density)
    # the largest section by what the scene has: drag area of about C_D 1, or the side of a cube of the displaced volume
    row["slam"] = 0.5 * density * SLAM * max(body.drag_area[2], (2.0 * row["half_height"]) ** 2)
    row["entry"] = row["added"][2]
    if body.slam_coefficient is not None:  # the slope of the smoothstep is 3/4 over half its height at most
        size = 0.5 * density * body.slam_coefficient * body.drag_area[2]
        row["entry"] = size * row["half_height"] * 4.0 / 3.0
    row["flow_time"], row["min_flow"] = body.flow_time_constant, body.least_flow_speed
    return row


@inline
def speed_past(flow):
    """Speed of the low-passed flow past a body."""
    return sqrt(flow[0] * flow[0] + flow[1] * flow[1])


@inline
def facing(flow):
    """Heading against the low-passed flow past a body [rad]; 0 where there is none."""
    return atan2(-flow[1], -flow[0]) if speed_past(flow) > 1e-9 else 0.0


@inline
def heading(flow):
    """Heading of a body [rad], its yaw in the world."""
    return facing(flow) + flow[LAG]


@inline
def heading_held(body, flow):
    """Is the heading of a body held for want of flow? Not of one that is alike ahead and across: it has none."""
    alike = body.drag[0] == body.drag[1] and body.added[0] == body.added[1]
    return speed_past(flow) < body.min_flow and not alike


@driver
def load(body, node, current, change, tangent, band):
    """Subtract the body's load from its node's row of the system, band [6, 16], and with tangent add its derivative.

    body: a BODY; node: q, v, a of the node and the flow past the body, each [6], and the water around it beyond the
    current [4], a row of work.around; change: see state.Change. Returns the power [W] the water gives to the body.

    Accelerating water adds displaced mass and added mass times its acceleration, each axis. What goes under meets the
    water with w, up, and gains the momentum A w: A' w^2 more (von Karman 1929); what comes out gives none back.
    """
    q, v, a, flow, water = node
    c1, c2, sigma = change.velocity, change.acceleration, change.damping
    height, width = q[2] - water[ELEVATION], 2.0 * body.half_height
    dry, dwet = smooth(height, -body.half_height, body.half_height)
    wet, dwet = 1.0 - dry, -dwet
    fall_x, fall_y = current[2] + water[SHEAR], current[3] + water[SHEAR + 1]
    ux = current[0] + water[EXTRA] - fall_x * q[2] - v[0] + water[ORBIT]
    uy = current[1] + water[EXTRA + 1] - fall_y * q[2] - v[1] + water[ORBIT + 1]
    uz = water[EXTRA + 2] + water[ORBIT + 2] - v[2]
    yaw = heading(flow)
    c, s = cos(yaw), sin(yaw)
    bx, by, bz = c * ux + s * uy, c * uy - s * ux, uz
    speed = sqrt(bx * bx + by * by + bz * bz + SPEED_FLOOR * SPEED_FLOOR)
    kx, ky, kz = body.drag[0], body.drag[1], body.drag[2]
    fx, fy, fz = kx * speed * bx, ky * speed * by, kz * speed * bz
    horizontal = bx * bx + by * by
    dx, dy, dz = a[0] - water[RATE], a[1] - water[RATE + 1], a[2] - water[RATE + 2]
    acc_x, acc_y = c * dx + s * dy, c * dy - s * dx
    mx, my, mz = body.added[0], body.added[1], body.added[2]
    swing = (my - mx) * flow[TURNING]  # the velocity through the water is minus the flow past
    lx, ly = fx - mx * acc_x - swing * by, fy - my * acc_y - swing * bx
    lz = fz - mz * dz + body.lift * horizontal + body.buoyancy + body.displaced * water[RATE + 2]
    m = body.mass
    wx = c * lx - s * ly + body.displaced * water[RATE]
    wy = s * lx + c * ly + body.displaced * water[RATE + 1]
    band[0, 12] -= m * (a[0] + sigma * v[0]) - wet * wx
    band[1, 12] -= m * (a[1] + sigma * v[1]) - wet * wy
    band[2, 12] -= m * (a[2] + sigma * v[2] + body.gravity) - wet * lz
    enters = max(uz, 0.0) if dwet != 0.0 else 0.0
    blow = -dwet * body.entry * enters * enters
    band[2, 12] += blow
    power = wet * (wx * v[0] + wy * v[1] + lz * v[2]) + blow * v[2]
    if not tangent:
        return power
    if enters > 0.0:
        curve = 6.0 * (1.0 - 2.0 * (height / width + 0.5)) / (width * width)
        band[2, 2] += body.entry * enters * (2.0 * -dwet * c1 - curve * enters)
    # body-axes derivative of the wet load to u, diag(k) (speed I + u u^T / speed) + lift, turned into the world
    per_speed = 1.0 / speed
    jac = (
        (kx * (speed + bx * bx * per_speed), kx * bx * by * per_speed - swing, kx * bx * bz * per_speed),
        (ky * by * bx * per_speed - swing, ky * (speed + by * by * per_speed), ky * by * bz * per_speed),
        (
            kz * bz * bx * per_speed + 2.0 * body.lift * bx,
            kz * bz * by * per_speed + 2.0 * body.lift * by,
            kz * (speed + bz * bz * per_speed),
        ),
    )
    turn = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
    load_z = (wx, wy, lz)
    for i in range(3):
        t = turn[i]
        mass = (t[0] * mx, t[1] * my, t[2] * mz)
        half = axpy(t[0], jac[0], axpy(t[1], jac[1], scale(t[2], jac[2])))
        for j in range(3):
            band[i, j] += wet * (c1 * dot(half, turn[j]) + c2 * dot(mass, turn[j]))
        band[i, i] += m * (c2 + sigma * c1)
        band[i, 2] += wet * (dot(half, turn[0]) * fall_x + dot(half, turn[1]) * fall_y) - dwet * load_z[i]
    return power


@inline
def slam(body, q, v, water, h):
    """Slam [N] of a body that is in the water surface, or was in the last h [s]: what load() has of it at the end, and
    what that leaves out of rho/2 C_s A w^2, w the vertical velocity into the water: DNV-RP-H103 (2011) 4.3.5. -1, 0
    where it is not there. q, v, water: see load().
    """
    w, height = water[EXTRA + 2] + water[ORBIT + 2] - v[2], q[2] - water[ELEVATION]
    if abs(height) > body.half_height + abs(w) * h:
        return -1.0, 0.0
    _, slope = smooth(height, -body.half_height, body.half_height)
    w = max(w, 0.0)
    largest = 0.75 * body.entry / body.half_height
    return slope * body.entry * w * w, max(body.slam - largest, 0.0) * w * w


@driver
def ground_load(surface, stiffness, q, v, c1):
    """Load of the ground on a point at q with velocity v, and rows of its derivative to q, v changing by c1 as much."""
    s = solid(surface)
    g, p, _ = touch(s, stiffness, q, v)
    along, n, k = p.along, g.own.normal, s.friction * p.load * c1 * p.per_speed
    row, direction = scale(-p.by_depth - c1 * p.by_closing, n), axpy(-s.friction, along, n)
    return acts(s, g.own, p), (
        axpy(direction[0], row, axpy(k * n[0], n, axpy(k * along[0], along, (-k, 0.0, 0.0)))),
        axpy(direction[1], row, axpy(k * n[1], n, axpy(k * along[1], along, (0.0, -k, 0.0)))),
        axpy(direction[2], row, axpy(k * n[2], n, axpy(k * along[2], along, (0.0, 0.0, -k)))),
    )


@driver
def lie(body, surface, node, change, tangent, band):
    """Add the load of the ground on the body to its node's row of the system, as load() does; returns its power [W]."""
    v = at3(node[1], 0)
    load, rows = ground_load(surface, body.floor_stiffness, at3(node[0], 0), v, change.velocity)
    for i in range(3):
        band[i, 12] += load[i]
        if tangent:
            for j in range(3):
                band[i, j] -= rows[i][j]
    return dot(load, v)


@inline
def past(q, water, current):
    """Velocity of the water at a body, x and y."""
    x = current[0] + water[EXTRA] - (current[2] + water[SHEAR]) * q[2] + water[ORBIT]
    return x, current[1] + water[EXTRA + 1] - (current[3] + water[SHEAR + 1]) * q[2] + water[ORBIT + 1]


@inline
def face_flow(body, node, current):
    """A body at rest faces the flow where it is, where there is enough of it; node: q, flow, water, see load()."""
    q, flow, water = node
    x, y = past(q, water, current)
    if sqrt(x * x + y * y) >= body.min_flow:
        flow[0], flow[1], flow[LAG] = x, y, 0.0


@driver
def turn_into_flow(body, node, current, h):
    """Low-pass the flow past the body over a step h [s] and turn the body into it, as fast as it may; keep the rate.

    node: q, v of the node and flow, each [6], and water, see load(). Below the least flow speed the heading is held,
    from twice that speed on it may turn by MAX_TURN in the body's time constant, between in proportion.
    """
    q, v, flow, water = node
    x, y = past(q, water, current)
    w, before = h / (body.flow_time + h), heading(flow)
    flow[0] += w * (x - v[0] - flow[0])
    flow[1] += w * (y - v[1] - flow[1])
    free = min(max(speed_past(flow) / body.min_flow - 1.0, 0.0), 1.0)
    maximum = free * MAX_TURN * h / body.flow_time
    miss = facing(flow) - before
    miss = atan2(sin(miss), cos(miss))
    turn = min(max(miss, -maximum), maximum)
    flow[LAG], flow[TURNING] = turn - miss, turn / h
