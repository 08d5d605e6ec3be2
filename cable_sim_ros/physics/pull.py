"""What is known of the mean flow at once: how fast the cable is pulled through the water, and how its shape turns.

The running mean of the material's velocity (state.MEAN) is slow, to keep waves out of the drag that is amplified. What
is no wave need not wait for it: the commanded rate of the winch and the mean speed of the sheave. A change dp of the
speed with which material comes outboard at the first node in the water changes the mean velocity m of node i by

    dm_i = D_i^-1 (x_i t_i - x_{i-1} t_{i-1}),    t_e . (dm_{e+1} - dm_e) = 0,    t . dm = dp at the top,

the balance of drag (D_i: its derivative to the flow, of half the elements beside the node and of bodies) and of the
change x_e of tension along a chain of its present shape that neither stretches nor has inertia: what the cable does in
the second after such a change, before its shape follows. It is linear in dp, so row PULL keeps dm for dp = 1 m/s.

Where a controller compensates heave through commands, what they have in common with the sheave's motion along the cable
is a wave and is left out. docs/theory.md, mean flow.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from .ancf import CD_FIXED, CN_FIT, CT_FIXED, CT_OF_RE, EXTRA_ALONG, EXTRA_DRAG, HALF_RHO_D, RE_FACTOR
from .drag import SPEED_FLOOR, along, coefficient_along, drag
from .drag_laws import CHOO_CASARELLA, choo_casarella, fitted
from .jit import LANES, driver, inline, link, opaque
from .sea import current_at
from .state import ARC, FLOW, MEAN, NOW, PULL, STEP, STRUM, Q
from .strum import EXTRA
from .towbody import heading
from .vec import add, axpy, dot, norm, row3, scale, sub

TAKE_UP = 0.3  # s, with which a commanded rate is taken into the mean
# m/s^2, at most: a cable that is paid out faster than it falls does not follow its winch, and a mean that did would
# push it: +-5 m/s by turns of half a second struck with 67 kN without this bound, 15 before there was a known part
FASTEST = 0.5
SHARP = 9.0  # corner of the ship's mean speed times cable.mean_flow_time: passes less than the mean flow up to 20 s
BUTTERWORTH = (0.9238795325112867, 0.3826834323650898)  # damping of the two halves of a low-pass of fourth order
MOVED, OLD = 0.05, 5.0  # m/s of changes and s, after which the response is computed anew
LEAST_WAVE = 1e-6  # m^2/s^2, below which a motion of the sheave is no wave
FAINT = 1e-3  # N s/m, keeps the drag of a node invertible
MOST = 2.0  # a node is not moved faster than this by a pull of 1
SEEN = 1e-9  # m/s, a change that is one
UPRIGHT, LYING = 0.1, 0.3  # square of the horizontal share of a direction: none of its turning counts, all of it
T, SWEEP = np.array((3, 4))  # rows of a node's work space: direction, what the sweep keeps; before them D^-1


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


@inline
def coefficient(p, e, speed):
    """C_D at a speed of the water, and its derivative to the speed; p: rows of a group, e: lane."""
    if p[CD_FIXED, e] >= 0.0:
        return p[CD_FIXED, e], 0.0
    re = p[RE_FACTOR, e] * speed
    if p[CN_FIT, e] == CHOO_CASARELLA:
        cd, dcd = choo_casarella(re)
    else:
        cd, dcd = fitted(int(p[CN_FIT, e]), re)
    return cd, dcd * p[RE_FACTOR, e]


@driver
def drag_change(p, e, extra, v, u, length, out):
    """Add the derivative of an element's drag to the flow, [3, 3], to out; p: rows of a group, e: lane; extra: drag
    factors less 1 across the cable and along it."""
    w = axpy(-dot(v, u), u, v)
    vn = sqrt(dot(w, w) + SPEED_FLOOR * SPEED_FLOOR)
    at = sqrt(dot(v, u) * dot(v, u) + SPEED_FLOOR * SPEED_FLOOR)
    cd, dcd = coefficient(p, e, vn)
    whole, d_whole = coefficient(p, e, sqrt(vn * vn + at * at))
    free = 1.0 if p[CD_FIXED, e] < 0.0 and p[CN_FIT, e] == CHOO_CASARELLA else 0.0
    cdt = coefficient_along(cd, dcd, whole, d_whole, vn, at, free)
    ref = p[RE_FACTOR, e]
    alpha, _, w, vt, a1, a2, b1, b2 = drag(v, u, vn, p[HALF_RHO_D, e], ref, cd, dcd / max(ref, 1e-300), cdt, p, e)
    if p[CT_FIXED, e] + p[CT_OF_RE, e] > 0.0:
        b2 += along(vt, p, e)[1]
    k, kt = (1.0 + extra[0]) * length, (1.0 + extra[1]) * length
    y, z = axpy(a1, w, scale(a2, u)), axpy(b1, w, scale(b2, u))
    for i in range(3):
        for j in range(3):
            across = alpha * ((1.0 if i == j else 0.0) - u[i] * u[j]) + w[i] * y[j]
            out[i, j] += k * across + kt * u[i] * z[j]


@driver
def body_change(body, flow, v, out):
    """The same of a body in the flow v past it."""
    yaw = heading(flow)
    c, s = cos(yaw), sin(yaw)
    b = (c * v[0] + s * v[1], c * v[1] - s * v[0], v[2])
    speed = sqrt(dot(b, b) + SPEED_FLOOR * SPEED_FLOOR)
    axes = ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))
    for k in range(3):
        pull = scale(body.drag[k] / speed * b[k], b)
        row = axpy(
            body.drag[k] * speed, axes[k], axpy(pull[0], axes[0], axpy(pull[1], axes[1], scale(pull[2], axes[2])))
        )
        if k == 2:
            row = axpy(2.0 * body.lift * b[0], axes[0], axpy(2.0 * body.lift * b[1], axes[1], row))
        for i in range(3):
            for j in range(3):
                out[i, j] += axes[k][i] * row[j]


@driver
def invert(m):
    """m [3, 3] becomes its inverse."""
    a, b, c = row3(m, 0), row3(m, 1), row3(m, 2)
    x = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
    y = (c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0])
    z = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    per = 1.0 / dot(a, x)
    for i in range(3):
        m[i, 0], m[i, 1], m[i, 2] = per * x[i], per * y[i], per * z[i]


@inline
def times(m, v):
    """m v for a table m [3 or more, 3 or more]."""
    return (
        m[0, 0] * v[0] + m[0, 1] * v[1] + m[0, 2] * v[2],
        m[1, 0] * v[0] + m[1, 1] * v[1] + m[1, 2] * v[2],
        m[2, 0] * v[0] + m[2, 1] * v[1] + m[2, 2] * v[2],
    )


@driver
def resist(line, state, first):
    """Inverse of the drag's derivative of every node from ``first`` on, and directions, into the work space."""
    band, memory, last = state.work.band, state.memory[NOW], state.tension.shape[0]
    q, mean = state.nodes[NOW, Q], state.nodes[NOW, MEAN]
    for n in range(first, last + 1):
        for i in range(3):
            for j in range(3):
                band[n, i, j] = FAINT if i == j else 0.0
    for e in range(first, last):
        chord = sub(row3(q, e + 1), row3(q, e))
        u = scale(1.0 / max(norm(chord), 1e-12), chord)
        band[e, T, 0], band[e, T, 1], band[e, T, 2] = u
        m = scale(0.5, add(row3(mean, e), row3(mean, e + 1)))
        x, y = current_at(line.sea, memory, 0.5 * (q[e, 2] + q[e + 1, 2]))
        rows = line.elements[e // LANES]
        extra = rows[EXTRA_DRAG, e % LANES] + state.nodes[NOW, STRUM, e, EXTRA], rows[EXTRA_ALONG, e % LANES]
        half = 0.5 * (state.nodes[NOW, ARC, e + 1, 0] - state.nodes[NOW, ARC, e, 0])
        past = (x - m[0], y - m[1], -m[2])
        for n in range(e, e + 2):
            drag_change(line.elements[e // LANES], e % LANES, extra, past, u, half, band[n])
    for i in range(line.bodies.shape[0]):
        n = line.body_nodes[i]
        if n >= first:
            x, y = current_at(line.sea, memory, q[n, 2])
            body_change(
                line.bodies[i], state.nodes[NOW, FLOW, n], (x - mean[n, 0], y - mean[n, 1], -mean[n, 2]), band[n]
            )
    for n in range(first, last + 1):
        invert(band[n])


@driver
def sweep(band, first, last, top):
    """Changes of tension x along the chain for a pull of 1 at its top, kept in the work space; is there a solution?

    Row e: t_e . (dm_{e+1} - dm_e) = 0 with dm_i = B_i (x_i t_i - x_{i-1} t_{i-1}), dm_first = top.
    """
    for e in range(first, last):
        t = (band[e, T, 0], band[e, T, 1], band[e, T, 2])
        after = times(band[e + 1], t)
        own, below, above, given = -dot(t, after), 0.0, 0.0, 0.0
        if e + 1 < last:
            following = (band[e + 1, T, 0], band[e + 1, T, 1], band[e + 1, T, 2])
            above = dot(t, times(band[e + 1], following))
        if e == first:
            given = dot(t, top)
        else:
            before = (band[e - 1, T, 0], band[e - 1, T, 1], band[e - 1, T, 2])
            own -= dot(t, times(band[e], t))
            below = dot(t, times(band[e], before))
            own -= below * band[e - 1, SWEEP, 0]
            given -= below * band[e - 1, SWEEP, 1]
        if not abs(own) > 0.0:
            return False
        band[e, SWEEP, 0], band[e, SWEEP, 1] = above / own, given / own
    x = 0.0
    for e in range(last - 1, first - 1, -1):
        x = band[e, SWEEP, 1] - band[e, SWEEP, 0] * x
        band[e, SWEEP, 2] = x
    return True


@driver
def respond(line, state):
    """Row PULL: what a pull of 1 m/s outboard at the first node in the water changes the mean velocities by."""
    q, pull, arc, band = state.nodes[NOW, Q], state.nodes[NOW, PULL], state.nodes[NOW, ARC], state.work.band
    first, last = first_wet(q), state.tension.shape[0]
    solved = False
    if first < last:
        resist(line, state, first)
        solved = sweep(band, first, last, direction(q, first))
    for n in range(last + 1):
        d = direction(q, n)
        if solved and n > first:
            t = (band[n - 1, T, 0], band[n - 1, T, 1], band[n - 1, T, 2])
            f = scale(-band[n - 1, SWEEP, 2], t)
            if n < last:
                f = axpy(band[n, SWEEP, 2], (band[n, T, 0], band[n, T, 1], band[n, T, 2]), f)
            moved = times(band[n], f)
            if norm(moved) <= MOST:
                d = moved
        for k in range(3):
            pull[n, k] = d[k]
    slopes(pull, arc, 0)


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
def learn(known, velocity, rate, t, tau, h):
    """Follow the mean speed of the sheave and the commanded rate [m/s] over a step h [s]; returns by how much what they
    bring outboard along t has changed. velocity: of the sheave, tow frame; tau: cable.mean_flow_time."""
    w, change, wave = SHARP / tau, 0.0, -velocity[2] * t[2]
    for k in range(2):
        x, before = velocity[k], known.speed[k, 2]
        for i in range(2):
            u, r = known.speed[k, 2 * i], known.speed[k, 2 * i + 1]
            r = (r + h * w * w * (x - u)) / (1.0 + h * w * (2.0 * BUTTERWORTH[i] + h * w))
            x = u + h * r
            known.speed[k, 2 * i], known.speed[k, 2 * i + 1] = x, r
        change += (x - before) * t[k]
        wave -= (velocity[k] - x) * t[k]
    a = 2.0 * h / (tau + 2.0 * h)
    known.rate_mean += a * (rate - known.rate_mean)
    known.wave_mean += a * (wave - known.wave_mean)
    off, wave = rate - known.rate_mean, wave - known.wave_mean
    known.common += a * (off * wave - known.common)
    known.waves += a * (wave * wave - known.waves)
    share = min(max(known.common / (known.waves + LEAST_WAVE), 0.0), 1.0)
    before = known.rate
    taken = h / (TAKE_UP + h) * (rate - share * wave - known.rate)
    known.rate += min(max(taken, -FASTEST * h), FASTEST * h)
    return change + known.rate - before


@driver
def _take_up(line, state, h):
    """Take into the mean flow what is known of the step of h [s] in hand: ship and winch are at its end."""
    now, nodes = state.memory[NOW], state.nodes[NOW]
    if not is_amplified(line, state):
        return
    known = now.known
    top = direction(nodes[Q], first_wet(nodes[Q]))
    change = learn(known, now.sheave.velocity, now.winch.command_rate, top, line.settings[0].mean_flow_time, h)
    change -= known.turned[0] * top[0] + known.turned[1] * top[1]  # of the turn of the ship, that is in the mean
    known.turned[0], known.turned[1] = 0.0, 0.0
    if abs(change) < SEEN:
        return
    known.moved += abs(change)
    if known.told == 0 or known.moved > MOVED or (now.sea.time - known.at) > OLD:
        respond(line, state)
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
