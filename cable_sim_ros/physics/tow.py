"""The tow: a line held by a winch, led over surfaces that move with a ship; one step in the order of physics."""

from __future__ import annotations

import numpy as np

from .contact_detection import detect_contact
from .contact_surface import DRUM, ON_SHIP
from .energy import beads_fed
from .heave_compensation import mean_track, set_point
from .instruments import end_strain
from .integrate import coefficients, settle
from .jit import NO, driver, link, opaque
from .mean_flow import take_up
from .mesh_motion import flow_of, lay_mesh
from .ship import evaluate, hull_point, rotate, spin
from .state import ARC, NOW, STEP, A, Q, V
from .substeps import begin, finish
from .vec import at3, axpy
from .viv_amplification import aim, approach
from .winch import WOUND, drum_point, drum_turning, servo, wind
from .winch_command import between
from .workspace import FED

NOT_MOVING = (0.0, 0.0, 0.0)
AT_ONCE, CONSISTENT, ROUNDS = 1e3, 1e-5, 40  # of a static start: change of a drag factor, that is none; rounds to it


@driver
def _strum(model, state, h, tick) -> float:
    """Drag factors of strumming over a tick of h [s]; new targets at every so many ticks, tick 0: and all at once.
    Returns the largest change."""
    rules = model.line.strum.rules[0]
    if tick % rules.every == 0:
        aim(model, state)
    return approach(state, rules.rate * h if tick > 0 else AT_ONCE)


strum = opaque(_strum)


def link_strum(model, state) -> None:
    """Compile or load what computes strumming and publish it; call before anything that uses it runs."""
    link(_strum, model, state, 0.0, np.int64(0))


@driver
def place_surfaces(model, state):
    """Contact surfaces and sheave at the ship's present pose; what stands on the ground drifts past the tow."""
    now = state.memory[NOW]
    motion, velocity = now.ship.motion, now.frame.velocity
    omega, _ = spin(motion)
    axis = rotate(motion.coord, (0.0, 1.0, 0.0))
    for i in range(state.surfaces.shape[0]):
        s = state.surfaces[i]
        if s.carrier != ON_SHIP:
            s.speed[0], s.speed[1] = -velocity[0], -velocity[1]
            continue
        p, v, _ = hull_point(motion, at3(s.body, 0), NOT_MOVING, NOT_MOVING)
        for k in range(3):
            s.centre[k] = p[k]
            s.speed[k] = v[k]
            s.spin[k] = omega[k]
            s.axis[k] = axis[k]
            if i == model.settings[0].sheave:
                now.sheave.position[k] = p[k]
                now.sheave.velocity[k] = v[k]
    turn_drum(model, state)


@driver
def turn_drum(model, state):
    """Spin of a drum that rubs: the ship's and, about its axis, the drum's as the winch turns now."""
    now = state.memory[NOW]
    for i in range(state.surfaces.shape[0]):
        s = state.surfaces[i]
        if s.kind == DRUM and s.carrier == ON_SHIP and s.friction > 0.0:
            omega, _ = spin(now.ship.motion)
            turned = axpy(drum_turning(model.settings[0].drum, now.winch), at3(s.axis, 0), omega)
            for k in range(3):
                s.spin[k] = turned[k]


@driver
def hold_end(model, state):
    """Position, velocity and acceleration of the first node, imposed exactly, and the mesh for the pay-out of now."""
    now, nodes = state.memory[NOW], state.nodes[NOW]
    lay_mesh(model.feed, model.settings[0].drum, now.winch, nodes[ARC], model.line.elements)
    turn_drum(model, state)
    p, v, a = drum_point(model.settings[0].drum, now.winch)
    p, v, a = hull_point(now.ship.motion, p, v, a)
    for k in range(3):
        nodes[Q, 0, k] = p[k]
        nodes[V, 0, k] = v[k]
        nodes[A, 0, k] = a[k]


@driver
def impose(model, state, inputs, t, h, command_rate):
    """Ship, surfaces, set-point, winch and cable end at the end t [ns] of a step of h [s]. Is a source blending?"""
    now, settings = state.memory[NOW], model.settings[0]
    blending = evaluate(t, inputs, now, settings.ship.stale_decay)
    place_surfaces(model, state)
    # before the set-point: a track that lags by a step would shift it by each change of the step
    mean_track(now.setpoint, now.sheave, now.ship.motion.coord[5], h)
    # the angle half-way through the step: the last one would lag by half of it, and with it what a drift asks for
    since = (t - now.measured.departure_stamp) * 1e-9 - 0.5 * h
    departure = now.measured.departure + min(max(since, 0.0), h) * now.measured.departure_rate
    length, rate = set_point(now.setpoint, now.sheave, departure, h)
    length += now.winch.commanded
    rate += command_rate
    servo(h, settings.drum, now.winch, (now.setpoint.length, now.setpoint.rate), (length, rate))
    now.setpoint.length, now.setpoint.rate = length, rate
    flow_of(h, coefficients(h, model.line.settings[0].rho_inf), state.memory[STEP].winch, now.winch)
    hold_end(model, state)
    return blending


@driver
def advance_tow(model, state, inputs, commanded, until):
    """Take what is to be taken next of a tick. Returns (False: no halving left, is a source blending).

    commanded, until: pay-out commanded at the beginning and at the end of the tick, each with its rate [m, m/s].
    """
    now, plan, tick_ns = state.memory[NOW], state.plan[0], model.settings[0].tick_ns
    fraction = plan.done + plan.fraction
    now.winch.commanded, now.winch.command_rate = between(commanded, until, fraction, tick_ns * 1e-9)
    h = begin(model.line, state, tick_ns * 1e-9)
    blending = impose(model, state, inputs, now.time.now + int(fraction * tick_ns), h, now.winch.command_rate)
    return end_step(model, state, h), blending


@driver
def end_step(model, state, h):
    """Solve the step of h [s] that was imposed, and wind what ran off or onto the drum. False: no halving left."""
    if model.line.settings[0].amplified != 0:
        take_up(model.line, state, h)
    if not finish(model.line, state, h):
        return False
    if state.plan[0].taken != 0:
        now = state.memory[NOW]
        moved = now.winch.length - state.memory[STEP].winch.length
        wind(model.settings[0].drum, now.winch, moved, end_strain(model.line.elements, state))
        now.account.work[FED] += beads_fed(model.line, state)
    return True


@driver
def rest(model, state, sigma, max_steps, max_step):
    """Static equilibrium of the tow at the ship's present pose, see integrate.settle.

    Where viv is on, settled again until shape and drag factors of strumming belong together; they are not rate limited.
    """
    place_surfaces(model, state)
    hold_end(model, state)
    result = settle(model.line, state, sigma, max_steps, max_step)
    if model.line.strum.sections.shape[0] > 0:
        rounds = 0
        while result[0] >= 0 and strum(model, state, 0.0, 0) > CONSISTENT:
            rounds += 1
            steps, iterations, left = settle(model.line, state, sigma, max_steps, max_step)
            result = steps if rounds < ROUNDS else -abs(steps), result[1] + iterations, left
    strain = end_strain(model.line.elements, state)
    for i in range(WOUND):
        state.memory[NOW].winch.wound[i] = strain
    detect_contact(state, 0.0, NO)
    return result
