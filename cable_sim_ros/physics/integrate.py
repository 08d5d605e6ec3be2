"""Time integration: generalised-alpha with the residual taken at the end of the step, and the static start.

Arnold & Bruls (2007): the auxiliary acceleration x obeys (1-am) x1 + am x0 = (1-af) a1 + af a0, q and v follow x by
Newmark; equilibrium holds exactly at the end of the step, so contact and configuration-dependent added mass need no
averaging. rho_inf <= 0.5: 0.6 and above gain energy silently in snaps (trap T2). The static start is backward Euler
with growing steps (pseudo-transient) on the same Newton core.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .banded import solve
from .cable import Work
from .cable import assemble as _assemble
from .jit import NO, YES, driver, link, opaque
from .quantity import Block, quantity
from .setpoint import LENGTH, RATE, compensation
from .ship import ACCEL, COORD, evaluate, hull_point, rotate, spin
from .ship import RATE as SHIP_RATE
from .surface import AXIS, BODY, CENTRE, SPEED, SPIN
from .towbody import load as body_load
from .winch import ACCEL_NOW, COMMANDED, LENGTH_NOW, RATE_NOW, drum_point, servo

assemble = opaque(_assemble)



class Solver(Block):
    tick: float = quantity(0.01, "s", 1e-4, 0.1, "one published step")
    rho_inf: float = quantity(
        0.3, "1", 0.0, 0.5, "spectral radius at infinite frequency", "trap T2: 0.6 and above gain energy in snaps")
    tolerance: float = quantity(
        1e-7, "1", 1e-12, 1e-3, "largest residual, as a fraction of the working tension; never below round-off")
    max_iterations: int = quantity(20, "1", 2, 200, "Newton iterations before a step is halved")
    max_halvings: int = quantity(8, "1", 0, 20, "halvings of a step before the solver gives up")


class Model(NamedTuple):
    """The scene as numbers for kernels; arrays are read-only except the two that may be set between ticks."""

    elements: np.ndarray      # [groups, ROWS, LANES] element table
    surfaces: np.ndarray      # [n, SURFACE_COLUMNS] contact surfaces in base_link
    body: np.ndarray          # [BODY_ROWS] towbody
    winch: np.ndarray         # [WINCH_ROWS]
    setpoint: np.ndarray      # [SETPOINT_ROWS], writeable
    mean: np.ndarray          # [6], writeable: mean coordinates of base_link in the tow frame
    sheave: int               # row of the sheave in surfaces
    tick_ns: int              # ns
    max_iterations: int
    max_halvings: int
    gravity: float            # m/s^2
    rho_inf: float
    tolerance: float          # N
    stale_after: float        # s
    stale_decay: float        # s
    start_blend: float        # s
    source_blend: float       # s
    penetration_limit: float  # m
    groove_depth: float       # m
    bending_length: float     # m, sqrt(EI/T) at working tension


class State(NamedTuple):
    """Everything that changes, preallocated and updated in place."""

    time: np.ndarray          # int64 [4] now, start [ns], ticks, start of the blend [ns]
    halted: np.ndarray        # int64 [1] flags of a halted run
    events: np.ndarray        # int64 [2] detachments, was in contact
    frame: np.ndarray         # [4] tow frame: origin x y [m] at the start, velocity [m/s]
    current: np.ndarray       # [4] surface current relative to the tow frame [m/s], gradient [1/s]
    arc: np.ndarray           # [nodes] unstretched arc length from the drum end [m]; may change (pay-out by flow)
    q: np.ndarray             # [nodes, 6] r [m, tow frame], g [1]
    v: np.ndarray
    a: np.ndarray
    x: np.ndarray             # auxiliary acceleration
    kept: np.ndarray          # [2, 4, nodes, 6] q v a x at the beginning of the step and of the tick
    tension: np.ndarray       # [elements] N
    reaction: np.ndarray      # [3] force of the drum on the cable end [N]
    ship: np.ndarray          # [SHIP_STATE]
    ship_work: np.ndarray     # [SHIP_STATE]
    sheave: np.ndarray        # [6] sheave centre and its velocity, tow frame
    surfaces: np.ndarray      # [n, SURFACE_COLUMNS] in the world
    winch: np.ndarray         # [WINCH_STATE]
    setpoint: np.ndarray      # [SETPOINT_STATE]
    controls: np.ndarray      # [2, 2, 16] winch and set-point at the beginning of the step and of the tick
    flow: np.ndarray          # [6] low-passed flow past the body [m/s], turning rate of the body [rad/s]
    measured: np.ndarray      # [2] departure angle [rad], tension [N] of the last tick: what instruments would show
    health: np.ndarray        # [6] iterations, substeps, residual N, strain energy J, -, iterations of the step before
    work: Work


STEP, TICK = 0, 1   # rows of State.kept and State.controls


@driver
def copy(a, b):
    """b = a for two tables of the same shape."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            b[i, j] = a[i, j]


