"""The ANCF cable element: inertia, weight, decoupled axial strain, bending, objective Kelvin-Voigt damping.

Sources: Westin (2018) 3.2 with the corrections of docs/theory.md, section 6; decoupled strain after Yue et al.,
(42)-(47). Residual R = M a + Q_l + Q_t + Q_d - Q_g, tangent c2 M + c1 C + K, all terms differentiated by hand.

Every elastic term depends on y only through h = r2 - r1, A = L g1, B = L g2: nine unknowns, not twelve.
With G(xi) = L r_p = N2' h + N1' A + N3' B:

* l = int |G| dxi, a = |A|/L, b = |B|/L, s = l/L, lambda = a N1' + s N2' + b N3', W = (EA L/2) int (lambda - 1)^2 dxi:
  T = EA times the elongation per length, where (42)-(47) have Green's strain (1.5 strains stiffer: 0.4 % at 10 km)
* where lambda < 1 EA counts with the share cable.compression_share (1: a rod; small: it folds and does not push), and
  but for that share axial damping is no larger than the elastic tension (trap T9)
* axial damping force c_a ds/dt along dl/dy
* bending energy E = (EI/2L^3) y^T B0 y (the 1/2 is missing in (48))
* bending damping tau dE/dt / (2 E + 2 E0) dE/dy, tau = c_b/EI: the rate of the *energy* is free of rigid rotation,
  while tau B0 dy/dt (and (55), trap T1) is not once the element is curved. E0 belongs to a curvature of 1e-3 1/m.
"""

import numpy as np

from ..compiler.jit import LANES, driver, inline
from .hermite import GAUSS_4_W, GAUSS_4_X, MASS, WEIGHT
from .vec import add, axpy, dot, get3, norm, plus3, put3, scale, sub

# rows of the element table P
(LENGTH, PER_LENGTH, MASS_PER_LENGTH, EA, EI, AXIAL_DAMPING, BENDING_TIME, WEIGHT_PER_LENGTH,
 HALF_RHO_D, RE_FACTOR, ADDED_MASS, BUOYANCY, EXTRA_DRAG, CD_FIXED) = range(14)
FN = 14          # 5 rows: cos 0, cos 1, sin 1, cos 2, sin 2
FT = 19          # 11 rows: cos 0..5, sin 1..5
COMPRESSION = 30
# rates of the mesh through the material over the length of the element, at its two ends, s'/L and s''/L, see
# mesh_convection.py
FLOW_0, FLOW_1, FLOW_RATE_0, FLOW_RATE_1 = range(31, 35)
# of links, see link_element.py: buoyancy that is taken off along them [N/m]; 1 where their drag has the closed forms
AXIAL_LIFT, CLOSED_DRAG = 35, 36
DISPLACED = 37  # kg/m of water that it displaces
# fit of C_N(Re) (drag_laws.py), C_T of its own: a constant, and the share of that of the Reynolds number along
CN_FIT, CT_FIXED, CT_OF_RE = range(38, 41)
EXTRA_ALONG = 41  # EXTRA_DRAG is the drag factor less 1 of the part across the cable, this that of the part along it
EXTRA_NOW = 42  # EXTRA_DRAG and what strumming adds to it: as the lengths and FLOW written anew at each gather
IDLE = 43  # column 0: how many lanes at the end hold no element of their own, in whole vectors of 8; see used()
ROWS = 44

# rows of the 9x9 tangent's blocks; numpy integers, for a literal compiles a version of its own
ROW_HH, ROW_HA, ROW_HB, ROW_AH, ROW_AA, ROW_AB, ROW_BH, ROW_BA, ROW_BB = np.arange(0, 81, 9)
ROW_FORCE, K9_ROWS = np.int64(81), 93

CURVATURE_FLOOR = 1e-3   # 1/m
GRAM_AA, GRAM_AB, GRAM_AS, GRAM_SS = 2.0 / 15.0, -1.0 / 30.0, -0.1, 0.2   # int N_i' N_j', N2' less the mean stretch
ZERO = (0.0, 0.0, 0.0)
S0, S1, S2, S3 = GAUSS_4_X
V0, V1, V2, V3 = GAUSS_4_W
H0, H1, H2, H3 = (6.0 * x * (1.0 - x) for x in GAUSS_4_X)   # factors of h, A, B in G at the Gauss points
A0, A1, A2, A3 = (1.0 - 4.0 * x + 3.0 * x * x for x in GAUSS_4_X)
B0, B1, B2, B3 = (x * (3.0 * x - 2.0) for x in GAUSS_4_X)


