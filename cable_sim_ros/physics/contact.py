"""Contact law: force from gap, normal and slip (Hunt-Crossley with Coulomb friction), Westin (2018) (93).

f = k delta^1.5 max(0, 1 + D ddelta/dt) n: smooth where contact opens and closes, and never attractive.
The stiffness follows from a penetration limit, not from Table 9 (trap T3: 60 mm). Geometry is in contact_surface.py.
Friction acts against the slip v along the surface, f_t = -mu f v / sqrt(v^2 + v_s^2), smooth at rest. There is one
law() for sheave, drum, seabed and what lies on them; lane loops of a surface without friction leave out what it adds.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ..compiler.jit import LANES, driver, inline
from .contact_surface import DRUM, FLOOR, GROOVE, Gap, drum_gap, gap, groove_gap, solid
from .drag import POINT_FLOW, POINT_R, POINT_V, flow_at
from .parameter import Block, quantity
from .vec import add, axpy, cross, dot, get3, plus_matrix, put3, put_matrix, scale

EVENTS = np.dtype(
    [
        ("detachments", "i8"),
        ("seated", "i8"),  # 1 while on the sheave
        ("pressed_since", "i8"),  # ns, -1: it does not press
        ("clearance", "f8"),  # m, groove clearance at the end of the last step, see contact_detection.py
        ("bears", "f8"),  # resultant on the sheave over the sum of its radial loads, of the last tick that loaded it
    ],
    align=True,
)
NOTHING = (0.0, 0.0, 0.0)
LOADED = 1e-3  # N/m, line load above which a contact point counts as loaded
CONTACT_POINTS_PER_ELEMENT = 5
CONTACT_POINT = np.dtype(
    [
        ("surface", "i8"),
        ("element", "i8"),
        ("place", "f8"),  # m, unstretched arc length
        ("length", "f8"),  # m of cable it stands for
        ("rel", "f8", 3),  # m from the centre of the surface, world axes
        ("normal_own", "f8", 3),
        ("normal_other", "f8", 3),
        ("depth_own", "f8"),  # m
        ("depth_other", "f8"),
        ("load_own", "f8"),  # N/m
        ("load_other", "f8"),
        ("rub", "f8", 3),  # N/m, friction on the cable, world axes
        ("side", "f8"),
        ("height", "f8"),  # m over the seat
        ("clearance", "f8"),  # m below the top of the groove
    ],
    align=True,
)
DETECTED = np.dtype(
    [
        ("first", "i8"),  # its rows in the table of contact points
        ("end", "i8"),
        ("clearance", "f8"),  # m below the top of the groove where the cable presses highest; -1: nowhere in it
        ("entered", "i8"),  # 1: deeper than the rim is round; 2: through it from side to side
        ("coarse", "i8"),  # 1: an element lies on it that is long for it
    ],
    align=True,
)


class Contact(Block):
    penetration_limit: float = quantity(
        0.1,
        "1",
        1e-4,
        0.5,
        "largest penetration at working tension, as a fraction of the cable diameter; it sets the stiffness",
        "trap T3: Westin's Table 9 stiffness lets the cable sink 60 mm",
    )
    working_tension: float = quantity(
        4000.0, "N", 1e-3, 1e7, "tension at which the penetration limit holds", "highest static tension expected"
    )
    damping: float = quantity(0.3, "s/m", 0.0, 100.0, "Hunt-Crossley damping D", "Westin (93)")
    slip_speed: float = quantity(
        0.001,
        "m/s",
        1e-5,
        1.0,
        "slip at which 0.71 of the friction of sheave and drum acts; below it the cable creeps over them",
        "measured: docs/limits.md",
    )
    reseat_time: float = quantity(
        0.02,
        "s",
        0.0,
        10.0,
        "time the cable must press in its groove without a break before a detachment is over; a "
        "rebound within it belongs to the same event",
        "window within which one event shows at most two changes",
    )


@inline
def press(delta, closing, k, d):
    """Force per length of one flank [N/m] and its derivatives to delta and to the closing speed."""
    p = max(delta, 0.0)
    root = sqrt(p)
    m = 1.0 + d * closing
    m = m if m > 0.0 else 0.0
    f = k * p * root
    return f * m, 1.5 * k * root * m, (f * d if m > 0.0 else 0.0)


class Press(NamedTuple):
    """What the law makes of one half: load [N/m, of a point N], its derivatives to penetration and closing speed, the
    slip along it over sqrt(slip^2 + v_s^2), and one over that root."""

    load: float
    by_depth: float
    by_closing: float
    along: tuple
    per_speed: float


class Touch(NamedTuple):
    """A point on a surface: where it is, and what each half presses with."""

    gap: Gap
    own: Press
    other: Press


AT_STANDSTILL = 1e-30  # m^2/s^2: without friction and slip the direction of the slip is none, not no number


@inline
def law(s, k, half, slip):
    """Press of one half of a Solid on a point that moves with ``slip`` relative to it; k: stiffness."""
    load, by_depth, by_closing = press(half.depth, -dot(half.normal, slip), k, s.damping)
    along = axpy(-dot(slip, half.normal), half.normal, slip)
    per_speed = 1.0 / sqrt(dot(along, along) + s.slip * s.slip + AT_STANDSTILL)
    return Press(load, by_depth, by_closing, scale(per_speed, along), per_speed)


@inline
def touch(s, k, r, v):
    """A Solid of any kind and a point at r with velocity v.

    k: stiffness, of a cable the Solid's own [N/m^2.5], of a body per point [N/m^1.5].
    """
    g = gap(s, r, v)
    own = law(s, k, g.own, g.slip)
    other = law(s, k, g.other, g.slip) if s.kind == GROOVE else Press(0.0, 0.0, 0.0, NOTHING, 0.0)
    return Touch(g, own, other)


@inline
def acts(s, half, p):
    """Load of one half with its friction, as a vector."""
    return scale(p.load, axpy(-s.friction, p.along, half.normal))


@inline
def rubs(s, touched):
    """Friction of both halves on the point, as a vector."""
    own, other = touched.own, touched.other
    return scale(-s.friction, axpy(own.load, own.along, scale(other.load, other.along)))


@inline
def latch(pressed, events, now, hold):
    """Detachments as events: left at once, back only after ``hold`` [ns] of pressing without a break; is it off?

    events: an EVENTS record.
    """
    if not pressed:
        events.detachments += events.seated
        events.seated, events.pressed_since = 0, -1
    elif events.seated == 0:
        if events.pressed_since < 0:
            events.pressed_since = now
        if now - events.pressed_since >= hold:
            events.seated = 1
    return events.seated == 0


@driver
def contact_point_lanes(x, p, n, t):
    """Position and velocity of one point a lane: rows R, V and FLOW of t; n: N_i [4]."""
    if x.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    n0, n1, n2, n3 = n[0], n[1], n[2], n[3]
    for e in range(LANES):
        put3(
            t,
            POINT_R,
            e,
            axpy(n0, get3(x, 0, e), axpy(n1, get3(x, 3, e), axpy(n2, get3(x, 6, e), scale(n3, get3(x, 9, e))))),
        )
        put3(
            t,
            POINT_V,
            e,
            axpy(n0, get3(x, 12, e), axpy(n1, get3(x, 15, e), axpy(n2, get3(x, 18, e), scale(n3, get3(x, 21, e))))),
        )
        t[POINT_FLOW, e] = flow_at(p, n1 + n2 + n3, e)


@driver
def contact_lanes(t, surface, weight, f):
    """f[3, LANES] = weight * contact load of a surface at the point of each lane (rows R and V of t)."""
    if t.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    s = solid(surface)
    if s.kind == DRUM and s.friction == 0.0:
        for e in range(LANES):
            g = drum_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            put3(f, 0, e, scale(weight[e] * law(s, s.stiffness, g.own, g.slip).load, g.radial))
    elif s.kind == GROOVE and s.friction == 0.0:
        for e in range(LANES):
            g = groove_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            own, other = law(s, s.stiffness, g.own, g.slip), law(s, s.stiffness, g.other, g.slip)
            put3(f, 0, e, scale(weight[e], axpy(own.load, g.own.normal, scale(other.load, g.other.normal))))
    elif s.kind == GROOVE:
        for e in range(LANES):
            g = groove_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            own, other = law(s, s.stiffness, g.own, g.slip), law(s, s.stiffness, g.other, g.slip)
            put3(f, 0, e, scale(weight[e], add(acts(s, g.own, own), acts(s, g.other, other))))
    else:
        for e in range(LANES):
            g = gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            put3(f, 0, e, scale(weight[e], acts(s, g.own, law(s, s.stiffness, g.own, g.slip))))


@inline
def half_row(n, p, t, m, slip, bend, vr, spin, c1):
    """Row vector of the tangent n row^T of one half; slip, bend: turning of n per way along t and m."""
    row = axpy(-slip * dot(t, vr), t, axpy(-bend * dot(m, vr), m, cross(n, spin)))
    return axpy(p.by_closing, row, scale(-p.by_depth - c1 * p.by_closing, n))


@inline
def plus_half(ka, kb, e, s, g, half, p, turn, rates):
    """Add the tangent of one half with friction; turn [1/m]: how its normal turns along g.around;
    rates: c1, weight, flow of the material."""
    c1, w, flow = rates
    n, t, a = half.normal, g.around, p.along
    m = cross(n, t)
    k = w * s.friction * p.load * c1 * p.per_speed
    direction = scale(w, axpy(-s.friction, a, n))
    row = half_row(n, p, t, m, turn, half.bend, g.slip, s.spin, c1)
    plus_matrix(ka, 0, e, -k, direction, row, scale(k, n), n)
    plus_matrix(ka, 0, e, 0.0, scale(k, a), a, scale(w * p.load * turn, t), t)
    plus_matrix(ka, 0, e, 0.0, scale(w * p.load * half.bend, m), m, t, NOTHING)
    k = flow * w * s.friction * p.load * p.per_speed
    plus_matrix(kb, 0, e, -k, scale(-flow * p.by_closing, direction), n, scale(k, n), n)
    plus_matrix(kb, 0, e, 0.0, scale(k, a), a, t, NOTHING)


@inline
def plus_turning(ka, e, s, g, half, p, turn, w):
    """Add how the friction of one half turns: the surface slips past with its spin, and its normal turns."""
    k, u, spin = w * s.friction * p.load * p.per_speed, g.slip, s.spin
    n, t, a = half.normal, g.around, p.along
    m, into = cross(n, t), dot(half.normal, g.slip)
    of_n = axpy(turn * dot(t, u), t, axpy(half.bend * dot(m, u), m, cross(spin, n)))
    of_a = axpy(-into * turn * dot(a, t), t, axpy(-into * half.bend * dot(a, m), m, cross(spin, a)))
    plus_matrix(ka, 0, e, 0.0, scale(k, n), of_n, scale(k, a), of_a)
    plus_matrix(ka, 0, e, 0.0, scale(k * into * turn, t), t, scale(k * into * half.bend, m), m)
    ka[1, e] -= k * spin[2]
    ka[2, e] += k * spin[1]
    ka[3, e] += k * spin[2]
    ka[5, e] -= k * spin[0]
    ka[6, e] -= k * spin[1]
    ka[7, e] += k * spin[0]


@driver
def contact_tangent_lanes(t, surface, c1, weight, out):
    """contact_lanes with its derivatives: f, ka to position, with c1 for the velocity part, kb to the slope through the
    velocity of the material, which changes with xi' dr/dxi (mesh_convection.py); each [., LANES]."""
    f, ka, kb = out
    if (
        t.shape[1] != LANES
        or weight.shape[0] != LANES
        or f.shape[1] != LANES
        or ka.shape[1] != LANES
        or (kb.shape[1] != LANES)
    ):
        raise ValueError("lanes")
    s = solid(surface)
    spin = s.spin
    if s.kind == DRUM and s.friction == 0.0:
        for e in range(LANES):
            g = drum_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            p, er, q, w = law(s, s.stiffness, g.own, g.slip), g.radial, g.around, weight[e]
            put3(f, 0, e, scale(w * p.load, er))
            row = half_row(er, p, q, er, 1.0 / g.rho, 0.0, g.slip, spin, c1)
            put_matrix(ka, 0, e, 0.0, scale(w, er), row, scale(w * p.load / g.rho, q), q)
            flow = w * t[POINT_FLOW, e]
            put_matrix(kb, 0, e, 0.0, scale(-flow * p.by_closing, er), er, er, NOTHING)
    elif s.kind == GROOVE and s.friction == 0.0:
        for e in range(LANES):
            g = groove_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            p1, p2 = law(s, s.stiffness, g.own, g.slip), law(s, s.stiffness, g.other, g.slip)
            n1, n2, q, w = g.own.normal, g.other.normal, g.around, weight[e]
            slip1, slip2, m = dot(n1, g.radial) / g.rho, dot(n2, g.radial) / g.rho, cross(n1, q)
            row1 = half_row(n1, p1, q, m, slip1, g.own.bend, g.slip, spin, c1)
            row2 = half_row(n2, p2, q, m, slip2, 0.0, g.slip, spin, c1)
            put3(f, 0, e, scale(w, axpy(p1.load, n1, scale(p2.load, n2))))
            put_matrix(ka, 0, e, 0.0, scale(w, n1), row1, scale(w, n2), row2)
            turns = w * (p1.load * slip1 + p2.load * slip2)  # n turns
            plus_matrix(ka, 0, e, 0.0, scale(turns, q), q, scale(w * p1.load * g.own.bend, m), m)
            flow = w * t[POINT_FLOW, e]
            put_matrix(kb, 0, e, 0.0, scale(-flow * p1.by_closing, n1), n1, scale(-flow * p2.by_closing, n2), n2)
    elif s.kind == GROOVE:
        for e in range(LANES):
            g = groove_gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            p1, p2 = law(s, s.stiffness, g.own, g.slip), law(s, s.stiffness, g.other, g.slip)
            rates, turn1, turn2 = (
                (c1, weight[e], t[POINT_FLOW, e]),
                dot(g.own.normal, g.radial) * g.turn,
                dot(g.other.normal, g.radial) * g.turn,
            )
            put3(f, 0, e, scale(weight[e], add(acts(s, g.own, p1), acts(s, g.other, p2))))
            put_matrix(ka, 0, e, 0.0, NOTHING, NOTHING, NOTHING, NOTHING)
            put_matrix(kb, 0, e, 0.0, NOTHING, NOTHING, NOTHING, NOTHING)
            plus_half(ka, kb, e, s, g, g.own, p1, turn1, rates)
            plus_half(ka, kb, e, s, g, g.other, p2, turn2, rates)
            plus_turning(ka, e, s, g, g.own, p1, turn1, weight[e])
            plus_turning(ka, e, s, g, g.other, p2, turn2, weight[e])
    else:
        for e in range(LANES):
            g = gap(s, get3(t, POINT_R, e), get3(t, POINT_V, e))
            p = law(s, s.stiffness, g.own, g.slip)
            put3(f, 0, e, scale(weight[e], acts(s, g.own, p)))
            put_matrix(ka, 0, e, 0.0, NOTHING, NOTHING, NOTHING, NOTHING)
            put_matrix(kb, 0, e, 0.0, NOTHING, NOTHING, NOTHING, NOTHING)
            plus_half(ka, kb, e, s, g, g.own, p, g.turn, (c1, weight[e], t[POINT_FLOW, e]))
            if s.kind != FLOOR:
                plus_turning(ka, e, s, g, g.own, p, g.turn, weight[e])
