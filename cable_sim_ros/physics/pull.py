"""What is known of the mean flow at once: how fast the cable is pulled through the water, and how its shape turns.

The running mean of the material's velocity (state.MEAN) is slow, to keep waves out of the drag that is amplified. What
is no wave need not wait for it: the mean speed of the sheave. A change dp of the speed with which material comes
outboard where the cable enters the water changes the mean velocity of node i by dp t_i, t_i the unit tangent: the cable
slides along itself. The commanded rate of the winch is not among what is known: docs/theory.md, mean flow, says why.
"""

from __future__ import annotations

from math import sqrt

from .ancf import EXTRA_DRAG
from .jit import LANES, driver, inline, link, opaque
from .sea import current_at
from .state import ARC, MEAN, NOW, PULL, STEP, STRUM, Q
from .strum import EXTRA
from .vec import norm, scale

SHARP = 9.0  # corner of the ship's mean speed times cable.mean_flow_time: passes less than the mean flow up to 20 s
BUTTERWORTH = (0.9238795325112867, 0.3826834323650898)  # damping of the two halves of a low-pass of fourth order
MOVED, OLD = 0.05, 5.0  # m/s of changes and s, after which the response is computed anew
SEEN = 1e-9  # m/s, a change that is one
UPRIGHT, LYING = 0.1, 0.3  # square of the horizontal share of a direction: none of its turning counts, all of it


@driver
def is_amplified(line, state):
    """Has any element a drag factor other than 1?"""
    for e in range(state.tension.shape[0]):
        if line.elements[e // LANES, EXTRA_DRAG, e % LANES] + state.nodes[NOW, STRUM, e, EXTRA] != 0.0:
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


@driver
def slide(state):
    """Row PULL: what a pull of 1 m/s outboard changes the mean velocities by, the tangents, and their slopes."""
    q, pull = state.nodes[NOW, Q], state.nodes[NOW, PULL]
    for n in range(q.shape[0]):
        pull[n, 0], pull[n, 1], pull[n, 2] = direction(q, n)
    slopes(pull, state.nodes[NOW, ARC], 0)


@driver
def learn(known, velocity, t, tau, h):
    """Follow the mean speed of the sheave [m/s] over a step h [s]; returns by how much what it brings outboard along t
    has changed. velocity: of the sheave, tow frame; tau: cable.mean_flow_time."""
    w, change = SHARP / tau, 0.0
    for k in range(2):
        x, before = velocity[k], known.speed[k, 2]
        for i in range(2):
            u, r = known.speed[k, 2 * i], known.speed[k, 2 * i + 1]
            r = (r + h * w * w * (x - u)) / (1.0 + h * w * (2.0 * BUTTERWORTH[i] + h * w))
            x = u + h * r
            known.speed[k, 2 * i], known.speed[k, 2 * i + 1] = x, r
        change += (x - before) * t[k]
    return change


@driver
def _take_up(line, state, h):
    """Take into the mean flow what is known of the step of h [s] in hand: ship and winch are at its end."""
    now, nodes = state.memory[NOW], state.nodes[NOW]
    if not is_amplified(line, state):
        return
    known = now.known
    top = direction(nodes[Q], first_wet(nodes[Q]))
    change = learn(known, now.sheave.velocity, top, line.settings[0].mean_flow_time, h)
    change -= known.turned[0] * top[0] + known.turned[1] * top[1]  # of the turn of the ship, that is in the mean
    known.turned[0], known.turned[1] = 0.0, 0.0
    if abs(change) < SEEN:
        return
    known.moved += abs(change)
    if known.told == 0 or known.moved > MOVED or (now.sea.time - known.at) > OLD:
        slide(state)
        known.told, known.moved, known.at = 1, 0.0, now.sea.time
    mean, pull = nodes[MEAN], nodes[PULL]
    for n in range(mean.shape[0]):
        for k in range(6):
            mean[n, k] += change * pull[n, k]


@driver
def carry(state):
    """Carry the mean velocity with the material through the mesh, in the water, over the step just solved.

    Where a node stands now the material had stood elsewhere among the old nodes: cubic between these.
    """
    arc, old, mean, new = state.nodes[NOW, ARC], state.nodes[STEP, ARC], state.nodes[NOW, MEAN], state.work.step
    last, flows = mean.shape[0] - 1, False
    for n in range(last + 1):
        flows = flows or arc[n, 0] != old[n, 0]
    first = first_wet(state.nodes[NOW, Q])
    if not flows or first >= last:
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
def turn(line, state):
    """Turn the mean flow past every node about the vertical with the cable over the step just solved: in a turn the
    cable follows the ship's path, and the flow along it stays along it."""
    q, old, mean, memory = state.nodes[NOW, Q], state.nodes[STEP, Q], state.nodes[NOW, MEAN], state.memory[NOW]
    top = first_wet(q)
    for n in range(q.shape[0]):
        x0, y0, x1, y1 = old[n, 3], old[n, 4], q[n, 3], q[n, 4]
        level = x1 * x1 + y1 * y1
        free = min(max((level / (level + q[n, 5] * q[n, 5]) - UPRIGHT) / (LYING - UPRIGHT), 0.0), 1.0)
        cross = x0 * y1 - y0 * x1
        if free <= 0.0 or cross == 0.0:
            continue
        s = free * cross / sqrt(level * (x0 * x0 + y0 * y0))
        c = sqrt(max(1.0 - s * s, 0.0))
        x, y = current_at(line.sea, memory, min(q[n, 2], 0.0))
        wx, wy = x - mean[n, 0], y - mean[n, 1]
        mx, my = x - (c * wx - s * wy), y - (s * wx + c * wy)
        if n == top:
            memory.known.turned[0], memory.known.turned[1] = mx - mean[n, 0], my - mean[n, 1]
        mean[n, 0], mean[n, 1] = mx, my


@driver
def _follow(line, state):
    """What a solved step does to the mean velocity beside the low-pass: it goes with the material and turns with it."""
    if is_amplified(line, state):
        carry(state)
        turn(line, state)


take_up, follow = opaque(_take_up), opaque(_follow)


def link_pull(line, state) -> None:
    """Compile or load what moves the mean flow and publish it; call before anything that uses it runs."""
    link(_take_up, line, state, 0.0)
    link(_follow, line, state)