@inline
def arc_point(x, w, h, a, b, acc):
    """One Gauss point of l and its gradient (h, A, B)."""
    l, dh, da, db = acc
    ph, pa, pb = 6.0 * x * (1.0 - x), 1.0 - 4.0 * x + 3.0 * x * x, x * (3.0 * x - 2.0)
    g = axpy(ph, h, axpy(pa, a, scale(pb, b)))
    s = norm(g)
    u = scale(w * (1.0 / s), g)   # 1/s serves hess_point too
    return l + w * s, axpy(ph, u, dh), axpy(pa, u, da), axpy(pb, u, db)


@inline
def arc(h, a, b):
    """Arc length l and dl/d(h, A, B)."""
    acc = (0.0, ZERO, ZERO, ZERO)
    acc = arc_point(S0, V0, h, a, b, acc)
    acc = arc_point(S1, V1, h, a, b, acc)
    acc = arc_point(S2, V2, h, a, b, acc)
    return arc_point(S3, V3, h, a, b, acc)


@inline
def hess_point(x, w, h, a, b):
    """(w/|G|) (I - u u^T) at one Gauss point: six numbers of a symmetric 3x3."""
    ph, pa, pb = 6.0 * x * (1.0 - x), 1.0 - 4.0 * x + 3.0 * x * x, x * (3.0 * x - 2.0)
    g = axpy(ph, h, axpy(pa, a, scale(pb, b)))
    r = 1.0 / norm(g)
    u = scale(r, g)
    k = w * r
    return (k - k * u[0] * u[0], -k * u[0] * u[1], -k * u[0] * u[2], k - k * u[1] * u[1], -k * u[1] * u[2],
            k - k * u[2] * u[2])


@inline
def sym_sum(s, m, t, n, u, o, v, p):
    """s m + t n + u o + v p of four symmetric 3x3."""
    return (s * m[0] + t * n[0] + u * o[0] + v * p[0], s * m[1] + t * n[1] + u * o[1] + v * p[1],
            s * m[2] + t * n[2] + u * o[2] + v * p[2], s * m[3] + t * n[3] + u * o[3] + v * p[3],
            s * m[4] + t * n[4] + u * o[4] + v * p[4], s * m[5] + t * n[5] + u * o[5] + v * p[5])


@inline
def sym_dot(m, v):
    return (m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[1] * v[0] + m[3] * v[1] + m[4] * v[2],
            m[2] * v[0] + m[4] * v[1] + m[5] * v[2])


@inline
def arc_hessian(h, a, b):
    """d2l/dy2: six symmetric 3x3 blocks hh hA hB AA AB BB; block by block, so that few numbers are alive at a time."""
    m, n = hess_point(S0, V0, h, a, b), hess_point(S1, V1, h, a, b)
    o, p = hess_point(S2, V2, h, a, b), hess_point(S3, V3, h, a, b)
    return (sym_sum(H0 * H0, m, H1 * H1, n, H2 * H2, o, H3 * H3, p),
            sym_sum(H0 * A0, m, H1 * A1, n, H2 * A2, o, H3 * A3, p),
            sym_sum(H0 * B0, m, H1 * B1, n, H2 * B2, o, H3 * B3, p),
            sym_sum(A0 * A0, m, A1 * A1, n, A2 * A2, o, A3 * A3, p),
            sym_sum(A0 * B0, m, A1 * B1, n, A2 * B2, o, A3 * B3, p),
            sym_sum(B0 * B0, m, B1 * B1, n, B2 * B2, o, B3 * B3, p))


@inline
def fold_point(x, w, a, s, b, acc):
    """One Gauss point of int <lambda - 1>^2/2 over what is shorter than unstretched: value, gradient, Hessian."""
    ps, pa, pb = 6.0 * x * (1.0 - x), 1.0 - 4.0 * x + 3.0 * x * x, x * (3.0 * x - 2.0)
    n = min(pa * (a - 1.0) + ps * (s - 1.0) + pb * (b - 1.0), 0.0)
    m = w if n < 0.0 else 0.0
    u, ga, gs, gb, aa, ab, sa, bb, sb, ss = acc
    f = w * n
    return (u + 0.5 * f * n, ga + pa * f, gs + ps * f, gb + pb * f, aa + m * pa * pa, ab + m * pa * pb,
            sa + m * ps * pa, bb + m * pb * pb, sb + m * ps * pb, ss + m * ps * ps)


