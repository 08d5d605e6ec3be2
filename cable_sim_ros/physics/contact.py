"""Contact law: force from gap, normal and closing speed (Hunt-Crossley), Westin (2018) (93).

f = k delta^1.5 max(0, 1 + D ddelta/dt) n: smooth where contact opens and closes, and never attractive.
The stiffness follows from a penetration limit, not from Table 9 (trap T3: 60 mm). Geometry is in surface.py.
"""

from __future__ import annotations

from math import sqrt

from .drag import POINT_R, POINT_V
from .jit import LANES, driver, inline
from .quantity import Block, quantity
from .surface import AXIS, CENTRE, DAMPING, RADIUS, SECOND_FLANK, SPEED, SPIN, STIFFNESS, other_half, own_half, place
from .vec import at3, axpy, cross, dot, get3, plus_matrix, put3, put_matrix, scale, sub

END_LOAD = 3.0  # line load at the ends of the arc over T/R: there bending adds a concentrated reaction

LOADED = 1e-3  # N/m, line load above which a station counts as loaded


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
    reseat_time: float = quantity(
        0.02,
        "s",
        0.0,
        10.0,
        "time the cable must press in its groove without a break before a detachment is over; a "
        "rebound within it belongs to the same event",
        "window within which one event shows at most two changes",
    )


def stiffness(tension: float, radius: float, slope_sin: float, flanks: int, penetration: float) -> float:
    """k [N/m^2.5] for which END_LOAD times the line load T/(flanks R sin s) of a flank presses in ``penetration``."""
    return END_LOAD * tension / (flanks * radius * slope_sin) / penetration**1.5


@inline
def press(delta, closing, k, d):
    """Force per length of one flank [N/m] and its derivatives to delta and to the closing speed."""
    p = max(delta, 0.0)
    root = sqrt(p)
    m = 1.0 + d * closing
    m = m if m > 0.0 else 0.0
    f = k * p * root
    return f * m, 1.5 * k * root * m, (f * d if m > 0.0 else 0.0)


@inline
def touch(r, v, s):
    """Both halves of surface row s on a point at r with velocity v.

    Returns geometry (e_r, t, rho, h), penetrations of own and other half, relative velocity, their normals, the press
    (f, df/ddelta, df/dclosing) and curvature of the own half, that press of the other, side, y.
    """
    ey = at3(s, AXIS)
    rel = sub(r, at3(s, CENTRE))
    y, er, t, rho, h = place(rel, ey, s[RADIUS])
    vr = sub(sub(v, at3(s, SPEED)), cross(at3(s, SPIN), rel))
    side = 1.0 if y > 0.0 else -1.0
    d1, n1, bend = own_half(side, y, h, er, ey, s)
    d2, n2 = other_half(side, y, h, er, ey, s)
    f1, k1, c1 = press(d1, -dot(n1, vr), s[STIFFNESS], s[DAMPING])
    f2, k2, c2 = press(d2, -dot(n2, vr), s[STIFFNESS] * s[SECOND_FLANK], s[DAMPING])
    return er, t, rho, h, d1, d2, vr, n1, n2, f1, k1, c1, bend, f2, k2, c2, side, y


@inline
def touch_drum(r, v, s):
    """touch() of a surface without a groove: e_r, t, rho, relative velocity and the press."""
    rel = sub(r, at3(s, CENTRE))
    _, er, t, rho, h = place(rel, at3(s, AXIS), s[RADIUS])
    vr = sub(sub(v, at3(s, SPEED)), cross(at3(s, SPIN), rel))
    return er, t, rho, vr, *press(-h, -dot(er, vr), s[STIFFNESS], s[DAMPING])


@inline
def loads(o):
    """What touch() found as line loads [N/m] of the half at -e_y (it pushes to +e_y in the groove) and that at +e_y."""
    return (o[13], o[9]) if o[16] > 0.0 else (o[9], o[13])


@inline
def latch(pressed, events, now, hold):
    """Detachments as events: left at once, back only after ``hold`` [ns] of pressing without a break; is it off?

    events: count of detachments, 1 while seated, time [ns] since when it presses, -1 while it does not.
    """
    if not pressed:
        events[0] += events[1]
        events[1], events[2] = 0, -1
    elif events[1] == 0:
        if events[2] < 0:
            events[2] = now
        if now - events[2] >= hold:
            events[1] = 1
    return events[1] == 0


@driver
def contact_point_lanes(x, n, t):
    """Position and velocity of one point a lane: rows R and V of t; n: N_i [4]."""
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


@driver
def contact_lanes(t, s, weight, f):
    """f[3, LANES] = weight * contact load of surface row s at the point of each lane (rows R and V of t)."""
    if t.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    if s[SECOND_FLANK] == 0.0:
        for e in range(LANES):
            er, _, _, _, f1, _, _ = touch_drum(get3(t, POINT_R, e), get3(t, POINT_V, e), s)
            put3(f, 0, e, scale(weight[e] * f1, er))
        return
    for e in range(LANES):
        o = touch(get3(t, POINT_R, e), get3(t, POINT_V, e), s)
        put3(f, 0, e, scale(weight[e], axpy(o[9], o[7], scale(o[13], o[8]))))


@inline
def half_row(n, k, c, t, m, slip, bend, vr, spin, c1):
    """Row vector p of the tangent n p^T of one half; slip, bend: turning of n per way along t and m."""
    p = axpy(-slip * dot(t, vr), t, axpy(-bend * dot(m, vr), m, cross(n, spin)))
    return axpy(c, p, scale(-k - c1 * c, n))


@driver
def contact_tangent_lanes(t, s, c1, weight, f, ka):
    """contact_lanes with ka[9, LANES], its derivative to position, with c1 for the velocity part."""
    if t.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES or ka.shape[1] != LANES:
        raise ValueError("lanes")
    spin = at3(s, SPIN)
    if s[SECOND_FLANK] == 0.0:
        for e in range(LANES):
            er, q, rho, vr, f1, k1, x1 = touch_drum(get3(t, POINT_R, e), get3(t, POINT_V, e), s)
            w = weight[e]
            put3(f, 0, e, scale(w * f1, er))
            put_matrix(
                ka,
                0,
                e,
                0.0,
                scale(w, er),
                half_row(er, k1, x1, q, er, 1.0 / rho, 0.0, vr, spin, c1),
                scale(w * f1 / rho, q),
                q,
            )
        return
    for e in range(LANES):
        er, q, rho, _, _, _, vr, n1, n2, f1, k1, x1, bend, f2, k2, x2, _, _ = touch(
            get3(t, POINT_R, e), get3(t, POINT_V, e), s
        )
        slip1, slip2, m, w = dot(n1, er) / rho, dot(n2, er) / rho, cross(n1, q), weight[e]
        p1 = half_row(n1, k1, x1, q, m, slip1, bend, vr, spin, c1)
        p2 = half_row(n2, k2, x2, q, m, slip2, 0.0, vr, spin, c1)
        put3(f, 0, e, scale(w, axpy(f1, n1, scale(f2, n2))))
        put_matrix(ka, 0, e, 0.0, scale(w, n1), p1, scale(w, n2), p2)
        plus_matrix(ka, 0, e, 0.0, scale(w * (f1 * slip1 + f2 * slip2), q), q, scale(w * f1 * bend, m), m)  # n turns
