"""The link: a straight element between two spherical joints, in the same assembly as the cubic of ancf.py.

Its unknowns are the places of its two nodes. Where it is gathered its slopes become those of its chord,
L g_1 = L g_2 = h = r_2 - r_1, with which the Hermite cubic is the straight line: water, contact and
the flow of the material go on as for any element. Where it is scattered what they gave to the slopes goes to the ends,
f' = T^T f and K' = T^T K T with (r_1, h, r_2, h) = T (r_1, r_2). Its own forces are those of a uniform rod: mass m L
[[1/3, 1/6], [1/6, 1/3]], which of a rigid rod is exact, weight, and a tension EA (l/L - 1) along it: a rod as stiff as
the cable, not a constraint.

Joints: without bending stiffness the gradients of the nodes are no unknowns; they are set to the mean direction of the
links beside them, for all that reads directions. With it each link pulls the gradients of its two nodes to its own
direction by springs of 2 EI/L. A gradient has no inertia and so stands between its links, and the joint is a spring
of EI over their mean length: as stiff as the cable. Bending damping is left out. Column LINK of the arc lengths
tells a link (hermite.py).
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import LANES, driver, inline, link, opaque
from .ancf import (
    ADDED_MASS,
    AXIAL_DAMPING,
    AXIAL_LIFT,
    BUOYANCY,
    CLOSED_DRAG,
    COMPRESSION,
    EA,
    EI,
    EXTRA_ALONG,
    EXTRA_NOW,
    FLOW_0,
    FLOW_1,
    FLOW_RATE_0,
    FLOW_RATE_1,
    FT,
    HALF_RHO_D,
    LENGTH,
    MASS_PER_LENGTH,
    PER_LENGTH,
    WEIGHT_PER_LENGTH,
    damping,
)
from .drag import POINT_CD, POINT_R, POINT_U, POINT_V, POINT_W, coefficients, friction, mean_lanes, point_lanes
from .hermite import LINK, X4, shape, slope
from .link_loads import added_mass, normal_drag, tangential_drag
from .state import ARC, AT_REST, NOW, Q
from .vec import add, axpy, dot, get3, norm, put3, row3, scale, sub
from .workspace import ENERGY, LOST, RISE, TENSION, WET

THIRD, SIXTH = 1.0 / 3.0, 1.0 / 6.0
# the middle of an element, a point a lane
_N_MID = np.repeat(np.array(shape(0.5))[:, None], LANES, 1)
_D_MID = np.repeat(np.array(slope(0.5))[:, None], LANES, 1)
_OUT = 1.0 / (X4[3] - X4[0])  # of the outer drag points, about the middle


@driver
def _straighten(work, p) -> None:
    """Slopes of a group of links and their first two rates [LANES], from the places of the nodes and their rates."""
    x, director = work.x, work.director
    for c in range(3):
        for e in range(LANES):
            director[c, e], director[3 + c, e] = x[3 + c, e], x[9 + c, e]
            grows = p[FLOW_1, e] - p[FLOW_0, e]  # L'/L, of the mesh
            h, u = x[6 + c, e] - x[c, e], x[18 + c, e] - x[12 + c, e]
            z = x[30 + c, e] - x[24 + c, e]
            z -= (p[FLOW_RATE_1, e] - p[FLOW_RATE_0, e]) * h + 2.0 * grows * (u - grows * h)
            u -= grows * h
            x[3 + c, e], x[9 + c, e] = h, h
            x[15 + c, e], x[21 + c, e] = u, u
            x[27 + c, e], x[33 + c, e] = z, z


@driver
def _straighten_mean(work) -> None:
    """The same for the running mean of the material's velocity [12, LANES]."""
    m = work.mean_v
    if m.shape[1] != LANES:
        raise ValueError("lanes")
    for c in range(3):
        for e in range(LANES):
            m[3 + c, e] = m[6 + c, e] - m[c, e]
            m[9 + c, e] = m[6 + c, e] - m[c, e]


