"""A line: the cable with what holds it, hangs on it and pulls it, and the balance of its forces.

This is all the solver sees. The tow of a ship is one user of it (tow.py), the verification cases are another (lab/).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .cable import HELD, LOADS, WATER, Work
from .cable import assemble as _assemble
from .jit import driver, link, opaque
from .towbody import load as body_load

assemble = opaque(_assemble)

# columns of a strut, a rigid or elastic load between a node and the next: node, length [m], stiffness [N], masses [kg]
STRUT_NODE, STRUT_LENGTH, STRUT_STIFFNESS, STRUT_AA, STRUT_AB, STRUT_BB, STRUT_COLUMNS = range(7)
# health of the solver: Newton corrections and substeps of a tick, residual [N], strain energy [J], and of the last step
# its length [s] and the tangents it needed
ITERATIONS, SUBSTEPS, RESIDUAL, STRAIN, LAST_STEP, TANGENTS, HEALTH = range(7)
LOAD_NODE, LOAD_FORCE, LOAD_MOMENT, LOAD_COLUMNS = 0, 1, 4, 7  # columns of a nodal load


class Line(NamedTuple):
    """One cable as numbers for kernels. Unknowns of a node: position r [m] and gradient g = dr/dp [1]."""

    elements: np.ndarray  # [groups, ROWS, LANES] element table, read-only
    held: np.ndarray  # [nodes, 6], read-only: 1 where q, v and a are imposed from outside
    bodies: np.ndarray  # [bodies, BODY_ROWS], read-only
    seats: np.ndarray  # int64 [bodies], read-only: the node that carries the body
    loads: np.ndarray  # [loads, LOAD_COLUMNS] node, dead force [N], moment [N m] on the tangent
    struts: np.ndarray  # [struts, STRUT_COLUMNS], read-only
    arc: np.ndarray  # [nodes] unstretched arc length [m]
    q: np.ndarray  # [nodes, 6] r, g
    v: np.ndarray
    a: np.ndarray
    x: np.ndarray  # auxiliary acceleration
    old: np.ndarray  # [4, nodes, 6] q v a x at the beginning of the step
    gain: np.ndarray  # [nodes, 6] what a gained in the step before
    current: np.ndarray  # [4] surface current [m/s], its gradient [1/s]
    surfaces: np.ndarray  # [n, SURFACE_COLUMNS] contact surfaces in the world
    flow: np.ndarray  # [bodies, 6] low-passed flow past each body [m/s], its turning rate [rad/s]
    tension: np.ndarray  # [elements] N
    reaction: np.ndarray  # [nodes, 6] what holds the held unknowns [N, N m]
    health: np.ndarray  # [HEALTH]
    work: Work
    gravity: float  # m/s^2
    tolerance: float  # N
    max_iterations: int


@driver
def pull(load, q, tangent, band):
    """Add one nodal load: a dead force on r, a moment m on the tangent: Q_g = m x g / |g|^2."""
    n = int(load[LOAD_NODE])
    gx, gy, gz = q[n, 3], q[n, 4], q[n, 5]
    mx, my, mz = load[LOAD_MOMENT], load[LOAD_MOMENT + 1], load[LOAD_MOMENT + 2]
    g2 = gx * gx + gy * gy + gz * gz
    m = ((0.0, -mz, my), (mz, 0.0, -mx), (-my, mx, 0.0))
    g = (gx, gy, gz)
    for i in range(3):
        band[n, i, 12] += load[LOAD_FORCE + i]
        turn = (m[i][0] * gx + m[i][1] * gy + m[i][2] * gz) / g2
        band[n, 3 + i, 12] += turn
        if tangent:
            for j in range(3):
                band[n, 3 + i, 3 + j] -= m[i][j] / g2 - 2.0 * turn * g[j] / g2


@driver
def strut(row, gravity, q, v, a, c1, c2, sigma, tangent, band, lower):
    """Add one two-point load, Westin (138)-(139) with the direction normalised: a spring between two masses.

    Force k (l - L)/L along the line; mass matrix of two points [[aa, ab], [ab, bb]] and its weight.
    """
    i = int(row[STRUT_NODE])
    j = i + 1
    length, k = row[STRUT_LENGTH], row[STRUT_STIFFNESS]
    dx, dy, dz = q[j, 0] - q[i, 0], q[j, 1] - q[i, 1], q[j, 2] - q[i, 2]
    l = (dx * dx + dy * dy + dz * dz) ** 0.5
    u = (dx / l, dy / l, dz / l)
    f = k * (l - length) / length
    aa, ab, bb = row[STRUT_AA], row[STRUT_AB], row[STRUT_BB]
    for r in range(3):
        fall = gravity if r == 2 else 0.0
        at_i, at_j = a[i, r] + sigma * v[i, r], a[j, r] + sigma * v[j, r]
        band[i, r, 12] += f * u[r] - aa * at_i - ab * at_j - (aa + ab) * fall
        band[j, r, 12] += -f * u[r] - ab * at_i - bb * at_j - (ab + bb) * fall
        if tangent:
            m = c2 + sigma * c1
            for c in range(3):
                e = 1.0 if r == c else 0.0
                s = k / length * u[r] * u[c] + f / l * (e - u[r] * u[c])
                band[i, r, c] += s + m * aa * e
                band[j, r, c] += s + m * bb * e
                band[i, r, 6 + c] += m * ab * e - s
                lower[j, r, c] += m * ab * e - s


@driver
def residual(line, c1, c2, sigma, tangent):
    """Assemble the whole system for the present q, v, a; returns the largest residual force [N].

    With tangent the system holds dR/dq, with c1 and c2 for v and a; sigma: mass damping of a static start [1/s].
    """
    band, lower = line.work.band, line.work.lower
    line.health[STRAIN] = assemble(
        line.elements,
        line.arc,
        line.q,
        line.v,
        line.a,
        line.current,
        line.surfaces,
        c1,
        c2,
        sigma,
        tangent,
        line.work,
        line.tension,
    )
    for i in range(line.bodies.shape[0]):
        n = line.seats[i]
        line.work.power[WATER] += body_load(
            line.bodies[i],
            line.gravity,
            line.q[n],
            line.v[n],
            line.a[n],
            line.current,
            line.flow[i],
            c1,
            c2,
            sigma,
            tangent,
            band[n],
        )
    for i in range(line.struts.shape[0]):
        strut(line.struts[i], line.gravity, line.q, line.v, line.a, c1, c2, sigma, tangent, band, lower)
    for i in range(line.loads.shape[0]):
        pull(line.loads[i], line.q, tangent, band)
    last = band.shape[0] - 1
    worst, held, given = 0.0, 0.0, 0.0
    for i in range(last + 1):
        per_length = 1.0 / (line.arc[min(i + 1, last)] - line.arc[max(i - 1, 0)])
        for k in range(6):
            if line.held[i, k] > 0.0:
                line.reaction[i, k] = -band[i, k, 12]
                held -= band[i, k, 12] * line.v[i, k]
                for c in range(16):
                    band[i, k, c] = 0.0
                for c in range(6):
                    lower[i, k, c] = 0.0
                band[i, k, k] = 1.0
            else:
                f = abs(band[i, k, 12]) * (1.0 if k < 3 else per_length)
                if not f < 1e300:
                    return np.inf
                worst = max(worst, f)
    for i in range(line.loads.shape[0]):
        n = int(line.loads[i, LOAD_NODE])
        for k in range(3):
            given += line.loads[i, LOAD_FORCE + k] * line.v[n, k]
    line.work.power[HELD], line.work.power[LOADS] = held, given
    return worst


def link_assembly(line: Line) -> None:
    """Compile or load the assembly and publish it; call before anything that uses it runs."""
    link(
        _assemble,
        line.elements,
        line.arc,
        line.q,
        line.v,
        line.a,
        line.current,
        line.surfaces,
        0.0,
        0.0,
        0.0,
        np.bool_(False),
        line.work,
        line.tension,
    )
