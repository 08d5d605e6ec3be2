"""Hydrodynamic line load of a cable: drag by the laws of drag_laws.py, normal added mass, buoyancy; lanes kernels.

Sources: Driscoll & Nahon as printed by Westin (2018) (58)-(69). Corrected against the print (docs/theory.md, 5): the
drag acts along +V with V = V_f - r_t; (58b) keeps one sign; G of (64) is the total factor, f = f_D(V_f - r_t) + (G-1)
f_D(mean of V_f - r_t): printed for a cable at rest in a steady stream, taken here with its own mean velocity; the
Froude-Krylov part of (69b) is counted once (a horizontal, steady, sheared current has none).

A tangential drag with a coefficient of its own, C_T |v_t| v_t, is a scalar and its derivative a point, zero for laws
whose f_t is a function of the angle. Such an f_t multiplies C_D(Re_n), which knows the flow across the cable alone: of
a cable that is hauled straight up in still water that is the floor of 1 mm/s, and C_D 2.6. So the C_D of f_t goes over
to that of the whole speed below GRAZING (drag_laws.py); at all larger angles it is C_D(Re_n).
"""

from math import sqrt

import numpy as np

from ..compiler.jit import LANES, driver, inline
from .ancf import (
    ADDED_MASS,
    BUOYANCY,
    CD_FIXED,
    CN_FIT,
    CT_FIXED,
    CT_OF_RE,
    EXTRA_ALONG,
    EXTRA_NOW,
    FLOW_0,
    FLOW_1,
    HALF_RHO_D,
    RE_FACTOR,
    used,
)
from .drag_laws import (
    CHOO_CASARELLA,
    FRICTION,
    GRAZING,
    MAX_RE,
    RE_TOP,
    choo_casarella,
    coefficient_along,
    fitted,
    loading,
)
from .vec import axpy, dot, get3, norm, plus3, plus_matrix, put3, put_matrix, scale, sub

SPEED_FLOOR = 1e-3     # m/s, regularises v_n, |v_t| and the sign of v_t

# rows of the point table: position, relative velocity, water velocity, acceleration, unit tangent, 1/|dr/dxi|, V_n,
# C_D, dC_D/dRe, above 0 for a lane off the top branch of C_D(Re) or of another law, below 0 where water grazes, xi' =
# -w/L of the material (mesh_convection.py), fall of the water's velocity (x, y) with height, tangential drag of its own
# coefficient and its derivative to v_t, C_D of f_t and its derivatives to V_n and |v_t|
(POINT_R, POINT_V, POINT_W, POINT_A, POINT_U, POINT_PER_G, POINT_VN, POINT_CD, POINT_DCD, POINT_X, POINT_FLOW,
 POINT_SHEAR, POINT_ALONG, POINT_DALONG, POINT_CDT) = np.array((0, 3, 6, 9, 12, 15, 16, 17, 18, 19, 20, 21, 23, 24, 25))
POINT_ROWS = 28


