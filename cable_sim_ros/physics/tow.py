"""The tow: a line held by a winch, led over surfaces that move with a ship; one step in the order of physics."""

from __future__ import annotations

import numpy as np

from ..compiler.jit import NO, driver, inline, link, opaque
from .ancf import EA
from .contact_detection import detect_contact
from .contact_output import pull_of
from .contact_surface import DRUM, ON_SHIP
from .energy import beads_fed
from .heave_compensation import mean_track, set_point
from .instruments import end_strain
from .integrate import advance, coefficients, conclude, settle, solve_step
from .mean_flow import take_up
from .mesh_motion import flow_of, lay_mesh
from .noise import gauss, spoiled
from .rate_loop import _follow_rate, follow_rate
from .sensor_models import FROZEN, NOISE
from .sensors import pin_tension
from .ship import evaluate, hull_point, rotate, ship_ring, spin, vehicle_ring
from .state import ARC, NOW, STEP, A, Q, V
from .substeps import finish
from .swivel import hinge, rolled, swing, swung_to
from .vec import at3, axpy
from .vehicle import end_of
from .viv_amplification import aim, approach
from .winch import WOUND, clip, drum_point, drum_turning, servo, wind
from .winch_drive import BRAKE, MEETINGS, MOTOR, RATE_LOOP, SERVO, balance, begin_turn, count_work
from .workspace import FED

