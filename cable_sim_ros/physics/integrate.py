"""Time integration of a line: generalised-alpha with the residual taken at the end of the step, and the static start.

Arnold & Bruls (2007): the auxiliary acceleration x obeys (1-am) x1 + am x0 = (1-af) a1 + af a0, q and v follow x by
Newmark; equilibrium holds exactly at the end of the step, so contact and configuration-dependent added mass need no
averaging. rho_inf <= 0.5: 0.6 and above gain energy silently in snaps (trap T2). The static start is backward Euler
with growing steps (pseudo-transient) on the same Newton core.
"""

from __future__ import annotations

import numpy as np

from .banded import solve, solve_again
from .jit import NO, YES, driver, inline, link, opaque
from .line import LAST_STEP, RESIDUAL, TANGENTS, link_assembly, residual
from .quantity import Block, quantity


class Solver(Block):
    tick: float = quantity(0.01, "s", 1e-4, 0.1, "one published step")
    rho_inf: float = quantity(
        0.3, "1", 0.0, 0.5, "spectral radius at infinite frequency", "trap T2: 0.6 and above gain energy in snaps"
    )
    tolerance: float = quantity(
        1e-7, "1", 1e-12, 1e-3, "largest residual, as a fraction of the working tension; never below round-off"
    )
    max_iterations: int = quantity(20, "1", 2, 200, "Newton iterations before a step is halved")
    max_halvings: int = quantity(8, "1", 0, 20, "halvings of a step before the solver gives up")


# change of a gradient in one step, and the step [s] below which it may change by more: long steps that turn slack cable
# farther gain energy until one has no solution
TURN_MOST, TURN_STEP = 0.2, 4e-4


@inline
def coefficients(h, rho):
    """am, af, beta, gamma of generalised-alpha and c1 = dv/dq, c2 = da/dq of a step h [s]."""
    am, af = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    return am, af, beta, gamma, gamma / (h * beta), (1.0 - am) / ((1.0 - af) * h * h * beta)


