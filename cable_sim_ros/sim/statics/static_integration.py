"""Integration of a tow from its body upward, for the static shape (static_shape.py): loads of the cable, of what hangs
on it, of the seabed under it. Independent of the kernels of the elements.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from ...compiler.jit import driver, inline, plain
from ...physics.ancf import (
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
from ...physics.drag import SPEED_FLOOR
from ...physics.drag_laws import CHOO_CASARELLA, FRICTION, GRAZING, fitted
from ...physics.towbody import Towbody, body_record
from ..scene import Scene
from ..tables.current import Flow, water_at
from ..tables.material import Hung, bodies_of, hung, material_rows, section_ends
from ..tables.viv_tables import Strumming, drag_factor, strumming_of

STEP = 0.06  # of the length over which the tension vector turns
MIN_STEPS = 160  # in all
SHORTEST = 1e-4  # of the length of a section, of a step
ROWS = int(1.0 / SHORTEST) + 2 * MIN_STEPS  # of a section at most

Row = tuple[float, ...]


class Rows(NamedTuple):
    """Of a shape from the body up."""

    s: np.ndarray  # [n] m
    y: np.ndarray  # [n, 6] place, m, and tension vector, N
    section: np.ndarray  # [n] its index
    load: np.ndarray  # [n, 3] N/m


Joint = Callable[[float], Row]  # force that what hangs there needs at a height, N


class CableLoads(NamedTuple):
    """One section's numbers for loads."""

    weight: float  # N/m dry
    buoyancy: float  # N/m
    half_rho_d: float
    factor: float  # drag_amplification, of the drag across
    along: float  # and along
    strumming: Strumming  # drag factor of a normal speed, of the drag across
    re: float  # Reynolds number of 1 m/s
    cd: float  # below 0: of the Reynolds number
    fit: int  # by this fit
    ct: float  # of its own
    ct_of_re: float  # share of C_T(Re)
    normal: tuple[float, ...]
    tangential: tuple[float, ...]
    ea: float
    minimum: float  # m/s across it that C_D(Re) is taken of at least


def cable_loads(scene: Scene) -> list[CableLoads]:
    """Numbers for loads of every section, from the drum end."""
    cable, found = scene.cable, []
    for section, strumming in zip(cable.sections.values(), strumming_of(scene), strict=True):
        rows = material_rows(cable, section, scene.water, scene.gravity)
        found.append(
            CableLoads(
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
                0.0 if scene.seabed.depth is None else SPEED_FLOOR,  # along what lies C_D(Re) has no other bound
            )
        )
    return found


@inline
def hypot_of(x, y):
    """Length of (x, y), rounded as by math.hypot: what the numba of a machine takes for it may differ by a bit."""
    x, y = max(abs(x), abs(y)), min(abs(x), abs(y))
    xx, dx = squared(x)
    if xx == 0.0:
        return x
    yy, dy = squared(y)
    total = xx + yy
    root = sqrt(total)
    square, over = squared(root)
    return root + ((total - square) - over + (yy - (total - xx)) + dx + dy) / (2.0 * root)


@inline
def squared(x):
    """x^2 and what its rounding leaves out (Dekker 1971)."""
    t = 134217729.0 * x
    high = t - (t - x)
    low = x - high
    square = x * x
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@inline
def _coefficient(c, re):
    """C_D by a law's fit."""
    if c.fit != CHOO_CASARELLA:
        return fitted(c.fit, re)[0]
    return 1.1 + 4.0 / sqrt(re) if re > 30.0 else 1.45 + 8.55 * re**-0.9


@inline
def _coefficients(c, vn, at):
    """C_D of the drag across and that of f_t: of the whole speed where the cable lies in the flow."""
    if c.cd >= 0.0:
        return c.cd, c.cd
    across = _coefficient(c, max(c.re * max(vn, c.minimum), 1e-2))
    x = (vn / (GRAZING * at)) ** 2 if vn < GRAZING * at else 1.0
    if x == 1.0 or c.fit != CHOO_CASARELLA:
        return across, across
    whole = _coefficient(c, max(c.re * max(hypot_of(vn, at), c.minimum), 1e-2))
    return across, whole + x * x * (3.0 - 2.0 * x) * (across - whole)


@driver
def line_load(c, z, force, flow):
    """Load per length [N/m] on cable c (CableLoads) with tension vector ``force`` at height z; flow: water past it."""
    if z >= 0.0:
        return 0.0, 0.0, -c.weight
    fx, fy, fz = force
    t = sqrt(fx * fx + fy * fy + fz * fz) or 1e-12
    ux, uy, uz = fx / t, fy / t, fz / t
    vx, vy = water_at(flow, z)
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
    a = c.half_rho_d * c.factor * drag_factor(c.strumming, vn) * cd * q2 * fn / vn
    b = c.half_rho_d * c.along * cdt * q2 * max(ft, 0.0) * (1.0 if vt >= 0.0 else -1.0)
    if c.ct + c.ct_of_re > 0.0:
        ct = c.ct + c.ct_of_re * fitted(FRICTION, c.re * abs(vt))[0]
        b += c.half_rho_d * c.along * ct * abs(vt) * vt
    return a * wx + b * ux, a * wy + b * uy, a * wz + b * uz - c.weight + c.buoyancy


@inline
def _slope(k, row, c, force, load):
    """Put d/ds of (x, y, z, Fx, Fy, Fz) up the cable under a load per length [N/m] into a row of k."""
    t = sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2) or 1e-12
    e = (1.0 + t / c.ea) / t
    for i in range(3):
        k[row, i], k[row, 3 + i] = e * force[i], -load[i]