@driver
def copy_row(a, b):
    """b = a for the length of the shorter."""
    for i in range(min(a.shape[0], b.shape[0])):
        b[i] = a[i]


@driver
def keep(q, v, a, x, winch, points, kept, controls):
    """Remember the nodes, winch and set-point in one row of State.kept and State.controls."""
    copy(q, kept[0])
    copy(v, kept[1])
    copy(a, kept[2])
    copy(x, kept[3])
    copy_row(winch, controls[0])
    copy_row(points, controls[1])


@driver
def roll_back(q, v, a, x, winch, points, kept, controls):
    """Take back what keep() remembered."""
    copy(kept[0], q)
    copy(kept[1], v)
    copy(kept[2], a)
    copy(kept[3], x)
    copy_row(controls[0], winch)
    copy_row(controls[1], points)


@driver
def place_surfaces(model, state):
    """Contact surfaces and sheave at the ship's present pose."""
    c, d, dd = state.ship[COORD:COORD + 6], state.ship[SHIP_RATE:SHIP_RATE + 6], state.ship[ACCEL:ACCEL + 6]
    omega, _ = spin(c, d, dd)
    axis = rotate(c, (0.0, 1.0, 0.0))
    zero = (0.0, 0.0, 0.0)
    for i in range(state.surfaces.shape[0]):
        s = model.surfaces[i]
        p, v, _ = hull_point(c, d, dd, (s[BODY], s[BODY + 1], s[BODY + 2]), zero, zero)
        for k in range(3):
            state.surfaces[i, CENTRE + k] = p[k]
            state.surfaces[i, SPEED + k] = v[k]
            state.surfaces[i, SPIN + k] = omega[k]
            state.surfaces[i, AXIS + k] = axis[k]
            if i == model.sheave:
                state.sheave[k] = p[k]
                state.sheave[3 + k] = v[k]


@driver
def hold_end(model, state):
    """Position, velocity and acceleration of the cable end on the drum, imposed exactly."""
    p, v, a = drum_point(model.winch, state.winch[LENGTH_NOW], state.winch[RATE_NOW], state.winch[ACCEL_NOW])
    p, v, a = hull_point(state.ship[COORD:COORD + 6], state.ship[SHIP_RATE:SHIP_RATE + 6],
                         state.ship[ACCEL:ACCEL + 6], p, v, a)
    for k in range(3):
        state.q[0, k] = p[k]
        state.v[0, k] = v[k]
        state.a[0, k] = a[k]


@driver
def residual(model, state, c1, c2, sigma, tangent):
    """Assemble the whole system for the present q, v, a; returns the largest residual force [N]."""
    band = state.work.band
    n = band.shape[0]
    state.health[3] = assemble(model.elements, state.arc, state.q, state.v, state.a, state.current, state.surfaces,
                               c1, c2, sigma, tangent, state.work, state.tension)
    body_load(model.body, model.gravity, state.q[n - 1], state.v[n - 1], state.a[n - 1], state.current, state.flow,
              c1, c2, sigma, tangent, band[n - 1])
    for k in range(3):
        state.reaction[k] = -band[0, k, 12]
        for c in range(16):
            band[0, k, c] = 0.0
        band[0, k, k] = 1.0
    worst = 0.0
    for i in range(n):
        length = state.arc[min(i + 1, n - 1)] - state.arc[max(i - 1, 0)]
        for k in range(3):
            f, m = abs(band[i, k, 12]), abs(band[i, 3 + k, 12]) / length
            if not (f < 1e300 and m < 1e300):
                return np.inf
            worst = max(worst, max(f, m))
    return worst


@driver
def _newton(model, state, c1, c2, sigma):
    """Solve the step for q with v += c1 dq, a += c2 dq. Returns the iterations used, or -1 where it does not converge.

    The residual is looked at alone only from the iteration on that solved the step before.
    """
    x = state.work.step
    expected = state.health[5]
    for i in range(model.max_iterations):
        r = residual(model, state, c1, c2, sigma, YES)
        if r <= model.tolerance:
            state.health[2], state.health[5] = r, i
            return i
        if not r < 1e200 or not solve(state.work.band, state.work.lower, x):
            return -1
        for n in range(x.shape[0]):
            for k in range(6):
                d = x[n, k]
                state.q[n, k] += d
                state.v[n, k] += c1 * d
                state.a[n, k] += c2 * d
        if i + 1 < expected:
            continue
        r = residual(model, state, c1, c2, sigma, NO)
        if r <= model.tolerance:
            state.health[2], state.health[5] = r, i + 1
            return i + 1
    return -1


