"""Time integration of a line: generalised-alpha with the residual taken at the end of the step, and the static start.

Arnold & Bruls (2007): the auxiliary acceleration x obeys (1-am) x1 + am x0 = (1-af) a1 + af a0, q and v follow x by
Newmark; equilibrium holds exactly at the end of the step, so contact and configuration-dependent added mass need no
averaging. rho_inf <= 0.5: 0.6 and above gain energy silently in snaps (trap T2). The static start is backward Euler
with growing steps (pseudo-transient) on the same Newton core.
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import NO, YES, driver, inline, link, opaque
from .attitude import copy_attitudes
from .block_tridiagonal import solve, solve_again
from .cable_assembly import mean_at
from .kept_tangent import keep_tangent, look_round, solve_by_kept
from .line import link_residual, residual
from .mean_flow import begin_mean, follow, link_mean_flow, mean_fraction
from .parameter import Block, quantity
from .rigid_body import (
    begin_still,
    conclude_attitudes,
    correct_attitudes,
    follow_nodes,
    foresee_attitudes,
    head_bodies,
    rest_attitudes,
)
from .state import (
    AT_REST,
    FLOW,
    GAIN,
    GAIN_2,
    GAIN_3,
    GAIN_4,
    MEAN,
    NODE_ROWS,
    NOW,
    SLOTS,
    STEP,
    A,
    Change,
    Q,
    V,
    X,
    checkpoint,
    forget_tangent,
)
from .towbody import face_flow
from .wake_oscillator import no_wake_load
from .water_kinematics import STILL, link_stir
from .wind import link_wind, wash

# a step halved so often takes a correction that does not make the residual less back by halves: from which one on, how
# often, and how much less it is to be. Longer steps are better halved first: that resolves what makes them hard
SEARCHED, PATIENCE, BACKTRACKS, FALL = 5, 8, 4, 0.9
BETTER = 0.8  # of the squares of what a shorter series errs, below which a longer one foresees the next step
KEPT_SERVES, LONGEST_WAIT = 2, 8  # corrections with a tangent of a step before, and 2^8 steps without after misses


TOLERANCE = 1e-7  # of the working tension, where the scene does not say


class Solver(Block):
    tick: float = quantity(0.01, "s", 1e-4, 1.0, "one published step; above 0.1 s only with solver.tension_error")
    rho_inf: float = quantity(
        0.3, "1", 0.0, 0.5, "spectral radius at infinite frequency", "trap T2: 0.6 and above gain energy in snaps"
    )
    tolerance: float | None = quantity(
        None,
        "1",
        1e-12,
        1e-3,
        "largest residual, as a fraction of the working tension; never below round-off; none: 1e-7, or what "
        "accuracy.position takes where that is less",
    )
    max_iterations: int = quantity(20, "1", 2, 200, "Newton iterations before a step is halved")
    tension_error: float | None = quantity(
        None,
        "1",
        1e-6,
        0.1,
        "error of the tension that steps may bring, as a fraction of the working tension, and of its deviation as a "
        "fraction of that: each tick is divided into as many as that takes (offline only); none: a tick is one step",
    )
    position_error: float = quantity(
        0.01, "m", 1e-6, 10.0, "error of the places that steps may bring, where solver.tension_error is given"
    )
    energy_share: float = quantity(
        0.05,
        "1",
        1e-4,
        1.0,
        "energy that the integration may gain while the cable is slack, of the work turned over since the start; more "
        "raises the flag SLACK_ENERGY",
    )
    max_halvings: int = quantity(8, "1", 0, 20, "halvings of a step before the solver gives up")


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


# loops over rows of as many numbers: few rows in each, so that they become loops of machine vectors


@driver
def zero(row):
    """row = 0"""
    for i in range(row.shape[0]):
        row[i] = 0.0


@driver
def subtract(a, b, out):
    """out = a - b"""
    for i in range(out.shape[0]):
        out[i] = a[i] - b[i]


@driver
def difference(new, kept):
    """kept = new and new = new - kept: the next backward difference."""
    for i in range(new.shape[0]):
        new[i], kept[i] = new[i] - kept[i], new[i]


@driver
def add(row, s, x):
    """row += s x"""
    for i in range(row.shape[0]):
        row[i] += s * x[i]


@driver
def add_two(row, s, x, t, y):
    """row += s x + t y"""
    for i in range(row.shape[0]):
        row[i] += s * x[i] + t * y[i]


@driver
def leave_held(row, held):
    """row = 0 where held is 1"""
    for i in range(row.shape[0]):
        row[i] *= 1.0 - held[i]


@driver
def trend(line, state, h):
    """Number of backward differences, 0 to 4, with which the next step foresees its acceleration: Newton's series.

    That which would have foreseen best at the end of the step before how the cable stretches, its stiffest way; a
    longer series where it errs less by far: after a jump all err alike. Rows GAIN to GAIN_4 take the new differences:
    what the series that end before them erred by.
    """
    g, health = state.nodes[NOW, Q, :, 3:], state.memory[NOW].health
    one, two = state.nodes[NOW, GAIN], state.nodes[NOW, GAIN_2]
    three, four, five = state.nodes[NOW, GAIN_3], state.nodes[NOW, GAIN_4], state.work.step
    rows, new = state.nodes.reshape(SLOTS, NODE_ROWS, five.size), five.reshape(five.size)
    subtract(rows[NOW, A], rows[STEP, A], new)
    for row in range(GAIN, GAIN_4 + 1):
        difference(new, rows[NOW, row])
    err_0, err_1, err_2, err_3, err_4 = 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(1, g.shape[0]):
        s0, s1, s2, s3, s4 = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            s0 += g[n, k] * (one[n, k] - one[n - 1, k])
            s1 += g[n, k] * (two[n, k] - two[n - 1, k])
            s2 += g[n, k] * (three[n, k] - three[n - 1, k])
            s3 += g[n, k] * (four[n, k] - four[n - 1, k])
            s4 += g[n, k] * (five[n, k] - five[n - 1, k])
        err_0 += s0 * s0
        err_1 += s1 * s1
        err_2 += s2 * s2
        err_3 += s3 * s3
        err_4 += s4 * s4
    same, health.last_step = health.last_step == h, h
    errors, terms = (err_0, err_1, err_2, err_3, err_4), 0
    for k in range(1, 5):
        if errors[k] < BETTER * errors[terms]:
            terms = k
    return terms if same else 0


@driver
def stretch_lag(state, ratio):
    """The lag of x behind a is in proportion to the step: that of a step ``ratio`` times as long as the last.

    Left as it is, each change of step from h' to h would leave an error of 0.11 h (h - h') j in the velocity.
    """
    a, x = state.nodes[NOW, A], state.nodes[NOW, X]
    for n in range(a.shape[0]):
        for k in range(6):
            x[n, k] = a[n, k] + ratio * (x[n, k] - a[n, k])


@driver
def _predict(line, state, h) -> None:
    """Begin a step: keep the present in slot STEP, extrapolate with an acceleration that stays or goes on changing.

    In a step of another length, so after a halving, it stays (see trend): one that goes on changing may foresee stiff
    cable as pushing, where the tangent is next to singular. So it does where it is held: no balance would call a series
    back that runs away from its own round-off.
    """
    rule = coefficients(h, line.settings[0].rho_inf)
    am, af, beta, gamma, _, _ = rule
    before = state.memory[NOW].health.last_step
    terms, ratio = trend(line, state, h), 1.0
    if line.settings[0].step_tension > 0.0 and before > 0.0 and before != h:
        ratio = h / before
        stretch_lag(state, ratio)
    checkpoint(state, STEP)
    begin_mean(line.settings[0], state, h)
    if state.attitude.shape[1] > 0:
        foresee_attitudes(state, h, ratio, float(min(terms, 1)), rule)
    rows, rise = state.nodes.reshape(SLOTS, NODE_ROWS, line.held.size), state.work.step.reshape(line.held.size)
    v, a, x, share = rows[STEP, V], rows[STEP, A], rows[STEP, X], 1.0 / (1.0 - am)
    zero(rise)
    for row in range(GAIN, GAIN + terms):
        add(rise, 1.0, rows[NOW, row])
    leave_held(rise, line.held.reshape(line.held.size))
    of_q, of_v = h * h * beta * share, h * gamma * share  # what the auxiliary acceleration at the end weighs in both
    add_two(rows[NOW, Q], h, v, of_q * (1.0 - af), rise)
    add_two(rows[NOW, Q], h * h * (0.5 - beta) - am * of_q, x, of_q, a)
    add_two(rows[NOW, V], h * (1.0 - gamma) - am * of_v, x, of_v, a)
    add(rows[NOW, V], of_v * (1.0 - af), rise)
    add(rows[NOW, A], 1.0, rise)


@driver
def correct(state, change, part):
    """Add this part of the solution in the work space to the nodes."""
    x = state.work.step.reshape(state.work.step.size)
    rows = state.nodes.reshape(SLOTS, NODE_ROWS, x.size)
    add(rows[NOW, Q], part, x)
    add(rows[NOW, V], part * change.velocity, x)
    add(rows[NOW, A], part * change.acceleration, x)
    if state.attitude.shape[1] > 0:
        correct_attitudes(state, change, part)


@driver
def correct_by_kept(line, state, change, r):
    """Correct the prediction, of residual ``r`` [N], with the tangent of a step before. Returns how often; negative
    where that does not solve the step, from where Newton goes on.

    A second time only where that would meet the tolerance by as much as the first gained: a new tangent costs as much.
    """
    plan, health, tolerance = state.plan[0], state.memory[NOW].health, line.settings[0].tolerance
    follow = look_round(state)
    for used in range(1, KEPT_SERVES + 1):
        solve_by_kept(line, state, follow)
        correct(state, change, 1.0)
        before, r = r, residual(line, state, change, NO)
        if r <= tolerance:
            health.residual, plan.missed = r, 0
            if used == KEPT_SERVES:
                plan.kept = 0.0  # it grows old
            return used
        if not r < before:
            correct(state, change, -1.0)
        if not r * r <= tolerance * before:
            break
    plan.missed = min(plan.missed + 1, LONGEST_WAIT)
    plan.wait = 2**plan.missed - 2  # at once after the first
    return -used


@driver
def _newton(line, state, change) -> int:
    """Solve the step for q; v and a follow by change. Returns the corrections used, or -1 where it does not converge.

    Where slack elements fold, the stiffness jumps at no tension, and whole corrections may lead from one side of it to
    the other and back for ever: in a step that has been halved SEARCHED times, after PATIENCE of them each is shortened
    until it makes the residual less.
    A tangent serves again where one more correction as good as its last meets the tolerance, in later steps of the same
    length too: those of a tick differ little. health.tangents, those that the step before needed, tells from which
    correction on the residual is looked at without one: after a step that needed none the prediction itself. Chosen
    steps need a tangent of their own for their error, and bodies with an attitude one that is their own.
    """
    work, x, health, tolerance = state.work, state.work.step, state.memory[NOW].health, line.settings[0].tolerance
    plan = state.plan[0]
    wanted, enough, chosen = health.tangents, 0, line.settings[0].step_tension > 0.0
    keeps, spent = not chosen and state.attitude.shape[1] == 0, 0
    serves = keeps and plan.kept == change.acceleration and plan.wait == 0
    plan.wait = max(plan.wait - 1, 0)
    if serves or (wanted == 0 and not chosen):
        r = residual(line, state, change, NO)
        if r <= tolerance:
            health.residual = r
            return 0
        spent = correct_by_kept(line, state, change, r) if serves else 0
        if spent > 0:
            return spent
    tangents, r, again = 0, np.inf, False
    for i in range(line.settings[0].max_iterations):
        before = r
        if again:
            solve_again(work.band, work.lower, work.factor, x)
        else:
            r, plan.factored = residual(line, state, change, YES), 0
            if r <= tolerance:
                health.residual, health.tangents = r, tangents
                return i - spent
            if not r < 1e200 or not solve(work.band, work.lower, work.factor, x):
                return -1
            plan.factored = 1
            if keeps:
                keep_tangent(state, change)
            if enough == 0 and tangents > 0 and r * r <= tolerance * before:
                enough = tangents
            before = r
            tangents += 1
        if state.attitude.shape[1] > 0:
            follow_nodes(line, state)
        correct(state, change, 1.0)
        searching = i >= PATIENCE and not again and plan.level >= SEARCHED
        if not again and tangents < wanted and not searching:
            continue
        r = residual(line, state, change, NO)
        if searching:
            part = 0.5
            for _ in range(BACKTRACKS):
                if r <= FALL * before:
                    break
                correct(state, change, -part)
                part *= 0.5
                r = residual(line, state, change, NO)
        if r <= tolerance:
            health.residual, health.tangents = r, enough if enough > 0 else tangents
            return i + 1 - spent
        again = r * r <= tolerance * before
    return -1


newton = opaque(_newton)
predict = opaque(_predict)


@inline
def solve_step(line, state, h):
    """Newton's corrections of the predicted step, held unknowns already at its end; negative: none found."""
    _, _, _, _, c1, c2 = coefficients(h, line.settings[0].rho_inf)
    fraction = mean_fraction(line.settings[0], state.memory[NOW].known, h)
    return newton(line, state, Change(c1, c2, line.settings[0].mass_damping, fraction))