@inline
def stretch(a, s, b, compression):
    """Axial energy over EA L, its gradient (a, s, b) and Hessian (aa, ab, sa, bb, sb, ss).

    (s-1)^2/2 + int (lambda-s)^2/2 is exact without quadrature; what of it belongs to lambda < 1 counts with the share
    ``compression``, so that with a small one an element never pushes: T = int N2' EA <lambda-1>, N2' > 0.
    """
    da, ds, db = a - s, s - 1.0, b - s
    wa, wb = GRAM_AA * da + GRAM_AB * db, GRAM_AB * da + GRAM_AA * db
    acc = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    acc = fold_point(S0, V0, a, s, b, acc)
    acc = fold_point(S1, V1, a, s, b, acc)
    acc = fold_point(S2, V2, a, s, b, acc)
    u, ga, gs, gb, aa, ab, sa, bb, sb, ss = fold_point(S3, V3, a, s, b, acc)
    c = compression - 1.0
    return (0.5 * (ds * ds + wa * da + wb * db) + c * u, wa + c * ga, ds - wa - wb + c * gs, wb + c * gb,
            GRAM_AA + c * aa, GRAM_AB + c * ab, GRAM_AS + c * sa, GRAM_AA + c * bb, GRAM_AS + c * sb,
            1.0 + GRAM_SS + c * ss)


@inline
def damping(viscous, tension, compression):
    """Axial damping force [N] of a Kelvin-Voigt force ``viscous`` beside an elastic ``tension`` [N].

    What is not a rod's (share ``compression``) is cut off at the tension: a cable neither pushes nor drags when slack.
    Returns the force and its derivatives for viscous and tension.
    """
    maximum = max(tension, 0.0)
    free = 1.0 - compression
    cut = 1.0 if abs(viscous) > maximum else 0.0
    side = 1.0 if viscous > 0.0 else -1.0
    return (viscous + free * cut * (side * maximum - viscous), 1.0 - free * cut,
            free * cut * side * (1.0 if tension > 0.0 else 0.0))


@inline
def bend(k, h, a, b):
    """k B0 (h, A, B), k = EI/L^3."""
    return (scale(k, axpy(12.0, h, axpy(-6.0, a, scale(-6.0, b)))),
            scale(k, axpy(-6.0, h, axpy(4.0, a, scale(2.0, b)))),
            scale(k, axpy(-6.0, h, axpy(2.0, a, scale(4.0, b)))))


@inline
def elastic(length, per_length, ea, ei, ca, tau, compression, h, a, b, vh, va, vb):
    """Forces on (h, A, B) of one element.

    Returns fh, fa, fb [N], tension [N], strain energy [J], power lost in the material [W].
    """
    l, dh, da, db = arc(h, a, b)
    ra, rb = norm(a), norm(b)
    u, wa, ws, wb = stretch(ra * per_length, l * per_length, rb * per_length, compression)[:4]
    rate = (dot(dh, vh) + dot(da, va) + dot(db, vb)) * per_length
    damped = damping(ca * rate, ea * ws, compression)[0]
    tension = ea * ws + damped
    k = ei * per_length * per_length * per_length
    qh, qa, qb = bend(k, h, a, b)
    energy = 0.5 * (dot(qh, h) + dot(qa, a) + dot(qb, b))
    floor = 0.5 * ei * length * CURVATURE_FLOOR * CURVATURE_FLOOR + 1e-300
    power = dot(qh, vh) + dot(qa, va) + dot(qb, vb)
    c = 1.0 + 0.5 * tau * power / (energy + floor)
    fh = axpy(tension, dh, scale(c, qh))
    fa = axpy(ea * wa / ra, a, axpy(tension, da, scale(c, qa)))
    fb = axpy(ea * wb / rb, b, axpy(tension, db, scale(c, qb)))
    return fh, fa, fb, tension, ea * length * u + energy, damped * rate * length + (c - 1.0) * power