@inline
def drag(v, u, vn, half_rho_d, re_factor, cd, dcd, cdt, p, e):
    """Drag per length of relative velocity v past unit tangent u, eq (58) with the thrust sign mended; vn regularised.

    cdt: C_D of f_t and its derivatives to V_n and |v_t|.

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
    kt = half_rho_d * cdt[0]
    beta = kt * q2 * ft * sign
    dk = half_rho_d * dcd * re_factor * q2
    dk_vn, dk_at = half_rho_d * cdt[1] * q2, half_rho_d * cdt[2] * q2
    a_vn = (dk * fn + k * (2.0 * vn * fn + dn * at) - alpha) * per_n
    a_at = k * (2.0 * at * fn - dn * vn) * per_n
    b_vn = sign * (dk_vn * ft + kt * (2.0 * vn * ft + dt * at))
    b_at = sign * (dk_at * ft + kt * (2.0 * at * ft - dt * vn))
    b2 = b_at * sign + kt * q2 * ft * SPEED_FLOOR * SPEED_FLOOR * per_t * per_t * per_t
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
    width = used(p)
    for e in range(width):
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
def grazing_lanes(p, t, row):
    """C_D of f_t where the water goes along the cable in any lane: rows CDT."""
    if p.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    width = used(p)
    for e in range(width):
        vt, vn = dot(get3(t, row, e), get3(t, POINT_U, e)), t[POINT_VN, e]
        at = sqrt(vt * vt + SPEED_FLOOR * SPEED_FLOOR)
        re = min(p[RE_FACTOR, e] * sqrt(vn * vn + at * at), MAX_RE)
        r = 1.0 / sqrt(re)
        free = 1.0 if p[CD_FIXED, e] < 0.0 else 0.0
        c, c_vn, c_at = coefficient_along(
            t[POINT_CD, e], p[RE_FACTOR, e] * t[POINT_DCD, e], 1.1 + 4.0 * r,
            -2.0 * p[RE_FACTOR, e] * r * r * r * (1.0 if re < MAX_RE else 0.0), vn, at, free)
        t[POINT_CDT, e], t[POINT_CDT + 1, e], t[POINT_CDT + 2, e] = c, c_vn, c_at


@driver
def coefficient_lanes(p, t, row):
    """V_n, C_D and dC_D/dRe of Choo-Casarella's top branch for the velocity in ``row``; POINT_X: the other lanes."""
    if p.shape[1] != LANES or t.shape[1] != LANES:
        raise ValueError("lanes")
    width = used(p)
    for e in range(width):
        u, v = get3(t, POINT_U, e), get3(t, row, e)
        w = axpy(-dot(v, u), u, v)
        vn = sqrt(dot(w, w) + SPEED_FLOOR * SPEED_FLOOR)
        re = p[RE_FACTOR, e] * vn
        fixed = p[CD_FIXED, e]
        free = 1.0 if fixed < 0.0 else 0.0
        q = 1.0 / sqrt(re)
        along = dot(v, u)
        grazes = free if vn * vn < GRAZING * GRAZING * (along * along + SPEED_FLOOR * SPEED_FLOOR) else 0.0
        t[POINT_VN, e] = vn
        t[POINT_CD, e] = free * (1.1 + 4.0 * q) + (1.0 - free) * fixed
        t[POINT_DCD, e] = -2.0 * free * q * q * q
        off = 1.0 if fixed < 0.0 and (re < RE_TOP or re > MAX_RE) else 0.0
        other = off + p[CN_FIT, e] + p[CT_FIXED, e] + p[CT_OF_RE, e]
        t[POINT_X, e] = other if other > 0.0 else -grazes
    for e in range(width):   # a loop of its own: with the one above it is not vectorised
        t[POINT_ALONG, e] = 0.0
        t[POINT_DALONG, e] = 0.0
        t[POINT_CDT, e] = t[POINT_CD, e]
        t[POINT_CDT + 1, e] = p[RE_FACTOR, e] * t[POINT_DCD, e]
        t[POINT_CDT + 2, e] = 0.0


@driver
def other_coefficients(p, t, row):
    """C_D off the top branch of Choo-Casarella, of other laws and of f_t; tangential drag of its own coefficient."""
    grazes, others = False, False
    for e in range(LANES):
        grazes |= t[POINT_X, e] < 0.0
        others |= t[POINT_X, e] > 0.0
    if grazes:
        grazing_lanes(p, t, row)
    for e in range(LANES if others else 0):
        if t[POINT_X, e] > 0.0:
            if p[CD_FIXED, e] < 0.0:
                k, vn = p[RE_FACTOR, e], t[POINT_VN, e]
                if p[CN_FIT, e] == CHOO_CASARELLA:
                    vt = dot(get3(t, row, e), get3(t, POINT_U, e))
                    at = sqrt(vt * vt + SPEED_FLOOR * SPEED_FLOOR)
                    cd, dcd = choo_casarella(k * vn)
                    whole, slope = choo_casarella(k * sqrt(vn * vn + at * at))
                    c, c_vn, c_at = coefficient_along(cd, k * dcd, whole, k * slope, vn, at, 1.0)
                else:  # no law with another fit has an f_t
                    cd, dcd = fitted(int(p[CN_FIT, e]), k * vn)
                    c, c_vn, c_at = cd, k * dcd, 0.0
                t[POINT_CD, e], t[POINT_DCD, e] = cd, dcd
                t[POINT_CDT, e], t[POINT_CDT + 1, e], t[POINT_CDT + 2, e] = c, c_vn, c_at
            if p[CT_FIXED, e] + p[CT_OF_RE, e] > 0.0:
                vt = dot(get3(t, row, e), get3(t, POINT_U, e))
                t[POINT_ALONG, e], t[POINT_DALONG, e] = along(vt, p, e)


@driver
def coefficients(p, t, row):
    """Coefficients of every lane for the velocity in ``row`` of t: rows VN, CD, DCD, ALONG, DALONG and CDT."""
    coefficient_lanes(p, t, row)
    other_coefficients(p, t, row)


@inline
def friction(vt, p, e):
    """rho d/2 C_T(Re_T) of its own coefficient, its derivative to |v_t|, and |v_t| regularised."""
    at = sqrt(vt * vt + SPEED_FLOOR * SPEED_FLOOR)
    ct, dct = p[CT_FIXED, e], 0.0
    if p[CT_OF_RE, e] > 0.0:
        own, down = fitted(FRICTION, p[RE_FACTOR, e] * at)
        ct, dct = ct + p[CT_OF_RE, e] * own, p[CT_OF_RE, e] * down * p[RE_FACTOR, e]
    return p[HALF_RHO_D, e] * ct, p[HALF_RHO_D, e] * dct, at


