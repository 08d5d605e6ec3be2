"""Wind on what is above the water: crossflow drag of the cable and drag of level bodies, held in a step.

It is evaluated once a step, for its end, at the predicted shape, and stands in columns WIND of State.work.around; of an
element that crosses the surface on the dry intervals alone, see waterline.py. On a body with an attitude of its own it
is part of the balance, see rigid_loads.py.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from ..compiler.jit import LANES, driver, link, opaque
from .ancf import HALF_RHO_D
from .drag_laws import smooth
from .hermite import LINK, W4, X4, shape, slope
from .parameter import Block, choice, quantity
from .sea import ELEVATION, WIND
from .state import ARC, FLOW, NOW, Q, V
from .towbody import heading
from .vec import axpy, dot, norm, scale
from .water import CurrentFrame
from .water_kinematics import stir
from .waterline import wet_intervals

CABLE, BODIES = 0, 1  # of LINE_SETTINGS air


class Air(Block):
    wind: tuple[float, float] = quantity(
        (0.0, 0.0), "m/s", -100.0, 100.0, "velocity of the wind, east and north, the same at every height; 0: no drag"
    )
    frame: CurrentFrame = choice(
        CurrentFrame.WORLD, "world: wind is east and north; heading: ahead and to port of the start's"
    )
    density: float = quantity(1.2, "kg/m^3", 0.5, 2.0, "density of the air", "20 deg C, 1 bar")
    drag_coefficient: float = quantity(
        1.2, "1", 0.0, 3.0, "C_D of the cable across the wind", "cylinder at Re 1e4, DNV-RP-C205 (2010) 6.7"
    )


@driver
def blow_between(line, state, e, begin, end):
    """Wind on element e from begin to end of its unit length, onto its nodes."""
    q, v, arc, around = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, ARC], state.work.around
    length, w, is_link = arc[e + 1, 0] - arc[e, 0], state.memory[NOW].wind, arc[e, LINK] != 0.0
    drag = line.settings[0].air[CABLE] * line.elements[e // LANES, HALF_RHO_D, e % LANES] * length * (end - begin)
    for g in range(4):
        x = begin + (end - begin) * X4[g]
        n0, n1, n2, n3 = shape(x)
        d0, d1, d2, d3 = slope(x)
        if is_link:
            n0, n1, n2, n3 = 1.0 - x, 0.0, x, 0.0
            d0, d1, d2, d3 = -1.0, 0.0, 1.0, 0.0
        n1, n3, d1, d3 = n1 * length, n3 * length, d1 * length, d3 * length
        u, t = (w[0], w[1], 0.0), (0.0, 0.0, 0.0)
        for n, kind, by_place, by_rate in ((e, 0, d0, n0), (e, 3, d1, n1), (e + 1, 0, d2, n2), (e + 1, 3, d3, n3)):
            t = axpy(by_place, (q[n, kind], q[n, kind + 1], q[n, kind + 2]), t)
            u = axpy(-by_rate, (v[n, kind], v[n, kind + 1], v[n, kind + 2]), u)
        t = scale(1.0 / norm(t), t)
        across = axpy(-dot(u, t), t, u)
        force = scale(drag * W4[g] * norm(across), across)
        for k in range(3):
            around[e, WIND + k] += n0 * force[k]
            around[e, WIND + 3 + k] += n1 * force[k]
            around[e + 1, WIND + k] += n2 * force[k]
            around[e + 1, WIND + 3 + k] += n3 * force[k]


@driver
def blow_element(line, state, e):
    """Wind on what of element e is above the water."""
    q, arc, around = state.nodes[NOW, Q], state.nodes[NOW, ARC], state.work.around
    length, bounds = arc[e + 1, 0] - arc[e, 0], state.work.lanes[0].cut[3]
    low, high = q[e, 2] - around[e, ELEVATION], q[e + 1, 2] - around[e + 1, ELEVATION]
    if max(low, high) + length < 0.0:
        return
    tilt = around[e + 1, ELEVATION] - around[e, ELEVATION]
    rise, fall = length * q[e, 5] - tilt, length * q[e + 1, 5] - tilt
    if arc[e, LINK] != 0.0:
        rise, fall = high - low, high - low
    begin = 0.0
    for i in range(wet_intervals((low, rise, high, fall), bounds)):
        if bounds[2 * i] > begin:
            blow_between(line, state, e, begin, bounds[2 * i])
        begin = bounds[2 * i + 1]
    if begin < 1.0:
        blow_between(line, state, e, begin, 1.0)


@driver
def blow_body(line, state, i):
    """Wind on a level body, as drag in its axes."""
    body, n, around = line.bodies[i], line.body_nodes[i], state.work.around
    q, v, w = state.nodes[NOW, Q], state.nodes[NOW, V], state.memory[NOW].wind
    dry, _ = smooth(q[n, 2] - around[n, ELEVATION], -body.half_height, body.half_height)
    if dry == 0.0 or body.rigid >= 0:
        return
    yaw = heading(state.nodes[NOW, FLOW, n])
    c, s = cos(yaw), sin(yaw)
    ux, uy, uz = w[0] - v[n, 0], w[1] - v[n, 1], -v[n, 2]
    bx, by = c * ux + s * uy, c * uy - s * ux
    size = line.settings[0].air[BODIES] * dry * sqrt(bx * bx + by * by + uz * uz)
    fx, fy = size * body.drag[0] * bx, size * body.drag[1] * by
    around[n, WIND] += c * fx - s * fy
    around[n, WIND + 1] += s * fx + c * fy
    around[n, WIND + 2] += size * body.drag[2] * uz


@driver
def _blow(line, state) -> None:
    """Wind of the present shape on every node."""
    around = state.work.around
    for n in range(around.shape[0]):
        for k in range(6):
            around[n, WIND + k] = 0.0
    for e in range(around.shape[0] - 1):
        blow_element(line, state, e)
    for i in range(line.bodies.shape[0]):
        blow_body(line, state, i)


blow = opaque(_blow)


@driver
def wash(line, state, h):
    """Water and wind at the present shape, of a step of h [s] as stir() takes it."""
    if state.work.stream.shape[0] > 0:
        stir(line, state, h)
    if line.settings[0].air[BODIES] > 0.0:
        blow(line, state)


def link_wind(line, state) -> None:
    """Compile or load blow() and publish it, where there is wind."""
    link(_blow, line, state, needed=bool(line.settings["air"][0, BODIES] > 0.0))
