"""Compiled entries of a Rig: steps on the one stepper, with nodes that follow a motion; rest, first accelerations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiler.jit import NO, YES, by_reference, driver
from ...physics.block_tridiagonal import solve
from ...physics.contact_detection import detect_contact
from ...physics.integrate import advance, settle
from ...physics.line import residual
from ...physics.rigid_body import follow_nodes
from ...physics.state import AT_REST, NOW, A, Change, Q, V, X, forget_tangent
from ...physics.substeps import begin, finish, start, unfinished
from ...physics.wind import wash


class Moved(NamedTuple):
    """Nodes that follow a motion: their numbers, and position, velocity, acceleration [steps + 1, nodes, 9] at the
    beginning and at the end of every step."""

    nodes: np.ndarray
    table: np.ndarray


class Samples(NamedTuple):
    """What march() fills, one row a sample."""

    q: np.ndarray
    v: np.ndarray
    reaction: np.ndarray
    tension: np.ndarray
    strain: np.ndarray
    attitude: np.ndarray


@driver
def accelerate(line, state):
    """Accelerations that balance the present q and v; returns the residual left [N]."""
    big = 1e14  # inertia over stiffness: the solution is an acceleration, the shape stays
    line, state = by_reference(line), by_reference(state)
    a, x, tolerance = state.nodes[NOW, A], state.nodes[NOW, X], line.settings[0].tolerance
    wash(line, state, 0.0)
    forget_tangent(state)
    worst = residual(line, state, AT_REST, NO)
    for _ in range(6):
        if worst <= tolerance:
            break
        residual(line, state, Change(0.0, big, 0.0, 0.0), YES)
        if not solve(state.work.band, state.work.lower, state.work.factor, state.work.step):
            return np.inf
        for n in range(a.shape[0]):
            for k in range(6):
                a[n, k] += big * state.work.step[n, k]
        if state.attitude.shape[1] > 0:
            follow_nodes(line, state)
        for i in range(state.attitude.shape[1]):
            for k in range(3):
                state.attitude[NOW, i].acceleration[k] += big * state.attitude[NOW, i].correction[k]
        worst = residual(line, state, AT_REST, NO)
    for n in range(a.shape[0]):
        for k in range(6):
            x[n, k] = a[n, k]
    for i in range(state.attitude.shape[1]):
        for k in range(3):
            state.attitude[NOW, i].auxiliary[k] = state.attitude[NOW, i].acceleration[k]
    return worst


@driver
def between(first, last, h, s):
    """Value, rate, acceleration at share s of a step of h [s]: the quintic through those (x, v, a) at its ends."""
    x0, v0, a0 = first
    x1, v1, a1 = last
    d, v0, v1, a0, a1 = x1 - x0, h * v0, h * v1, h * h * a0, h * h * a1
    c3 = 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * d - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    x = x0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    v = v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
    a = a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))
    return x, v / h, a / (h * h)


@driver
def move(state, moved, i, length):
    """Put the moved nodes where they are at the end of what is being taken of step i of ``length`` [s]."""
    plan, nodes = state.plan[0], state.nodes[NOW]
    s = plan.done + plan.fraction
    for m in range(moved.nodes.shape[0]):
        n, first, last = moved.nodes[m], moved.table[i, m], moved.table[i + 1, m]
        for k in range(3):
            x, v, a = last[k], last[3 + k], last[6 + k]
            if s < 1.0:
                x, v, a = between((first[k], first[3 + k], first[6 + k]), (x, v, a), length, s)
            nodes[Q, n, k], nodes[V, n, k], nodes[A, n, k] = x, v, a


@driver
def take(line, state, moved, i, length):
    """Take what is to be taken next of step i of ``length`` [s]. Returns its own length, negative: not solved."""
    line, state = by_reference(line), by_reference(state)
    h = begin(line, state, length)
    move(state, moved, i, length)
    before = state.plan[0].done
    if not finish(line, state, h, advance(line, state, h)):
        return -1.0
    return h if state.plan[0].done > before else 0.0


@driver
def integrate(line, state, h, every, moved, out):
    """Steps of h [s], as many as ``moved`` has, into the Samples out. Returns the steps done, the iterations."""
    line, state = by_reference(line), by_reference(state)
    steps, used = moved.table.shape[0] - 1, 0
    for i in range(steps):
        start(state)
        while unfinished(state):
            if take(line, state, moved, i, h) < 0.0:
                return i, used
        used += state.plan[0].used
        if (i + 1) % every == 0:
            s = (i + 1) // every - 1
            for n in range(state.reaction.shape[0]):
                for k in range(6):
                    out.q[s, n, k] = state.nodes[NOW, Q, n, k]
                    out.v[s, n, k] = state.nodes[NOW, V, n, k]
                    out.reaction[s, n, k] = state.reaction[n, k]
            for e in range(state.tension.shape[0]):
                out.tension[s, e] = state.tension[e]
            for i in range(state.attitude.shape[1]):
                for k in range(4):
                    out.attitude[s, i, k] = state.attitude[NOW, i].quaternion[k]
                for k in range(3):
                    out.attitude[s, i, 4 + k] = state.attitude[NOW, i].rate[k]
            out.strain[s] = state.memory[NOW].health.strain
    return steps, used


@driver
def begin_step(state):
    """step.start as an entry of its own."""
    start(state)


@driver
def bring_to_rest(line, state, sigma, steps, longest):
    """integrate.settle as an entry of its own."""
    return settle(line, state, sigma, steps, longest)


@driver
def look(state):
    """contact_detection.detect_contact of every contact point as an entry of its own."""
    detect_contact(state, 0.0, YES)


@driver
def weigh_up(line, state, change, tangent):
    """line.residual as an entry of its own, in the water of now."""
    line, state = by_reference(line), by_reference(state)
    wash(line, state, 0.0)
    return residual(line, state, change, tangent)
