"""Beads: point masses that sit on the cable at a place of its material, such as the termination between two sections.

A bead is carried by the element that holds its place s: with r = N(xi) q at xi of s and N_i scaled like the unknowns,
its inertia is m N_i N_j, and its weight and buoyancy load the four unknowns with N_i. Crossing the surface, its wet
share is a smoothstep over the size of the displaced volume, as that of a towbody.
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import driver, inline
from .drag_laws import smooth
from .hermite import LINK, hermite_of, shape
from .instruments import locate
from .mesh_convection import material
from .state import ARC, NOW, A, Q, V
from .vec import add

BEAD = np.dtype(
    [
        ("place", "f8"),  # m, unstretched arc length
        ("mass", "f8"),  # kg
        ("gravity", "f8"),  # m/s^2
        ("buoyancy", "f8"),  # N
        ("half_height", "f8"),  # m, half of that over which it leaves the water
    ],
    align=True,
)


def bead_record(place: float, mass: float, net_weight: float, gravity: float, density: float) -> np.ndarray:
    """A point mass [kg] at arc length ``place`` [m] as a BEAD record; net weight [N] in water of ``density``."""
    row = np.zeros((), BEAD)
    row["place"], row["mass"], row["gravity"], row["buoyancy"] = place, mass, gravity, mass * gravity - net_weight
    row["half_height"] = half_height(float(row["buoyancy"]), gravity, density)
    return row


def half_height(buoyancy: float, gravity: float, density: float) -> float:
    """Half the height [m] over which a body leaves the water: half the edge of a cube of the displaced volume."""
    return 0.5 * max(buoyancy / (density * max(gravity, 1e-9)), 1e-6) ** (1.0 / 3.0)


@inline
def aboard(place, state, slot):
    """1 where the material at arc length ``place`` is on the drum, before the first node; 0 outboard of it."""
    return 1 if place < state.nodes[slot, ARC, 0, 0] else 0


@inline
def weighted(n, table, e):
    """Sum of N_i times the unknowns of element e in a node table [nodes, 6]; n carries the element length."""
    return (
        n[0] * table[e, 0] + n[1] * table[e, 3] + n[2] * table[e + 1, 0] + n[3] * table[e + 1, 3],
        n[0] * table[e, 1] + n[1] * table[e, 4] + n[2] * table[e + 1, 1] + n[3] * table[e + 1, 4],
        n[0] * table[e, 2] + n[1] * table[e, 5] + n[2] * table[e + 1, 2] + n[3] * table[e + 1, 5],
    )


@inline
def carried(place, state):
    """Where the material at arc length ``place`` is: element, N_i of its unknowns, position, velocity, acceleration."""
    arc = state.nodes[NOW, ARC]
    e, x = locate(arc[:, 0], place)
    s, length = shape(x), arc[e + 1, 0] - arc[e, 0]
    if arc[e, LINK] != 0.0:
        s = (1.0 - x, 0.0, x, 0.0)
    n = (s[0], length * s[1], s[2], length * s[3])
    q, v, a = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A]
    p = (arc[e, 1] / length, arc[e + 1, 1] / length)
    w, b = flowing(s, p, (arc[e, 2] / length, arc[e + 1, 2] / length), q, v, e, arc)
    return e, n, weighted(n, q, e), add(weighted(n, v, e), w), add(weighted(n, a, e), b)


@inline
def flowing(s, p, q2, q, v, e, arc):
    """What the flow of the material (mesh_convection.py) adds to velocity and acceleration at a point; s: N_i there."""
    vx, ax = component(s, p, q2, q, v, e, arc, 0)
    vy, ay = component(s, p, q2, q, v, e, arc, 1)
    vz, az = component(s, p, q2, q, v, e, arc, 2)
    return (vx, vy, vz), (ax, ay, az)


@inline
def component(s, p, q2, q, v, e, arc, c):
    """One coordinate of flowing()."""
    y, u = hermite_of(arc, q, v, e, c)
    d, b = material(p, q2, y, u)
    return (
        s[0] * d[0] + s[1] * d[1] + s[2] * d[2] + s[3] * d[3],
        s[0] * b[0] + s[1] * b[1] + s[2] * b[2] + s[3] * b[3],
    )


@driver
def carry(bead, state, change, tangent):
    """Subtract the bead's load from the rows of its element in the system, and with tangent add its derivative.

    change: see state.Change. Returns the power [W] that the water gives to the bead.
    """
    band, lower = state.work.band, state.work.lower
    if aboard(bead.place, state, NOW) != 0:
        return 0.0
    e, n, r, v, a = carried(bead.place, state)
    dry, rise = smooth(r[2], -bead.half_height, bead.half_height)
    m, sigma, lift = bead.mass, change.damping, (1.0 - dry) * bead.buoyancy
    force = (-m * (a[0] + sigma * v[0]), -m * (a[1] + sigma * v[1]), lift - m * (a[2] + sigma * v[2] + bead.gravity))
    for c in range(3):
        band[e, c, 12] += n[0] * force[c]
        band[e, 3 + c, 12] += n[1] * force[c]
        band[e + 1, c, 12] += n[2] * force[c]
        band[e + 1, 3 + c, 12] += n[3] * force[c]
        if tangent:
            k = m * (change.acceleration + sigma * change.velocity) + (rise * bead.buoyancy if c == 2 else 0.0)
            for i in range(2):
                for j in range(2):
                    band[e, 3 * i + c, 3 * j + c] += k * n[i] * n[j]
                    band[e, 3 * i + c, 6 + 3 * j + c] += k * n[i] * n[2 + j]
                    lower[e + 1, 3 * i + c, 3 * j + c] += k * n[2 + i] * n[j]
                    band[e + 1, 3 * i + c, 3 * j + c] += k * n[2 + i] * n[2 + j]
    return lift * v[2]