@driver
def rod_lanes(x, p, c1, k9):
    """Tension along each link: k9 rows 0-8 dF/dh, 9-11 F [N], 12 tension [N], 13 energy [J], 14 power lost [W].

    c1: what a velocity changes by with its place [1/s].
    """
    if x.shape[1] != LANES or p.shape[1] != LANES or k9.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        h, w = get3(x, 3, e), sub(get3(x, 18, e), get3(x, 12, e))
        r = 1.0 / norm(h)
        u = scale(r, h)
        per_length, fraction = p[PER_LENGTH, e], p[COMPRESSION, e]
        strain = per_length / r - 1.0
        stiff = p[EA, e] * (fraction if strain < 0.0 else 1.0)
        rate = dot(u, w)
        c = p[AXIAL_DAMPING, e] * per_length
        damped, by_rate, by_tension = damping(c * rate, stiff * strain, fraction)
        t = stiff * strain + damped
        # dT/dh = z; the rates of the ends are the material's: d(w)/dh = c1 - L'/L
        d = by_rate * c
        along = stiff * (1.0 + by_tension) * per_length + d * (c1 - p[FLOW_1, e] + p[FLOW_0, e])
        z = axpy(along - t * r - d * r * rate, u, scale(d * r, w))
        s = t * r
        k9[0, e] = s + u[0] * z[0]
        k9[1, e] = u[0] * z[1]
        k9[2, e] = u[0] * z[2]
        k9[3, e] = u[1] * z[0]
        k9[4, e] = s + u[1] * z[1]
        k9[5, e] = u[1] * z[2]
        k9[6, e] = u[2] * z[0]
        k9[7, e] = u[2] * z[1]
        k9[8, e] = s + u[2] * z[2]
        k9[9, e] = t * u[0]
        k9[10, e] = t * u[1]
        k9[11, e] = t * u[2]
        k9[12, e] = t
        k9[13, e] = 0.5 * stiff * strain * strain * p[LENGTH, e]
        k9[14, e] = damped * rate


@inline
def joint_stiffness(p, e):
    """EI/L^3: the energy of half a joint is EI/L |h/L - g|^2, so that of a joint EI/(L_1 + L_2) |t_1 - t_2|^2."""
    return p[EI, e] * p[PER_LENGTH, e] ** 3


@driver
def _link_lanes(work, p, change, tangent) -> None:
    """Inertia, weight and tension of a group of links: sets force[12, LANES], with tangent k[144, LANES], and the rows
    TENSION [N], ENERGY [J], LOST [W] of the lanes. change: see state.Change."""
    x, force, k, k9, lane = work.x, work.force, work.k, work.k9, work.lane
    c1, sigma = change.velocity, change.damping
    rod_lanes(x, p, c1, k9)
    for r in range(12):
        for e in range(LANES):
            force[r, e] = 0.0
    for e in range(LANES):
        m, w = p[MASS_PER_LENGTH, e] * p[LENGTH, e], 0.5 * p[WEIGHT_PER_LENGTH, e] * p[LENGTH, e]
        a = axpy(sigma, get3(x, 12, e), get3(x, 24, e))
        b = axpy(sigma, get3(x, 18, e), get3(x, 30, e))
        pull = get3(k9, 9, e)
        put3(force, 0, e, add(axpy(m * THIRD, a, scale(m * SIXTH, b)), sub((0.0, 0.0, w), pull)))
        put3(force, 6, e, add(axpy(m * SIXTH, a, scale(m * THIRD, b)), add((0.0, 0.0, w), pull)))
        h, bend = get3(x, 3, e), joint_stiffness(p, e)
        a, b = sub(h, get3(work.director, 0, e)), sub(h, get3(work.director, 3, e))
        lane[TENSION, e], lane[LOST, e] = k9[12, e], k9[14, e]
        lane[ENERGY, e] = k9[13, e] + bend * (dot(a, a) + dot(b, b))
    if not tangent:
        return
    for r in range(144):
        for e in range(LANES):
            k[r, e] = 0.0
    for c in range(9):
        for e in range(LANES):
            hh = k9[c, e]
            k[c, e], k[18 + c, e], k[72 + c, e], k[90 + c, e] = hh, -hh, -hh, hh
    inertia = change.acceleration + sigma * c1
    for c in range(0, 9, 4):
        for e in range(LANES):
            m = p[MASS_PER_LENGTH, e] * p[LENGTH, e]
            # what the flow of the material adds to the accelerations of the ends is q h + 2 p (h' - L'/L h)
            turn = 2.0 * (c1 - p[FLOW_1, e] + p[FLOW_0, e])
            a, b = p[FLOW_RATE_0, e] + turn * p[FLOW_0, e], p[FLOW_RATE_1, e] + turn * p[FLOW_1, e]
            ma, mb = m * (a * THIRD + b * SIXTH), m * (a * SIXTH + b * THIRD)
            k[c, e] += inertia * m * THIRD + ma
            k[18 + c, e] += inertia * m * SIXTH - ma
            k[72 + c, e] += inertia * m * SIXTH + mb
            k[90 + c, e] += inertia * m * THIRD - mb


