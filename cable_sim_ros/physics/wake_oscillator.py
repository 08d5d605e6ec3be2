"""Wake oscillator in time: the force that shed vortices exert on short spans, and how the cable's motion drives them.

Bai & Qin as printed by Westin (2018), appendix A, (A19)-(A20), corrected (docs/wake.md): om w for om^2 w, and the sign
in the bracket, with which a small wake grows. With q = w'/om and s = w

    s' = om q,    q' = -om s + a1 om (1 - a2 q^2) q + (a3/d) Y',    om = 2 pi St U/d

which is q'' + a1 om (3 a2 q^2 - 1) q' + om^2 q = (a3/d) Y'' where om is constant: van der Pol's form, Facchinetti's
oscillator for a2 = 1/3. Alone it ends on a cycle of amplitude 2/sqrt(3 a2).

    f_CF = (1/4) C_L0 rho U^2 d q  along t x V_n,     f_SW = -(1/4) C_D0 rho U^2 d q q'/om  along V_n

U = |V_n| of the flow past the cable, less along it, with a lag of FLOW_PERIODS periods of shedding: t is the tangent
from the drum end outward, Y' the velocity of the cable along t x V_n beyond that flow. Below MIN_RE nothing is shed.
"""

from __future__ import annotations

from enum import Enum
from math import ceil, cos, exp, pi, sin, sqrt

import numpy as np

from ..compiler.jit import LANES, driver, inline, link, opaque
from .drag_laws import smooth
from .parameter import Block, choice, quantity
from .sea import ELEVATION, EXTRA, ORBIT, SHEAR
from .state import ARC, NOW, STEP, WAKE, Q, V
from .vec import add, axpy, cross, dot, scale
from .workspace import WATER

# columns of State.nodes[:, WAKE]: q and s; the lagging flow past the node [m/s]; its shedding frequency [rad/s], 0: not
# begun
WAKE_Q, WAKE_S, WAKE_FLOW, WAKE_RATE = np.array((0, 1, 2, 5))
START = 0.1  # q^2 + s^2 = START^2 at the start: a small wake, which grows
FLOW_PERIODS = 10.0
SUBSTEP = 0.1  # rad of shedding that one sub-step of the oscillator takes at most, MAX_SUBSTEPS of them a step
MAX_SUBSTEPS = 200
MAX_SWING = 8.0  # diameters: a wake is driven no harder than by such an amplitude at its own frequency
MIN_RE, RE_FULL = 47.0, 60.0  # nothing is shed below, all of the force acts from there on
# rad of shedding in a step: beyond the first the force fades, at the second its mean over the step is taken, none
TURN_FADES, TURN_LOST = 2.0 * pi / 10.0, 2.0 * pi / 5.0


class WakeLaw(str, Enum):
    """Oscillators."""

    OFF = "off"
    BAI_QIN = "bai_qin"  # a2 = 0.2
    FACCHINETTI = "facchinetti"  # a2 = 1/3


SATURATION = {WakeLaw.BAI_QIN: 0.2, WakeLaw.FACCHINETTI: 1.0 / 3.0}


class WakePhase(str, Enum):
    """How the wakes of the nodes begin."""

    UNIFORM = "uniform"  # all alike: the largest force, as in the source
    ALTERNATING = "alternating"  # every other node the other way
    RANDOM = "random"  # of each node its own, by the seed


class Wake(Block):
    law: WakeLaw = choice(
        WakeLaw.OFF, "oscillator of the vortices that bare cable sheds, for short spans", "docs/wake.md"
    )
    strouhal: float = quantity(0.2, "1", 0.05, 0.5, "St = f d/U of the normal flow", "Westin (A25)")
    lift_coefficient: float = quantity(
        0.3, "1", 0.0, 5.0, "C_L0, lift of a wake of q = 2 on a held cable", "Westin (A20b)"
    )
    drag_coefficient: float = quantity(0.2, "1", 0.0, 5.0, "C_D0 of the streamwise force", "Westin (A20a)")
    growth: float = quantity(0.3, "1", 0.0, 3.0, "a1: a small wake grows by a1 om/2", "Westin (A19)")
    saturation: float | None = quantity(
        None, "1", 0.001, 10.0, "a2; none: that of the law, 0.2 or 1/3", "Westin (A19); Facchinetti"
    )
    coupling: float = quantity(12.0, "1", 0.0, 100.0, "a3: how the cable's motion drives its wake", "Westin (A19)")
    phase: WakePhase = choice(WakePhase.UNIFORM, "how the wakes along the cable begin")
    seed: int = quantity(0, "1", 0, 2**31 - 1, "of the phases, where they are random")


