"""The tow: a line held by a winch, led over surfaces that move with a ship; one step in the order of physics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .cable import POWERS, Work
from .contact import LOADED, touch
from .integrate import advance, copy, predict, settle, take_back, whipped
from .jit import driver, inline
from .line import ITERATIONS, SUBSTEPS, Line
from .setpoint import LENGTH, RATE, compensation
from .shape import X5, point_of
from .ship import ACCEL, COORD, evaluate, hull_point, rotate, spin
from .ship import RATE as SHIP_RATE
from .surface import AXIS, BODY, CENTRE, NO_TOP, RADIUS, RIM, SPEED, SPIN, TOP, beside, margin, place
from .vec import at3, axpy, cross, norm, sub
from .winch import ACCEL_NOW, COMMANDED, LENGTH_NOW, RATE_NOW, drum_point, servo


class Model(NamedTuple):
    """The scene as numbers for kernels; arrays are read-only except the two that may be set between ticks."""

    elements: np.ndarray  # [groups, ROWS, LANES] element table
    surfaces: np.ndarray  # [n, SURFACE_COLUMNS] contact surfaces in base_link
    held: np.ndarray  # [nodes, 6] 1 where an unknown is imposed: the end on the drum
    bodies: np.ndarray  # [1, BODY_ROWS] towbody
    seats: np.ndarray  # int64 [1] its node
    loads: np.ndarray  # [0, LOAD_COLUMNS] nodal loads: none in a tow
    struts: np.ndarray  # [0, STRUT_COLUMNS]: none in a tow
    winch: np.ndarray  # [WINCH_ROWS]
    setpoint: np.ndarray  # [SETPOINT_ROWS], writeable
    mean: np.ndarray  # [6], writeable: mean coordinates of base_link in the tow frame
    sheave: int  # row of the sheave in surfaces
    tick_ns: int  # ns
    max_iterations: int
    max_halvings: int
    gravity: float  # m/s^2
    rho_inf: float
    tolerance: float  # N
    stale_after: float  # s
    stale_decay: float  # s
    start_blend: float  # s
    source_blend: float  # s
    penetration_limit: float  # m
    groove_depth: float  # m
    reseat_ns: int  # ns
    bending_length: float  # m, sqrt(EI/T) at working tension


class State(NamedTuple):
    """Everything that changes, preallocated and updated in place."""

    time: np.ndarray  # int64 [4] now, start [ns], ticks, start of the blend [ns]
    halted: np.ndarray  # int64 [1] flags of a halted run
    events: np.ndarray  # int64 [3] detachments, seated, since when it presses [ns], see latch()
    frame: np.ndarray  # [4] tow frame: origin x y [m] at the start, velocity [m/s]
    current: np.ndarray  # [4] surface current relative to the tow frame [m/s], gradient [1/s]
    arc: np.ndarray  # [nodes] unstretched arc length from the drum end [m]; may change (pay-out by flow)
    q: np.ndarray  # [nodes, 6] r [m, tow frame], g [1]
    v: np.ndarray
    a: np.ndarray
    x: np.ndarray  # auxiliary acceleration
    kept: np.ndarray  # [2, 4, nodes, 6] q v a x at the beginning of the step and of the tick
    gain: np.ndarray  # [nodes, 6] what a gained in the step before
    tension: np.ndarray  # [elements] N
    reaction: np.ndarray  # [nodes, 6] force of the drum on the cable end [N], the other rows zero
    ship: np.ndarray  # [SHIP_STATE]
    ship_work: np.ndarray  # [SHIP_STATE]
    sheave: np.ndarray  # [6] sheave centre and its velocity, tow frame
    surfaces: np.ndarray  # [n, SURFACE_COLUMNS] in the world
    winch: np.ndarray  # [WINCH_STATE]
    setpoint: np.ndarray  # [SETPOINT_STATE]
    controls: np.ndarray  # [2, 2, 16] winch and set-point at the beginning of the step and of the tick
    flow: np.ndarray  # [1, 6] low-passed flow past the body [m/s], turning rate of the body [rad/s]
    measured: np.ndarray  # [3] departure angle [rad], tension [N] of the last tick, as instruments show; seat() [m]
    account: np.ndarray  # [POWERS + 1] work [J] of Work.power since the start, energy stored at the start
    before: np.ndarray  # [POWERS] W, powers at the end of the last step
    health: np.ndarray  # [HEALTH] see line.py
    work: Work


STEP, TICK = 0, 1  # rows of State.kept and State.controls
LEFT, SEATED, SINCE = 0, 1, 2  # State.events, see contact.latch
# s; a longer step must not end off the sheave it began on, nor higher than half-way up the groove that it began in, nor
# with a cable deeper in it than its rim is round: Newton may converge on the wrong side (trap T5). Shorter ones may
LEAVE_STEP = 2e-3


def tow_line(model: Model, state: State) -> Line:
    """The tow as the solver sees it."""
    return Line(
        model.elements,
        model.held,
        model.bodies,
        model.seats,
        model.loads,
        model.struts,
        state.arc,
        state.q,
        state.v,
        state.a,
        state.x,
        state.kept[STEP],
        state.gain,
        state.current,
        state.surfaces,
        state.flow,
        state.tension,
        state.reaction,
        state.health,
        state.work,
        model.gravity,
        model.tolerance,
        model.max_iterations,
    )


line_of = inline(tow_line)


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
    c, d, dd = state.ship[COORD : COORD + 6], state.ship[SHIP_RATE : SHIP_RATE + 6], state.ship[ACCEL : ACCEL + 6]
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
    p, v, a = hull_point(
        state.ship[COORD : COORD + 6], state.ship[SHIP_RATE : SHIP_RATE + 6], state.ship[ACCEL : ACCEL + 6], p, v, a
    )
    for k in range(3):
        state.q[0, k] = p[k]
        state.v[0, k] = v[k]
        state.a[0, k] = a[k]


@inline
def clear_of(arc, q, v, e, s):
    """Is element e out of reach of surface row s? 10 % for stretch and curvature."""
    mid, _, _ = point_of(arc, q, v, e, 0.5)
    return norm(sub(mid, at3(s, CENTRE))) - 0.55 * (arc[e + 1] - arc[e]) > s[RADIUS] + s[TOP]


@driver
def seat(arc, q, v, s):
    """How far [m] below the top of the groove of surface row s the cable presses at its highest; -1: nowhere in it."""
    least = NO_TOP
    for e in range(arc.shape[0] - 1):
        if clear_of(arc, q, v, e, s):
            continue
        for g in range(5):
            r, w, _ = point_of(arc, q, v, e, X5[g])
            o = touch(r, w, s)
            below = margin(o[17], o[3], s)
            if o[9] + o[13] > LOADED and below > 0.0:
                least = min(least, below)
    return -1.0 if least == NO_TOP else least


@driver
def pierced(arc, q, v, old, s, h):
    """How the cable got into the sheave of row s in a step of h [s] from positions ``old``.

    0: not; 1: deeper than its rim is round; 2: through it, from beside it to beside it on the other side. The sheave is
    taken back to the beginning of the step by its present speed and spin.
    """
    found = 0
    c, speed, turn = at3(s, CENTRE), at3(s, SPEED), at3(s, SPIN)
    axis = at3(s, AXIS)
    before, was = axpy(-h, speed, c), axpy(-h, cross(turn, axis), axis)
    for e in range(arc.shape[0] - 1):
        if clear_of(arc, q, v, e, s):
            continue
        for g in range(5):
            r, w, _ = point_of(arc, q, v, e, X5[g])
            o = touch(r, w, s)
            if o[4] > s[RIM]:
                found = 1
            side = beside(o[17], o[3], s)
            if side != 0.0:
                r, _, _ = point_of(arc, old, v, e, X5[g])
                y, _, _, _, gap = place(sub(r, before), was, s[RADIUS])
                if side * beside(y, gap, s) < 0.0:
                    return 2
    return found


@driver
def astray(model, state, h, now):
    """Did Newton converge where a step of h [s] cannot be trusted to have led? now: seat() at its end."""
    s = state.surfaces[model.sheave]
    through = pierced(state.arc, state.q, state.v, state.kept[STEP, 0], s, h)
    if through == 2 or whipped(state.q, state.kept[STEP], h):
        return True
    if h <= LEAVE_STEP:
        return False
    if through == 1 or (state.events[SINCE] >= 0 and now < 0.0):
        return True
    high = 0.5 * s[TOP]  # where the rim begins at the latest
    return now < high and state.measured[2] >= high


@driver
def step(model, state, inputs, t, h, command_rate):
    """One step of h [s] that ends at t [ns]. Returns (solved, blending); unsolved leaves the state as it was.

    A long step that leaves the sheave, goes deep into it, begins to climb over its rim or turns the cable far counts as
    unsolved, so that the halved steps decide where it goes; so does any step that goes through the sheave.
    """
    line = line_of(model, state)
    copy_row(state.winch, state.controls[STEP, 0])
    copy_row(state.setpoint, state.controls[STEP, 1])
    predict(line, h, model.rho_inf)
    blending = evaluate(t, state.ship, state.time[3], inputs, state.frame, state.time[1], model.mean, model.stale_decay)
    place_surfaces(model, state)
    s = state.sheave
    length, rate = compensation(
        model.setpoint, state.setpoint, (s[0], s[1], s[2]), (s[3], s[4], s[5]), state.measured[0]
    )
    length += state.winch[COMMANDED]
    rate += command_rate
    servo(h, model.winch, state.winch, state.setpoint[LENGTH], state.setpoint[RATE], length, rate)
    state.setpoint[LENGTH], state.setpoint[RATE] = length, rate
    hold_end(model, state)
    used = advance(line, h, model.rho_inf)
    now = seat(state.arc, state.q, state.v, state.surfaces[model.sheave])
    if used >= 0 and astray(model, state, h, now):
        take_back(line)
        used = -1
    if used < 0:
        copy_row(state.controls[STEP, 0], state.winch)
        copy_row(state.controls[STEP, 1], state.setpoint)
        return False, blending
    for i in range(POWERS):  # trapezium; the powers of the last residual are those of the end of the step
        state.account[i] += 0.5 * h * (state.before[i] + state.work.power[i])
        state.before[i] = state.work.power[i]
    state.measured[2] = now
    state.health[ITERATIONS] += used
    state.health[SUBSTEPS] += 1.0
    return True, blending


@driver
def rest(model, state, sigma, max_steps, step_most):
    """Static equilibrium of the tow at the ship's present pose, see integrate.settle."""
    place_surfaces(model, state)
    hold_end(model, state)
    return settle(line_of(model, state), sigma, max_steps, step_most)
