"""Static shape of the tow by integration from the towbody upward; the mesh is made from it.

No mesh, no bending, no sheave: dF/ds = -f for the tension vector F, dr/ds = (1 + T/EA) F/T, by Runge-Kutta in s from
the body; the depth of the body is shifted until the upper end comes to the sheave. Where there is a seabed and the body
comes down to it, so much of its weight, and then so much cable, lies there that it does; what lies is laid straight and
drags with the seabed's friction. Independent of the kernels, plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acos, cos, hypot, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..physics.ancf import (
    BUOYANCY,
    CD_FIXED,
    CN_FIT,
    CT_FIXED,
    CT_OF_RE,
    EA,
    EXTRA_DRAG,
    FN,
    FT,
    HALF_RHO_D,
    RE_FACTOR,
    WEIGHT_PER_LENGTH,
)
from ..physics.drag_laws import CHOO_CASARELLA, FRICTION, fitted
from ..physics.towbody import Towbody, body_record
from .current import flow_of
from .material import Hung, hung, material_rows, section_ends
from .scene import Scene
from .statics import Route
from .strumming import drag_factors

STEP = 0.06  # of the length over which the tension vector turns
LEAST_STEPS = 160  # in all
SHOTS = 30
LOOSE = 1e-3  # of the scope: a shape that ends farther from the sheave is none
SETTLED = 2e-5  # of the scope
LYING = 1e-3  # of the weight of a body on the ground is left to the cable
HALVINGS = 40  # of what lies


Row = tuple[float, ...]
Flow = Callable[[float], tuple[float, float]]  # water past the tow at a height, m/s
Joint = Callable[[float], Row]  # force that what hangs there needs at a height, N


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


class _Cable(NamedTuple):
    """One section's numbers for loads."""

    weight: float  # N/m dry
    buoyancy: float  # N/m
    half_rho_d: float
    factor: float  # drag_amplification
    strumming: Callable[[float], float]  # computed drag factor of a normal speed [m/s]
    re: float  # Reynolds number of 1 m/s
    cd: float  # below 0: of the Reynolds number
    fit: int  # by this fit
    ct: float  # of its own
    ct_of_re: float  # share of C_T(Re)
    normal: tuple[float, ...]
    tangential: tuple[float, ...]
    ea: float


def _cables(scene: Scene) -> list[_Cable]:
    cable, found = scene.cable, []
    for section, strumming in zip(cable.sections.values(), drag_factors(scene), strict=True):
        rows = material_rows(cable, section, scene.water, scene.gravity)
        found.append(
            _Cable(
                rows[WEIGHT_PER_LENGTH],
                rows[BUOYANCY],
                rows[HALF_RHO_D],
                1.0 + rows[EXTRA_DRAG],
                strumming,
                rows[RE_FACTOR],
                rows[CD_FIXED],
                int(rows[CN_FIT]),
                rows[CT_FIXED],
                rows[CT_OF_RE],
                tuple(rows[FN + i] for i in range(5)),
                tuple(rows[FT + i] for i in range(11)),
                rows[EA],
            )
        )
    return found