WAKE_SECTION = np.dtype(
    [
        ("end", "f8"),  # m, arc length at which the section ends
        ("on", "i8"),
        ("a1", "f8"),
        ("a2", "f8"),
        ("a3", "f8"),
        ("strouhal", "f8"),
        ("diameter", "f8"),  # m
        ("lift", "f8"),  # kg/m^2: C_L0 rho d/4 and C_D0 rho d/4
        ("drag", "f8"),
        ("re_factor", "f8"),  # s/m, rho d/mu
    ],
    align=True,
)
NEAR = 1e-6  # m from the end of a section: on it


def wake_section(wake: Wake, end: float, diameter: float, density: float, viscosity: float) -> np.ndarray:
    """WAKE_SECTION record of a section that ends at arc length ``end`` [m]; diameter [m], fluid in SI."""
    row = np.zeros((), WAKE_SECTION)
    row["end"], row["on"] = end, wake.law is not WakeLaw.OFF
    row["a1"], row["a3"], row["strouhal"] = wake.growth, wake.coupling, wake.strouhal
    row["a2"] = SATURATION.get(wake.law, 1.0) if wake.saturation is None else wake.saturation
    row["diameter"], row["re_factor"] = diameter, density * diameter / viscosity
    row["lift"] = 0.25 * wake.lift_coefficient * density * diameter
    row["drag"] = 0.25 * wake.drag_coefficient * density * diameter
    return row


@inline
def section_at(wakes, s):
    """Number of the section that holds arc length s [m]."""
    i = 0
    while i < wakes.shape[0] - 1 and s > wakes[i].end:
        i += 1
    return i


@inline
def section_of_node(wakes, s):
    """Number of the section whose wake a node at arc length s [m] has: between two, the first with one."""
    i = section_at(wakes, s - NEAR)
    return i if wakes[i].on != 0 else section_at(wakes, s + NEAR)


@inline
def damped(q, a2, grown):
    """q after a time in which a small one grows by the factor sqrt(grown): q' = a1 om (1 - a2 q^2) q, exactly."""
    return q * sqrt(grown / (1.0 + a2 * q * q * (grown - 1.0)))


@driver
def oscillate(q, s, a1, a2, om, first, last, h):
    """q and s after h [s], the drive (a3/d) Y' [1/s] going from ``first`` to ``last``: second order, always stable.

    Strang's splitting in equal sub-steps: damping (exact), half a kick, rotation (exact), half a kick, damping.
    """
    count = max(1, min(int(ceil(om * h / SUBSTEP)), MAX_SUBSTEPS))
    dt = h / count
    c, n, grown = cos(om * dt), sin(om * dt), exp(a1 * om * dt)
    for i in range(count):
        kick = 0.5 * dt * (first + (last - first) * (i + 0.5) / count)
        q = damped(q, a2, grown) + kick
        q, s = c * q - n * s, c * s + n * q
        q = damped(q + kick, a2, grown)
    return q, s


@inline
def flow_past(q, v, arc, current, n):
    """Velocity [m/s] of the fluid past the material at node n."""
    rate = arc[n, 1]
    return (
        current[0] - current[2] * q[n, 2] - v[n, 0] + rate * q[n, 3],
        current[1] - current[3] * q[n, 2] - v[n, 1] + rate * q[n, 4],
        rate * q[n, 5] - v[n, 2],
    )