@driver
def copy(a, b):
    """b = a for two tables of the same shape."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            b[i, j] = a[i, j]


@driver
def trend(line, h):
    """Share (0 or 1) of the last gain in acceleration that the next step begins with; line.gain takes the new gain.

    1 where the acceleration of the step before, had it gone on to change like that, would have been the better guess.
    """
    old = line.old[2]
    alike, size = 0.0, 0.0
    for n in range(old.shape[0]):
        for k in range(6):
            new = line.a[n, k] - old[n, k]
            if k < 3:
                alike += new * line.gain[n, k]
                size += line.gain[n, k] * line.gain[n, k]
            line.gain[n, k] = new
    same, line.health[LAST_STEP] = line.health[LAST_STEP] == h, h
    return 1.0 if same and alike > 0.5 * size else 0.0


@driver
def predict(line, h, rho):
    """Begin a step: remember the old state, extrapolate with an acceleration that stays or goes on changing.

    In a step of another length, so after a halving, it stays (see trend): one that goes on changing may foresee stiff
    cable as pushing, where the tangent is next to singular.
    """
    am, af, beta, gamma, _, _ = coefficients(h, rho)
    share = trend(line, h)
    old = line.old
    copy(line.q, old[0])
    copy(line.v, old[1])
    copy(line.a, old[2])
    copy(line.x, old[3])
    for n in range(line.q.shape[0]):
        for k in range(6):
            rise, x = share * line.gain[n, k], old[3, n, k]
            new = (old[2, n, k] + (1.0 - af) * rise - am * x) / (1.0 - am)
            line.q[n, k] += h * old[1, n, k] + h * h * ((0.5 - beta) * x + beta * new)
            line.v[n, k] += h * ((1.0 - gamma) * x + gamma * new)
            line.a[n, k] += rise


@driver
def _newton(line, c1, c2, sigma):
    """Solve the step for q with v += c1 dq, a += c2 dq. Returns the corrections used, or -1 where it does not converge.

    A tangent serves again where one more correction as good as its last meets the tolerance. health[TANGENTS], those
    that the step before needed, tells from which correction on the residual is looked at without one.
    """
    work, x = line.work, line.work.step
    wanted, enough = line.health[TANGENTS], 0.0
    tangents, r, again = 0, np.inf, False
    for i in range(line.max_iterations):
        before = r
        if again:
            solve_again(work.band, work.lower, work.factor, x)
        else:
            r = residual(line, c1, c2, sigma, YES)
            if r <= line.tolerance:
                line.health[RESIDUAL], line.health[TANGENTS] = r, tangents
                return i
            if not r < 1e200 or not solve(work.band, work.lower, work.factor, x):
                return -1
            if enough == 0.0 and tangents > 0 and r * r <= line.tolerance * before:
                enough = tangents
            before = r
            tangents += 1
        for n in range(x.shape[0]):
            for k in range(6):
                d = x[n, k]
                line.q[n, k] += d
                line.v[n, k] += c1 * d
                line.a[n, k] += c2 * d
        if not again and tangents < wanted:
            continue
        r = residual(line, c1, c2, sigma, NO)
        if r <= line.tolerance:
            line.health[RESIDUAL], line.health[TANGENTS] = r, enough if enough > 0.0 else tangents
            return i + 1
        again = r * r <= line.tolerance * before
    return -1


newton = opaque(_newton)


@driver
def take_back(line):
    """Return to the state at the beginning of the step."""
    old = line.old
    copy(old[0], line.q)
    copy(old[1], line.v)
    copy(old[2], line.a)
    copy(old[3], line.x)


@driver
def advance(line, h, rho):
    """Solve the predicted step, held unknowns already at its end. Returns the iterations, or -1 and the old state."""
    am, af, _, _, c1, c2 = coefficients(h, rho)
    old = line.old
    used = newton(line, c1, c2, 0.0)
    if used < 0:
        take_back(line)
        return used
    for n in range(line.q.shape[0]):
        for k in range(6):
            line.x[n, k] = ((1.0 - af) * line.a[n, k] + af * old[2, n, k] - am * old[3, n, k]) / (1.0 - am)
    return used


@driver
def whipped(q, old, h):
    """Did a step of h [s], longer than TURN_STEP, turn a gradient by more than TURN_MOST? old: what predict kept."""
    if h <= TURN_STEP:
        return False
    for n in range(q.shape[0]):
        for k in range(3, 6):
            if abs(q[n, k] - old[0, n, k]) > TURN_MOST:
                return True
    return False


@driver
def rest_still(v, a):
    """v = a = 0."""
    for n in range(v.shape[0]):
        for k in range(6):
            v[n, k] = 0.0
            a[n, k] = 0.0


@driver
def settle(line, sigma, max_steps, step_most):
    """Static equilibrium with the held unknowns where they are: backward Euler, step 0.02 s growing by 1.7.

    sigma: mass damping [1/s]. Returns (steps, iterations, residual [N] at rest); steps < 0 where it did not settle.
    """
    old = line.old
    rest_still(line.v, line.a)
    h, count, total = 0.02, 0, 0
    for _ in range(max_steps):
        copy(line.q, old[0])
        copy(line.v, old[1])
        for n in range(line.q.shape[0]):
            for k in range(6):
                line.a[n, k] = -old[1, n, k] / h
                line.v[n, k] = 0.0
        used = newton(line, 1.0 / h, 1.0 / (h * h), sigma)
        count += 1
        if used < 0:
            copy(old[0], line.q)
            copy(old[1], line.v)
            h *= 0.25
            if h < 1e-5:
                break
            continue
        total += used
        if h >= min(1.0, step_most):  # balanced at rest is settled; a free end without tension needs no longer one
            copy(line.v, old[1])
            rest_still(line.v, line.a)
            rest = residual(line, 0.0, 0.0, 0.0, NO)
            if rest <= line.tolerance:
                rest_still(line.x, line.a)
                return count, total, rest
            copy(old[1], line.v)
        h = min(1.7 * h, step_most)
    rest_still(line.v, line.a)
    return -count, total, residual(line, 0.0, 0.0, 0.0, NO)


def link_solver(line) -> None:
    """Compile or load the assembly and the Newton solve and publish them; call before anything that uses them runs."""
    link_assembly(line)
    link(_newton, line, 0.0, 0.0, 0.0)
