"""Instruments: what a controller aboard can measure, and what it is told at the next tick.

Tension is the effective tension. Aboard: conjugate to the arc length of an element (see ancf.py), interpolated between
element middles, as at the point where the cable leaves the sheave. Outboard: from the gradient at the nodes. At the
drum: from the force that holds the cable end.
"""

from math import acos, cos, sin, sqrt

from ..compiler.jit import LANES, driver, inline
from .ancf import COMPRESSION, EA
from .heave_compensation import signed_departure
from .hermite import LINK, point_of
from .ship import unrotate
from .state import ARC, NOW, Q
from .vec import axpy, norm, scale


@inline
def locate(arc, s):
    """Element and xi at unstretched arc length s, clamped to the cable."""
    low, high = 0, arc.shape[0] - 1
    s = min(max(s, arc[0]), arc[high])
    while high - low > 1:
        mid = (low + high) // 2
        if arc[mid] <= s:
            low = mid
        else:
            high = mid
    return low, (s - arc[low]) / (arc[low + 1] - arc[low])


@driver
def tension_at(state, s):
    """Element tensions interpolated between element middles at arc length s."""
    arc, tension = state.nodes[NOW, ARC, :, 0], state.tension
    e, x = locate(arc, s)
    o = e + 1 if x > 0.5 else e - 1
    if o < 0 or o >= tension.shape[0]:
        return tension[e]
    me, mo = 0.5 * (arc[e] + arc[e + 1]), 0.5 * (arc[o] + arc[o + 1])
    w = (s - me) / (mo - me)
    return tension[e] * (1.0 - w) + tension[o] * w


@driver
def node_tension(elements, q, n):
    """Tension at a node of a nearly straight cable from its gradient: continuous where the load per length jumps.

    Shorter than unstretched it pushes with the share of EA that it has in compression.
    """
    e = min(n, q.shape[0] - 2)
    rows, lane = elements[e // LANES], e % LANES
    strain = sqrt(q[n, 3] ** 2 + q[n, 4] ** 2 + q[n, 5] ** 2) - 1.0
    return rows[EA, lane] * strain * (rows[COMPRESSION, lane] if strain < 0.0 else 1.0)


@inline
def end_strain(elements, state):
    """Strain of the first element: what the drum winds on."""
    return state.tension[0] / elements[0, EA, 0]


@driver
def direction_at(state, s):
    """Unit tangent at arc length s, towards the towbody; along links from that at the joints, so that none jumps."""
    arc, q = state.nodes[NOW, ARC], state.nodes[NOW, Q]
    e, x = locate(arc[:, 0], s)
    _, _, g = point_of(arc, q, q, e, x)
    if arc[e, LINK] != 0.0:
        g = axpy(x, (q[e + 1, 3], q[e + 1, 4], q[e + 1, 5]), scale(1.0 - x, (q[e, 3], q[e, 4], q[e, 5])))
    return scale(1.0 / norm(g), g)


@driver
def measure(state, out, tension):
    """Keep what the instruments show of the departing cable: its direction ``out`` and tension [N]."""
    measured, now = state.memory[NOW].measured, state.memory[NOW].time.now
    measured.departure_angle, measured.tension = acos(min(max(-out[2], -1.0), 1.0)), tension
    departure, since = signed_departure(state.memory[NOW].setpoint, out), (now - measured.departure_stamp) * 1e-9
    measured.departure_rate = (departure - measured.departure) / since if since > 0.0 else 0.0
    measured.departure, measured.departure_stamp = departure, now


@inline
def drum_torque(drum, phi, state):
    """Torque of the cable's reaction about the drum axis [N m]: it pulls the drum round with minus the reaction.

    phi: angle [rad] at which the first node stands. A drum that feeds bears T R and no more: the momentum that the
    material carries onto it, mu w^2 R a second, is what the turning drum gains in angular momentum.
    """
    coord, reaction = state.memory[NOW].ship.motion.coord, state.reaction
    local = unrotate(coord, (reaction[0, 0], reaction[0, 1], reaction[0, 2]))
    return drum.radius * (drum.side * cos(phi) * local[0] - sin(phi) * local[2])