@driver
def stream_near(streams, n, last, z):
    """Velocity [m/s] of waves, tables and turbulence (sea.py) at node n, at height z [m]: mean of the Gauss points next
    to it. ``last``: the last node."""
    u = (0.0, 0.0, 0.0)
    if streams.shape[0] == 0:
        return u
    count = 0
    for e in range(max(n - 1, 0), min(n, last - 1) + 1):
        s, lane = streams[e // LANES, 3 if e < n else 0], e % LANES
        point = (
            s[EXTRA, lane] - s[SHEAR, lane] * z + s[ORBIT, lane],
            s[EXTRA + 1, lane] - s[SHEAR + 1, lane] * z + s[ORBIT + 1, lane],
            s[EXTRA + 2, lane] + s[ORBIT + 2, lane],
        )
        u, count = add(u, point), count + 1
    return scale(1.0 / count, u)


@inline
def shed(past, tangent, row):
    """(V_n [m/s], its size, shedding frequency [rad/s] held at that of MIN_RE, share of the force by Re)."""
    across = axpy(-dot(past, tangent), tangent, past)
    speed = sqrt(dot(across, across))
    om = 2.0 * pi * row.strouhal * max(speed, MIN_RE / row.re_factor) / row.diameter
    return across, speed, om, smooth(row.re_factor * speed, MIN_RE, RE_FULL)[0]


@driver
def _advance_wake(line, state, h) -> None:
    """Wakes at the end of a predicted step of h [s], and their load on every node: Work.wake.

    Columns 0 to 2 of the load are U^2 q along t x V_n, 3 to 5 -U^2 q q'/om along V_n [m^2/s^2]; rho d C/4 is the
    element's.
    """
    wakes, load, m, around = line.wakes, state.work.wake, state.memory[NOW].current, state.work.around
    now, old, arc = state.nodes[NOW], state.nodes[STEP], state.nodes[NOW, ARC]
    current = (m[0], m[1], m[2], m[3])
    for n in range(load.shape[0]):
        for k in range(6):
            load[n, k] = 0.0
        row = wakes[section_of_node(wakes, arc[n, 0])]
        if row.on == 0 or now[Q, n, 2] >= around[n, ELEVATION]:
            continue
        wake = now[WAKE, n]
        stream = stream_near(state.work.stream, n, load.shape[0] - 1, now[Q, n, 2])
        first = add(stream, flow_past(old[Q], old[V], arc, current, n))
        last = add(stream, flow_past(now[Q], now[V], arc, current, n))
        g = (now[Q, n, 3], now[Q, n, 4], now[Q, n, 5])
        tangent = scale(1.0 / sqrt(dot(g, g)), g)
        if wake[WAKE_RATE] == 0.0:
            for k in range(3):
                wake[WAKE_FLOW + k] = first[k]
            wake[WAKE_RATE] = shed(first, tangent, row)[2]
        fraction = 1.0 - exp(-h * wake[WAKE_RATE] / (2.0 * pi * FLOW_PERIODS))
        for k in range(3):
            wake[WAKE_FLOW + k] += fraction * (0.5 * (first[k] + last[k]) - wake[WAKE_FLOW + k])
        past = (wake[WAKE_FLOW], wake[WAKE_FLOW + 1], wake[WAKE_FLOW + 2])
        across, speed, om, fraction = shed(past, tangent, row)
        mean = 0.5 * (wake[WAKE_RATE] + om)
        wake[WAKE_RATE] = om
        along = scale(1.0 / max(speed, 1e-9), across)
        aside = cross(tangent, along)
        maximum = MAX_SWING * row.diameter * mean
        drive = fraction * row.a3 / row.diameter
        begin = drive * min(max(-dot(first, aside), -maximum), maximum)
        end = drive * min(max(-dot(last, aside), -maximum), maximum)
        q, s = oscillate(wake[WAKE_Q], wake[WAKE_S], row.a1, row.a2, mean, begin, end, h)
        wake[WAKE_Q], wake[WAKE_S] = q, s
        rate = -s + row.a1 * (1.0 - row.a2 * q * q) * q + end / om
        fraction *= 1.0 - smooth(om * h, TURN_FADES, TURN_LOST)[0]
        pressure = fraction * speed * speed
        for k in range(3):
            load[n, k] = pressure * q * aside[k]
            load[n, 3 + k] = -pressure * q * rate * along[k]


@driver
def _add_wake(line, state) -> None:
    """Load of the wakes on the right-hand side of the system, and its power to that of the water.

    Linear along an element between its nodes, integrated exactly with the shape functions. It is held in a step, so
    that the tangent has no part of it.
    """
    wakes, load, band, arc = line.wakes, state.work.wake, state.work.band, state.nodes[NOW, ARC]
    v, power = state.nodes[NOW, V], 0.0
    for e in range(load.shape[0] - 1):
        length = arc[e + 1, 0] - arc[e, 0]
        row = wakes[section_at(wakes, arc[e, 0] + 0.5 * length)]
        if row.on == 0:
            continue
        square = length * length
        for k in range(3):
            a = row.lift * load[e, k] + row.drag * load[e, 3 + k]
            b = row.lift * load[e + 1, k] + row.drag * load[e + 1, 3 + k]
            f0, f1 = length * (0.35 * a + 0.15 * b), length * (0.15 * a + 0.35 * b)
            m0, m1 = square * (a / 20.0 + b / 30.0), -square * (a / 30.0 + b / 20.0)
            band[e, k, 12] += f0
            band[e, 3 + k, 12] += m0
            band[e + 1, k, 12] += f1
            band[e + 1, 3 + k, 12] += m1
            power += f0 * v[e, k] + m0 * v[e, 3 + k] + f1 * v[e + 1, k] + m1 * v[e + 1, 3 + k]
    state.work.lanes[0].power[WATER] += power


@driver
def no_wake_load(state):
    """No load of wakes: a line at rest."""
    load = state.work.wake
    for n in range(load.shape[0]):
        for k in range(6):
            load[n, k] = 0.0


add_wake, advance_wake = opaque(_add_wake), opaque(_advance_wake)


def link_wakes(line, state) -> None:
    """Compile or load what a line with wakes needs and publish it; call before a step runs."""
    link(_add_wake, line, state, needed=len(line.wakes) > 0)
    link(_advance_wake, line, state, 0.0, needed=len(line.wakes) > 0)
