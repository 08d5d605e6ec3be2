"""Hydrodynamic line load of a cable: drag by loading functions, normal added mass, buoyancy.

Sources: Driscoll & Nahon as printed by Westin (2018) (58)-(69), ribbon fairing (145), Choo & Casarella C_D(Re)
(61)-(62). Corrected against the print (docs/theory.md, 5): the drag acts along +V with V = V_f - r_t; (58b) keeps
one sign; G of (64) is the total factor, f = f_D(V_f - r_t) + (G-1) f_D(mean of V_f - r_t): printed for a cable at
rest in a steady stream, taken here with its own mean velocity; the second line of (145) is f_t;
the Froude-Krylov part of (69b) is counted once (a horizontal, steady, sheared current has none).

A law is two trigonometric polynomials in eta = atan(v_n/|v_t|): f_n up to 2 eta, f_t up to 5 eta. The quintic of (60b)
is fitted by the latter to 1e-7 of its unit (test), so that no law needs an arc tangent. f_t below zero counts as zero.
"""

from __future__ import annotations

from enum import Enum
from math import log, sqrt

import numpy as np

from .ancf import ADDED_MASS, BUOYANCY, CD_FIXED, DISPLACED, EXTRA_DRAG, FLOW_0, FLOW_1, FN, FT, HALF_RHO_D, RE_FACTOR
from .jit import LANES, driver, inline
from .vec import axpy, dot, get3, norm, plus3, plus_matrix, put3, put_matrix, scale, sub

SPEED_FLOOR = 1e-3     # m/s, regularises v_n, |v_t| and the sign of v_t
RE_LEAST, RE_BLEND_1, RE_BLEND_2, RE_MOST = 1e-3, (0.8, 1.25), (25.0, 36.0), 1e5
RE_TOP = RE_BLEND_2[1]

# rows of the point table: position, relative velocity, water velocity, acceleration, unit tangent, 1/|dr/dxi|, V_n,
# C_D, dC_D/dRe, is the lane off the top branch of C_D(Re), xi' = -w/L of the material (flow.py), fall of the water's
# velocity (x, y) with height
(POINT_R, POINT_V, POINT_W, POINT_A, POINT_U, POINT_PER_G, POINT_VN, POINT_CD, POINT_DCD, POINT_X,
 POINT_FLOW, POINT_SHEAR) = np.array((0, 3, 6, 9, 12, 15, 16, 17, 18, 19, 20, 21))
POINT_ROWS = 23


class DragLaw(str, Enum):
    """Loading functions of a section."""

    OFF = "off"
    DRISCOLL_NAHON = "driscoll_nahon"                    # 0.011 on sin(2 eta): our default, a judgement
    DRISCOLL_NAHON_PRINTED = "driscoll_nahon_printed"    # 0.11 as printed by Westin (60a); f_n < 0 below 8 deg
    RIBBON = "ribbon"                                    # ribbon fairing, Westin (145)
    CROSSFLOW = "crossflow"                              # f_n = sin^2 eta, f_t = C_t / C_D cos^2 eta
    PODE = "pode"                                        # f_n = sin^2 eta, f_t = C_t / C_D at every angle


# fit of (60b) on [0, pi/2], cos 0..5 and sin 1..5, largest difference 7e-8; checked by a test
_FT_BARE = (-0.154069822042428, 0.32370195471209123, -0.19768199976246204, 0.04699662080294466, 0.0025192226692795916,
            -0.0013760002668004867, 0.024658849723673076, -0.0890678193267043, 0.07196180416171502,
            -0.017956738489678433, 0.0011127654967487688)
