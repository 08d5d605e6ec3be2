"""Strumming: vortex-induced vibration of the cable, and by how much it raises the mean drag.

Once a period, from the shape, the tension and the running mean of the flow across the cable: Reynolds number, shedding
frequency, amplitude A/d, drag factor G, number of the mode of that frequency. G in force follows its target with a
limited rate. Per element, kept in row STRUM of the node at which it begins; the gather (cable_assembly.py) adds G - 1
to that of the section, and drag.py multiplies the drag of the mean flow across the cable by it. Not that along it: the
formulas are of the cross-flow C_D.

    alpha = (m/(rho A) + C_m) zeta
    A/d = 1.155 (1 - 1.12 alpha + 0.30 alpha^2) log10(0.41 Re^0.36)     Govardhan & Williamson (2006), Re 500 to 33000
    A/d = 1.155 1.29/(1 + 0.43 S)^3.35,   A/d = 1.155 0.32/sqrt(0.06 + S^2)      Skop & Griffin; Sarpkaya
    S = 2 pi^3 St^2 alpha,   St = 0.2 (1 - 20/Re)
    G = 1 + 1.043 (2 y/d)^0.65, y = A/2 or A/sqrt(2)  Vandiver (1983);   G = 1 + 2.1 A/d   Blevins

1.155: a string in its mode against a rigid cylinder on springs. Re < 47 sheds no vortices; a fairing holds the cable
still. docs/strumming.md
"""

from __future__ import annotations

from enum import Enum
from math import log, log10, pi, sqrt

from ..compiler.jit import driver, inline
from .hermite import point_of
from .parameter import Block, choice, quantity
from .sea import current_at
from .state import ARC, MEAN, NOW, STRUM, Q
from .vec import axpy, dot, norm, scale
from .workspace import BINS

EXTRA, TARGET, SPEED, FREQUENCY, AMPLITUDE, MODE = range(6)  # columns: G - 1, what it tends to, m/s, Hz, 1, 1
RE_SHEDDING, RE_FULL = 47.0, 60.0  # below the first the wake is steady; amplitudes set in smoothly up to the second
STRING, MAX_ALPHA, MAX_AMPLITUDE, MAX_FACTOR = 1.155, 1.8, 1.3, 3.0
SLOWEST, FASTEST = 1e-3, 20.0  # m/s, bounds of the classes of speed
SHAPE_ONLY = 8  # columns of the shape table that are no matter of this file


class StrumLaw(str, Enum):
    """Amplitude of a strumming cable."""

    OFF = "off"
    GOVARDHAN_WILLIAMSON = "govardhan_williamson"
    SKOP_GRIFFIN = "skop_griffin"
    SARPKAYA = "sarpkaya"


class StrumDrag(str, Enum):
    """Drag factor of an amplitude."""

    VANDIVER = "vandiver"
    BLEVINS = "blevins"


class StrumRms(str, Enum):
    """Where along a standing wave the rms displacement of `vandiver` is taken."""

    MEAN = "mean"  # A/2: mean square over the wave
    ANTINODE = "antinode"  # A/sqrt(2)


LAWS, FORMULAS = tuple(StrumLaw), tuple(StrumDrag)
SKOP_GRIFFIN, SARPKAYA = LAWS.index(StrumLaw.SKOP_GRIFFIN), LAWS.index(StrumLaw.SARPKAYA)
BLEVINS = FORMULAS.index(StrumDrag.BLEVINS)


class Viv(Block):
    """Vortex-induced vibration of the cable in the water, and the drag factor computed from it."""

    law: StrumLaw = choice(
        StrumLaw.OFF,
        "law of the amplitude; off: sections have the constant drag_amplification alone",
        "docs/strumming.md; Govardhan & Williamson (2006)",
    )
    damping_ratio: float = quantity(
        0.01,
        "1",
        0.0,
        1.0,
        "structural damping of the cable in the water, of critical; 0.005 to 0.02 where it is not known",
    )
    multiplier: float = quantity(
        1.0,
        "1",
        0.0,
        2.0,
        "factor on the amplitude; 0.6 where cable is inclined by less than 35 deg to the flow or the flow is strongly "
        "sheared",
        "docs/strumming.md",
        configure=False,
    )
    amplification: StrumDrag = choice(
        StrumDrag.VANDIVER, "drag factor of an amplitude", "Vandiver (1983); Blevins (1990)"
    )
    rms: StrumRms = choice(
        StrumRms.MEAN, "rms displacement that vandiver takes: mean over the standing wave, or antinode"
    )
    lock_in_band: float = quantity(
        0.0,
        "1",
        0.0,
        0.9,
        "an amplitude is reduced to the share of the strumming cable whose shedding frequency is within this part of "
        "its own; 0.2 is usual; 0: not reduced",
        "docs/strumming.md",
    )
    rate: float = quantity(0.05, "1/s", 1e-4, 100.0, "most change of the drag factor in a second")
    period: float = quantity(
        1.0, "s", 0.01, 3600.0, "simulation time from one evaluation to the next; at least one tick"
    )


