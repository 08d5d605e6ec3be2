"""What the mean flow does beside its low-pass: its memory, and how it goes and turns with the cable.

The running mean of the material's velocity (state.MEAN) is slow, to keep waves out of the drag that is amplified. After
a change that is no wave, of the commanded rate of the winch or of the ship's mean speed, it begins anew: the memory is
short first and grows with the time since, as the mean of all that came after the change would have it.
"""

from __future__ import annotations

from math import sqrt

from ..compiler.jit import LANES, driver, inline, link, opaque
from .ancf import EXTRA_DRAG
from .cable_assembly import mean_at
from .sea import current_at
from .state import ARC, MEAN, NOW, STEP, STRUM, Q
from .vec import at3, axpy, norm, scale, sub
from .viv_amplification import EXTRA

# corners times cable.mean_flow_time; with 60 s 0.1 % of a wave of 8 s is left of a speed, 11 % of a commanded rate
SHIP, WINCH = 9.0, 27.0
BUTTERWORTH = (0.9238795325112867, 0.3826834323650898)  # damping of the two halves of a low-pass of fourth order
HALF_WAVE = 10.0  # s, of the longest wave
SHORTEST = 2.0  # s, memory just after a change: some periods of vortices
TOLERATED = 0.05  # m/s between what is known and what the mean has of it: no change yet
KNOWN_STEP = 2e-3  # s, in which chosen steps follow what is known
AT_ONCE = 1.0  # s, in which a difference of twice that shortens the memory to a third
UPRIGHT, LYING = 0.1, 0.3  # square of the horizontal share of a direction: none of its turning counts, all of it


