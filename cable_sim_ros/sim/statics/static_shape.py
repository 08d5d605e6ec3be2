"""Static shape of the tow by integration from the towbody upward; the mesh is made from it.

No mesh, no bending, no sheave: dF/ds = -f for the tension vector F, dr/ds = (1 + T/EA) F/T, by Runge-Kutta in s from
the body; the depth of the body is shifted until the upper end comes to the sheave. Where there is a seabed and the body
comes down to it, so much of its weight, and then so much cable, lies there that it does; what lies is laid straight and
drags with the seabed's friction. Independent of the kernels of the elements.
"""

from __future__ import annotations

from math import acos, cos, hypot, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from ...compiler.jit import plain
from ..scene import Scene
from ..tables.current import Flow, flow_of
from ..tables.material import Hung
from .route import Route
from .static_integration import (
    CableLoads,
    Ground,
    Joint,
    Rows,
    bears,
    cable_loads,
    holding_force,
    integrate,
    joint_forces,
)

SHOTS = 30
LOOSE = 1e-3  # of the scope: a shape that ends farther from the sheave is none
SETTLED = 2e-5  # of the scope
LYING = 1e-3  # of the weight of a body on the ground is left to the cable
HALVINGS = 30  # of what lies
LIMP = 0.1  # of the weight of cable from ground to sheave: with less pull along the ground it lies slack


class TowShape(NamedTuple):
    """The free cable from the towbody upward; s [n] m from the body."""

    s: np.ndarray
    place: np.ndarray  # [n, 3] m, x y from the body, z above the water
    force: np.ndarray  # [n, 3] N, tension times unit tangent, pointing up the cable
    bend: np.ndarray  # [n, 3] 1/m, d2r/ds2
    section: np.ndarray  # [n] index of the section
    wet: np.ndarray  # [n] in the water?
    drag: np.ndarray  # [n] N/m, of the cable across the water that passes
    flow: np.ndarray  # [n, 3] m/s, water past the cable
    angle: float  # rad from the vertical where it leaves the sheave, negative where it leads back towards the drum
    scope: float  # m
    speed: float  # m/s, of the water past the upper end
    closed: bool  # does it come to the sheave? One that comes to the surface may not
    across: np.ndarray  # [n] m/s, speed of the water across the cable
    past: np.ndarray  # [n] m/s, of the water

    @property
    def tension(self) -> np.ndarray:
        """[n] N."""
        return np.linalg.norm(self.force, axis=1)


def _free(route: Route, scope: float, angle: float) -> float:
    """Length [m] that hangs free of a sheave that the cable leaves at ``angle`` [rad]."""
    return max(scope - route.on_sheave(angle) + route.inboard - route.span, 0.01 * scope)


class _Shooting(NamedTuple):
    """What a shot from the body at the sheave is made with."""

    scene: Scene
    route: Route
    cables: list[CableLoads]
    joints: dict[int, Joint]
    flow: Flow
    ground: Ground
    yaw: float
    top: float  # m, height of the sheave

    def spans(self, free: float) -> list[tuple[float, int]]:
        """Length [m] and index of every section that hangs free, from the body."""
        found, sections = [], list(self.scene.cable.sections.values())
        for i in reversed(range(len(sections))):
            length = min(free, sections[i].length)
            if length > 0.0:
                found.append((length, i))
            free -= length
        return found

    def shot(self, z: float, free: float, lies: float = 0.0) -> tuple[Rows, float, float]:
        """Rows of integrate() from a body at z with ``free`` m of cable, gap at the sheave [m] and angle there [rad].

        lies: share of the body's weight that the ground bears; from 1 on all of it, and more is a share of the cable.
        """
        scene, yaw, ground = self.scene, self.yaw, self.ground
        body = Hung("towbody", free, scene.towbody.net_weight, scene.towbody.mass)
        held = holding_force(scene.towbody, self.flow(z), scene, z) + (0.0, 0.0, body.weight(scene.gravity, z))
        force, laid = tuple(held.tolist()), max(lies - 1.0, 0.0) * free
        if lies > 0.0:
            down, borne = max(force[2], 0.0), max(1.0 - lies, LYING)
            force = (*plain(bears)(ground, force, (1.0 - borne) * down)[:2], borne * down if laid == 0.0 else 0.0)
        if laid > 0.0 and hypot(*force[:2]) < self.slack:
            force = (self.slack * cos(yaw), self.slack * sin(yaw), 0.0)
        if hypot(hypot(*force[:2]), force[2]) < 1e-9:
            force = (0.0, 0.0, 1e-9)
        rows = integrate(self.cables, self.spans(free), (0.0, 0.0, z, *force), self.flow, ground, self.joints, laid)
        end = rows.y[-1].tolist()
        t = sqrt(sum(f * f for f in end[3:])) or 1e-12
        aft = 1.0 if (end[3] * cos(yaw) + end[4] * sin(yaw)) * self.route.side >= 0.0 else -1.0
        angle = aft * min(acos(max(-1.0, min(1.0, end[5] / t))), 0.5 * pi)
        return rows, self.top + self.route.sheave * sin(angle) - end[2], angle

    @property
    def slack(self) -> float:
        """Pull [N] along the ground below which the cable lies there slack, and no place is its own."""
        last = self.cables[-1]
        return max(LIMP * (self.top - self.ground.bottom) * (last.weight - last.buoyancy), 1e-9)

    def lying(self, z: float, free: float) -> tuple[Rows, float, float]:
        """shot() from the ground, with as much lying there as brings the upper end to the sheave."""
        few, many = 0.0, 2.0
        for _ in range(HALVINGS):
            half = 0.5 * (few + many)
            rows, gap, angle = self.shot(z, free, half)
            few, many = (half, many) if gap < 0.0 else (few, half)
            if abs(gap) < SETTLED * free:
                break
        return rows, gap, angle