_NONE = (0.0,) * 11
# law: f_n (1, cos, sin, cos 2, sin 2), f_t (1, cos .. cos 5, sin .. sin 5)
LOADING: dict[DragLaw, tuple[tuple[float, ...], tuple[float, ...]]] = {
    DragLaw.OFF: ((0.0,) * 5, _NONE),
    DragLaw.DRISCOLL_NAHON: ((0.5, -0.1, 0.1, -0.4, -0.011), _FT_BARE),
    DragLaw.DRISCOLL_NAHON_PRINTED: ((0.5, -0.1, 0.1, -0.4, -0.11), _FT_BARE),
    DragLaw.RIBBON: ((0.498609, -0.2499, 0.2527, -0.2487, 0.0),
                     (-0.2255, 0.3417, 0.0, 0.0, 0.0, 0.0, 0.255, -0.0811, 0.0, 0.0, 0.0)),
    DragLaw.CROSSFLOW: ((0.5, 0.0, 0.0, -0.5, 0.0), _NONE),
    DragLaw.PODE: ((0.5, 0.0, 0.0, -0.5, 0.0), _NONE),
}


@inline
def smooth(x, low, high):
    """Smoothstep from 0 at low to 1 at high and its derivative."""
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / (high - low)


@inline
def choo_casarella(re):
    """C_D(Re) of (61) and dC_D/dRe, blended over Re 0.8-1.25 and 25-36, held outside 1e-3..1e5."""
    if re >= RE_MOST:
        return 1.1 + 4.0 / sqrt(RE_MOST), 0.0
    if re >= RE_TOP:
        return 1.1 + 4.0 / sqrt(re), -2.0 / (re * sqrt(re))
    x = max(re, RE_LEAST)
    mid = 8.55 * x ** -0.9
    cd, dcd = 1.45 + mid, -0.9 * mid / x
    if x > RE_BLEND_2[0]:
        t, dt = smooth(x, RE_BLEND_2[0], RE_BLEND_2[1])
        top, dtop = 1.1 + 4.0 / sqrt(x), -2.0 / (x * sqrt(x))
        return cd + t * (top - cd), dcd + t * (dtop - dcd) + dt * (top - cd)
    if x < RE_BLEND_1[1]:
        s = -0.077215665 + log(8.0 / x)
        g = 8.0 * np.pi / (x * s)
        low = g * (1.0 - 0.87 / (s * s))
        dlow = g / x * (-1.0 + 1.0 / s + 0.87 / (s * s) - 2.61 / (s * s * s))
        t, dt = smooth(x, RE_BLEND_1[0], RE_BLEND_1[1])
        cd, dcd = low + t * (cd - low), dlow + t * (dcd - dlow) + dt * (cd - low)
    return cd, (dcd if re > RE_LEAST else 0.0)


@inline
def loading(c, s, p, e):
    """f_n, df_n/deta, f_t, df_t/deta for cos eta = c, sin eta = s with the coefficients of lane e."""
    c2, s2 = c * c - s * s, 2.0 * s * c
    fn = p[FN, e] + p[FN + 1, e] * c + p[FN + 2, e] * s + p[FN + 3, e] * c2 + p[FN + 4, e] * s2
    dn = p[FN + 2, e] * c - p[FN + 1, e] * s + 2.0 * (p[FN + 4, e] * c2 - p[FN + 3, e] * s2)
    c3, s3 = c2 * c - s2 * s, s2 * c + c2 * s
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    c5, s5 = c4 * c - s4 * s, s4 * c + c4 * s
    ft = (p[FT, e] + p[FT + 1, e] * c + p[FT + 2, e] * c2 + p[FT + 3, e] * c3 + p[FT + 4, e] * c4 + p[FT + 5, e] * c5
          + p[FT + 6, e] * s + p[FT + 7, e] * s2 + p[FT + 8, e] * s3 + p[FT + 9, e] * s4 + p[FT + 10, e] * s5)
    dt = (p[FT + 6, e] * c - p[FT + 1, e] * s + 2.0 * (p[FT + 7, e] * c2 - p[FT + 2, e] * s2)
          + 3.0 * (p[FT + 8, e] * c3 - p[FT + 3, e] * s3) + 4.0 * (p[FT + 9, e] * c4 - p[FT + 4, e] * s4)
          + 5.0 * (p[FT + 10, e] * c5 - p[FT + 5, e] * s5))
    return fn, dn, (ft if ft > 0.0 else 0.0), (dt if ft > 0.0 else 0.0)


