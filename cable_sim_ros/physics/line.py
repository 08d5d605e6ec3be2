"""A line: the cable with what holds it, hangs on it and pulls it, and the balance of its forces.

This is all the solver sees. The tow of a ship is one user of it (tow.py), lines of one's own are another (sim/rig).
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import driver, link, opaque
from .cable_assembly import assemble, link_assembly
from .contact_surface import ON_GROUND
from .energy import fed
from .link_element import align, is_links, without_bending
from .point_mass import carry
from .rigid_body import condense, link_rigid, rigid_load
from .sea import WIND
from .state import ARC, AT_REST, FLOW, NOW, A, Q, V
from .towbody import lie
from .towbody import load as body_load
from .wake_oscillator import add_wake, link_wakes
from .wind import BODIES
from .workspace import FED, HELD, LOADS, SURFACES, WATER


@driver
def pull(load, q, tangent, band):
    """Add one nodal load (LOAD): a dead force on r, a moment m on the tangent: Q_g = m x g / |g|^2."""
    n = load.node
    gx, gy, gz = q[n, 3], q[n, 4], q[n, 5]
    mx, my, mz = load.moment[0], load.moment[1], load.moment[2]
    g2 = gx * gx + gy * gy + gz * gz
    m = ((0.0, -mz, my), (mz, 0.0, -mx), (-my, mx, 0.0))
    g = (gx, gy, gz)
    for i in range(3):
        band[n, i, 12] += load.force[i]
        turn = (m[i][0] * gx + m[i][1] * gy + m[i][2] * gz) / g2
        band[n, 3 + i, 12] += turn
        if tangent:
            for j in range(3):
                band[n, 3 + i, 3 + j] -= m[i][j] / g2 - 2.0 * turn * g[j] / g2


@driver
def strut(strut, gravity, state, change, tangent):
    """Add one two-point load (STRUT), Westin (138)-(139) with the direction normalised: a spring between two masses.

    Force k (l - L)/L along the line; mass matrix of two points [[aa, ab], [ab, bb]] and its weight.
    """
    band, lower = state.work.band, state.work.lower
    q, v, a = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A]
    i = strut.node
    j = i + 1
    sigma, m = change.damping, change.acceleration + change.damping * change.velocity
    length, k = strut.length, strut.stiffness
    dx, dy, dz = q[j, 0] - q[i, 0], q[j, 1] - q[i, 1], q[j, 2] - q[i, 2]
    l = (dx * dx + dy * dy + dz * dz) ** 0.5
    u = (dx / l, dy / l, dz / l)
    f = k * (l - length) / length
    aa, ab, bb = strut.aa, strut.ab, strut.bb
    for r in range(3):
        fall = gravity if r == 2 else 0.0
        at_i, at_j = a[i, r] + sigma * v[i, r], a[j, r] + sigma * v[j, r]
        band[i, r, 12] += f * u[r] - aa * at_i - ab * at_j - (aa + ab) * fall
        band[j, r, 12] += -f * u[r] - ab * at_i - bb * at_j - (ab + bb) * fall
        if tangent:
            for c in range(3):
                e = 1.0 if r == c else 0.0
                s = k / length * u[r] * u[c] + f / l * (e - u[r] * u[c])
                band[i, r, c] += s + m * aa * e
                band[j, r, c] += s + m * bb * e
                band[i, r, 6 + c] += m * ab * e - s
                lower[j, r, c] += m * ab * e - s


@driver
def _hold_struts(line, state, change, tangent) -> None:
    """Add all two-point loads."""
    for i in range(line.struts.shape[0]):
        strut(line.struts[i], line.settings[0].gravity, state, change, tangent)


@driver
def _carry_beads(line, state, change, tangent) -> None:
    """Add all beads: their own forces and the water's."""
    power = state.work.lanes[0].power
    for i in range(line.beads.shape[0]):
        power[WATER] += carry(line.beads[i], state, change, tangent)


hold_struts, carry_beads = opaque(_hold_struts), opaque(_carry_beads)