@driver
def fold(work, tangent):
    """Give to the two nodes of each link of the group what its chord bears: T^T force and T^T k T, zero elsewhere."""
    force, k = work.force, work.k
    for c in range(3):
        for e in range(LANES):
            slopes = force[3 + c, e] + force[9 + c, e]
            force[c, e] -= slopes
            force[6 + c, e] += slopes
            force[3 + c, e], force[9 + c, e] = 0.0, 0.0
    if not tangent:
        return
    for c in range(9):
        for e in range(LANES):
            s0 = k[36 + c, e] + k[108 + c, e]  # rows of the slopes
            s1 = k[45 + c, e] + k[117 + c, e]
            s2 = k[54 + c, e] + k[126 + c, e]
            s3 = k[63 + c, e] + k[135 + c, e]
            a = k[9 + c, e] - s1 + k[27 + c, e] - s3
            b = k[81 + c, e] + s1 + k[99 + c, e] + s3
            k[c, e] += -s0 - a
            k[18 + c, e] += -s2 + a
            k[72 + c, e] += s0 - b
            k[90 + c, e] += s2 + b
    for i in range(4):
        for j in range(4):
            if i % 2 == 1 or j % 2 == 1:
                for c in range(9):
                    for e in range(LANES):
                        k[9 * (4 * i + j) + c, e] = 0.0


@driver
def bend_joints(work, p, tangent):
    """Add what the joints' springs do to the nodes and to their gradients, to a group that is folded."""
    x, force, k, director = work.x, work.force, work.k, work.director
    for c in range(3):
        for e in range(LANES):
            s, h = 2.0 * joint_stiffness(p, e), x[6 + c, e] - x[c, e]
            a, b = s * (director[c, e] - h), s * (director[3 + c, e] - h)
            force[c, e] += a + b
            force[3 + c, e] += a
            force[6 + c, e] -= a + b
            force[9 + c, e] += b
    if not tangent:
        return
    for c in range(0, 9, 4):
        for e in range(LANES):
            s = 2.0 * joint_stiffness(p, e)
            k[c, e] += 2.0 * s
            k[18 + c, e] -= 2.0 * s
            k[72 + c, e] -= 2.0 * s
            k[90 + c, e] += 2.0 * s
            k[9 + c, e] = k[27 + c, e] = k[36 + c, e] = k[108 + c, e] = s
            k[54 + c, e] = k[81 + c, e] = k[99 + c, e] = k[126 + c, e] = -s
            k[45 + c, e] = k[135 + c, e] = s


@driver
def _fold_links(work, p, tangent) -> None:
    """Give to the nodes of a group of links what their chords and joints bear."""
    fold(work, tangent)
    bend_joints(work, p, tangent)