def tow_shape(scene: Scene, route: Route, scope: float, heading: float | None = None) -> TowShape:
    """Static shape of the tow with ``scope`` [m] out, see Layout.shape(). The sheave stands at its mean place.

    heading: yaw of the ship [rad]; None: the scene's.
    """
    cables, over, bed = cable_loads(scene), scene.ship.tow_speed, scene.seabed
    yaw = radians(scene.ship.heading_deg) if heading is None else heading
    flow = flow_of(scene.water, yaw, (over * cos(yaw), over * sin(yaw)))
    top = scene.sheave.position[2] + scene.ship.reference_height
    slides = bed.friction * over / hypot(over, bed.slip_speed)
    bottom = -np.inf if bed.depth is None else -bed.depth
    ground = Ground(bottom, (slides * cos(yaw), slides * sin(yaw)))
    shooting = _Shooting(scene, route, cables, joint_forces(scene, flow), flow, ground, yaw, top)
    angle, z, low, high = 0.5 * pi, top - 0.5 * scope, top - 1.5 * scope, top
    closed, tried = False, list[tuple[float, float]]()
    for _ in range(SHOTS):
        free = _free(route, scope, angle)
        z = max(z, bottom)
        rows, gap, angle = shooting.shot(z, free)
        lies = (
            z <= bottom and gap < 0.0
        )  # its whole weight lifts the line over the sheave: so much lies that it does not
        if lies:
            rows, gap, angle = shooting.lying(z, free)
        closed = abs(gap) < LOOSE * scope
        if lies:
            closed = closed and (rows.y[0, 5] > 0.0 or hypot(*rows.y[0, 3:5].tolist()) > shooting.slack)
            if abs(free - _free(route, scope, angle)) < SETTLED * scope:
                break
            continue
        if abs(gap) < SETTLED * scope:
            break
        low, high = (z, high) if gap > 0.0 else (low, z)
        rate = 1.0
        if tried and abs(z - tried[-1][0]) > 1e-9 * scope:  # secant: a flat tow rises more than its body
            rate = max((tried[-1][1] - gap) / (z - tried[-1][0]), 0.1)
        tried.append((z, gap))
        z += gap / rate
        if not low < z < high:
            z = 0.5 * (low + high)
    return finished(cables, flow, rows, angle, scope, closed)


def finished(
    cables: list[CableLoads],
    flow: Flow,
    rows: Rows,
    angle: float,
    scope: float,
    closed: bool,
    bend: np.ndarray | None = None,
) -> TowShape:
    """A shape with what follows from its rows.

    bend: d2r/ds2 [n, 3], None: that under the loads of the cable where it is.
    """
    s, y, section, load = rows
    pull = y[:, 3:]
    tension = np.maximum(np.linalg.norm(pull, axis=1), 1e-12)
    tangent = pull / tension[:, None]
    across = load - (load * tangent).sum(1)[:, None] * tangent
    wet = y[:, 2] < 0.0
    water = np.array([(*flow(row[2]), 0.0) for row in y])
    speeds, along = np.linalg.norm(water, axis=1), (water * tangent).sum(1)
    normal = np.sqrt(np.maximum(speeds**2 - along**2, 0.0))
    broad = np.array([1.2 * c.half_rho_d * c.factor for c in cables])[section] * speeds**2 * wet
    return TowShape(
        s,
        y[:, :3],
        pull,
        -across / tension[:, None] if bend is None else bend,
        section,
        wet,
        broad,
        water,
        angle,
        scope,
        hypot(*flow(0.0)),
        closed,
        normal,
        speeds,
    )


def derivative(shape: TowShape, order: int) -> np.ndarray:
    """|d3r/ds3| [n] 1/m^2, or of order 4 |d4r/ds4| [n] 1/m^3, piece by piece between ends of sections and the water
    surface, where it has no meaning."""
    out = np.zeros(len(shape.s))
    cut = np.flatnonzero((np.diff(shape.section) != 0) | (np.diff(shape.wet.astype(int)) != 0)) + 1
    for piece in np.split(np.arange(len(shape.s)), cut):
        if len(piece) < 4:
            continue
        s, b = shape.s[piece], shape.bend[piece]
        keep = np.concatenate(([True], np.diff(s) > 1e-12))
        s, b = s[keep], b[keep]
        if len(s) < 4:
            continue
        for _ in range(order - 2):
            b = np.gradient(b, s, axis=0)
        size = np.linalg.norm(b, axis=1)
        size[0], size[1] = size[2], size[2]  # one-sided differences of differences
        size[-1], size[-2] = size[-3], size[-3]
        out[piece] = np.interp(shape.s[piece], s, size)
    return out