@inline
def _keep(out, n, s, y, load):
    """A row of s, y and load."""
    out[n, 0] = s
    for i in range(6):
        out[n, 1 + i] = y[i]
    for i in range(3):
        out[n, 7 + i] = load[i]


@inline
def bears(ground, force, weight):
    """The tension vector above something of ``weight`` [N] that lies on the ground, or is lifted by it."""
    down = max(weight, 0.0)
    return force[0] + ground.rub[0] * down, force[1] + ground.rub[1] * down, 0.0


@driver
def _march(c, y, s, length, total, laid, flow, ground, k, out):
    """Go up a section of ``length`` m from y [6], s m from the body; of all ``total`` m ``laid`` lie.

    Rows of s, y and load per length before each step and at the end into out [ROWS, 10]; returns how many. y is then
    that at the end.
    k [4, 6]: scratch.
    """
    done, n, bottom = 0.0, 0, ground.bottom
    while done < length - 1e-9 * total:
        force = (y[3], y[4], y[5])
        f = line_load(c, y[2], force, flow)
        _keep(out, n, s + done, y, f)
        n += 1
        if s + done < laid - 1e-9 * total:
            h = min(total / MIN_STEPS, length - done, laid - s - done)
            t = hypot_of(y[3], y[4]) or 1e-12
            e = h * (1.0 + t / c.ea) / t
            y[0], y[1], y[2] = y[0] + e * y[3], y[1] + e * y[4], bottom
            y[3], y[4], y[5] = bears(ground, (y[3] - h * f[0], y[4] - h * f[1]), (c.weight - c.buoyancy) * h)
            done += h
            continue
        t = sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2)
        vx, vy = water_at(flow, y[2])
        wet = 1.0 if y[2] < 0.0 else 0.0
        scale = hypot_of(hypot_of(f[0], f[1]), f[2]) + 0.3 * c.half_rho_d * c.factor * (vx * vx + vy * vy) * wet
        h = min(STEP * t / max(scale, 1e-12) + 1e-5 * total, total / MIN_STEPS, length - done)
        h = max(h, SHORTEST * length)
        if length - done - h < 0.3 * h:
            h = length - done
        _slope(k, 0, c, force, f)
        for i in range(1, 4):  # the loads do not depend on x and y
            part = h if i == 3 else 0.5 * h
            force = (y[3] + part * k[i - 1, 3], y[4] + part * k[i - 1, 4], y[5] + part * k[i - 1, 5])
            _slope(k, i, c, force, line_load(c, y[2] + part * k[i - 1, 2], force, flow))
        sixth = h / 6.0
        for i in range(6):
            y[i] += sixth * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])
        if y[2] < bottom:  # what would go below the ground lies on it, straight
            y[2], y[5] = bottom, max(y[5], 0.0)
        done += h
    _keep(out, n, s + length, y, line_load(c, y[2], (y[3], y[4], y[5]), flow))
    return n + 1


def joint_forces(scene: Scene, flow: Flow) -> dict[int, Joint]:
    """By section: force [N] that what hangs at its outboard end adds to the tension vector above it, at height z."""
    ends, found, bodies = list(section_ends(scene.cable).values()), dict[int, Joint](), bodies_of(scene)

    def pull(things: list[Hung]) -> Joint:
        def at(z: float) -> Row:
            force = np.array([0.0, 0.0, sum(thing.weight(scene.gravity, z) for thing in things)])
            for thing in things:
                if thing.key in bodies:
                    force += holding_force(bodies[thing.key], flow(z), scene, z)
            return tuple(force.tolist())

        return at

    for i, end in enumerate(ends):
        things = [thing for thing in hung(scene) if thing.place == end]
        if things:
            found[i] = pull(things)
    return found


def holding_force(body: Towbody, water: tuple[float, float], scene: Scene, z: float) -> np.ndarray:
    """Force [N] that holds a body at height z against drag and lift; water: flow past it."""
    if z >= 0.0:
        return np.zeros(3)
    row, speed = body_record(body, scene.gravity, scene.water.density), hypot(*water)
    along = float(row["drag"][0]) * speed
    return np.array([-along * water[0], -along * water[1], -float(row["lift"]) * speed * speed])


class Ground(NamedTuple):
    """The seabed under a tow."""

    bottom: float  # m, its height
    rub: tuple[float, float]  # friction over the weight that lies: what it adds to the tension vector up the cable


def integrate(
    cables: list[CableLoads],
    spans: list[tuple[float, int]],
    start: Row,
    flow: Flow,
    ground: Ground,
    joints: dict[int, Joint],
    laid: float = 0.0,
) -> Rows:
    """From the body up over spans [(length, index of section)]; laid: m of it that lie on the ground."""
    total = sum(length for length, _ in spans)
    parts, sections, s, y = [], [], 0.0, np.array(start)
    k, out = np.empty((4, 6)), np.empty((ROWS, 10))
    for length, i in spans:
        if i in joints:
            added = joints[i](float(y[2]))
            force = tuple(a + b for a, b in zip(y[3:].tolist(), added, strict=True))
            y[3:] = plain(bears)(ground, force, added[2]) if s < laid else force
        count = _march(cables[i], y, s, length, total, laid, flow, ground, k, out)
        parts.append(out[:count].copy())
        sections.append(np.full(count, i))
        s += length
    rows = np.concatenate(parts)
    return Rows(rows[:, 0], rows[:, 1:7], np.concatenate(sections), rows[:, 7:])
