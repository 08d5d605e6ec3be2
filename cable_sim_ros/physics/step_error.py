"""The error of one step, from the change of the acceleration over it: what the choice of the step goes by.

With jerk j the auxiliary acceleration x of generalised-alpha lags, x = a + (am - af) h j, and q1 = q0 + h v0
+ h^2 ((1/2 - beta) x0 + beta x1) misses the Taylor series of q by c h^3 j, c = beta + (am - af)/2 - 1/6: so h^2 c
(a1 - a0), as Zienkiewicz and Xie (1991) for Newmark, where x = a, and Hulbert and Jang (1995) for generalised-alpha.
Of a mode that a step does not resolve that is no error, the end of the step is in balance: S^-1 c2 M, S the matrix of
the step, leaves slow modes as they are and takes a stiff one down by 1 + (its frequency times h)^2, after
Shampine and Baca (1984). M is lumped: an estimate needs no more.

The drum of a motor is one more node with the same estimate (winch_drive.balance), its held end imposed on the cable: so
brake, dry friction, limits and changes of mode, which change its acceleration at once, show in it, as does what a step
would have gone past an end stop. Its error times the stiffness that a step sees is one of the tension. The attitude of
a rigid body has the same estimate, as the place of its nose.

That is an error over the working tension. What the steps add to the deviation of the tension is of its own size: a
method of second order errs in the amplitude of what goes with frequency w by K (w h)^2 of it, in a variance by
2 K h^2 times that of the rate. So the tension may change in one step by a share of its deviation, both as they were
lately: that bounds (w h)^2 with the w of the deviation itself, whatever moves the tow.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..compiler.jit import LANES, driver, link, opaque
from .ancf import ADDED_MASS, EA, MASS_PER_LENGTH
from .block_tridiagonal import RHS, solve, solve_again
from .integrate import coefficients
from .rigid_body import turn_error
from .state import ARC, NOW, STEP, A, Q
from .vec import dot, norm, sub

# s: over which the deviation of the tension is taken, that of now and its rate; and in which it has just begun, so that
# no less counts than BEGUN times the error that a step may bring of it
DEVIATION_TIME, RATE_TIME, SETTLED = 30.0, 3.0, 5.0
BEGUN = 10.0
SEEN = 100.0  # times what a residual may be: a deviation below that is the solver's
NO_BOUND = 1e300


@driver
def weigh(line, state, n):
    """Mass and added mass [kg] that move with node n along x and y, and along z."""
    arc, m = state.nodes[NOW, ARC, :, 0], 0.0
    for e in range(max(n - 1, 0), min(n + 1, arc.shape[0] - 1)):
        p = line.elements[e // LANES]
        m += 0.5 * (arc[e + 1] - arc[e]) * (p[MASS_PER_LENGTH, e % LANES] + p[ADDED_MASS, e % LANES])
    level, upright = m, m
    for i in range(line.bodies.shape[0]):
        if line.body_nodes[i] == n:
            b = line.bodies[i]
            level += b.mass + 0.5 * (b.added[0] + b.added[1])
            upright += b.mass + b.added[2]
    return level, upright


@driver
def local_error(line, state, h):
    """Errors that the solved step of h [s] brought: of the place [m] and of the tension [N].

    Means of the squares, by mass and by length: a node of little mass that rings on the sheave is no error of the tow.
    """
    work, a, old = state.work, state.nodes[NOW, A], state.nodes[STEP, A]
    am, af, beta, _, _, c2 = coefficients(h, line.settings[0].rho_inf)
    fraction = c2 * h * h * (beta + 0.5 * (am - af) - 1.0 / 6.0)
    for n in range(a.shape[0]):
        level, upright = weigh(line, state, n)
        for k in range(6):
            mass = 0.0 if k > 2 or line.held[n, k] > 0.0 else (upright if k == 2 else level)
            work.band[n, k, RHS] = fraction * mass * (a[n, k] - old[n, k])
    x = work.step
    if state.plan[0].factored != 0:
        solve_again(work.band, work.lower, work.factor, x)
    elif not solve(work.band, work.lower, work.factor, x):
        return np.inf, np.inf
    arc, q = state.nodes[NOW, ARC, :, 0], state.nodes[NOW, Q]
    moved, total, pulled = 0.0, 0.0, 0.0
    for n in range(x.shape[0]):
        d, mass = (x[n, 0], x[n, 1], x[n, 2]), weigh(line, state, n)[1]
        moved += mass * dot(d, d)
        total += mass
        if n > 0:
            e, length = n - 1, arc[n] - arc[n - 1]
            along = sub((q[n, 0], q[n, 1], q[n, 2]), (q[e, 0], q[e, 1], q[e, 2]))
            stretch = dot(sub(d, (x[e, 0], x[e, 1], x[e, 2])), along) / norm(along)
            tension = line.elements[e // LANES, EA, e % LANES] * stretch / length
            pulled += length * tension * tension
    place = sqrt(moved / total)
    if state.attitude.shape[1] > 0:
        place = max(place, turn_error(line, state, fraction))
    return place, sqrt(pulled / (arc[arc.shape[0] - 1] - arc[0]))


@driver
def _error_ratio(line, state, h) -> float:
    """Error of the solved step of h [s] over what it may be; not finite where it cannot be told."""
    settings, control = line.settings[0], state.memory[NOW].control
    control.position, control.tension = local_error(line, state, h)
    drum = state.memory[NOW].drive  # of no error where no motor turns it
    control.position = max(control.position, drum.error)
    control.tension = max(control.tension, drum.error * drum.stiffness)
    return max(control.position / settings.step_position, control.tension / settings.step_tension)


@driver
def mean_tension(state):
    """Mean of the tension along the cable [N]: what rings in a few short elements does not show in it."""
    arc, total = state.nodes[NOW, ARC, :, 0], 0.0
    for e in range(state.tension.shape[0]):
        total += (arc[e + 1] - arc[e]) * state.tension[e]
    return total / (arc[arc.shape[0] - 1] - arc[0])


@driver
def _longest_step(line, state, h) -> float:
    """Take the step of h [s] into what the tension did lately; returns the longest step [s] its deviation bears."""
    settings, control = line.settings[0], state.memory[NOW].control
    tension = mean_tension(state)
    if control.age <= 0.0:
        control.tension_mean = tension
    else:
        off, rate = tension - control.tension_mean, (tension - control.tension_last) / h
        fraction = h / (h + min(control.age, DEVIATION_TIME))
        control.tension_mean += fraction * off
        control.variance += fraction * (off * off - control.variance)
        fraction = h / (h + min(control.age, RATE_TIME))
        control.variance_now += fraction * (off * off - control.variance_now)
        control.rate_square += fraction * (rate * rate - control.rate_square)
    control.tension_last = tension
    control.age += h
    deviation, minimum = sqrt(max(control.variance, control.variance_now)), SEEN * settings.tolerance
    if control.age < SETTLED:
        deviation = max(deviation, BEGUN * settings.step_tension)
    if deviation < minimum or control.rate_square <= 0.0:
        return NO_BOUND
    return settings.step_deviation * deviation / sqrt(control.rate_square)


error_ratio = opaque(_error_ratio)
longest_step = opaque(_longest_step)


def link_error(line, state) -> None:
    """Compile or load the estimates and publish them; call before anything that uses them runs."""
    chosen = line.settings[0].step_tension > 0.0
    link(_error_ratio, line, state, 0.0, needed=chosen)
    link(_longest_step, line, state, 0.0, needed=chosen)