@inline
def without_bending(elements, n, last):
    """Has the joint at node n, of nodes 0 to ``last``, no bending stiffness on either side?"""
    e, o = max(n - 1, 0), min(n, last - 1)
    return elements[e // LANES, EI, e % LANES] == 0.0 and elements[o // LANES, EI, o % LANES] == 0.0


@driver
def any_of(row, value):
    """Has any lane of row [LANES] this value?"""
    for e in range(LANES):
        if row[e] == value:
            return True
    return False


@driver
def _closed_loads(work, p, current, second) -> None:
    """In place of the loads of the four drag points of wet links whose law allows it, two at the outer points with the
    resultant and the first moment of the closed forms (link_loads.py). second: with the extra drag of the mean flow.

    Their coefficient is that of the middle. The tangent stays that of the four points.
    """
    x, t, load, wet = work.x, work.point, work.load, work.lane[WET]
    if not any_of(p[CLOSED_DRAG], 1.0):
        return
    point_lanes(x, p, _N_MID, _D_MID, current, t)
    if second:
        mean_lanes(work.mean_v, _N_MID, t)
        coefficients(p, t, POINT_W)
        for e in range(LANES):
            t[POINT_R, e] = t[POINT_CD, e]
    coefficients(p, t, POINT_V)
    for e in range(LANES):
        if p[CLOSED_DRAG, e] != 1.0 or wet[e] <= 0.0:
            continue
        length, per_length, u = p[LENGTH, e], p[PER_LENGTH, e], get3(t, POINT_U, e)
        rise = x[5, e]
        shear = (-current[2] * rise, -current[3] * rise, 0.0)
        turn = scale(per_length, sub(shear, sub(get3(x, 18, e), get3(x, 12, e))))
        b = p[HALF_RHO_D, e] * t[POINT_CD, e]
        v = get3(t, POINT_V, e)
        c = 2.0 * p[FT, e] * b + friction(dot(v, u), p, e)[0]
        f, m = normal_drag(v, turn, u, b, length)
        f1, m1 = tangential_drag(v, turn, u, c, length)
        f, m = add(f, f1), add(m, m1)
        a, b_a = get3(x, 24, e), get3(x, 30, e)
        f1, m1 = added_mass(scale(-0.5, add(a, b_a)), scale(per_length, sub(a, b_a)), u, p[ADDED_MASS, e], length)
        f, m = add(f, f1), add(m, m1)
        if second:
            mean = work.mean_v
            v, turn = get3(t, POINT_W, e), scale(per_length, sub(shear, sub(get3(mean, 6, e), get3(mean, 0, e))))
            b = p[HALF_RHO_D, e] * t[POINT_R, e]
            f1, m1 = normal_drag(v, turn, u, p[EXTRA_NOW, e] * b, length)
            f, m = add(f, f1), add(m, m1)
            c = p[EXTRA_ALONG, e] * (2.0 * p[FT, e] * b + friction(dot(v, u), p, e)[0])
            f1, m1 = tangential_drag(v, turn, u, c, length)
            f, m = add(f, f1), add(m, m1)
        f = (f[0], f[1], f[2] + p[BUOYANCY, e] * length)
        m = scale(_OUT * per_length, m)
        for g in range(load.shape[0]):
            put3(load[g], 0, e, (0.0, 0.0, 0.0))
        put3(load[0], 0, e, axpy(0.5, f, scale(-1.0, m)))
        put3(load[3], 0, e, axpy(0.5, f, m))


@driver
def _drop_axial_lift(work, p, tangent) -> None:
    """Take the buoyancy along the links off their wet part, where theirs is HK 55: into force and k."""
    x, force, k, wet, rise = work.x, work.force, work.k, work.lane[WET], work.lane[RISE : RISE + 2]
    for e in range(LANES):
        if p[AXIAL_LIFT, e] == 0.0 or wet[e] == 0.0:
            continue
        h = get3(x, 3, e)
        r = 1.0 / norm(h)
        u = scale(r, h)
        first, last = 0.5, 0.5  # shares of the load that the two ends bear
        if wet[e] < 0.0:
            z0, z1 = x[2, e] - rise[0, e], x[8, e] - rise[1, e]
            cut = min(max(z0 / (z0 - z1), 0.0), 1.0)
            first = cut - 0.5 * cut * cut if z0 < 0.0 else 0.5 * (1.0 - cut) ** 2
            last = 0.5 * cut * cut if z0 < 0.0 else 0.5 * (1.0 - cut * cut)
        s = p[AXIAL_LIFT, e] * p[LENGTH, e]
        for i in range(3):
            f = s * u[2] * u[i]  # taken off, so that the inner force is larger
            force[i, e] += first * f
            force[6 + i, e] += last * f
            if tangent:
                for j in range(3):
                    d = s * r * (u[i] * ((1.0 if j == 2 else 0.0) - 2.0 * u[2] * u[j]) + (u[2] if i == j else 0.0))
                    c = 3 * i + j
                    k[c, e] -= first * d
                    k[18 + c, e] += first * d
                    k[72 + c, e] -= last * d
                    k[90 + c, e] += last * d


@driver
def _align(elements, state) -> None:
    """Gradients of limp joints: the mean of h/L of the links beside them, of an end that of the last link."""
    q, arc = state.nodes[NOW, Q], state.nodes[NOW, ARC]
    last = q.shape[0] - 1
    for n in range(last + 1):
        if not without_bending(elements, n, last):
            continue
        before, after = max(n - 1, 0), min(n, last - 1)
        a, b = 0.5 / (arc[before + 1, 0] - arc[before, 0]), 0.5 / (arc[after + 1, 0] - arc[after, 0])
        for k in range(3):
            q[n, 3 + k] = a * (q[before + 1, k] - q[before, k]) + b * (q[after + 1, k] - q[after, k])


@driver
def is_links(arc):
    """Is the line of the arc lengths [nodes, 6] one of links?"""
    return arc[0, LINK] != 0.0


@driver
def _joint_tension(state, n) -> float:
    """Tension [N] at joint n: the size of the force between its two links.

    The force along a link is that at its middle, and its half loads turn it by the joint: interpolated as a vector
    between the middles of the two links, at an end extrapolated from the last two.
    """
    q, arc, tension = state.nodes[NOW, Q], state.nodes[NOW, ARC], state.tension
    count = tension.shape[0]
    if count == 1:
        return tension[0]
    i = min(max(n - 1, 0), count - 2)
    first, last = 0.5 * (arc[i, 0] + arc[i + 1, 0]), 0.5 * (arc[i + 1, 0] + arc[i + 2, 0])
    w = (arc[n, 0] - first) / (last - first)
    a, b = sub(row3(q, i + 1), row3(q, i)), sub(row3(q, i + 2), row3(q, i + 1))
    return norm(axpy((1.0 - w) * tension[i] / norm(a), a, scale(w * tension[i + 1] / norm(b), b)))


straighten, straighten_mean, link_lanes = opaque(_straighten), opaque(_straighten_mean), opaque(_link_lanes)
closed_loads, drop_axial_lift, fold_links = opaque(_closed_loads), opaque(_drop_axial_lift), opaque(_fold_links)
align, joint_tension = opaque(_align), opaque(_joint_tension)


def link_links(line, state) -> None:
    """Compile or load what a line of links needs and publish it; call before the assembly runs."""
    work, p, no, there = state.work.lanes[0], line.elements[0], np.bool_(False), bool(is_links(state.nodes[NOW, ARC]))
    link(_straighten, work, p, needed=there)
    link(_straighten_mean, work, needed=there)
    link(_link_lanes, work, p, AT_REST, no, needed=there)
    link(_closed_loads, work, p, (0.0, 0.0, 0.0, 0.0), no, needed=there)
    link(_drop_axial_lift, work, p, no, needed=there)
    link(_fold_links, work, p, no, needed=there)
    link(_align, line.elements, state, needed=there)
    link(_joint_tension, state, 0, needed=there)