@driver
def advance(line, state, h):
    """Solve the predicted step, held unknowns already at its end. Returns the iterations, or -1 and no valid state."""
    used = solve_step(line, state, h)
    if used >= 0:
        conclude(line, state, h)
    return used


@driver
def conclude(line, state, h):
    """What follows from a solved step: auxiliary accelerations and the running mean."""
    rule = coefficients(h, line.settings[0].rho_inf)
    am, af, _, _, _, _ = rule
    if state.attitude.shape[1] > 0:
        conclude_attitudes(state, rule)
    rows, share = state.nodes.reshape(SLOTS, NODE_ROWS, line.held.size), 1.0 / (1.0 - am)
    x = rows[NOW, X]
    zero(x)
    add_two(x, (1.0 - af) * share, rows[NOW, A], af * share, rows[STEP, A])
    add(x, -am * share, rows[STEP, X])
    if line.settings[0].amplified != 0:
        fraction, mean = mean_fraction(line.settings[0], state.memory[NOW].known, h), state.nodes[NOW, MEAN]
        for n in range(mean.shape[0]):
            for k in range(6):
                mean[n, k] = mean_at(state.nodes, n, k, fraction)
        follow(line, state)


@driver
def rest_still(state):
    """No velocity, no acceleration, and none in the mean; no load of a wake."""
    no_wake_load(state)
    if state.attitude.shape[1] > 0:
        rest_attitudes(state)
    for row in (V, A, MEAN):
        table = state.nodes[NOW, row]
        for n in range(table.shape[0]):
            for k in range(6):
                table[n, k] = 0.0


