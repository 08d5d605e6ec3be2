"""The one stepper: a step that is asked for, taken whole or in halves by one set of rules.

    start(state)
    while unfinished(state):
        h = begin(line, state, length)     # keeps the present, predicts
        ...                                # what is held or moved goes to where it is at the end of h
        if not finish(line, state, h):     # solves, surveys, judges: takes the step, or takes it back and halves it
            return failed

Used by the tow, by lines of one's own, by the cases and by the stress tests.
"""

from __future__ import annotations

from ..compiler.jit import NO, driver, inline, link, opaque
from .contact_detection import DEEP, THROUGH, detect_contact, link_contact_detection, rubbed
from .contact_surface import GROOVE
from .integrate import link_solver, predict
from .ringing import damped
from .state import GAIN, GAIN_4, NOW, STEP, Q, restore
from .step_error import error_ratio, link_error, longest_step
from .wake_oscillator import advance_wake
from .wind import wash
from .workspace import POWERS, RUBBED

# change of a gradient in one step, and the step [s] below which it may change by more: long steps that turn slack cable
# farther gain energy until one has no solution
MAX_TURN, TURN_STEP = 0.2, 4e-4
# s; a longer step must not end off the sheave it began on, nor higher than half-way up the groove that it began in, nor
# with a cable deeper in it than its rim is round: Newton may converge on the wrong side (trap T5). Shorter ones may
LEAVE_STEP = 2e-3
NO_LIMIT = 1e300
# error of a chosen step over what it may be, up to which the next is twice as long: it goes with the third power of the
# step; corrections up to which a step is worth doubling; and steps between a refused one and the next longer one
GROW, EASY, WAIT = 0.1, 4, 10
ROOM = 0.9  # of the longest step that the deviation bears may be filled by one that is made twice as long


@driver
def turned_far(line, state, h):
    """Did the step of h [s] turn a gradient by more than it may?"""
    maximum = line.settings[0].max_turn
    if h <= TURN_STEP or maximum >= NO_LIMIT:
        return False
    q, old = state.nodes[NOW, Q], state.nodes[STEP, Q]
    for n in range(q.shape[0]):
        for k in range(3, 6):
            if abs(q[n, k] - old[n, k]) > maximum:
                return True
    return False


@driver
def left_groove(line, state, h):
    """Did the step of h [s] end where it cannot be trusted to have led: through, deep in, off or high up a sheave?"""
    events, leave = state.memory[NOW].events, line.settings[0].leave_step
    for i in range(state.surfaces.shape[0]):
        s, found = state.surfaces[i], state.detected[i]
        if s.kind != GROOVE or leave >= NO_LIMIT:
            continue
        if found.entered == THROUGH:
            return True
        if h <= leave:
            continue
        if found.entered == DEEP or (events.pressed_since >= 0 and found.clearance < 0.0):
            return True
        high = 0.5 * s.top  # where the rim begins at the latest
        if found.clearance < high and events.clearance >= high:
            return True
    return False


@inline
def start(state):
    """A step is asked for."""
    plan = state.plan[0]
    plan.done, plan.fraction, plan.level, plan.halved, plan.used, plan.taken = 0.0, 1.0, 0, 0, 0, 0
    while plan.level < state.memory[NOW].control.level:
        plan.level += 1
        plan.fraction *= 0.5


@inline
def unfinished(state):
    """Is there more of the step to take?"""
    return state.plan[0].done < 1.0


@driver
def begin(line, state, length):
    """Begin what is to be taken next of a step of ``length`` [s]; returns its own length."""
    h = state.plan[0].fraction * length
    predict(line, state, h)
    wash(line, state, h)
    if line.wakes.shape[0] > 0:
        advance_wake(line, state, h)
    return h


@driver
def halve(line, state):
    """Take the step back; the next will be half as long. False where it has been halved often enough."""
    plan = state.plan[0]
    restore(state, STEP)
    state.nodes[NOW, GAIN : GAIN_4 + 1] = 0.0  # of no use for a step of another length
    plan.taken = 0
    plan.level += 1
    plan.fraction *= 0.5
    if line.settings[0].step_tension > 0.0:
        state.memory[NOW].control.wait = WAIT
    return plan.level <= line.settings[0].max_halvings


@driver
def _finish(line, state, h, used) -> bool:
    """Take the step of h [s] solved with ``used`` corrections, or halve it; negative: not solved. False: no halving
    left."""
    plan, now = state.plan[0], state.memory[NOW]
    if used >= 0 and state.surfaces.shape[0] > 0 and line.settings[0].leave_step < NO_LIMIT:
        detect_contact(state, h, NO)
        if left_groove(line, state, h):
            used = -1
    if used < 0 or turned_far(line, state, h):
        plan.halved = 1
        going_on = halve(line, state)
        now.control.unsolved += 1
        return going_on
    error, chosen = 0.0, line.settings[0].step_tension > 0.0
    if chosen:
        error = error_ratio(line, state, h)
        if not error <= 1.0:
            going_on = halve(line, state)
            now.control.refused += 1
            return going_on
    account = now.account
    state.work.lanes[0].power[RUBBED] = rubbed(state)
    for i in range(POWERS):  # trapezium; the powers of the last residual are those of the end of the step
        account.work[i] += 0.5 * h * (account.power[i] + state.work.lanes[0].power[i])
        account.power[i] = state.work.lanes[0].power[i]
    for i in range(state.surfaces.shape[0]):
        if state.surfaces[i].kind == GROOVE:
            now.events.clearance = state.detected[i].clearance
    now.health.iterations += used
    now.health.substeps += 1
    account.ringing += damped(line, state, h)
    now.control.taken[plan.level] += 1
    plan.used += used
    plan.taken = 1
    plan.done += plan.fraction
    now.control.wait = max(now.control.wait - 1, 0)
    longest = longest_step(line, state, h) if chosen else NO_LIMIT
    longer = not chosen or (error <= GROW and used <= EASY and now.control.wait == 0 and 2.0 * h <= ROOM * longest)
    if longer and plan.fraction < 1.0 and (plan.done / (2.0 * plan.fraction)) % 1.0 == 0.0:
        plan.fraction *= 2.0
        plan.level -= 1
    elif h > longest and plan.level < line.settings[0].max_halvings:
        plan.fraction *= 0.5
        plan.level += 1
    if chosen:
        now.control.level = plan.level
    return True


finish = opaque(_finish)


def link_stepper(line, state) -> None:
    """Compile or load solver, contact detection and stepper and publish them; call before what uses them runs."""
    link_solver(line, state)
    link_contact_detection(state)
    link_error(line, state)
    link(_finish, line, state, 0.0, 0)