@driver
def bodies(line, state, change, tangent):
    """Add bodies and beads: their own forces, the water's, the ground's."""
    band, power = state.work.band, state.work.lanes[0].power
    q, v, a, flow = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A], state.nodes[NOW, FLOW]
    m = state.memory[NOW].current
    current = (m[0], m[1], m[2], m[3])
    for i in range(line.bodies.shape[0]):
        n, body = line.body_nodes[i], line.bodies[i]
        if body.rigid >= 0:
            power[WATER] += rigid_load(line.rigid, body.rigid, state, change, tangent)
            continue
        node = (q[n], v[n], a[n], flow[n], state.work.around[n])
        power[WATER] += body_load(body, node, current, change, tangent, band[n])
        for k in range(state.surfaces.shape[0]):
            if state.surfaces[k].carrier == ON_GROUND and body.floor_stiffness > 0.0:
                power[SURFACES] += lie(body, state.surfaces[k], node, change, tangent, band[n])
    if line.beads.shape[0] > 0:
        carry_beads(line, state, change, tangent)


@driver
def push_by_wind(state):
    """Add the load of the wind on every node; returns its power [W], with that on rigid bodies."""
    band, around, v, power = state.work.band, state.work.around, state.nodes[NOW, V], 0.0
    for n in range(around.shape[0]):
        for k in range(6):
            band[n, k, 12] += around[n, WIND + k]
            power += around[n, WIND + k] * v[n, k]
    for i in range(state.attitude.shape[1]):
        power += state.attitude[NOW, i].blown
    return power


@driver
def _residual(line, state, change, tangent) -> float:
    """Assemble the whole system for the present q, v, a; returns the largest residual force [N].

    With tangent the system holds dR/dq, with the change of v and a.
    """
    band, lower, q, v = state.work.band, state.work.lower, state.nodes[NOW, Q], state.nodes[NOW, V]
    arc = state.nodes[NOW, ARC]
    links = is_links(arc)
    if tangent:
        state.plan[0].kept = 0.0  # the one in the work space is written over
    if links:
        align(line.elements, state)
    state.memory[NOW].health.strain = assemble(line, state, change, tangent)
    bodies(line, state, change, tangent)
    if line.wakes.shape[0] > 0:
        add_wake(line, state)
    if line.struts.shape[0] > 0:
        hold_struts(line, state, change, tangent)
    for i in range(line.loads.shape[0]):
        pull(line.loads[i], q, tangent, band)
    last = band.shape[0] - 1
    worst, held, given = 0.0, 0.0, 0.0
    if line.settings[0].air[BODIES] > 0.0:
        given = push_by_wind(state)
    for i in range(last + 1):
        per_length = 1.0 / (arc[min(i + 1, last), 0] - arc[max(i - 1, 0), 0])
        for k in range(6):
            if line.held[i, k] > 0.0 or (links and k > 2 and without_bending(line.elements, i, last)):
                state.reaction[i, k] = -band[i, k, 12]
                through = arc[i, 1] * q[i, 3 + k] if k < 3 else 0.0  # the material moves on through the held node
                held -= band[i, k, 12] * (v[i, k] - through)
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
        load = line.loads[i]
        for k in range(3):
            given += load.force[k] * v[load.node, k]
    power = state.work.lanes[0].power
    power[HELD], power[LOADS], power[FED] = held, given, fed(line, state)
    if line.rigid.bodies.shape[0] > 0:
        worst = max(worst, condense(line, state))
    return worst


residual = opaque(_residual)


def link_residual(line, state) -> None:
    """Compile or load the residual and publish it; call before anything that uses it runs."""
    link_assembly(line, state)
    link_rigid(line, state)
    link_wakes(line, state)
    link(_hold_struts, line, state, AT_REST, np.bool_(False), needed=len(line.struts) > 0)
    link(_carry_beads, line, state, AT_REST, np.bool_(False), needed=len(line.beads) > 0)
    link(_residual, line, state, AT_REST, np.bool_(False))