newton = opaque(_newton)


@driver
def step(model, state, inputs, t, h, command_rate):
    """One step of h [s] that ends at t [ns]. Returns (solved, blending); unsolved leaves the state as it was."""
    rho = model.rho_inf
    am, af = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    old = state.kept[STEP]
    keep(state.q, state.v, state.a, state.x, state.winch, state.setpoint, old, state.controls[STEP])
    blending = evaluate(t, state.ship, state.time[3], inputs, state.frame, state.time[1], model.mean, model.stale_decay)
    place_surfaces(model, state)
    s = state.sheave
    length, rate = compensation(model.setpoint, state.setpoint, (s[0], s[1], s[2]), (s[3], s[4], s[5]),
                                state.measured[0])
    length += state.winch[COMMANDED]
    rate += command_rate
    servo(h, model.winch, state.winch, state.setpoint[LENGTH], state.setpoint[RATE], length, rate)
    state.setpoint[LENGTH], state.setpoint[RATE] = length, rate
    # predictor: constant acceleration
    for n in range(state.q.shape[0]):
        for k in range(6):
            a, x = old[2, n, k], old[3, n, k]
            new = (a - am * x) / (1.0 - am)
            state.a[n, k] = a
            state.q[n, k] += h * old[1, n, k] + h * h * ((0.5 - beta) * x + beta * new)
            state.v[n, k] += h * ((1.0 - gamma) * x + gamma * new)
    hold_end(model, state)
    c1 = gamma / (h * beta)
    c2 = (1.0 - am) / ((1.0 - af) * h * h * beta)
    used = newton(model, state, c1, c2, 0.0)
    if used < 0:
        roll_back(state.q, state.v, state.a, state.x, state.winch, state.setpoint, old, state.controls[STEP])
        return False, blending
    for n in range(state.q.shape[0]):
        for k in range(6):
            state.x[n, k] = ((1.0 - af) * state.a[n, k] + af * old[2, n, k] - am * old[3, n, k]) / (1.0 - am)
    state.health[0] += used
    state.health[1] += 1.0
    return True, blending


@driver
def rest_still(v, a):
    """v = a = 0."""
    for n in range(v.shape[0]):
        for k in range(6):
            v[n, k] = 0.0
            a[n, k] = 0.0


@driver
def settle(model, state, sigma, max_steps, step_most):
    """Static equilibrium at the present pose: backward Euler, step 0.02 s growing by 1.7, mass damping sigma [1/s].

    Returns (steps, iterations, residual [N] at rest); steps < 0 where it did not settle.
    """
    place_surfaces(model, state)
    old = state.kept[STEP]
    rest_still(state.v, state.a)
    h, count, total = 0.02, 0, 0
    for _ in range(max_steps):
        hold_end(model, state)
        copy(state.q, old[0])
        copy(state.v, old[1])
        for n in range(state.q.shape[0]):
            for k in range(6):
                state.a[n, k] = -old[1, n, k] / h
                state.v[n, k] = 0.0
        hold_end(model, state)
        used = newton(model, state, 1.0 / h, 1.0 / (h * h), sigma)
        count += 1
        if used < 0:
            copy(old[0], state.q)
            copy(old[1], state.v)
            h *= 0.25
            if h < 1e-5:
                break
            continue
        total += used
        if h >= step_most:
            copy(state.v, old[1])
            rest_still(state.v, state.a)
            rest = residual(model, state, 0.0, 0.0, 0.0, NO)
            if rest <= model.tolerance:
                rest_still(state.x, state.a)
                return count, total, rest
            copy(old[1], state.v)
        h = min(1.7 * h, step_most)
    rest_still(state.v, state.a)
    return -count, total, residual(model, state, 0.0, 0.0, 0.0, NO)


def link_solver(model: Model, state: State) -> None:
    """Compile or load the assembly and the Newton solve and publish them; call before anything that uses them runs."""
    link(_assemble, model.elements, state.arc, state.q, state.v, state.a, state.current, state.surfaces, 0.0, 0.0,
         0.0, NO, state.work, state.tension)
    link(_newton, model, state, 0.0, 0.0, 0.0)