@inline
def strouhal(re):
    """Shedding frequency times diameter over normal speed, for Re of 47 and more."""
    return 0.2 * (1.0 - 20.0 / re)


@inline
def onset(re):
    """Share of the amplitude at a Reynolds number, 0 to 1: a jump at 47 would leave a static start without solution."""
    t = min(max((re - RE_SHEDDING) / (RE_FULL - RE_SHEDDING), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@inline
def amplitude(law, alpha, re):
    """A/d of the antinodes by a law (place in LAWS) for mass damping alpha; re: Reynolds number, past the onset."""
    if law == SKOP_GRIFFIN or law == SARPKAYA:
        st = 0.2 * (1.0 - 20.0 / re)
        s = 2.0 * pi * pi * pi * st * st * alpha
        return STRING * (1.29 / (1.0 + 0.43 * s) ** 3.35 if law == SKOP_GRIFFIN else 0.32 / sqrt(0.06 + s * s))
    a = min(alpha, MAX_ALPHA)
    return STRING * (1.0 - 1.12 * a + 0.30 * a * a) * log10(0.41 * re**0.36)


@inline
def amplification(formula, antinode, a):
    """Drag factor G of an amplitude a >= 0 in diameters; formula: place in FORMULAS; antinode: 1: rms taken there."""
    if formula == BLEVINS:
        return 1.0 + 2.1 * a
    return 1.0 + 1.043 * (a * (sqrt(2.0) if antinode != 0 else 1.0)) ** 0.65


@inline
def class_of(speed):
    """Place of a speed among the classes, logarithmic, 0 to BINS - 1."""
    fraction = log(max(speed, SLOWEST) / SLOWEST) / log(FASTEST / SLOWEST)
    return min(fraction, 1.0) * (BINS - 1)


@inline
def up_to(bins, speed):
    """Length of strumming cable [m] past which the flow is slower than ``speed``, of the accumulated classes."""
    x = class_of(speed)
    i = min(int(x), BINS - 2)
    return bins[i] + (x - i) * (bins[i + 1] - bins[i])


@inline
def mean_flow_at(sea, state, e):
    """Mean normal flow [m/s] past the middle of element e, one above the water as at the surface."""
    nodes = state.nodes  # what the motion of the mesh adds to the mean velocity is along the cable
    r, w, g = point_of(nodes[NOW, ARC], nodes[NOW, Q], nodes[NOW, MEAN], e, 0.5)
    x, y = current_at(sea, state.memory[NOW], min(r[2], 0.0))
    v, u = (x - w[0], y - w[1], -w[2]), scale(1.0 / norm(g), g)
    return norm(axpy(-dot(v, u), u, v))


@inline
def dry(q, e):
    """Is element e out of the water? One with an end in it is not, so that what changes then acts on no length."""
    return min(q[e, 2], q[e + 1, 2]) >= 0.0


@driver
def look_along(line, state, begin):
    """Speed, shedding frequency and unreduced amplitude of every element, the length of strumming cable by speed.

    Elements above the water are taken as at the surface: in a sea they may be in it before the next look. begin: arc
    length [m] at the sheave. Returns the time [s] that a wave across the cable takes from there to the end.
    """
    rules, sections, bins = line.strum.rules[0], line.strum.sections, state.work.bins
    arc, row = state.nodes[NOW, ARC, :, 0], state.nodes[NOW, STRUM]
    for i in range(BINS):
        bins[i] = 0.0
    travel, section = 0.0, 0
    for e in range(arc.shape[0] - 1):
        middle, length = 0.5 * (arc[e] + arc[e + 1]), arc[e + 1] - arc[e]
        while section < sections.shape[0] - 1 and sections[section].end <= middle:
            section += 1
        s = sections[section]
        speed = mean_flow_at(line.sea, state, e)
        row[e, SPEED] = speed
        row[e, FREQUENCY], row[e, AMPLITUDE], row[e, MODE] = 0.0, 0.0, 0.0
        wet = not dry(state.nodes[NOW, Q], e)
        mass = s.mass + (s.added if wet else 0.0)
        outboard = min(max(arc[e + 1] - begin, 0.0), length)
        if state.tension[e] > 0.0:
            travel += outboard * sqrt(mass / state.tension[e])
        re = s.reynolds * speed
        if s.strums != 0 and re > RE_SHEDDING:
            row[e, FREQUENCY] = strouhal(re) * speed / s.diameter
            a = min(max(amplitude(rules.law, s.mass_damping, re), 0.0), MAX_AMPLITUDE)
            row[e, AMPLITUDE] = onset(re) * rules.multiplier * s.multiplier * a
            bins[min(int(class_of(speed)) + 1, BINS - 1)] += length if wet else 0.0
    for i in range(1, BINS):
        bins[i] += bins[i - 1]
    return travel


@driver
def aim(model, state):
    """What every element tends to: TARGET, and the columns after it, from the present shape, tension and mean flow."""
    line, now, drum = model.line, state.memory[NOW], model.settings[0].drum
    rules, bins, row = line.strum.rules[0], state.work.bins, state.nodes[NOW, STRUM]
    last = row.shape[0] - 1
    scope = drum.payout_0 + now.winch.length - drum.inboard
    travel = look_along(line, state, state.nodes[NOW, ARC, last, 0] - scope)
    for e in range(last):
        if row[e, FREQUENCY] > 0.0:
            if rules.band > 0.0 and bins[BINS - 1] > 0.0:
                v = row[e, SPEED]
                near = up_to(bins, v * (1.0 + rules.band)) - up_to(bins, v * (1.0 - rules.band))
                row[e, AMPLITUDE] *= near / bins[BINS - 1]
            row[e, MODE] = max(1.0, float(int(2.0 * row[e, FREQUENCY] * travel + 0.5)))
        a = row[e, AMPLITUDE]
        factor = amplification(rules.formula, rules.antinode, a) if a > 0.0 else 1.0
        row[e, TARGET] = min(factor, MAX_FACTOR) - 1.0
        if dry(state.nodes[NOW, Q], e):
            for k in range(SPEED, MODE + 1):
                row[e, k] = 0.0
    for k in range(TARGET, MODE + 1):
        row[last, k] = row[last - 1, k]


@driver
def approach(state, maximum):
    """Let every drag factor go to its target, by ``maximum`` at most. Returns the largest change."""
    row, largest = state.nodes[NOW, STRUM], 0.0
    for n in range(row.shape[0]):
        change = min(max(row[n, TARGET] - row[n, EXTRA], -maximum), maximum)
        row[n, EXTRA] += change
        largest = max(largest, abs(change))
    return largest


@driver
def sum_up(line, state):
    """Mean drag factor over the cable in the water and largest amplitude in diameters; 1 and 0 where viv is off."""
    if line.strum.sections.shape[0] == 0:
        return 1.0, 0.0
    arc, row = state.nodes[NOW, ARC, :, 0], state.nodes[NOW, STRUM]
    total, wet, maximum = 0.0, 0.0, 0.0
    for e in range(arc.shape[0] - 1):
        if row[e, SPEED] > 0.0:
            total += row[e, EXTRA] * (arc[e + 1] - arc[e])
            wet += arc[e + 1] - arc[e]
            maximum = max(maximum, row[e, AMPLITUDE])
    return 1.0 + (total / wet if wet > 0.0 else 0.0), maximum


@driver
def show(state, table):
    """The columns of a shape table that follow those of the shape: speed, frequency, mode, amplitude, drag factor."""
    if table.shape[1] < SHAPE_ONLY + 5:
        return
    row = state.nodes[NOW, STRUM]
    for n in range(table.shape[0]):
        table[n, SHAPE_ONLY] = row[n, SPEED]
        table[n, SHAPE_ONLY + 1] = row[n, FREQUENCY]
        table[n, SHAPE_ONLY + 2] = row[n, MODE]
        table[n, SHAPE_ONLY + 3] = row[n, AMPLITUDE]
        table[n, SHAPE_ONLY + 4] = 1.0 + (row[n, EXTRA] if row[n, SPEED] > 0.0 else 0.0)