@inline
def along(vt, p, e):
    """Tangential drag per length of its own coefficient, rho d/2 C_T(Re_T) |v_t| v_t, and its derivative to v_t."""
    c, dc, at = friction(vt, p, e)
    return c * at * vt, c * (at + vt * vt / at) + dc * vt * vt


@inline
def drag_of(t, row, p, e):
    """drag() of lane e for the velocity in ``row`` of t, with the tangential drag of its own coefficient."""
    al, be, w, vt, a1, a2, b1, b2 = drag(
        get3(t, row, e), get3(t, POINT_U, e), t[POINT_VN, e], p[HALF_RHO_D, e], p[RE_FACTOR, e], t[POINT_CD, e],
        t[POINT_DCD, e], get3(t, POINT_CDT, e), p, e)
    return al, be + t[POINT_ALONG, e], w, vt, a1, a2, b1, b2 + t[POINT_DALONG, e]


@driver
def load_lanes(t, p, weight, f):
    """f[3, LANES] = weight * line load less the extra rest drag; weight [m] of the point of each lane."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    width = used(p)
    for e in range(width):
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
    width = used(p)
    for e in range(width):
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
    """Add weight * (G-1) f_D of the mean flow (row W of t), the extra drag of amplification, to f[3, LANES]: G - 1 of
    the part across the cable and that of the part along it."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        al, be, w, _, _, _, _, _ = drag_of(t, POINT_W, p, e)
        s, st = weight[e] * p[EXTRA_NOW, e], weight[e] * p[EXTRA_ALONG, e]
        plus3(f, 0, e, axpy(s * al, w, scale(st * be, get3(t, POINT_U, e))))


@driver
def mean_tangent_lanes(t, p, c1, weight, f, ka, kb):
    """mean_load_lanes with its derivatives added to ka and kb; c1: change of the mean velocity with position [1/s]."""
    if t.shape[1] != LANES or p.shape[1] != LANES or weight.shape[0] != LANES or (
            f.shape[1] != LANES or ka.shape[1] != LANES or kb.shape[1] != LANES):
        raise ValueError("lanes")
    for e in range(LANES):
        u = get3(t, POINT_U, e)
        y, z, w, vt, y1, y2, z1, z2 = drag_of(t, POINT_W, p, e)
        s, st = weight[e] * p[EXTRA_NOW, e], weight[e] * p[EXTRA_ALONG, e]
        y, y1, y2, z, z1, z2 = s * y, s * y1, s * y2, st * z, st * z1, st * z2
        plus3(f, 0, e, axpy(y, w, scale(z, u)))
        c = (-t[POINT_SHEAR, e], -t[POINT_SHEAR + 1, e], 0.0)
        q, r = axpy(y1, w, scale(y2, u)), axpy(z1, w, scale(z2 - y, u))
        dz = axpy(y, c, axpy(dot(q, c), w, scale(dot(r, c), u)))
        ka[2, e] += dz[0]
        ka[5, e] += dz[1]
        ka[8, e] += dz[2]
        plus_matrix(ka, 0, e, -c1 * y, w, scale(-c1, q), u, scale(-c1, r))
        k = t[POINT_PER_G, e]
        i = k * (z - y * vt)
        h = scale(k * (y2 - y1 * vt), w)
        o = axpy(k * (z2 - z1 * vt - y), w, scale(-i, u))
        plus_matrix(kb, 0, e, i, w, h, u, o)


@driver
def amplified(p):
    """Has any lane a drag factor other than 1? Without one the second drag evaluation is left out."""
    for e in range(LANES):
        if p[EXTRA_NOW, e] != 0.0 or p[EXTRA_ALONG, e] != 0.0:
            return True
    return False


@driver
def water_load(t, p, weight, second, f):
    """Line load of one point a lane, f[3, LANES] = weight * f; second: with the extra drag of the mean flow."""
    coefficients(p, t, POINT_V)
    load_lanes(t, p, weight, f)
    if second:
        coefficients(p, t, POINT_W)
        mean_load_lanes(t, p, weight, f)


@driver
def water_tangent(t, p, change, weight, second, out):
    """water_load with its derivatives, see load_tangent_lanes; change: state.Change; out: f, ka, kb."""
    f, ka, kb = out
    coefficients(p, t, POINT_V)
    load_tangent_lanes(t, p, change.velocity, change.acceleration, weight, f, ka, kb)
    if second:
        coefficients(p, t, POINT_W)
        mean_tangent_lanes(t, p, change.fraction * change.velocity, weight, f, ka, kb)


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