def _load(c: _Cable, z: float, force: Row, flow: Flow) -> tuple[float, float, float]:
    """Load per length [N/m] on cable with tension vector ``force`` at height z; flow(z): water past it."""
    if z >= 0.0:
        return 0.0, 0.0, -c.weight
    fx, fy, fz = force
    t = sqrt(fx * fx + fy * fy + fz * fz) or 1e-12
    ux, uy, uz = fx / t, fy / t, fz / t
    vx, vy = flow(z)
    vt = vx * ux + vy * uy
    wx, wy, wz = vx - vt * ux, vy - vt * uy, -vt * uz
    vn = sqrt(wx * wx + wy * wy + wz * wz) + 1e-9
    q2 = vn * vn + vt * vt
    re = max(c.re * vn, 1e-2)
    if c.cd >= 0.0:
        cd = c.cd
    elif c.fit == CHOO_CASARELLA:
        cd = 1.1 + 4.0 / sqrt(re) if re > 30.0 else 1.45 + 8.55 * re**-0.9
    else:
        cd = fitted(c.fit, re)[0]
    q = sqrt(q2)
    co, si = abs(vt) / q, vn / q
    c2, s2 = co * co - si * si, 2.0 * si * co
    n, h = c.normal, c.tangential
    fn = n[0] + n[1] * co + n[2] * si + n[3] * c2 + n[4] * s2
    c3, s3 = c2 * co - s2 * si, s2 * co + c2 * si
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    c5, s5 = c4 * co - s4 * si, s4 * co + c4 * si
    ft = (
        h[0] + h[1] * co + h[2] * c2 + h[3] * c3 + h[4] * c4 + h[5] * c5
        + h[6] * si + h[7] * s2 + h[8] * s3 + h[9] * s4 + h[10] * s5
    )  # fmt: skip
    k = c.half_rho_d * c.factor * c.strumming(vn) * cd * q2
    a, b = k * fn / vn, k * max(ft, 0.0) * (1.0 if vt >= 0.0 else -1.0)
    if c.ct + c.ct_of_re > 0.0:
        ct = c.ct + c.ct_of_re * fitted(FRICTION, c.re * abs(vt))[0]
        b += c.half_rho_d * c.factor * ct * abs(vt) * vt
    return a * wx + b * ux, a * wy + b * uy, a * wz + b * uz - c.weight + c.buoyancy


def _slope(c: _Cable, y: Row, flow: Flow) -> Row:
    """d/ds of (x, y, z, Fx, Fy, Fz) up the cable."""
    force = y[3:]
    t = sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2) or 1e-12
    f = _load(c, y[2], force, flow)
    e = (1.0 + t / c.ea) / t
    return (e * force[0], e * force[1], e * force[2], -f[0], -f[1], -f[2])


def _joints(scene: Scene, flow: Flow) -> dict[int, Joint]:
    """By section: force [N] that what hangs at its outboard end adds to the tension vector above it, at height z."""
    ends, found = list(section_ends(scene.cable).values()), dict[int, Joint]()
    bodies = {f"bodies.{name}": body for name, body in scene.bodies.items()}

    def pull(things: list[Hung]) -> Joint:
        def at(z: float) -> Row:
            force = np.array([0.0, 0.0, sum(thing.weight(scene.gravity, z) for thing in things)])
            for thing in things:
                if thing.key in bodies:
                    force += _held(bodies[thing.key], flow(z), scene, z)
            return tuple(force.tolist())

        return at

    for i, end in enumerate(ends):
        things = [thing for thing in hung(scene) if thing.place == end]
        if things:
            found[i] = pull(things)
    return found


def _held(body: Towbody, water: tuple[float, float], scene: Scene, z: float) -> np.ndarray:
    """Force [N] that holds a body at height z against drag and lift; water: flow past it."""
    if z >= 0.0:
        return np.zeros(3)
    row, speed = body_record(body, scene.gravity, scene.water.density), hypot(*water)
    along = float(row["drag"][0]) * speed
    return np.array([-along * water[0], -along * water[1], -float(row["lift"]) * speed * speed])


class _Ground(NamedTuple):
    """The seabed under a tow."""

    bottom: float  # m, its height
    rub: tuple[float, float]  # friction over the weight that lies: what it adds to the tension vector up the cable

    def bears(self, force: Row, weight: float) -> Row:
        """The tension vector above something of ``weight`` [N] that lies there, or is lifted by it."""
        down = max(weight, 0.0)
        return (force[0] + self.rub[0] * down, force[1] + self.rub[1] * down, 0.0)