NOT_MOVING, ACROSS = (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
DRIVE_CHANCE = 77  # seed of the noise of a fault
NO_WAY = 1e-13  # m, over which no stiffness is taken
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


@driver
def place_surfaces(model, state):
    """Contact surfaces and sheave at the ship's present pose; what stands on the ground drifts past the tow."""
    now, swivel = state.memory[NOW], model.settings[0].swivel
    motion, velocity = now.ship.motion, now.frame.velocity
    omega, _ = spin(motion)
    across = rotate(motion.coord, ACROSS)
    for i in range(state.surfaces.shape[0]):
        s = state.surfaces[i]
        if s.carrier != ON_SHIP:
            s.speed[0], s.speed[1] = -velocity[0], -velocity[1]
            continue
        body, drift, axis, turns = at3(s.body, 0), NOT_MOVING, across, omega
        if i == model.settings[0].sheave and swivel.on != 0:
            body, drift = swung_to(swivel, now.swung, body)
            axis = rotate(motion.coord, rolled(swivel, now.swung.angle, ACROSS))
            turns = axpy(now.swung.rate, rotate(motion.coord, hinge(swivel)), omega)
        p, v, _ = hull_point(motion, body, drift, NOT_MOVING)
        for k in range(3):
            s.centre[k] = p[k]
            s.speed[k] = v[k]
            s.spin[k] = turns[k]
            s.axis[k] = axis[k]
            if i == model.settings[0].sheave:
                now.sheave.position[k] = p[k]
                now.sheave.velocity[k] = v[k]
        if s.bearing > 0.0:  # the bearing bears the resultant alone
            s.friction = min(s.grip, s.bearing * now.events.bears)
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
def lay(model, state):
    """The mesh for the pay-out of now."""
    now, arc = state.memory[NOW], state.nodes[NOW, ARC]
    lay_mesh(model.feed, model.settings[0].drum, now.winch, arc, model.line.elements)


@driver
def hold_end(model, state):
    """Position, velocity and acceleration of the first node, imposed exactly, and the mesh for the pay-out of now."""
    now, nodes = state.memory[NOW], state.nodes[NOW]
    lay(model, state)
    turn_drum(model, state)
    p, v, a = drum_point(model.settings[0].drum, now.winch)
    p, v, a = hull_point(now.ship.motion, p, v, a)
    for k in range(3):
        nodes[Q, 0, k] = p[k]
        nodes[V, 0, k] = v[k]
        nodes[A, 0, k] = a[k]
    if model.settings[0].vehicle.on != 0:
        hold_far_end(model, state)


@driver
def _hold_far_end(model, state) -> None:
    """The same of the last node, which a vehicle drives."""
    now, nodes, settings = state.memory[NOW], state.nodes[NOW], model.settings[0]
    p, v, a, now.vehicle_off = end_of(settings.vehicle, now, state.surfaces[settings.sheave], settings.drum)
    last = nodes.shape[1] - 1
    for k in range(3):
        nodes[Q, last, k] = p[k]
        nodes[V, last, k] = v[k]
        nodes[A, last, k] = a[k]


hold_far_end = opaque(_hold_far_end)


@driver
def _move_vehicle(t, inputs, now, vehicle) -> bool:
    """Motion of the vehicle at t [ns]. Is a changed source being taken up?"""
    return evaluate(t, vehicle_ring(inputs), now.vehicle, now, vehicle.times.stale_decay)


move_vehicle = opaque(_move_vehicle)


@driver
def _impose(model, state, inputs, t, h) -> bool:
    """Ship, surfaces, set-point, winch and cable end at the end t [ns] of a step of h [s]. Is a source blending?"""
    now, settings = state.memory[NOW], model.settings[0]
    blending = evaluate(t, ship_ring(inputs), now.ship, now, settings.ship.stale_decay)
    if settings.vehicle.on != 0 and not move_vehicle(t, inputs, now, settings.vehicle):
        now.vehicle.blend_length = 0.0
    if settings.swivel.on != 0:
        swing(h, settings.swivel, state.memory[STEP].swung, now.swung)
    place_surfaces(model, state)
    sheave = now.seen if settings.instrumented != 0 else now.sheave
    # before the set-point: a track that lags by a step would shift it by each change of the step
    mean_track(now.setpoint, sheave, now.ship.motion.coord[5], h)
    # the angle half-way through the step: the last one would lag by half of it, and with it what a drift asks for
    since = (t - now.measured.departure_stamp) * 1e-9 - 0.5 * h
    departure = now.measured.departure + min(max(since, 0.0), h) * now.measured.departure_rate
    tension = pin_tension(state.sensors) if settings.instrumented != 0 else now.measured.tension
    paid = now.winch.length - now.winch.commanded
    length, rate = set_point(now.setpoint, sheave, departure, h, tension, paid)
    now.drive.law = length
    length += now.winch.commanded
    rate += now.winch.command_rate
    turn(model, state, h, length, rate)
    flow_of(h, coefficients(h, model.line.settings[0].rho_inf), state.memory[STEP].winch, now.winch)
    hold_end(model, state)
    return blending


impose = opaque(_impose)


@inline
def late(model, state, length, rate):
    """The set-point as it comes to the drive: that of drive.dead_time ago, on the line between two ticks."""
    now, rows = state.memory[NOW], state.delayed.shape[0]
    if rows == 0:
        return length, rate
    tick, settings = now.time.ticks, model.settings[0]
    newest = state.delayed[(tick + 1) % rows]  # of the end of this tick, written again by each of its steps
    newest[0], newest[1] = length, rate
    part = state.plan[0].done + state.plan[0].fraction
    back = (settings.drive.dead_time * 1e9 / settings.tick_ns) + 1.0 - part  # ticks from the end of this one
    whole = int(back)
    s = back - whole
    one = state.delayed[(tick + 1 - min(whole, tick + 1)) % rows]  # before the first tick: as at the start
    two = state.delayed[(tick + 1 - min(whole + 1, tick + 1)) % rows]
    return (1.0 - s) * one[0] + s * two[0], (1.0 - s) * one[1] + s * two[1]


@inline
def spoiled_set_point(fault, length, rate, time):
    """A set-point with the fault of the drive."""
    since = (time.now - fault.since) * 1e-9
    chance = gauss(DRIVE_CHANCE, time.ticks, 0) if fault.kind == NOISE else 0.0
    moves = 0.0 if fault.kind == FROZEN else spoiled(fault, rate, 1, since, chance)
    return spoiled(fault, length, 0, since, chance), moves


@driver
def begin_drive(model, state, before):
    """A drive at rest: its motor holds the cable, or its brake where that is to be set."""
    drum, drive = model.settings[0].drum, model.settings[0].drive
    before.tension = pull_of(drum, state) / drum.radius
    before.tension_before, before.integral = before.tension, before.tension
    before.stiffness = model.line.elements[0, EA, 0] / max(drum.payout_0 + drum.max_length - drum.min_length, 1.0)
    before.brake = 1.0 if drive.mode >= BRAKE else 0.0
    before.begun = 1


@driver
def _turn_motor(model, state, h, given, given_rate) -> None:
    """The same, a drum that a motor turns against the pull of the cable and its own inertia."""
    now, settings = state.memory[NOW], model.settings[0]
    drive, driving, old, before = settings.drive, now.drive, state.memory[STEP].winch, state.memory[STEP].drive
    if before.begun == 0:
        begin_drive(model, state, before)
    begin_turn(h, settings.drum, drive, old, before, driving, now.winch, given, given_rate)
    if driving.following == 0:  # nor does the mean flow know of a command that moves nothing
        now.winch.command_rate = 0.0
    driving.begun, driving.stiffness = 1, before.stiffness
    trend = (before.tension - before.tension_before) * (h / before.step if before.step > 0.0 else 0.0)
    at = old.length + h * (old.rate + 0.5 * h * old.accel)
    alpha = coefficients(h, model.line.settings[0].rho_inf)
    balance(h, alpha, settings.drum, drive, old, before, now.winch, driving, at, before.tension + trend)


turn_motor = opaque(_turn_motor)


@driver
def turn(model, state, h, length, rate):
    """Drum at the end of a step of h [s] towards a set-point (length [m], rate [m/s]), by the model of its drive."""
    now, settings = state.memory[NOW], model.settings[0]
    drive, driving = settings.drive, now.drive
    given, given_rate = late(model, state, length, rate)
    if now.winch.drive_fault.kind != 0:
        given, given_rate = spoiled_set_point(now.winch.drive_fault, given, given_rate, now.time)
    if drive.model == SERVO:
        begin = (now.setpoint.length, now.setpoint.rate)
        if state.delayed.shape[0] > 0 or now.winch.drive_fault.kind != 0:
            begin = (driving.given, driving.given_rate)
        servo(h, settings.drum, now.winch, begin, (given, given_rate))
    elif drive.model == RATE_LOOP:
        follow_rate(h, settings.drum, drive, now.winch, driving, given, given_rate)
    else:
        turn_motor(model, state, h, given, given_rate)
    now.setpoint.length, now.setpoint.rate = length, rate
    driving.given, driving.given_rate = given, given_rate


@driver
def _solve_driven(model, state, h) -> int:
    """Solve cable and drum together, see winch_drive.py. Returns the corrections, negative where they do not meet."""
    now, line, drum, drive = state.memory[NOW], model.line, model.settings[0].drum, model.settings[0].drive
    winch, driving, total = now.winch, now.drive, 0
    alpha = coefficients(h, line.settings[0].rho_inf)
    last_length, last_tension = winch.length, 0.0
    for i in range(MEETINGS):
        used = solve_step(line, state, h)
        if used < 0:
            return used
        total += used
        driving.rounds += 1
        tension = pull_of(drum, state) / drum.radius
        if i > 0 and abs(winch.length - last_length) > NO_WAY:
            secant = (last_tension - tension) / (winch.length - last_length)
            if secant > 0.0:
                driving.stiffness = secant
        if driving.stopped != 0 or abs(tension - driving.expected) <= drive.balance:
            driving.tension_before, driving.tension = state.memory[STEP].drive.tension, tension
            conclude(line, state, h)
            if driving.following == 0:  # commands go on from where the drum is
                winch.commanded = clip(winch.length - driving.law, drum.min_reach, drum.max_reach)
            driving.ticked += h
            driving.limited += h if driving.spent != 0 else 0.0
            count_work(drive, state.memory[STEP].winch, state.memory[STEP].drive, winch, driving)
            winch.fastest, winch.hardest = max(winch.fastest, abs(winch.rate)), max(winch.hardest, abs(winch.accel))
            return total
        last_length, last_tension = winch.length, tension
        old, before = state.memory[STEP].winch, state.memory[STEP].drive
        balance(h, alpha, drum, drive, old, before, winch, driving, last_length, tension)
        flow_of(h, alpha, old, winch)
        hold_end(model, state)
    return -1


solve_driven = opaque(_solve_driven)


@driver
def end_step(model, state, h):
    """Solve the step of h [s] that was imposed, and wind what ran off or onto the drum. False: no halving left."""
    if model.line.settings[0].amplified != 0:
        take_up(model.line, state, h)
    driven = model.settings[0].drive.model == MOTOR
    used = solve_driven(model, state, h) if driven else advance(model.line, state, h)
    if not finish(model.line, state, h, used):
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


def link_tow(model, state, inputs) -> None:
    """Compile or load what a step of a tow calls by symbol and publish it; call before anything that uses it runs."""
    settings, now = model.settings[0], state.memory[NOW]
    drive, vehicle = settings.drive, settings.vehicle
    motor, loop = drive.model == MOTOR, drive.model == RATE_LOOP
    link(_hold_far_end, model, state, needed=vehicle.on != 0)
    link(_move_vehicle, 0, inputs, now, vehicle, needed=vehicle.on != 0)
    link(_impose, model, state, inputs, 0, 0.0)
    link(_follow_rate, 0.0, settings.drum, drive, now.winch, now.drive, 0.0, 0.0, needed=loop)
    link(_turn_motor, model, state, 0.0, 0.0, 0.0, needed=motor)
    link(_solve_driven, model, state, 0.0, needed=motor)
    link(_strum, model, state, 0.0, np.int64(0), needed=len(model.line.strum.sections) > 0)
