"""Where the water of sea.py is evaluated: once a step, for its end, at the predicted shape, into tables of State.work.

Points that no component reaches cost nothing but their place; a sea at rest costs one test a step.
"""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from ..compiler.jit import LANES, driver, link, opaque
from .drag import POINT_R
from .hermite import X4, shape
from .sea import (
    ELEVATION,
    EXTRA,
    FREQUENCY,
    NUMBER,
    PHASE,
    RATE,
    SHEAR,
    TOWARDS,
    elevation,
    gust,
    look_up,
    push_lanes,
    stream_at,
    stream_lanes,
    tabled,
    wave_lanes,
)
from .state import ARC, NOW, Q
from .workspace import WEIGHT

N4L = np.repeat(np.array([shape(x) for x in X4])[:, :, None], LANES, 2)  # shape functions, [Gauss point, 4, LANES]
STILL = -1.0  # in place of the length of a step: a static start


@driver
def pass_time(sea, state, h):
    """Take the SEA of the present on by h [s], with the phases of the waves, see stir()."""
    memory, phase = state.memory[NOW], state.work.phase
    now, frame, settings = memory.sea, memory.frame, sea.settings[0]
    if h > 0.0:
        now.time += h
        for k in range(2):
            now.shift[k] += h * frame.velocity[k]
    grown = min(now.time / settings.ramp, 1.0) if settings.ramp > 0.0 else 1.0
    now.fraction[0], now.fraction[1] = grown * grown * (3.0 - 2.0 * grown), 0.0
    if grown < 1.0:
        now.fraction[1] = 6.0 * grown * (1.0 - grown) / settings.ramp
    if h < 0.0:
        now.fraction[0], now.fraction[1] = 0.0, 0.0
    factor, turn = 1.0, now.current_yaw
    if sea.variation.shape[0] > 0:
        factor, angle, _, _ = look_up(sea.variation, now.time)
        turn += angle
        c, s, steady = factor * cos(angle), factor * sin(angle), now.steady
        memory.current[0] = c * steady[0] - s * steady[1] - frame.velocity[0]
        memory.current[1] = s * steady[0] + c * steady[1] - frame.velocity[1]
        memory.current[2], memory.current[3] = c * steady[2] - s * steady[3], s * steady[2] + c * steady[3]
    now.turn[0], now.turn[1] = factor * cos(turn), factor * sin(turn)
    for i in range(sea.waves.shape[0]):
        w = sea.waves[i]
        b = w[TOWARDS] + now.wave_yaw
        phase[i, 0], phase[i, 1] = w[NUMBER] * cos(b), w[NUMBER] * sin(b)
        angle = phase[i, 0] * now.shift[0] + phase[i, 1] * now.shift[1] - w[FREQUENCY] * now.time + w[PHASE]
        phase[i, 2] = angle % (2.0 * pi)


@driver
def heave_surface(sea, state):
    """Elevation of the surface over the nodes of every element that may cross it."""
    now, work, q, arc = state.memory[NOW].sea, state.work, state.nodes[NOW, Q], state.nodes[NOW, ARC]
    crest, marked = sea.settings[0].crest, -1
    for e in range(q.shape[0] - 1):
        sag = 0.5 * (arc[e + 1, 0] - arc[e, 0])
        low, high = min(q[e, 2], q[e + 1, 2]) - sag, max(q[e, 2], q[e + 1, 2]) + sag
        for n in range(e, e + 2):
            if low < crest and high > -crest:
                if n > marked:
                    work.around[n, ELEVATION] = elevation(sea.waves, work.phase, now.fraction, q[n, 0], q[n, 1])
                    marked = n
            elif n > marked:
                work.around[n, ELEVATION] = 0.0


@driver
def fill(sea, now, work, gusts, top, place, out):
    """Stream at the points in rows POINT_R of ``place`` into out [STREAM_ROWS, LANES]; top: their highest z."""
    wave_lanes(sea.waves, work.phase, now.fraction, top, place, out)
    for e in range(LANES):
        out[EXTRA, e], out[EXTRA + 1, e], out[EXTRA + 2, e] = gusts[0], gusts[1], gusts[2]
        out[SHEAR, e], out[SHEAR + 1, e] = 0.0, 0.0
        for k in range(3):
            out[RATE + k, e] += gusts[3 + k]
    if sea.profile.shape[0] > 0:
        for e in range(LANES):
            z = place[POINT_R + 2, e]
            u, v, du, dv = tabled(sea, now, z)
            out[EXTRA, e] += u - du * z
            out[EXTRA + 1, e] += v - dv * z
            out[SHEAR, e], out[SHEAR + 1, e] = -du, -dv