@driver
def is_amplified(elements, strumming):
    """Has any element a drag factor other than 1? strumming: row STRUM of the nodes."""
    for e in range(strumming.shape[0] - 1):
        if elements[e // LANES, EXTRA_DRAG, e % LANES] + strumming[e, EXTRA] != 0.0:
            return True
    return False


@inline
def first_wet(q):
    """First node in the water from the drum on; the last where none is."""
    n = 0
    while n < q.shape[0] - 1 and q[n, 2] >= 0.0:
        n += 1
    return n


@inline
def direction(q, n):
    """Unit tangent at node n, outboard."""
    g = (q[n, 3], q[n, 4], q[n, 5])
    return scale(1.0 / max(norm(g), 1e-12), g)


@driver
def slopes(table, arc, first):
    """Columns 3 to 5 of a table of nodes: slopes of columns 0 to 2 along the cable, from ``first`` on."""
    last = table.shape[0] - 1
    for n in range(first, last + 1):
        a, b = max(n - 1, first), min(n + 1, last)
        before, after = arc[n, 0] - arc[a, 0], arc[b, 0] - arc[n, 0]
        for k in range(3):
            if a == b:
                table[n, 3 + k] = 0.0
            elif a == n:
                table[n, 3 + k] = (table[b, k] - table[n, k]) / after
            elif b == n:
                table[n, 3 + k] = (table[n, k] - table[a, k]) / before
            else:
                up, down = (table[b, k] - table[n, k]) / after, (table[n, k] - table[a, k]) / before
                table[n, 3 + k] = (up * before + down * after) / (before + after)


@inline
def smoothed(stages, x, w, h):
    """Butterworth low-pass of fourth order, corner w [rad/s], over a step h [s]; stages: value and rate of two."""
    for i in range(2):
        u, r = stages[2 * i], stages[2 * i + 1]
        r = (r + h * w * w * (x - u)) / (1.0 + h * w * (2.0 * BUTTERWORTH[i] + h * w))
        x = u + h * r
        stages[2 * i], stages[2 * i + 1] = x, r
    return x


@driver
def changed(known, velocity, current, rate, t, tau, h):
    """By how much ship or winch [m/s] have changed beyond what the running mean has of it, after a step h [s].

    velocity: of the sheave, tow frame; rate: commanded; t: outboard, where the cable enters the water. A controller may
    compensate waves by commands: as much as the low-pass leaves of the sheave's waves is no change of the winch, unless
    the change keeps its sign for longer than half a wave.
    """
    w = SHIP / tau
    x, y = smoothed(known.east, velocity[0], w, h), smoothed(known.north, velocity[1], w, h)
    speed = sqrt((x - current[0]) ** 2 + (y - current[1]) ** 2)
    w = WINCH / tau
    wound, heave = smoothed(known.wound, rate, w, h), smoothed(known.heave, velocity[2], w, h)
    surge = smoothed(known.surge, (velocity[0] - x) * t[0] + (velocity[1] - y) * t[1], w, h)
    known.waves = max(sqrt(heave * heave + surge * surge), known.waves * tau / (tau + h))
    if known.begun == 0:
        known.begun, known.taken[0] = 1, speed
    fraction = taken_up(known, tau, h)
    ship, winch = speed - known.taken[0], wound - known.taken[1]
    known.taken[0] += fraction * ship
    known.taken[1] += fraction * winch
    known.kept = known.kept + h if winch * known.winch > 0.0 else h
    known.winch = winch
    return max(abs(ship), abs(winch) - (known.waves if known.kept < HALF_WAVE else 0.0))


@inline
def taken_up(known, tau, h):
    """Share of the difference to the running mean that this takes up in h [s]: backward Euler of m' = (v - m) / memory.

    1 / memory = 1 / tau + known.faster; tau: cable.mean_flow_time.
    """
    taken = h * (1.0 / tau + known.faster)
    return taken / (1.0 + taken)


@inline
def halved(settings):
    """Does the mean take up half of a step with the velocity of its beginning? Where steps are chosen: of second order
    as the cable, by the trapezium."""
    return settings.step_tension > 0.0 and settings.mean_flow_time > SHORTEST


@inline
def mean_fraction(settings, known, h):
    """Share of a step of h [s] that the running mean of the velocity takes up with the velocity of its end."""
    return taken_up(known, settings.mean_flow_time, 0.5 * h if halved(settings) else h)


@driver
def begin_mean(settings, state, h):
    """What the running mean takes up of a step of h [s] with the velocity of its beginning, which is that of now."""
    if not halved(settings):
        return
    nodes = state.nodes
    fraction = 0.5 * h * (1.0 / settings.mean_flow_time + state.memory[NOW].known.faster)
    for n in range(nodes.shape[2]):
        for k in range(6):
            nodes[NOW, MEAN, n, k] = mean_at(nodes, n, k, fraction)


@driver
def _take_up(line, state, h) -> None:
    """Set the memory of the mean flow for the step of h [s] in hand: ship and winch are at its end."""
    now, old, tau = state.memory[NOW], state.memory[STEP], line.settings[0].mean_flow_time
    if tau <= SHORTEST or not is_amplified(line.elements, state.nodes[NOW, STRUM]):
        return
    known, q, c = now.known, state.nodes[NOW, Q], now.current
    top = direction(q, first_wet(q))
    count = max(1, int(h / KNOWN_STEP + 0.999)) if line.settings[0].step_tension > 0.0 else 1
    d, velocity = h / count, at3(now.sheave.velocity, 0)
    gain, gained = sub(velocity, at3(old.sheave.velocity, 0)), now.winch.command_rate - old.winch.command_rate
    for i in range(count):
        left = 1.0 - (i + 1.0) / count
        rate = now.winch.command_rate - left * gained
        change = changed(known, axpy(-left, gain, velocity), (c[0], c[1]), rate, top, tau, d)
        if change <= TOLERATED and known.faster == 0.0:
            continue
        memory = 1.0 / (1.0 / tau + known.faster) + d
        memory /= 1.0 + max(change / TOLERATED - 1.0, 0.0) * d / AT_ONCE
        known.faster = max(1.0 / max(memory, SHORTEST) - 1.0 / tau, 0.0)


@driver
def flows(arc, old):
    """Has material moved through the mesh?"""
    for n in range(arc.shape[0]):
        if arc[n, 0] != old[n, 0]:
            return True
    return False


@driver
def carry(q, arc, old, mean, new):
    """Carry the mean velocity with the material through the mesh, in the water, over the step just solved; new: room.

    Where a node stands now the material had stood elsewhere among the old nodes: cubic between these.
    """
    last, first = mean.shape[0] - 1, first_wet(q)
    if first >= last:
        return
    slopes(mean, old, first)
    for n in range(first, last + 1):
        s = min(max(arc[n, 0], old[first, 0]), old[last, 0])
        e = min(max(n - 1, first), last - 1)
        while e < last - 1 and s > old[e + 1, 0]:
            e += 1
        while e > first and s < old[e, 0]:
            e -= 1
        length = old[e + 1, 0] - old[e, 0]
        x = (s - old[e, 0]) / length
        for k in range(3):
            a, b, c, d = mean[e, k], length * mean[e, 3 + k], mean[e + 1, k], length * mean[e + 1, 3 + k]
            square = 3.0 * (c - a) - 2.0 * b - d
            cube = 2.0 * (a - c) + b + d
            new[n, k] = a + x * (b + x * (square + x * cube))
            new[n, 3 + k] = (b + x * (2.0 * square + 3.0 * x * cube)) / length
    for n in range(first, last + 1):
        for k in range(6):
            mean[n, k] = new[n, k]


@driver
def turn(q, old, mean, sea, memory):
    """Turn the mean flow past every node about the vertical with the cable over the step just solved: in a turn the
    cable follows the ship's path, and the flow along it stays along it."""
    for n in range(q.shape[0]):
        x0, y0, x1, y1 = old[n, 3], old[n, 4], q[n, 3], q[n, 4]
        cross = x0 * y1 - y0 * x1
        if cross == 0.0:
            continue
        level = x1 * x1 + y1 * y1
        free = min(max((level / (level + q[n, 5] * q[n, 5]) - UPRIGHT) / (LYING - UPRIGHT), 0.0), 1.0)
        if free <= 0.0:
            continue
        s = free * cross / sqrt(level * (x0 * x0 + y0 * y0))
        c = sqrt(max(1.0 - s * s, 0.0))
        x, y = current_at(sea, memory, min(q[n, 2], 0.0))
        wx, wy = x - mean[n, 0], y - mean[n, 1]
        mean[n, 0], mean[n, 1] = x - (c * wx - s * wy), y - (s * wx + c * wy)


@driver
def _follow(line, state) -> None:
    """What a solved step does to the mean velocity beside the low-pass: it goes with the material and turns with it."""
    now, old = state.nodes[NOW], state.nodes[STEP]
    if not is_amplified(line.elements, now[STRUM]):
        return
    if flows(now[ARC], old[ARC]):
        carry(now[Q], now[ARC], old[ARC], now[MEAN], state.work.step)
    turn(now[Q], old[Q], now[MEAN], line.sea, state.memory[NOW])


take_up, follow = opaque(_take_up), opaque(_follow)


def link_mean_flow(line, state) -> None:
    """Compile or load what moves the mean flow and publish it; call before anything that uses it runs."""
    link(_take_up, line, state, 0.0)
    link(_follow, line, state)