@inline
def drag(v, u, vn, half_rho_d, re_factor, cd, dcd, p, e):
    """Drag per length of relative velocity v past unit tangent u, eq (58) with the thrust sign mended; vn regularised.

    Returns alpha, beta, w, vt and the derivatives a1, a2, b1, b2 of
    f = alpha w + beta u,  df/dV = alpha I + w (a1 w + a2 u)^T + u (b1 w + (b2 - alpha) u)^T.
    """
    vt = dot(v, u)
    w = axpy(-vt, u, v)
    at = sqrt(vt * vt + SPEED_FLOOR * SPEED_FLOOR)
    q2 = vn * vn + at * at
    q = sqrt(q2)
    r = 1.0 / (vn * at * q)   # one division for 1/vn, 1/at and 1/q
    per_n, per_t, per_q = r * at * q, r * vn * q, r * vn * at
    fn, dn, ft, dt = loading(at * per_q, vn * per_q, p, e)
    sign = vt * per_t
    k = half_rho_d * cd
    alpha = k * q2 * fn * per_n
    beta = k * q2 * ft * sign
    dk = half_rho_d * dcd * re_factor * q2
    a_vn = (dk * fn + k * (2.0 * vn * fn + dn * at) - alpha) * per_n
    a_at = k * (2.0 * at * fn - dn * vn) * per_n
    b_vn = sign * (dk * ft + k * (2.0 * vn * ft + dt * at))
    b_at = k * sign * (2.0 * at * ft - dt * vn)
    b2 = b_at * sign + k * q2 * ft * SPEED_FLOOR * SPEED_FLOOR * per_t * per_t * per_t
    return alpha, beta, w, vt, a_vn * per_n, a_at * sign, b_vn * per_n, b2


@inline
def flow_at(p, xi, e):
    """xi' of the material [1/s] at xi in the element of lane e; xi = N_2 + N_3 + N_4."""
    return -(p[FLOW_0, e] + (p[FLOW_1, e] - p[FLOW_0, e]) * xi)


@driver
def point_lanes(x, p, n, d, current, t):
    """Kinematics of one point a lane: rows V (relative), W (water), A, U, PER_G, FLOW, SHEAR of t.

    n, d: N_i and N_i' [4, LANES].
    """
    if x.shape[1] != LANES or n.shape[1] != LANES or d.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        n0, n1, n2, n3 = n[0, e], n[1, e], n[2, e], n[3, e]
        z = n0 * x[2, e] + n1 * x[5, e] + n2 * x[8, e] + n3 * x[11, e]
        v = axpy(n0, get3(x, 12, e), axpy(n1, get3(x, 15, e), axpy(n2, get3(x, 18, e), scale(n3, get3(x, 21, e)))))
        a = axpy(n0, get3(x, 24, e), axpy(n1, get3(x, 27, e), axpy(n2, get3(x, 30, e), scale(n3, get3(x, 33, e)))))
        g = axpy(d[0, e], get3(x, 0, e), axpy(d[1, e], get3(x, 3, e), axpy(
            d[2, e], get3(x, 6, e), scale(d[3, e], get3(x, 9, e)))))
        w = (current[0] - current[2] * z, current[1] - current[3] * z, 0.0)
        put3(t, POINT_V, e, sub(w, v))
        put3(t, POINT_W, e, w)
        put3(t, POINT_A, e, a)
        r = 1.0 / norm(g)
        put3(t, POINT_U, e, scale(r, g))
        t[POINT_PER_G, e] = r
        t[POINT_FLOW, e] = flow_at(p, n1 + n2 + n3, e)
        t[POINT_SHEAR, e], t[POINT_SHEAR + 1, e] = current[2], current[3]


