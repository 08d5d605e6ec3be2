"""Contact law: force from gap, normal and closing speed (Hunt-Crossley), Westin (2018) (93).

f = k delta^1.5 max(0, 1 + D ddelta/dt) n: smooth where contact opens and closes, and never attractive.
The stiffness follows from a penetration limit, not from Table 9 (trap T3: 60 mm). Geometry is in surface.py.
"""

from __future__ import annotations

from math import sqrt

from .drag import POINT_R, POINT_V, smooth
from .jit import LANES, driver, inline
from .quantity import Block, quantity
from .surface import (
    AXIS,
    CENTRE,
    DAMPING,
    FADE_HIGH,
    FADE_LOW,
    LATERAL,
    RADIUS,
    SECOND_FLANK,
    SLOPE_COS,
    SLOPE_SIN,
    SPEED,
    SPIN,
    STIFFNESS,
    flank,
    place,
)
from .vec import add, axpy, cross, dot, get3, put3, put_matrix, scale, sub

END_LOAD = 3.0   # line load at the ends of the arc over T/R: there bending adds a concentrated reaction

LOADED = 1e-3   # N/m, line load above which a station counts as loaded


class Contact(Block):
    penetration_limit: float = quantity(
        0.1, "1", 1e-4, 0.5, "largest penetration at working tension, as a fraction of the cable diameter; "
        "it sets the stiffness", "trap T3: Westin's Table 9 stiffness lets the cable sink 60 mm")
    working_tension: float = quantity(
        4000.0, "N", 1e-3, 1e7, "tension at which the penetration limit holds", "highest static tension expected")
    damping: float = quantity(0.3, "s/m", 0.0, 100.0, "Hunt-Crossley damping D", "Westin (93)")


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
    """Both flanks of surface row s on a point at r with velocity v.

    Returns geometry (er, t, rho, h), relative velocity, normals n1 n2, presses (f, df/ddelta, df/dclosing) of each with
    the fade of the groove top in them, and f0 dfade/dh of each.
    """
    c = (s[CENTRE], s[CENTRE + 1], s[CENTRE + 2])
    ey = (s[AXIS], s[AXIS + 1], s[AXIS + 2])
    rel = sub(r, c)
    y, er, t, rho, h = place(rel, ey, s[RADIUS])
    vr = sub(sub(v, (s[SPEED], s[SPEED + 1], s[SPEED + 2])), cross((s[SPIN], s[SPIN + 1], s[SPIN + 2]), rel))
    d1, n1 = flank(1.0, y, h, er, ey, s[SLOPE_SIN], s[SLOPE_COS])
    d2, n2 = flank(-1.0, y, h, er, ey, s[SLOPE_SIN], s[SLOPE_COS])
    f1, k1, c1 = press(d1, -dot(n1, vr), s[STIFFNESS], s[DAMPING])
    f2, k2, c2 = press(d2, -dot(n2, vr), s[STIFFNESS], s[DAMPING])
    step, dstep = smooth(h, s[FADE_LOW], s[FADE_HIGH])
    side, dside = smooth(abs(y), 0.5 * s[LATERAL], s[LATERAL])   # beyond the width of the groove there is no flank
    inside = 1.0 - side
    w1, w2 = (1.0 - step) * inside, (1.0 - step) * inside * s[SECOND_FLANK]
    g1, g2 = -f1 * dstep * inside, -f2 * dstep * inside * s[SECOND_FLANK]
    dside = -(1.0 - step) * dside * (1.0 if y > 0.0 else -1.0)
    return (er, t, rho, h, d1, d2, vr, n1, n2, w1 * f1, w1 * k1, w1 * c1, g1, w2 * f2, w2 * k2, w2 * c2, g2,
            f1 * dside, f2 * dside * s[SECOND_FLANK])


@driver
def contact_point_lanes(x, n, t):
    """Position and velocity of one point a lane: rows R and V of t; n: N_i [4]."""
    if x.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    n0, n1, n2, n3 = n[0], n[1], n[2], n[3]
    for e in range(LANES):
        put3(t, POINT_R, e, axpy(n0, get3(x, 0, e), axpy(n1, get3(x, 3, e), axpy(
            n2, get3(x, 6, e), scale(n3, get3(x, 9, e))))))
        put3(t, POINT_V, e, axpy(n0, get3(x, 12, e), axpy(n1, get3(x, 15, e), axpy(
            n2, get3(x, 18, e), scale(n3, get3(x, 21, e))))))


@driver
def contact_lanes(t, s, weight, f):
    """f[3, LANES] = weight * contact load of surface row s at the point of each lane (rows R and V of t)."""
    if t.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        o = touch(get3(t, POINT_R, e), get3(t, POINT_V, e), s)
        put3(f, 0, e, scale(weight[e], axpy(o[9], o[7], scale(o[13], o[8]))))


@inline
def flank_row(n, f, k, c, g, er, l, ey, t, vr, slip, spin, c1):
    """Row vector p of the tangent n p^T of one flank; g, l: derivatives of the fades along e_r and e_y."""
    p = scale(-k - c1 * c, n)
    p = axpy(c, axpy(-slip * dot(t, vr), t, cross(n, spin)), p)
    return axpy(g, er, axpy(l, ey, p))


@driver
def contact_tangent_lanes(t, s, c1, weight, f, ka):
    """contact_lanes with ka[9, LANES], its derivative to position, with c1 for the velocity part."""
    if t.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES or ka.shape[1] != LANES:
        raise ValueError("lanes")
    spin, ey = (s[SPIN], s[SPIN + 1], s[SPIN + 2]), (s[AXIS], s[AXIS + 1], s[AXIS + 2])
    for e in range(LANES):
        er, q, rho, _, _, _, vr, n1, n2, f1, k1, x1, g1, f2, k2, x2, g2, l1, l2 = touch(
            get3(t, POINT_R, e), get3(t, POINT_V, e), s)
        slip = s[SLOPE_SIN] / rho
        p1 = flank_row(n1, f1, k1, x1, g1, er, l1, ey, q, vr, slip, spin, c1)
        p2 = flank_row(n2, f2, k2, x2, g2, er, l2, ey, q, vr, slip, spin, c1)
        # n1 = m + l, n2 = m - l: two outer products carry both flanks, a third the turning of the normal
        m, l = scale(0.5, add(n1, n2)), scale(0.5, sub(n1, n2))
        w = weight[e]
        put3(f, 0, e, scale(w, axpy(f1, n1, scale(f2, n2))))
        put_matrix(ka, 0, e, 0.0, m, scale(w, add(p1, p2)), l, scale(w, sub(p1, p2)))
        z = w * (f1 + f2) * slip
        a = scale(z, q)
        ka[0, e] += q[0] * a[0]
        ka[1, e] += q[0] * a[1]
        ka[2, e] += q[0] * a[2]
        ka[3, e] += q[1] * a[0]
        ka[4, e] += q[1] * a[1]
        ka[5, e] += q[1] * a[2]
        ka[6, e] += q[2] * a[0]
        ka[7, e] += q[2] * a[1]
        ka[8, e] += q[2] * a[2]