@driver
def face(line, state):
    """Turn the bodies into the flow where they are, at rest."""
    q, flow, m = state.nodes[NOW, Q], state.nodes[NOW, FLOW], state.memory[NOW].current
    for i in range(line.bodies.shape[0]):
        n = line.body_nodes[i]
        if line.bodies[i].rigid >= 0:
            continue
        face_flow(line.bodies[i], (q[n], flow[n], state.work.around[n]), (m[0], m[1], m[2], m[3]))
    if state.attitude.shape[1] > 0:
        head_bodies(line, state)


@driver
def _settle(line, state, sigma, max_steps, max_step) -> tuple[int, int, float]:
    """Static equilibrium with the held unknowns where they are: backward Euler, step 0.02 s growing by 1.7.

    sigma: mass damping [1/s]. Returns (steps, iterations, residual [N] at rest); steps < 0 where it did not settle.
    """
    q, v, a, x = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A], state.nodes[NOW, X]
    old_q, old_v = state.nodes[STEP, Q], state.nodes[STEP, V]
    rest_still(state)
    plan = state.plan[0]
    plan.level = 0
    h, count, total = 0.02, 0, 0
    for _ in range(max_steps):
        copy(q, old_q)
        copy(v, old_v)
        for n in range(q.shape[0]):
            for k in range(6):
                a[n, k] = -old_v[n, k] / h
                v[n, k] = 0.0
        if state.attitude.shape[1] > 0:
            begin_still(state, h)
        wash(line, state, STILL)
        used = newton(line, state, Change(1.0 / h, 1.0 / (h * h), sigma, 0.0))
        forget_tangent(state)
        count += 1
        if used < 0:
            copy(old_q, q)
            copy(old_v, v)
            if state.attitude.shape[1] > 0:
                copy_attitudes(state.attitude, STEP, NOW)
            h *= 0.25
            plan.level = SEARCHED  # for the next: most starts need no shortened correction, and some mind them
            if h < 1e-5:
                break
            continue
        total += used
        plan.level = 0
        face(line, state)
        if h >= min(1.0, max_step):  # balanced at rest is settled; a free end without tension needs no longer one
            copy(v, old_v)
            if state.attitude.shape[1] > 0:
                copy_attitudes(state.attitude, NOW, STEP)
            rest_still(state)
            wash(line, state, STILL)
            rest = residual(line, state, AT_REST, NO)
            if rest <= line.settings[0].tolerance:
                copy(a, x)
                return count, total, rest
            copy(old_v, v)
            if state.attitude.shape[1] > 0:
                copy_attitudes(state.attitude, STEP, NOW)
        h = min(1.7 * h, max_step)
    rest_still(state)
    wash(line, state, STILL)
    return -count, total, residual(line, state, AT_REST, NO)


settle = opaque(_settle)


def link_solver(line, state) -> None:
    """Compile or load the assembly and the Newton solve and publish them; call before anything that uses them runs."""
    link_residual(line, state)
    link_mean_flow(line, state)
    link(_newton, line, state, AT_REST)
    link(_predict, line, state, 0.0)
    link_stir(line, state)
    link_wind(line, state)
    link(_settle, line, state, 0.0, 0, 0.0)