@driver
def mean_lanes(m, n, t):
    """Row W of t less the cable's own mean velocity: the mean flow past it; m: that of the unknowns [12, LANES]."""
    if m.shape[1] != LANES or n.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        v = axpy(n[0, e], get3(m, 0, e), axpy(n[1, e], get3(m, 3, e), axpy(
            n[2, e], get3(m, 6, e), scale(n[3, e], get3(m, 9, e)))))
        put3(t, POINT_W, e, sub(get3(t, POINT_W, e), v))


@driver
def coefficient_lanes(p, t, row):
    """V_n, C_D and dC_D/dRe for the velocity in ``row`` (POINT_V or POINT_W) of t; lanes off the top branch singly."""
    if p.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        u, v = get3(t, POINT_U, e), get3(t, row, e)
        w = axpy(-dot(v, u), u, v)
        vn = sqrt(dot(w, w) + SPEED_FLOOR * SPEED_FLOOR)
        re = p[RE_FACTOR, e] * vn
        fixed = p[CD_FIXED, e]
        free = 1.0 if fixed < 0.0 else 0.0
        q = 1.0 / sqrt(re)
        t[POINT_VN, e] = vn
        t[POINT_CD, e] = free * (1.1 + 4.0 * q) + (1.0 - free) * fixed
        t[POINT_DCD, e] = -2.0 * free * q * q * q
        t[POINT_X, e] = 1.0 if fixed < 0.0 and (re < RE_TOP or re > RE_MOST) else 0.0
    for e in range(LANES):
        if t[POINT_X, e] > 0.0:
            t[POINT_CD, e], t[POINT_DCD, e] = choo_casarella(p[RE_FACTOR, e] * t[POINT_VN, e])


@inline
def drag_of(t, row, p, e):
    """drag() of lane e for the velocity in ``row`` of t."""
    return drag(get3(t, row, e), get3(t, POINT_U, e), t[POINT_VN, e], p[HALF_RHO_D, e], p[RE_FACTOR, e], t[POINT_CD, e],
                t[POINT_DCD, e], p, e)


@driver
def load_lanes(t, p, weight, f):
    """f[3, LANES] = weight * line load less the extra rest drag; weight [m] of the point of each lane."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        u, a, m, s = get3(t, POINT_U, e), get3(t, POINT_A, e), p[ADDED_MASS, e], weight[e]
        al, be, w, _, _, _, _, _ = drag_of(t, POINT_V, p, e)
        o = axpy(-m, a, axpy(al, w, scale(be + m * dot(u, a), u)))
        put3(f, 0, e, (s * o[0], s * o[1], s * (o[2] + p[BUOYANCY, e])))


@driver
def load_tangent_lanes(t, p, c1, c2, weight, f, ka, kb):
    """load_lanes with its derivatives: ka (of N_j y_j, with c1, c2 folded in) and kb (of N_j' y_j), [9, LANES]."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or (
            f.shape[1] != LANES or ka.shape[1] != LANES or kb.shape[1] != LANES):
        raise ValueError("lanes")
    for e in range(LANES):
        u, a = get3(t, POINT_U, e), get3(t, POINT_A, e)
        al, be, w, vt, a1, a2, b1, b2 = drag_of(t, POINT_V, p, e)
        m = p[ADDED_MASS, e]
        s = weight[e]
        i0 = m * dot(u, a)
        o = axpy(-m, a, axpy(al, w, scale(be + i0, u)))
        put3(f, 0, e, (s * o[0], s * o[1], s * (o[2] + p[BUOYANCY, e])))
        # d/dV and d/da:  -c1 (df/dV) - c2 m (I - u u^T)
        q = axpy(a1, w, scale(a2, u))
        r = axpy(b1, w, scale(b2 - al, u))
        put_matrix(ka, 0, e, -s * (c1 * al + c2 * m), w, scale(-s * c1, q), u,
                   axpy(-s * c1, r, scale(s * c2 * m, u)))
        # d/dz through the current:  df/dV dV_f/dz into the z column
        c = (-t[POINT_SHEAR, e], -t[POINT_SHEAR + 1, e], 0.0)
        dz = axpy(al, c, axpy(dot(q, c), w, scale(dot(r, c), u)))
        ka[2, e] += s * dz[0]
        ka[5, e] += s * dz[1]
        ka[8, e] += s * dz[2]
        # d/dg
        k = s * t[POINT_PER_G, e]
        i1 = be - al * vt + i0
        put_matrix(kb, 0, e, k * i1, w, scale(k * (a2 - a1 * vt), w), u,
                   axpy(k * (b2 - b1 * vt - al), w, axpy(k * m, a, scale(-k * (i1 + i0), u))))
        # through the flow: V changes with xi' g, a with 2 c1 xi' g
        z = -s * t[POINT_FLOW, e]
        y = 2.0 * c1 * m
        plus_matrix(kb, 0, e, z * (al + y), w, scale(z, q), u, axpy(z, r, scale(-z * y, u)))