def _march(
    cables: list[_Cable],
    spans: list[tuple[float, int]],
    y: Row,
    flow: Flow,
    ground: _Ground,
    joints: dict[int, Joint],
    laid: float = 0.0,
) -> list[tuple[float, Row, int]]:
    """From the body up over spans [(length, index of section)]; rows of s, y, section. laid: m that lie on the ground."""
    total = sum(length for length, _ in spans)
    out, s, bottom = [], 0.0, ground.bottom
    for length, i in spans:
        c, done = cables[i], 0.0
        if i in joints:
            added = joints[i](y[2])
            force = tuple(a + b for a, b in zip(y[3:], added, strict=True))
            y = (*y[:3], *(ground.bears((*force[:2], 0.0), added[2]) if s < laid else force))
        while done < length - 1e-9 * total:
            out.append((s + done, y, i))
            if s + done < laid - 1e-9 * total:
                h = min(total / LEAST_STEPS, length - done, laid - s - done)
                t = hypot(y[3], y[4]) or 1e-12
                f = _load(c, bottom, y[3:], flow)
                force = ground.bears((y[3] - h * f[0], y[4] - h * f[1], 0.0), (c.weight - c.buoyancy) * h)
                e = h * (1.0 + t / c.ea) / t
                y = (y[0] + e * y[3], y[1] + e * y[4], bottom, *force)
                done += h
                continue
            t = sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2)
            f = _load(c, y[2], y[3:], flow)
            vx, vy = flow(y[2])
            scale = hypot(hypot(f[0], f[1]), f[2]) + 0.3 * c.half_rho_d * c.factor * (vx * vx + vy * vy) * (y[2] < 0.0)
            h = min(STEP * t / max(scale, 1e-12) + 1e-5 * total, total / LEAST_STEPS, length - done)
            h = max(h, 1e-4 * length)
            if length - done - h < 0.3 * h:
                h = length - done
            k1 = _slope(c, y, flow)
            k2 = _slope(c, tuple(a + 0.5 * h * b for a, b in zip(y, k1, strict=True)), flow)
            k3 = _slope(c, tuple(a + 0.5 * h * b for a, b in zip(y, k2, strict=True)), flow)
            k4 = _slope(c, tuple(a + h * b for a, b in zip(y, k3, strict=True)), flow)
            y = tuple(a + h / 6.0 * (p + 2.0 * (q + r) + w) for a, p, q, r, w in zip(y, k1, k2, k3, k4, strict=True))
            if y[2] < bottom:  # what would go below the ground lies on it, straight
                y = (*y[:2], bottom, *y[3:5], max(y[5], 0.0))
            done += h
        s += length
        out.append((s, y, i))
    return out


def _free(route: Route, scope: float, angle: float) -> float:
    """Length [m] that hangs free of a sheave that the cable leaves at ``angle`` [rad]."""
    return max(scope - route.on_sheave(angle) + route.inboard - route.span, 0.01 * scope)