@driver
def locate_points(state, group, g, place):
    """Gauss point g of every element of a group into rows POINT_R of ``place``; returns lowest and highest z of its
    elements' reach and the highest of the points."""
    q, arc = state.nodes[NOW, Q], state.nodes[NOW, ARC]
    count, s = q.shape[0] - 1, shape(X4[g])
    low, high = 1e300, -1e300
    for lane in range(LANES):
        e = min(LANES * group + lane, count - 1)
        length = arc[e + 1, 0] - arc[e, 0]
        for k in range(3):
            place[POINT_R + k, lane] = (
                s[0] * q[e, k] + s[1] * length * q[e, 3 + k] + s[2] * q[e + 1, k] + s[3] * length * q[e + 1, 3 + k]
            )
        low = min(low, min(q[e, 2], q[e + 1, 2]) - 0.5 * length)
        high = max(high, place[POINT_R + 2, lane])
    return low, high


@driver
def _stir(line, state, h) -> None:
    """The water at the end of a step of h [s] that has just been predicted; h = 0: of now; STILL: of now, without waves
    and turbulence."""
    sea, work = line.sea, state.work
    pass_time(sea, state, h)
    now, gusts, place = state.memory[NOW].sea, work.gusts, work.lanes[0].point
    gust(sea.eddies, now, gusts)
    if sea.waves.shape[0] > 0:
        heave_surface(sea, state)
    for group in range(work.stream.shape[0]):
        for g in range(4):
            low, high = locate_points(state, group, g, place)
            if low > sea.settings[0].crest:
                break  # in the air, all of it
            fill(sea, now, work, gusts, high, place, work.stream[group, g])
    q, out = state.nodes[NOW, Q], work.stream_of_body
    for i in range(line.bodies.shape[0]):
        n = line.body_nodes[i]
        for lane in range(LANES):
            for k in range(3):
                place[POINT_R + k, lane] = q[n, k]
        fill(sea, now, work, gusts, q[n, 2], place, out)
        for row in range(out.shape[0]):
            work.around[n, row] = out[row, 0]
        work.around[n, ELEVATION] = elevation(sea.waves, work.phase, now.fraction, q[n, 0], q[n, 1])


@driver
def _stream_points(streams, g, work) -> None:
    """Add the streams of a group to the kinematics at Gauss point g of its elements."""
    stream_lanes(streams[0, g], work.x, N4L[g], work.point)


@driver
def _push_points(streams, g, work, p) -> None:
    """Add the Froude-Krylov load at Gauss point g of a group."""
    push_lanes(streams[0, g], p, work.lane[WEIGHT], work.load[g])


@driver
def _stream_cut(streams, e, work) -> None:
    """The same at the points of the partly wet element in lane e, see waterline.py."""
    stream, at = work.cut_stream[:], work.cut[1]
    for lane in range(LANES):
        stream_at(streams[0], e, at[lane], lane, stream)
    stream_lanes(stream, work.cut_x, work.cut_n, work.point)


@driver
def _push_cut(work) -> None:
    push_lanes(work.cut_stream[:], work.cut_p[:], work.cut[0], work.load[0])


stir, stream_points, push_points = opaque(_stir), opaque(_stream_points), opaque(_push_points)
stream_cut, push_cut = opaque(_stream_cut), opaque(_push_cut)


def link_stir(line, state) -> None:
    """Compile or load what more than a linear current needs, and publish it; call before the assembly runs."""
    streams, work = state.work.stream, state.work.lanes[0]
    there = len(streams) > 0
    link(_stir, line, state, 0.0, needed=there)
    link(_stream_points, streams, 0, work, needed=there)
    link(_push_points, streams, 0, work, line.elements[0], needed=there)
    link(_stream_cut, streams, 0, work, needed=there)
    link(_push_cut, work, needed=there)