@inline
def store(k9, row, e, d, s, t, x, p, y, q, z, r):
    """k9[row:row+9, e] = d I + t S + x p^T + y q^T + z r^T, S symmetric."""
    k9[row, e] = d + t * s[0] + x[0] * p[0] + y[0] * q[0] + z[0] * r[0]
    k9[row + 1, e] = t * s[1] + x[0] * p[1] + y[0] * q[1] + z[0] * r[1]
    k9[row + 2, e] = t * s[2] + x[0] * p[2] + y[0] * q[2] + z[0] * r[2]
    k9[row + 3, e] = t * s[1] + x[1] * p[0] + y[1] * q[0] + z[1] * r[0]
    k9[row + 4, e] = d + t * s[3] + x[1] * p[1] + y[1] * q[1] + z[1] * r[1]
    k9[row + 5, e] = t * s[4] + x[1] * p[2] + y[1] * q[2] + z[1] * r[2]
    k9[row + 6, e] = t * s[2] + x[2] * p[0] + y[2] * q[0] + z[2] * r[0]
    k9[row + 7, e] = t * s[4] + x[2] * p[1] + y[2] * q[1] + z[2] * r[1]
    k9[row + 8, e] = d + t * s[5] + x[2] * p[2] + y[2] * q[2] + z[2] * r[2]


@inline
def turned(p, h, a, b):
    """B^T (h, a, b), B the derivative of the flow's part of the rates of (r_2 - r_1, L g_1, L g_2) to these."""
    s, t = p
    return (
        axpy(-6.0 * s, a, scale(6.0 * t, b)),
        axpy(s, h, axpy(4.0 * s, a, scale(-2.0 * t, b))),
        axpy(-t, h, axpy(2.0 * s, a, scale(-4.0 * t, b))),
    )


@inline
def elastic_tangent(k9, e, c1, flow, length, per_length, ea, ei, ca, tau, compression, h, a, b, vh, va, vb):
    """elastic() with its 9x9 tangent into k9[81, e], blocks in the order hh hA hB Ah AA AB Bh BA BB.

    c1, flow: how the material's rates vh, va, vb change with h, a, b, see turned().
    """
    l, dh, da, db = arc(h, a, b)
    hh, ha, hb, aa, ab, bb = arc_hessian(h, a, b)
    ra, rb = 1.0 / norm(a), 1.0 / norm(b)
    ua, ub = scale(ra, a), scale(rb, b)
    u, wa, ws, wb, waa, wab, wsa, wbb, wsb, wss = stretch(per_length / ra, l * per_length, per_length / rb, compression)
    rate = (dot(dh, vh) + dot(da, va) + dot(db, vb)) * per_length
    damped, by_rate, by_tension = damping(ca * rate, ea * ws, compression)
    tension = ea * ws + damped
    q = ea * per_length
    d = by_rate * ca * per_length
    # z: what multiplies dl in the first factor of the outer products; H v is the rate of dl
    t = q * (1.0 + by_tension)
    p = t * wss + d * c1
    zh = axpy(p, dh, scale(d, add(sym_dot(hh, vh), add(sym_dot(ha, va), sym_dot(hb, vb)))))
    za = axpy(p, da, scale(d, add(sym_dot(ha, vh), add(sym_dot(aa, va), sym_dot(ab, vb)))))
    zb = axpy(p, db, scale(d, add(sym_dot(hb, vh), add(sym_dot(ab, va), sym_dot(bb, vb)))))
    xh, xa, xb = turned(flow, dh, da, db)
    zh, za, zb = axpy(d, xh, zh), axpy(d, xa, za), axpy(d, xb, zb)
    za = axpy(t * wsa, ua, za)
    zb = axpy(t * wsb, ub, zb)
    # rows of A and B: derivative of p_a u_a and p_b u_b
    pa, pb = ea * wa * ra, ea * wb * rb
    ah, ab_, aa_ = scale(q * wsa, dh), axpy(q * wsa, db, scale(q * wab, ub)), axpy(
        q * wsa, da, scale(q * waa - pa, ua))
    bh, ba_, bb_ = scale(q * wsb, dh), axpy(q * wsb, da, scale(q * wab, ua)), axpy(
        q * wsb, db, scale(q * wbb - pb, ub))
    # bending with the damping of its energy rate
    k = ei * per_length * per_length * per_length
    fh, fa, fb = bend(k, h, a, b)
    gh, ga, gb = bend(k, vh, va, vb)
    xh, xa, xb = turned(flow, fh, fa, fb)
    gh, ga, gb = add(gh, xh), add(ga, xa), add(gb, xb)
    bent = 0.5 * (dot(fh, h) + dot(fa, a) + dot(fb, b))
    energy = bent + 0.5 * ei * length * CURVATURE_FLOOR * CURVATURE_FLOOR + 1e-300
    power = dot(fh, vh) + dot(fa, va) + dot(fb, vb)
    per_energy = 1.0 / energy
    t = 0.5 * tau * per_energy
    c = 1.0 + t * power
    force = (axpy(tension, dh, scale(c, fh)), axpy(ea * wa, ua, axpy(tension, da, scale(c, fa))),
             axpy(ea * wb, ub, axpy(tension, db, scale(c, fb))))
    lost = damped * rate * length + (c - 1.0) * power
    c *= k
    p = c1 - power * per_energy
    gh, ga, gb = scale(t, axpy(p, fh, gh)), scale(t, axpy(p, fa, ga)), scale(t, axpy(p, fb, gb))
    store(k9, ROW_HH, e, 12.0 * c, hh, tension, dh, zh, fh, gh, ZERO, ZERO)
    store(k9, ROW_HA, e, -6.0 * c, ha, tension, dh, za, fh, ga, ZERO, ZERO)
    store(k9, ROW_HB, e, -6.0 * c, hb, tension, dh, zb, fh, gb, ZERO, ZERO)
    store(k9, ROW_AH, e, -6.0 * c, ha, tension, da, zh, fa, gh, ua, ah)
    store(k9, ROW_AA, e, 4.0 * c + pa, aa, tension, da, za, fa, ga, ua, aa_)
    store(k9, ROW_AB, e, 2.0 * c, ab, tension, da, zb, fa, gb, ua, ab_)
    store(k9, ROW_BH, e, -6.0 * c, hb, tension, db, zh, fb, gh, ub, bh)
    store(k9, ROW_BA, e, 2.0 * c, ab, tension, db, za, fb, ga, ub, ba_)
    store(k9, ROW_BB, e, 4.0 * c + pb, bb, tension, db, zb, fb, gb, ub, bb_)
    return force[0], force[1], force[2], tension, ea * length * u + bent, lost