@driver
def mean_load_lanes(t, p, weight, f):
    """Add weight * (G-1) f_D of the mean flow (row W of t), the extra drag of amplification, to f[3, LANES]."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        al, be, w, _, _, _, _, _ = drag_of(t, POINT_W, p, e)
        plus3(f, 0, e, scale(weight[e] * p[EXTRA_DRAG, e], axpy(al, w, scale(be, get3(t, POINT_U, e)))))


@driver
def mean_tangent_lanes(t, p, c1, weight, f, ka, kb):
    """mean_load_lanes with its derivatives added to ka and kb; c1: change of the mean velocity with position [1/s]."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or (
            f.shape[1] != LANES or ka.shape[1] != LANES or kb.shape[1] != LANES):
        raise ValueError("lanes")
    for e in range(LANES):
        u = get3(t, POINT_U, e)
        y, z, w, vt, y1, y2, z1, z2 = drag_of(t, POINT_W, p, e)
        s = weight[e] * p[EXTRA_DRAG, e]
        plus3(f, 0, e, scale(s, axpy(y, w, scale(z, u))))
        c = (-t[POINT_SHEAR, e], -t[POINT_SHEAR + 1, e], 0.0)
        q, r = axpy(y1, w, scale(y2, u)), axpy(z1, w, scale(z2 - y, u))
        dz = axpy(y, c, axpy(dot(q, c), w, scale(dot(r, c), u)))
        ka[2, e] += s * dz[0]
        ka[5, e] += s * dz[1]
        ka[8, e] += s * dz[2]
        o = -s * c1
        plus_matrix(ka, 0, e, o * y, w, scale(o, q), u, scale(o, r))
        k = s * t[POINT_PER_G, e]
        i = k * (z - y * vt)
        h = scale(k * (y2 - y1 * vt), w)
        o = axpy(k * (z2 - z1 * vt - y), w, scale(-i, u))
        plus_matrix(kb, 0, e, i, w, h, u, o)


@driver
def amplified(p):
    """Has any lane a drag factor other than 1? Without one the second drag evaluation is left out."""
    for e in range(LANES):
        if p[EXTRA_DRAG, e] != 0.0:
            return True
    return False


@driver
def water_load(t, p, weight, second, f):
    """Line load of one point a lane, f[3, LANES] = weight * f; second: with the extra drag of the mean flow."""
    coefficient_lanes(p, t, POINT_V)
    load_lanes(t, p, weight, f)
    if second:
        coefficient_lanes(p, t, POINT_W)
        mean_load_lanes(t, p, weight, f)


@driver
def water_tangent(t, p, change, weight, second, out):
    """water_load with its derivatives, see load_tangent_lanes; change: state.Change; out: f, ka, kb."""
    f, ka, kb = out
    coefficient_lanes(p, t, POINT_V)
    load_tangent_lanes(t, p, change.velocity, change.acceleration, weight, f, ka, kb)
    if second:
        coefficient_lanes(p, t, POINT_W)
        mean_tangent_lanes(t, p, change.share * change.velocity, weight, f, ka, kb)


