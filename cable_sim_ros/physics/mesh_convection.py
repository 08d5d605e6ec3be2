"""Material flow: what the material does where it runs through a mesh that moves along it.

Node i stands at arc length s_i(t) of the material, an element spans L = s_2 - s_1 between two nodes. With
w = s_1' (1 - xi) + s_2' xi a point of material moves at xi' = -w/L, and its velocity v = r' - w r_s is, for a linear w
and a cubic r, again a cubic in xi: v = sum N_k V_k, exactly. So is its acceleration a = v' - w v_s. The unknowns' rates
are turned into V and A once, where an element is gathered; inertia, added mass, drag, damping and contact know of no
mesh.

Scaled unknowns y = (r_1, L g_1, r_2, L g_2), their rates u = (r_1', L g_1', ...) and z likewise; p = s'/L, q = s''/L at
the two ends, l = L'/L = p_2 - p_1, and the second derivatives R_0 = 6 (y_3 - y_1) - 4 y_2 - 2 y_4,
R_1 = -6 (y_3 - y_1) + 2 y_2 + 4 y_4 at xi = 0 and 1:

    V = u - (p_1 y_2, p_1 R_0, p_2 y_4, p_2 R_1)(y)
    A_1 = z_1 - q_1 y_2 - p_1 (u_2 + V_2)        A_2 = z_2 - (q_1 - 2 p_1 l) R_0(y) - p_1 (R_0(Y') + R_0(V))

and the same with p_2, q_2, y_4, R_1 at the other end; Y' = (u_1, u_2 + l y_2, u_3, u_4 + l y_4). Bending and axial
damping need no more: the material's rate of r_ss is v_ss, of the mean strain the mean of r_s v_s / |r_s|.
docs/theory.md, section 4.
"""

from ..compiler.jit import LANES, driver, inline
from .ancf import FLOW_0, FLOW_1, FLOW_RATE_0, FLOW_RATE_1, LENGTH, MASS_PER_LENGTH
from .hermite import MASS


@inline
def second(y):
    """Second derivatives to xi of a Hermite cubic with data y at xi = 0 and 1."""
    h = 6.0 * (y[2] - y[0])
    return h - 4.0 * y[1] - 2.0 * y[3], 2.0 * y[1] + 4.0 * y[3] - h


@inline
def convective(p, y):
    """-w r_s of one coordinate as Hermite data; p: s'/L at both ends."""
    r0, r1 = second(y)
    return -p[0] * y[1], -p[0] * r0, -p[1] * y[3], -p[1] * r1


@inline
def material(p, q, y, u):
    """What the flow adds to velocity and acceleration of one coordinate, as Hermite data; q: s''/L at both ends."""
    r0, r1 = second(y)
    v = convective(p, y)
    l = p[1] - p[0]
    v1, v3 = u[1] + v[1], u[3] + v[3]
    # Y' + V in one: second() is linear
    s0, s1 = second((2.0 * u[0] + v[0], u[1] + l * y[1] + v1, 2.0 * u[2] + v[2], u[3] + l * y[3] + v3))
    a = (
        -q[0] * y[1] - p[0] * (u[1] + v1),
        -(q[0] - 2.0 * p[0] * l) * r0 - p[0] * s0,
        -q[1] * y[3] - p[1] * (u[3] + v3),
        -(q[1] - 2.0 * p[1] * l) * r1 - p[1] * s1,
    )
    return v, a


@inline
def convective_columns(flow, c1, j):
    """What the flow adds to dA/dy_j where u changes by c1 with y; flow: s'/L and s''/L at both ends."""
    y = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0, 1.0 if j == 3 else 0.0)
    _, a = material((flow[0], flow[1]), (flow[2], flow[3]), y, (c1 * y[0], c1 * y[1], c1 * y[2], c1 * y[3]))
    return a


@driver
def material_lanes(x, p):
    """Rates and accelerations of the scaled unknowns in x[12:36, LANES] become the material's, as Hermite data."""
    if x.shape[1] != LANES or p.shape[1] != LANES:
        raise ValueError("lanes")
    for c in range(3):
        for e in range(LANES):
            first, then = (p[FLOW_0, e], p[FLOW_1, e]), (p[FLOW_RATE_0, e], p[FLOW_RATE_1, e])
            y, u = (
                (x[c, e], x[3 + c, e], x[6 + c, e], x[9 + c, e]),
                (x[12 + c, e], x[15 + c, e], x[18 + c, e], x[21 + c, e]),
            )
            v, a = material(first, then, y, u)
            x[12 + c, e], x[15 + c, e] = u[0] + v[0], u[1] + v[1]
            x[18 + c, e], x[21 + c, e] = u[2] + v[2], u[3] + v[3]
            x[24 + c, e] += a[0]
            x[27 + c, e] += a[1]
            x[30 + c, e] += a[2]
            x[33 + c, e] += a[3]


@driver
def convective_tangent_lanes(p, c1, k):
    """What the flow of the material adds to inertia_tangent_lanes: M (c1 C + K_c), scalar 4x4 times I3."""
    if p.shape[1] != LANES or k.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        t = p[MASS_PER_LENGTH, e] * p[LENGTH, e]
        flow = (p[FLOW_0, e], p[FLOW_1, e], p[FLOW_RATE_0, e], p[FLOW_RATE_1, e])
        for j in range(4):
            a = convective_columns(flow, c1, j)
            for i in range(4):
                s = t * (MASS[i, 0] * a[0] + MASS[i, 1] * a[1] + MASS[i, 2] * a[2] + MASS[i, 3] * a[3])
                row = 36 * i + 9 * j
                k[row, e] += s
                k[row + 4, e] += s
                k[row + 8, e] += s
