"""The order of physics: ship -> surfaces -> winch -> water -> cable -> towbody -> tick output, one tick in one
compiled call.

The types stand in state.py (Model, State), inputs.py and output.py (Output); sim/loop.py is the compiled entry.
"""

from __future__ import annotations

import numpy as np

from ..compiler.jit import driver, link, opaque
from .flaps import link_flaps, move_flaps
from .heave_compensation import by_angle
from .output import _fill_vehicle, glance, no_peaks
from .output import observe as _observe
from .rigid_body import head_bodies
from .ringing import fade
from .sensors import sense as _sense
from .ship import follow, ship_ring, vehicle_ring
from .state import FLOW, NOW, TICK, Q, V, checkpoint, restore
from .substeps import begin, link_stepper, start, unfinished
from .tick_output import HALVED, NEWTON_FAILED, NOT_FINITE, SETPOINT_LIMITED
from .tow import end_step, impose, link_tow, place_surfaces, strum
from .towbody import turn_into_flow
from .winch import forget, note_command, winch_flags
from .winch_command import between, command, command_between
from .winch_drive import drive_flags

observe, sense = opaque(_observe), opaque(_sense)


@driver
def finite(x):
    """Is every number of a table finite?"""
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            if not np.isfinite(x[i, j]):
                return False
    return True


@driver
def halt(model, state, output, slot, flags):
    """Roll the tick back and halt the run: everything is as it was before the tick, but for the flags."""
    restore(state, TICK)
    place_surfaces(model, state)
    state.memory[NOW].halted = flags
    output.frame[slot].status = flags
    return flags


@driver
def turn_bodies(line, state, h):
    """Turn the bodies into the flow past them over a tick of h [s]."""
    q, v, flow, m = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, FLOW], state.memory[NOW].current
    for i in range(line.bodies.shape[0]):
        n = line.body_nodes[i]
        turn_into_flow(line.bodies[i], (q[n], v[n], flow[n], state.work.around[n]), (m[0], m[1], m[2], m[3]), h)
    if state.attitude.shape[1] > 0:
        head_bodies(line, state)


@driver
def _follow_vehicle(t, t_next, inputs, now, vehicle) -> None:
    """Take up new samples of the vehicle's motion, see follow()."""
    follow(t, t_next, vehicle_ring(inputs), now.vehicle, now, vehicle.times)


follow_vehicle = opaque(_follow_vehicle)


@driver
def look(model, state, inputs, first, last, h, chosen):
    """Ship, vehicle, commands and flaps at the end ``last`` [ns] of an interval of h [s], which began at ``first``: of
    a tick, or where steps are chosen of each step."""
    now, settings = state.memory[NOW], model.settings[0]
    before = now.winch.command_rate
    follow(first, last, ship_ring(inputs), now.ship, now, settings.ship)
    if settings.vehicle.on != 0:
        follow_vehicle(first, last, inputs, now, settings.vehicle)
    if chosen:
        command_between(first, last, settings.drum, inputs, now.winch)
    else:
        command(last, h, settings.drum, inputs, now.winch)
    note_command(settings.drum, now.winch, before, h)
    if state.attitude.shape[1] > 0:
        move_flaps(model.line.rigid, state, inputs, last, h)


@driver
def end_interval(model, state, last, h, blending):
    """What has gone by with an interval of h [s] that was solved to its end ``last`` [ns]."""
    now = state.memory[NOW]
    now.time.now = last
    turn_bodies(model.line, state, h)
    if not blending:
        now.ship.blend_length = 0.0


@driver
def step(model, state, inputs, begun, commanded, until, chosen):
    """Take what is to be taken next of a tick that began at ``begun`` [ns]. Returns (False: no halving left, is a
    source blending).

    commanded, until: pay-out commanded at the beginning and at the end of the tick, each with its rate [m, m/s], which
    count where steps are not chosen.
    """
    now, plan, tick_ns = state.memory[NOW], state.plan[0], model.settings[0].tick_ns
    done, fraction = plan.done, plan.done + plan.fraction
    first, last = now.time.now, begun + np.int64(fraction * tick_ns)
    if not chosen:
        now.winch.commanded, now.winch.command_rate = between(commanded, until, fraction, tick_ns * 1e-9)
    h = begin(model.line, state, tick_ns * 1e-9)
    if chosen:
        look(model, state, inputs, first, last, h, True)
    blending = impose(model, state, inputs, last, h)
    going_on = end_step(model, state, h)
    if chosen and plan.done > done:
        end_interval(model, state, last, h, blending)
    return going_on, blending


@driver
def _tick(model, state, inputs, output, slot) -> int:
    """Advance one tick and fill row ``slot`` of the output. Returns the flags (tick_output.Flag).

    A step that Newton cannot solve is halved, max_halvings times at most; then the tick is rolled back and the run
    halts: a halted simulation changes nothing and returns its flags again.
    """
    now, settings = state.memory[NOW], model.settings[0]
    if now.halted != 0:
        output.frame[slot].status = now.halted
        return now.halted
    checkpoint(state, TICK)
    end, h, flags = now.time.now + settings.tick_ns, settings.tick_ns * 1e-9, 0
    now.health.iterations, now.health.substeps = 0, 0
    no_peaks(now.health)
    forget(now.winch)
    now.drive.limited, now.drive.ticked, now.drive.rounds = 0.0, 0.0, 0
    begun, commanded, blending = now.time.now, (now.winch.commanded, now.winch.command_rate), False
    chosen = model.line.settings[0].step_tension > 0.0
    if not chosen:
        look(model, state, inputs, begun, end, h, False)
    until = now.winch.commanded, now.winch.command_rate
    start(state)
    while unfinished(state):
        going_on, blending = step(model, state, inputs, begun, commanded, until, chosen)
        if not going_on:
            return halt(model, state, output, slot, NEWTON_FAILED | HALVED)
        if state.plan[0].taken != 0 and unfinished(state):
            if chosen and by_angle(now.setpoint.algorithm):
                observe(model, state, output, slot, 0, blending)
            glance(model, state, output.contact[slot])
    if state.plan[0].halved != 0 and not chosen:
        flags |= HALVED
    if not (finite(state.nodes[NOW, Q]) and finite(state.nodes[NOW, V])):
        return halt(model, state, output, slot, NOT_FINITE | flags)
    if not chosen:
        end_interval(model, state, end, h, blending)
    now.time.ticks += 1
    fade(model.line, state, h, now.time.ticks)
    if model.line.strum.sections.shape[0] > 0:
        strum(model, state, h, now.time.ticks)
    flags |= winch_flags(now.winch, h) | drive_flags(now.drive, now.winch)
    if now.setpoint.limited != 0:
        flags |= SETPOINT_LIMITED
    flags = observe(model, state, output, slot, flags, blending)
    if model.sensors.rules.shape[0] > 0:
        sense(model, state, output.frame[slot])
    return flags


tick = opaque(_tick)


def link_tick(model, state, inputs, output) -> None:
    """Compile or load the tick and what it calls by symbol; call before a compiled function that ticks runs."""
    link_stepper(model.line, state)
    link_tow(model, state, inputs)
    link_flaps(model.line.rigid, state, inputs)
    link(_observe, model, state, output, 0, 0, False)
    vehicle = model.settings[0].vehicle
    link(_follow_vehicle, 0, 0, inputs, state.memory[NOW], vehicle, needed=vehicle.on != 0)
    link(_fill_vehicle, vehicle, state, output.frame[0], needed=vehicle.on != 0)
    link(_sense, model, state, output.frame[0], needed=len(model.sensors.rules) > 0)
    link(_tick, model, state, inputs, output, 0)