@driver
def spread_force(n, f, points, force):
    """force_i -= sum over points of N_i f: n [points, 4], f [points, 3, LANES], force [12, LANES]."""
    y, z = force.reshape(4, 3 * LANES), f.reshape(f.shape[0], 3 * LANES)
    if y.shape[1] != 3 * LANES or z.shape[1] != 3 * LANES:
        raise ValueError("lanes")
    for g in range(points):
        for i in range(4):
            s = n[g, i]
            for r in range(3 * LANES):
                y[i, r] -= s * z[g, r]


@driver
def spread_matrix(n, d, loads, points, mixed, k):
    """k_ij -= sum over points g of N_i (N_j ka[g] + N_j' kb[g]): n, d [points, 4]; loads: ka and kb [points, 9, LANES].

    Column by column of k [144, LANES]; two rows and four points at a time, so that loads do not outnumber products.
    """
    ka, kb = loads
    y, z = k.reshape(16, 9 * LANES), mixed.reshape(mixed.shape[0], 9 * LANES)
    za, zb = ka.reshape(ka.shape[0], 9 * LANES), kb.reshape(kb.shape[0], 9 * LANES)
    if y.shape[1] != 9 * LANES or z.shape[1] != 9 * LANES or za.shape[1] != 9 * LANES or zb.shape[1] != 9 * LANES:
        raise ValueError("lanes")
    for j in range(4):
        for g in range(points):   # one array written a loop, else the overlap tests outgrow the vectoriser's limit
            a, b = n[g, j], d[g, j]
            for r in range(9 * LANES):
                z[g, r] = a * za[g, r] + b * zb[g, r]
        for i in range(j, j + 16, 8):
            row = i // 4
            a0, a1, a2, a3 = n[0, row], n[1, row], n[2, row], n[3, row]
            b0, b1, b2, b3 = n[0, row + 1], n[1, row + 1], n[2, row + 1], n[3, row + 1]
            for r in range(9 * LANES):
                m0, m1, m2, m3 = z[0, r], z[1, r], z[2, r], z[3, r]
                y[i, r] -= a0 * m0 + a1 * m1 + a2 * m2 + a3 * m3
                y[i + 4, r] -= b0 * m0 + b1 * m1 + b2 * m2 + b3 * m3
        for g in range(4, points):
            for i in range(4):
                a = n[g, i]
                for r in range(9 * LANES):
                    y[4 * i + j, r] -= a * z[g, r]


# f_t of the laws with a tangential coefficient, as a polynomial like those above
TANGENTIAL = {DragLaw.CROSSFLOW: (0.5, 0.0, 0.5), DragLaw.PODE: (1.0, 0.0, 0.0)}


def element_rows(section, cable, water, gravity: float) -> dict[int, float]:
    """Hydrodynamic rows of the element table for one section: blocks Section, Cable and Water; gravity [m/s^2]."""
    d, density = cable.diameter, water.density
    area = 0.25 * np.pi * d**2
    rows = {HALF_RHO_D: 0.5 * density * d, RE_FACTOR: density * d / water.viscosity,
            ADDED_MASS: density * area * cable.added_mass_coefficient, BUOYANCY: density * area * gravity,
            DISPLACED: density * area,
            EXTRA_DRAG: section.drag_amplification - 1.0,
            CD_FIXED: -1.0 if section.drag_coefficient is None else section.drag_coefficient}
    normal, polynomial = LOADING[section.drag_law]
    rows.update({FN + i: value for i, value in enumerate(normal)})
    rows.update({FT + i: value for i, value in enumerate(polynomial)})
    tangential = section.tangential_coefficient
    if tangential and section.drag_law in TANGENTIAL:
        rows.update({FT + i: tangential / section.drag_coefficient * value
                     for i, value in enumerate(TANGENTIAL[section.drag_law])})
    return rows
