"""A factorised tangent that serves later steps, turned with the cable.

Between steps little of it changes but where the cable points, and that by far the most: a turn by a brings EA a/L
across, which the stiffness T/L takes back with EA/T, thousands, times a^2. So every node's forces are turned back to
where the node pointed when the tangent was kept, and what solves them turned on again: K is taken for R K R^T.
"""

from __future__ import annotations

from ..compiler.jit import driver, inline
from .block_tridiagonal import RHS, solve_again
from .state import NOW, Q
from .vec import add, cross, dot, row3, scale

COSINE = 3  # columns of Work.turn: sine times axis, 1/(1 + cosine)
SLIGHT = 1e-7  # square of a sine; times EA/T it is less than what drag changes in a tangent from step to step


@driver
def keep_tangent(state, change):
    """Let the factorised tangent in the work space serve later steps of this change of acceleration."""
    facing, q = state.work.facing, state.nodes[NOW, Q]
    state.plan[0].kept = change.acceleration
    for n in range(q.shape[0]):
        for k in range(3):
            facing[n, k] = q[n, 3 + k]


@driver
def look_round(state):
    """How every node has turned since the tangent was kept, about the axis across where it pointed and points.

    By more than a right angle it is not followed: then the tangent does not serve. Returns whether any has by more
    than slightly.
    """
    q, facing, turn, most = state.nodes[NOW, Q], state.work.facing, state.work.turn, 0.0
    for n in range(q.shape[0]):
        was, now = row3(facing, n), (q[n, 3], q[n, 4], q[n, 5])
        per_square = 2.0 / (dot(was, was) + dot(now, now))  # stretch goes into the second order
        sine = scale(per_square, cross(was, now))
        turn[n, 0], turn[n, 1], turn[n, 2] = sine
        turn[n, COSINE] = 1.0 / (1.0 + max(per_square * dot(was, now), 0.0))
        most = max(most, dot(sine, sine))
    return most > SLIGHT


@inline
def turned(w, k, v):
    """A vector turned, Rodrigues: w sine times axis, k 1/(1 + cosine)."""
    across = cross(w, v)
    return add(add(v, across), scale(k, cross(w, across)))


@driver
def turn_vectors(line, turn, sense, table, column):
    """Turn both vectors of each node, of table[n, 3 i : 3 i + 3, column], on (sense 1) or back (-1).

    Not where one or two of their components are held: the others would move them.
    """
    for n in range(turn.shape[0]):
        w, k = scale(sense, row3(turn, n)), turn[n, COSINE]
        for i in (0, 3):
            held = line.held[n, i] + line.held[n, i + 1] + line.held[n, i + 2]
            if held == 0.0 or held == 3.0:
                v = turned(w, k, (table[n, i, column], table[n, i + 1, column], table[n, i + 2, column]))
                table[n, i, column], table[n, i + 1, column], table[n, i + 2, column] = v


@driver
def solve_by_kept(line, state, follow):
    """Solve for the residual in the work space with the tangent that is kept; follow: turned as look_round() found."""
    work = state.work
    x = work.step.reshape(work.step.shape[0], 6, 1)
    if follow:
        turn_vectors(line, work.turn, -1.0, work.band, RHS)
    solve_again(work.band, work.lower, work.factor, work.step)
    if follow:
        turn_vectors(line, work.turn, 1.0, x, 0)