def tow_shape(scene: Scene, scope: float, heading: float | None = None) -> TowShape:
    """Static shape of the tow with ``scope`` [m] out. The sheave stands at its mean place.

    heading: yaw of the ship [rad]; None: the scene's.
    """
    route, cables = Route(scene), _cables(scene)
    yaw = radians(scene.ship.heading_deg) if heading is None else heading
    flow = flow_of(scene.water, yaw, (scene.ship.tow_speed * cos(yaw), scene.ship.tow_speed * sin(yaw)))

    top = scene.sheave.position[2] + scene.ship.reference_height
    bed = scene.seabed.depth
    over = scene.ship.tow_speed
    slides = 0.0 if bed is None else scene.seabed.friction * over / hypot(over, scene.seabed.slip_speed)
    ground = _Ground(-np.inf if bed is None else -bed, (slides * cos(yaw), slides * sin(yaw)))
    bottom = ground.bottom
    joints = _joints(scene, flow)
    angle, z, low, high = 0.5 * pi, top - 0.5 * scope, top - 1.5 * scope, top
    closed, tried = False, list[tuple[float, float]]()
    for _ in range(SHOTS):
        free = _free(route, scope, angle)
        spans, left = [], free
        for i in reversed(range(len(cables))):
            length = min(left, list(scene.cable.sections.values())[i].length)
            if length > 0.0:
                spans.append((length, i))
            left -= length
        z = max(z, bottom)
        towbody = Hung("towbody", scope, scene.towbody.net_weight, scene.towbody.mass)
        held = _held(scene.towbody, flow(z), scene, z) + (0.0, 0.0, towbody.weight(scene.gravity, z))

        def shot(lies: float, spans=spans, held=held, z=z, free=free) -> tuple[list[tuple[float, Row, int]], float, float]:
            """Rows, gap at the sheave and angle there; lies: share of the weight on the ground, from 1 on of the cable."""
            borne, laid = max(1.0 - lies, LYING), max(lies - 1.0, 0.0) * free
            force = tuple(held.tolist())
            if lies > 0.0:
                rests = (1.0 - borne) * max(force[2], 0.0)
                force = (*ground.bears(force, rests)[:2], borne * max(force[2], 0.0) if laid == 0.0 else 0.0)
            if hypot(hypot(*force[:2]), force[2]) < 1e-9:
                force = (-1e-9 * cos(yaw), -1e-9 * sin(yaw), 0.0) if laid > 0.0 else (0.0, 0.0, 1e-9)
            rows = _march(cables, spans, (0.0, 0.0, z, *force), flow, ground, joints, laid)
            end = rows[-1][1]
            t = sqrt(sum(f * f for f in end[3:])) or 1e-12
            aft = 1.0 if (end[3] * cos(yaw) + end[4] * sin(yaw)) * route.side >= 0.0 else -1.0
            leaves = aft * min(acos(max(-1.0, min(1.0, end[5] / t))), 0.5 * pi)
            return rows, top + route.sheave * sin(leaves) - end[2], leaves

        rows, gap, angle = shot(0.0)
        lies = z <= bottom and gap < 0.0
        if lies:  # its whole weight lifts the line over the sheave: so much lies that it does not
            few, many = 0.0, 2.0
            for _ in range(HALVINGS):
                half = 0.5 * (few + many)
                rows, gap, angle = shot(half)
                few, many = (half, many) if gap < 0.0 else (few, half)
                if abs(gap) < SETTLED * scope:
                    break
        closed = abs(gap) < LOOSE * scope
        if abs(gap) < SETTLED * scope and abs(free - _free(route, scope, angle)) < SETTLED * scope:
            break
        if lies:
            continue
        low, high = (z, high) if gap > 0.0 else (low, z)
        rate = 1.0
        if tried and abs(z - tried[-1][0]) > 1e-9 * scope:  # secant: a flat tow rises more than its body
            rate = max((tried[-1][1] - gap) / (z - tried[-1][0]), 0.1)
        tried.append((z, gap))
        z += gap / rate
        if not low < z < high:
            z = 0.5 * (low + high)
    s = np.array([row[0] for row in rows])
    y = np.array([row[1] for row in rows])
    section = np.array([row[2] for row in rows])
    pull = y[:, 3:]
    tension = np.maximum(np.linalg.norm(pull, axis=1), 1e-12)
    load = np.array([_load(cables[i], row[2], row[3:], flow) for i, row in zip(section, y, strict=True)])
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
        -across / tension[:, None],
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


def third_derivative(shape: TowShape) -> np.ndarray:
    """|d3r/ds3| [n] 1/m^2, piece by piece as fourth_derivative()."""
    return _derivative(shape, 1)


def fourth_derivative(shape: TowShape) -> np.ndarray:
    """|d4r/ds4| [n] 1/m^3, piece by piece between ends of sections and the water surface, where it has no meaning."""
    return _derivative(shape, 2)


def _derivative(shape: TowShape, times: int) -> np.ndarray:
    """Size of the ``times``-th derivative of d2r/ds2 [n]."""
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
        for _ in range(times):
            b = np.gradient(b, s, axis=0)
        size = np.linalg.norm(b, axis=1)
        size[0], size[1] = size[2], size[2]  # one-sided differences of differences
        size[-1], size[-2] = size[-3], size[-3]
        out[piece] = np.interp(shape.s[piece], s, size)
    return out