@inline
def used(p):
    """How many lanes of a group the costly kernels work on; what is in the others is of no element."""
    return LANES - int(p[IDLE, 0])


@inline
def inertia_row(i, t, w, sigma, x, e):
    """Force i of inertia and weight: t mass of the element [kg], w its weight [N]."""
    m0, m1, m2, m3 = t * MASS[i, 0], t * MASS[i, 1], t * MASS[i, 2], t * MASS[i, 3]
    f = axpy(m0, get3(x, 24, e), axpy(m1, get3(x, 27, e), axpy(m2, get3(x, 30, e), scale(m3, get3(x, 33, e)))))
    m0, m1, m2, m3 = sigma * m0, sigma * m1, sigma * m2, sigma * m3
    f = axpy(m0, get3(x, 12, e), axpy(m1, get3(x, 15, e), axpy(m2, get3(x, 18, e), axpy(m3, get3(x, 21, e), f))))
    return (f[0], f[1], f[2] + w * WEIGHT[i])


@driver
def inertia_lanes(x, p, f, sigma):
    """Inertia and weight: sets f[12, LANES]. sigma: mass damping [1/s]."""
    if x.shape[1] != LANES or p.shape[1] != LANES or f.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        t, w = p[MASS_PER_LENGTH, e] * p[LENGTH, e], p[WEIGHT_PER_LENGTH, e] * p[LENGTH, e]
        put3(f, 0, e, inertia_row(0, t, w, sigma, x, e))
        put3(f, 3, e, inertia_row(1, t, w, sigma, x, e))
        put3(f, 6, e, inertia_row(2, t, w, sigma, x, e))
        put3(f, 9, e, inertia_row(3, t, w, sigma, x, e))


@driver
def inertia_tangent_lanes(p, c, k):
    """Derivative of inertia_lanes added to k[144, LANES]; c = c2 + sigma c1 [1/s^2]."""
    if p.shape[1] != LANES or k.shape[1] != LANES:
        raise ValueError("lanes")
    for i in range(4):
        row = 36 * i
        m0, m1, m2, m3 = c * MASS[i, 0], c * MASS[i, 1], c * MASS[i, 2], c * MASS[i, 3]
        for e in range(LANES):   # twelve rows in one body: with three the loop is unrolled and not vectorised
            t = p[MASS_PER_LENGTH, e] * p[LENGTH, e]
            k[row, e] += m0 * t
            k[row + 4, e] += m0 * t
            k[row + 8, e] += m0 * t
            k[row + 9, e] += m1 * t
            k[row + 13, e] += m1 * t
            k[row + 17, e] += m1 * t
            k[row + 18, e] += m2 * t
            k[row + 22, e] += m2 * t
            k[row + 26, e] += m2 * t
            k[row + 27, e] += m3 * t
            k[row + 31, e] += m3 * t
            k[row + 35, e] += m3 * t


