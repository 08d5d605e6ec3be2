"""The order of physics: ship -> surfaces -> winch -> water -> cable -> towbody -> Frame, one tick in one compiled call.

The types stand in tow.py (Model, State), inputs.py and observe.py (Output); sim/entry.py is the compiled entry.
"""

from __future__ import annotations

import numpy as np

from .integrate import link_solver
from .jit import driver, link, opaque
from .line import ITERATIONS, SUBSTEPS
from .observe import COMMAND_STALE, DRUM_END, HALVED, NEWTON_FAILED, NOT_FINITE
from .observe import observe as _observe
from .setpoint import mean_track
from .ship import BLEND_LENGTH, COORD, follow
from .tow import TICK, keep, roll_back, step, tow_line
from .towbody import turn_into_flow
from .winch import AT_END, COMMAND_AGE, COMMANDED, STALE, command

NOW, START, COUNT, CLOCK = 0, 1, 2, 3  # State.time [ns, ns, 1, ns]


@driver
def finite(x):
    """Is every number of a table finite?"""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            if not np.isfinite(x[i, j]):
                return False
    return True


@driver
def halt(state, output, slot, flags):
    """Roll the tick back and halt the run."""
    roll_back(state.q, state.v, state.a, state.x, state.winch, state.setpoint, state.kept[TICK], state.controls[TICK])
    state.halted[0] = flags
    output.frame[slot].status = flags
    return state.halted[0]


@driver
def _tick(model, state, inputs, output, slot):
    """Advance one tick and fill row ``slot`` of the output. Returns the flags (sim.frame.Flag).

    A step that Newton cannot solve is halved, max_halvings times at most; then the tick is rolled back and the run
    halts: a halted simulation changes nothing and returns its flags again.
    """
    flags = state.halted[0]
    if flags != 0:
        output.frame[slot].status = flags
        return flags
    begin = state.time[NOW]
    end = begin + model.tick_ns
    keep(state.q, state.v, state.a, state.x, state.winch, state.setpoint, state.kept[TICK], state.controls[TICK])
    state.health[ITERATIONS], state.health[SUBSTEPS] = 0.0, 0.0
    state.time[CLOCK] = follow(
        begin,
        end,
        state.ship,
        state.time[CLOCK],
        inputs,
        state.frame,
        state.time[START],
        model.mean,
        model.stale_decay,
        model.start_blend,
        model.source_blend,
        state.ship_work,
    )
    commanded = state.winch[COMMANDED]
    rate = command(end, model.tick_ns * 1e-9, model.winch, inputs, state.winch)
    stale, age = state.winch[STALE], state.winch[COMMAND_AGE]
    done, share, level = 0.0, 1.0, 0
    blending = False
    while done < 1.0:
        h = share * model.tick_ns * 1e-9
        t = begin + np.int64((done + share) * model.tick_ns)
        state.winch[COMMANDED] = commanded + rate * (done + share) * model.tick_ns * 1e-9
        ok, blending = step(model, state, inputs, t, h, rate)
        if ok:
            done += share
            if share < 1.0 and (done / (2.0 * share)) % 1.0 == 0.0:
                share *= 2.0
                level -= 1
        else:
            flags |= HALVED
            level += 1
            share *= 0.5
            if level > model.max_halvings:
                return halt(state, output, slot, NEWTON_FAILED | flags)
    if not (finite(state.q) and finite(state.v)):
        return halt(state, output, slot, NOT_FINITE | flags)
    h = model.tick_ns * 1e-9
    last = state.q.shape[0] - 1
    turn_into_flow(model.bodies[0], state.q[last], state.v[last], state.current, state.flow[0], h)
    mean_track(model.setpoint, state.setpoint, state.sheave[0], state.sheave[1], state.ship[COORD + 5], h)
    state.time[NOW] = end
    state.time[COUNT] += 1
    if stale != 0.0:
        flags |= COMMAND_STALE
    if state.winch[AT_END] != 0.0:
        flags |= DRUM_END
    state.winch[COMMAND_AGE] = age
    if not blending:
        state.ship[BLEND_LENGTH] = 0.0
    return observe(model, state, output, slot, flags, blending)


observe = opaque(_observe)
tick = opaque(_tick)


def link_tick(model, state, inputs, output) -> None:
    """Compile or load the tick and what it calls by symbol; call before a compiled function that ticks runs."""
    link_solver(tow_line(model, state))
    link(_observe, model, state, output, 0, 0, False)
    link(_tick, model, state, inputs, output, 0)
