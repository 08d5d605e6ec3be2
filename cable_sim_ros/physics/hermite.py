"""Hermite shape functions of the ANCF element, Westin (2018) (29) with the sign of its last function mended.

Unknowns of an element are scaled: y = (r1, L g1, r2, L g2), g = dr/dp, so that tables carry no length.
"""

import numpy as np

from ..compiler.jit import inline


@inline
def shape(x):
    """Values N_i at xi = x in [0, 1]."""
    return (1.0 - x * x * (3.0 - 2.0 * x), x * (1.0 - x) * (1.0 - x), x * x * (3.0 - 2.0 * x), x * x * (x - 1.0))


@inline
def slope(x):
    """Derivatives N_i' at xi = x."""
    return (-6.0 * x * (1.0 - x), 1.0 - 4.0 * x + 3.0 * x * x, 6.0 * x * (1.0 - x), x * (3.0 * x - 2.0))


# Gauss points on [0, 1] as literals: numpy's differ in the last bit between versions
GAUSS_4_X = (0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263)
GAUSS_4_W = (0.17392742256872692, 0.32607257743127305, 0.32607257743127305, 0.17392742256872692)
GAUSS_5_X = (0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319)
GAUSS_5_W = (0.11846344252809454, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324, 0.11846344252809454)

X4, W4 = np.array(GAUSS_4_X), np.array(GAUSS_4_W)
X5, W5 = np.array(GAUSS_5_X), np.array(GAUSS_5_W)

# integrals over [0, 1]: mass int N_i N_j, bending int N_i'' N_j'', weight int N_i
MASS = (
    np.array(
        [[156.0, 22.0, 54.0, -13.0], [22.0, 4.0, 13.0, -3.0], [54.0, 13.0, 156.0, -22.0], [-13.0, -3.0, -22.0, 4.0]]
    )
    / 420.0
)
WEIGHT = np.array([0.5, 1.0 / 12.0, 0.5, -1.0 / 12.0])


LINK = 3  # column of the arc lengths: 1 where the element that begins at the node is a link (link_element.py)


@inline
def hermite_of(arc, q, v, e, c):
    """Scaled data (r_1, L g_1, r_2, L g_2) of one coordinate c of element e, and their rates (r_1', L g_1', ..).

    arc: s and s' of the nodes [nodes, 6]. The slopes of a link are its chord's.
    """
    length = arc[e + 1, 0] - arc[e, 0]
    if arc[e, LINK] != 0.0:
        h = q[e + 1, c] - q[e, c]
        u = v[e + 1, c] - v[e, c] - (arc[e + 1, 1] - arc[e, 1]) / length * h
        return (q[e, c], h, q[e + 1, c], h), (v[e, c], u, v[e + 1, c], u)
    y = (q[e, c], length * q[e, 3 + c], q[e + 1, c], length * q[e + 1, 3 + c])
    return y, (v[e, c], length * v[e, 3 + c], v[e + 1, c], length * v[e + 1, 3 + c])


@inline
def on_link(arc, q, v, e, x):
    """point_of() of a link."""
    g = (q[e + 1, 0] - q[e, 0], q[e + 1, 1] - q[e, 1], q[e + 1, 2] - q[e, 2])
    r = (q[e, 0] + x * g[0], q[e, 1] + x * g[1], q[e, 2] + x * g[2])
    rate = -(arc[e, 1] * (1.0 - x) + arc[e + 1, 1] * x) / (arc[e + 1, 0] - arc[e, 0])
    w = (
        v[e, 0] + x * (v[e + 1, 0] - v[e, 0]) + rate * g[0],
        v[e, 1] + x * (v[e + 1, 1] - v[e, 1]) + rate * g[1],
        v[e, 2] + x * (v[e + 1, 2] - v[e, 2]) + rate * g[2],
    )
    return r, w, g


@inline
def point_of(arc, q, v, e, x):
    """Position, velocity, tangent (not unit) of element e at xi = x; arc: s and s' of the nodes [nodes, 6].

    The velocity is that of the material: v = N q' + L' (h_1 g_1 + h_3 g_2) + xi' dr/dxi, see mesh_convection.py.
    """
    length = arc[e + 1, 0] - arc[e, 0]
    if arc[e, LINK] != 0.0:
        return on_link(arc, q, v, e, x)
    n, d = shape(x), slope(x)
    r = (
        n[0] * q[e, 0] + n[1] * length * q[e, 3] + n[2] * q[e + 1, 0] + n[3] * length * q[e + 1, 3],
        n[0] * q[e, 1] + n[1] * length * q[e, 4] + n[2] * q[e + 1, 1] + n[3] * length * q[e + 1, 4],
        n[0] * q[e, 2] + n[1] * length * q[e, 5] + n[2] * q[e + 1, 2] + n[3] * length * q[e + 1, 5],
    )
    w = (
        n[0] * v[e, 0] + n[1] * length * v[e, 3] + n[2] * v[e + 1, 0] + n[3] * length * v[e + 1, 3],
        n[0] * v[e, 1] + n[1] * length * v[e, 4] + n[2] * v[e + 1, 1] + n[3] * length * v[e + 1, 4],
        n[0] * v[e, 2] + n[1] * length * v[e, 5] + n[2] * v[e + 1, 2] + n[3] * length * v[e + 1, 5],
    )
    g = (
        d[0] * q[e, 0] + d[1] * length * q[e, 3] + d[2] * q[e + 1, 0] + d[3] * length * q[e + 1, 3],
        d[0] * q[e, 1] + d[1] * length * q[e, 4] + d[2] * q[e + 1, 1] + d[3] * length * q[e + 1, 4],
        d[0] * q[e, 2] + d[1] * length * q[e, 5] + d[2] * q[e + 1, 2] + d[3] * length * q[e + 1, 5],
    )
    grows, xi_rate = arc[e + 1, 1] - arc[e, 1], -(arc[e, 1] * (1.0 - x) + arc[e + 1, 1] * x) / length
    a, b = grows * n[1], grows * n[3]
    w = (
        w[0] + a * q[e, 3] + b * q[e + 1, 3] + xi_rate * g[0],
        w[1] + a * q[e, 4] + b * q[e + 1, 4] + xi_rate * g[1],
        w[2] + a * q[e, 5] + b * q[e + 1, 5] + xi_rate * g[2],
    )
    return r, w, g