@driver
def elastic_lanes(x, p, f, tension, energy, lost):
    """Axial and bending forces added to f[12, LANES]; tension [N], strain energy [J], power lost [W] of each lane."""
    if x.shape[1] != LANES or p.shape[1] != LANES or f.shape[1] != LANES or (
            tension.shape[0] != LANES or energy.shape[0] != LANES or lost.shape[0] != LANES):
        raise ValueError("lanes")
    width = used(p)
    for e in range(width):
        fh, fa, fb, t, u, w = elastic(
            p[LENGTH, e], p[PER_LENGTH, e], p[EA, e], p[EI, e], p[AXIAL_DAMPING, e], p[BENDING_TIME, e],
            p[COMPRESSION, e], sub(get3(x, 6, e), get3(x, 0, e)), get3(x, 3, e), get3(x, 9, e),
            sub(get3(x, 18, e), get3(x, 12, e)), get3(x, 15, e), get3(x, 21, e))
        plus3(f, 0, e, scale(-1.0, fh))
        plus3(f, 3, e, fa)
        plus3(f, 6, e, fh)
        plus3(f, 9, e, fb)
        tension[e] = t
        energy[e] = u
        lost[e] = w


@driver
def elastic_tangent_lanes(x, p, c1, f, tension, energy, lost, k9, k):
    """elastic_lanes with its tangent: sets k[144, LANES]; k9[K9_ROWS, LANES] is work space."""
    if x.shape[1] != LANES or p.shape[1] != LANES or f.shape[1] != LANES or k9.shape[1] != LANES or (
            k.shape[1] != LANES or tension.shape[0] != LANES or energy.shape[0] != LANES or lost.shape[0] != LANES):
        raise ValueError("lanes")
    width = used(p)
    for e in range(width):
        fh, fa, fb, t, u, w = elastic_tangent(
            k9, e, c1, (p[FLOW_0, e], p[FLOW_1, e]), p[LENGTH, e], p[PER_LENGTH, e], p[EA, e], p[EI, e],
            p[AXIAL_DAMPING, e], p[BENDING_TIME, e],
            p[COMPRESSION, e], sub(get3(x, 6, e), get3(x, 0, e)), get3(x, 3, e), get3(x, 9, e),
            sub(get3(x, 18, e), get3(x, 12, e)), get3(x, 15, e), get3(x, 21, e))
        put3(k9, ROW_FORCE, e, fh)
        put3(k9, ROW_FORCE + 3, e, fa)
        put3(k9, ROW_FORCE + 6, e, fb)
        k9[ROW_FORCE + 9, e] = t
        k9[ROW_FORCE + 10, e] = u
        k9[ROW_FORCE + 11, e] = w
    for c in range(3):   # one array written above: with more, the overlap tests outgrow the vectoriser's limit
        for e in range(width):
            f[c, e] -= k9[ROW_FORCE + c, e]
            f[3 + c, e] += k9[ROW_FORCE + 3 + c, e]
            f[6 + c, e] += k9[ROW_FORCE + c, e]
            f[9 + c, e] += k9[ROW_FORCE + 6 + c, e]
    for e in range(width):
        tension[e] = k9[ROW_FORCE + 9, e]
        energy[e] = k9[ROW_FORCE + 10, e]
        lost[e] = k9[ROW_FORCE + 11, e]
    for c in range(9):   # nine unknowns to twelve: r1 = -h, r2 = +h
        for e in range(LANES):
            hh, ha, hb = k9[c, e], k9[9 + c, e], k9[18 + c, e]
            ah, bh = k9[27 + c, e], k9[54 + c, e]
            k[c, e] = hh
            k[9 + c, e] = -ha
            k[18 + c, e] = -hh
            k[27 + c, e] = -hb
            k[36 + c, e] = -ah
            k[45 + c, e] = k9[36 + c, e]
            k[54 + c, e] = ah
            k[63 + c, e] = k9[45 + c, e]
            k[72 + c, e] = -hh
            k[81 + c, e] = ha
            k[90 + c, e] = hh
            k[99 + c, e] = hb
            k[108 + c, e] = -bh
            k[117 + c, e] = k9[63 + c, e]
            k[126 + c, e] = bh
            k[135 + c, e] = k9[72 + c, e]
