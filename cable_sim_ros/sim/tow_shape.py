"""Static shape of the tow by integration from the towbody upward; the mesh is made from it.

No mesh, no bending, no sheave: dF/ds = -f for the tension vector F, dr/ds = (1 + T/EA) F/T, by Runge-Kutta in s from
the body; the depth of the body is shifted until the upper end comes to the sheave. Where there is a seabed, what would
lie below it is laid straight on it. Independent of the kernels, plain Python.
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
    EXTRA_ALONG,
    EXTRA_DRAG,
    FN,
    FT,
    HALF_RHO_D,
    RE_FACTOR,
    WEIGHT_PER_LENGTH,
)
from ..physics.drag_laws import CHOO_CASARELLA, FRICTION, GRAZING, fitted
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
    factor: float  # drag_amplification, of the drag across
    along: float  # and along
    strumming: Callable[[float], float]  # computed drag factor of a normal speed [m/s], of the drag across
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
                1.0 + rows[EXTRA_ALONG],
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


def _coefficient(c: _Cable, re: float) -> float:
    """C_D by a law's fit."""
    if c.fit != CHOO_CASARELLA:
        return fitted(c.fit, re)[0]
    return 1.1 + 4.0 / sqrt(re) if re > 30.0 else 1.45 + 8.55 * re**-0.9


def _coefficients(c: _Cable, vn: float, at: float) -> tuple[float, float]:
    """C_D of the drag across and that of f_t: of the whole speed where the cable lies in the flow."""
    if c.cd >= 0.0:
        return c.cd, c.cd
    across = _coefficient(c, max(c.re * vn, 1e-2))
    x = (vn / (GRAZING * at)) ** 2 if vn < GRAZING * at else 1.0
    if x == 1.0 or c.fit != CHOO_CASARELLA:
        return across, across
    whole = _coefficient(c, max(c.re * hypot(vn, at), 1e-2))
    return across, whole + x * x * (3.0 - 2.0 * x) * (across - whole)


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
    cd, cdt = _coefficients(c, vn, abs(vt))
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
    a = c.half_rho_d * c.factor * c.strumming(vn) * cd * q2 * fn / vn
    b = c.half_rho_d * c.along * cdt * q2 * max(ft, 0.0) * (1.0 if vt >= 0.0 else -1.0)
    if c.ct + c.ct_of_re > 0.0:
        ct = c.ct + c.ct_of_re * fitted(FRICTION, c.re * abs(vt))[0]
        b += c.half_rho_d * c.along * ct * abs(vt) * vt
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


def _march(
    cables: list[_Cable], spans: list[tuple[float, int]], y: Row, flow: Flow, bottom: float, joints: dict[int, Joint]
) -> list[tuple[float, Row, int]]:
    """From the body up over spans [(length, index of section)]; rows of s, y, section."""
    total = sum(length for length, _ in spans)
    out, s = [], 0.0
    for length, i in spans:
        c, done = cables[i], 0.0
        if i in joints:
            y = (*y[:3], *(a + b for a, b in zip(y[3:], joints[i](y[2]), strict=True)))
        while done < length - 1e-9 * total:
            out.append((s + done, y, i))
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


def tow_shape(scene: Scene, scope: float, heading: float | None = None) -> TowShape:
    """Static shape of the tow with ``scope`` [m] out. The sheave stands at its mean place.

    heading: yaw of the ship [rad]; None: the scene's.
    """
    route, cables = Route(scene), _cables(scene)
    yaw = radians(scene.ship.heading_deg) if heading is None else heading
    flow = flow_of(scene.water, yaw, (scene.ship.tow_speed * cos(yaw), scene.ship.tow_speed * sin(yaw)))

    top = scene.sheave.position[2] + scene.ship.reference_height
    bed = scene.seabed.depth
    bottom = -np.inf if bed is None else -bed
    joints = _joints(scene, flow)
    angle, z, low, high = 0.5 * pi, top - 0.5 * scope, top - 1.5 * scope, top
    closed, tried = False, list[tuple[float, float]]()
    for _ in range(SHOTS):
        free = max(scope - route.on_sheave(angle) + route.inboard - route.span, 0.01 * scope)
        spans, left = [], free
        for i in reversed(range(len(cables))):
            length = min(left, list(scene.cable.sections.values())[i].length)
            if length > 0.0:
                spans.append((length, i))
            left -= length
        z = max(z, bottom)
        towbody = Hung("towbody", scope, scene.towbody.net_weight, scene.towbody.mass)
        held = _held(scene.towbody, flow(z), scene, z) + (0.0, 0.0, towbody.weight(scene.gravity, z))
        for borne in (1.0, LYING) if z <= bottom else (1.0,):
            force = tuple(held.tolist())
            if borne < 1.0:  # the ground bears it
                force = (*force[:2], borne * max(force[2], 0.0))
            if hypot(hypot(*force[:2]), force[2]) < 1e-9:
                force = (0.0, 0.0, 1e-9)
            rows = _march(cables, spans, (0.0, 0.0, z, *force), flow, bottom, joints)
            end = rows[-1][1]
            t = sqrt(sum(f * f for f in end[3:])) or 1e-12
            aft = 1.0 if (end[3] * cos(yaw) + end[4] * sin(yaw)) * route.side >= 0.0 else -1.0
            angle = aft * min(acos(max(-1.0, min(1.0, end[5] / t))), 0.5 * pi)
            gap = top + route.sheave * sin(angle) - end[2]
            if gap > 0.0:  # the whole of its weight is too little: it does not come down to the ground
                break
        lies = borne < 1.0
        closed = abs(gap) < LOOSE * scope or lies
        if abs(gap) < SETTLED * scope or (lies and gap > 0.0):
            break
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
