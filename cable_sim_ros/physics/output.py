"""What one tick answers: the state as a tick output row with its tables of shape and contact.

Each part is filled by one function; what is read is in instruments.py, contact_output.py and energy.py.
"""

from __future__ import annotations

from math import acos, atan2, hypot
from typing import NamedTuple

import numpy as np

from ..compiler.jit import driver, inline, opaque
from .attitude import axes, roll_pitch_yaw, to_world
from .contact import latch
from .contact_output import in_block, pull_of, read_drums, read_ground, read_sheave, rub_moment
from .drum_layers import lay_of, layer_of, radius_of, turns_of
from .energy import fill_energy, slack_gain
from .flaps import LIMITED, STALE
from .instruments import direction_at, measure, node_tension, tension_at
from .link_element import is_links, joint_tension
from .ringing import missing
from .sea import elevation
from .ship import along_heading, axis_of, frame_shift, quaternion, rotate, spin, unrotate
from .state import ARC, FLOW, NOW, A, Q, V
from .swivel import aim_block
from .tick_output import (
    COARSE_AT_SURFACE,
    DETACHED,
    FLAP_LIMITED,
    FLAP_STALE,
    LOW_FLOW,
    MOTION_BLENDING,
    MOTION_STALE,
    PENETRATION,
    RINGING_DAMPED,
    SEABED,
    SLACK,
    SLACK_ENERGY,
    STALLED,
    SURFACE_CROSSED,
    VEHICLE_BLENDING,
    VEHICLE_LIMITED,
    VEHICLE_STALE,
)
from .towbody import TURNING, heading, heading_held, slam
from .vec import add, at3, cross, dot, norm, row3, scale
from .viv_amplification import show, sum_up
from .winch import ACCELERATION, COMMAND, RAMP, RATE, TRAVEL, cell

SLACK_TENSION = 1e-3  # N below zero at which an element counts as slack


class Output(NamedTuple):
    """A ring of tick outputs with their tables."""

    frame: np.ndarray  # records of tick_output.TICK_OUTPUT [rows]
    shape: np.ndarray  # [rows, nodes, 8], with STRUM_COLUMNS but three where viv is on, TURNED where a body is rigid
    contact: np.ndarray  # [rows, contact points, 9]


@inline
def between(a, b):
    """Angle between two unit vectors [rad]."""
    return acos(min(max(dot(a, b), -1.0), 1.0))


@driver
def fill_motion(state, f, body, rigid):
    """Ship, sheave and the towbody at node ``body``, in odom; rigid: row of its attitude, or -1."""
    now = state.memory[NOW]
    motion = now.ship.motion
    c, d = motion.coord, motion.rate
    omega, _ = spin(motion)
    quat = quaternion(c)
    q, v, a, flow = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, A], state.nodes[NOW, FLOW, body]
    ox, oy = frame_shift(now, now.time.now)
    f.time, f.tick = now.time.now, now.time.ticks
    for k in range(3):
        o = ox if k == 0 else (oy if k == 1 else 0.0)
        w = now.frame.velocity[0] if k == 0 else (now.frame.velocity[1] if k == 1 else 0.0)
        f.ship_position[k] = c[k] + o
        f.ship_velocity[k] = d[k] + w
        f.ship_rate[k] = omega[k]
        f.sheave_position[k] = now.sheave.position[k] + o
        f.sheave_velocity[k] = now.sheave.velocity[k] + w
        f.body_position[k] = q[body, k] + o
        f.body_velocity[k] = v[body, k] + w
        f.body_acceleration[k] = a[body, k]
        f.body_rate[k] = flow[TURNING] if k == 2 else 0.0
    f.sheave_ahead_rate, f.sheave_port_rate, f.sheave_up_rate = along_heading(now, now.sheave.velocity)
    bq = quaternion((0.0, 0.0, 0.0, 0.0, 0.0, heading(flow)))
    if rigid >= 0:
        e, rate = state.attitude[NOW, rigid].quaternion, state.attitude[NOW, rigid].rate
        bq, turning = (e[0], e[1], e[2], e[3]), to_world(axes(e), (rate[0], rate[1], rate[2]))
        for k in range(3):
            f.body_rate[k] = turning[k]
    for k in range(4):
        f.ship_quaternion[k] = quat[k]
        f.body_quaternion[k] = bq[k]
    f.layback = hypot(f.body_position[0] - f.sheave_position[0], f.body_position[1] - f.sheave_position[1])
    f.motion_source = np.int64(now.ship.source)
    f.motion_age = now.ship.age


@driver
def _fill_vehicle(vehicle, state, f) -> int:
    """Pose of the vehicle, what the cable does to it, and what of its pose is not followed; returns the flags."""
    now, last, flags = state.memory[NOW], state.reaction.shape[0] - 1, 0
    motion, v = now.vehicle.motion, state.nodes[NOW, V]
    shift, force = frame_shift(now, now.time.now), scale(-1.0, at3(state.reaction[last], 0))
    moment = cross(rotate(motion.coord, at3(vehicle.attachment, 0)), force)
    omega, quat = spin(motion)[0], quaternion(motion.coord)
    f.vehicle_power = 0.0
    for k in range(3):
        f.vehicle_position[k] = motion.coord[k] + axis_of(shift, k)
        f.vehicle_velocity[k] = motion.rate[k] + axis_of(now.frame.velocity, k)
        f.vehicle_force[k], f.vehicle_moment[k], f.body_rate[k] = force[k], moment[k], omega[k]
        f.vehicle_power -= force[k] * v[last, k]
    for k in range(4):
        f.body_quaternion[k] = quat[k]
    f.vehicle_off, f.vehicle_age = now.vehicle_off, now.vehicle.age
    if f.vehicle_age > vehicle.times.stale_after:
        flags |= VEHICLE_STALE
    if now.vehicle.blend_length > 0.0:
        flags |= VEHICLE_BLENDING
    if now.vehicle_off > 0.0 or norm(force) > vehicle.max_tension:
        flags |= VEHICLE_LIMITED
    return flags


fill_vehicle = opaque(_fill_vehicle)


@inline
def no_peaks(health):
    """A tick begins: no step of it has been seen."""
    health.tension_min, health.cable_min, health.power_min = 1e300, 1e300, 1e300
    health.tension_max, health.cable_max, health.power_max = -1e300, -1e300, -1e300
    health.contact_max, health.depth_max, health.pull_max = 0.0, 0.0, -1e300


@inline
def leaves(model, surface, seen):
    """Arc lengths [m] of the first and last contact of the sheave, and how far from there its bend has died out."""
    first, end = (seen.first, seen.last) if seen.loaded > 0 else (seen.nearest, seen.nearest)
    return first, end, max(0.25 * surface.radius, 4.0 * model.settings[0].bending_length)


@inline
def note_peaks(state, tension, contact, depth, pull):
    """Take one step into the peaks of its tick: tension at the sheave, resultant there, pull at the drum [N] and depth
    of contact [m]; tension along the cable is looked at here."""
    health, rate = state.memory[NOW].health, state.memory[NOW].winch.rate
    health.tension_min, health.tension_max = min(health.tension_min, tension), max(health.tension_max, tension)
    health.contact_max, health.depth_max = max(health.contact_max, contact), max(health.depth_max, depth)
    health.pull_max = max(health.pull_max, pull)
    health.power_min, health.power_max = min(health.power_min, -pull * rate), max(health.power_max, -pull * rate)
    minimum, maximum = health.cable_min, health.cable_max
    for e in range(state.tension.shape[0]):
        minimum, maximum = min(minimum, state.tension[e]), max(maximum, state.tension[e])
    health.cable_min, health.cable_max = minimum, maximum


@inline
def draw_block(model, state, out, tension, seen):
    """Take in where the departing cable, in the direction ``out``, draws a block that swivels."""
    now = state.memory[NOW]
    load = norm(seen.force) if seen.loaded > 0 else 0.0
    aim_block(model.settings[0].swivel, now.swung, now.ship.motion.coord, out, tension, load)


@driver
def glance(model, state, table):
    """What observe() keeps of the peaks, of a step that no tick output shows; table: room for the contact points of
    the sheave."""
    seen, drum = read_sheave(model, state, table), model.settings[0].drum
    _, end, ahead = leaves(model, state.surfaces[model.settings[0].sheave], seen)
    depth, _ = read_drums(state)
    pull = pull_of(drum, state) / drum.radius
    tension = tension_at(state, end + ahead)
    if model.settings[0].swivel.on != 0:
        draw_block(model, state, direction_at(state, end + ahead), tension, seen)
    note_peaks(state, tension, norm(seen.force), max(seen.deepest, depth), pull)


@driver
def fill_sheave(model, state, f, table):
    """Tension, departure and contact at the sheave.

    Returns the arc length [m] up to which the cable is bent over drum and sheave, and the flags of what was seen.
    """
    now, settings = state.memory[NOW], model.settings[0]
    coord, sheave = now.ship.motion.coord, state.surfaces[settings.sheave]
    seen = read_sheave(model, state, table)
    first, end, ahead = leaves(model, sheave, seen)
    out = direction_at(state, end + ahead)
    back = direction_at(state, first - ahead)
    f.tension = tension_at(state, end + ahead)
    measure(state, out, f.tension)
    if settings.swivel.on != 0:
        draw_block(model, state, out, f.tension, seen)
    f.swivel_angle = now.swung.angle
    f.departure_angle = now.measured.departure_angle
    wrap = between(back, out)
    vec = unrotate(coord, scale(f.tension, out))
    res = unrotate(coord, seen.force)
    for k in range(3):
        f.tension_vector[k] = vec[k]
        f.contact_force[k] = res[k]
    f.sheave_friction = (
        -settings.drum.side * rub_moment(state, settings.sheave) / sheave.radius if sheave.friction > 0.0 else 0.0
    )
    f.contact_resultant, f.contact_total = norm(seen.force), seen.total
    if seen.loaded > 0:
        now.events.bears = f.contact_resultant / (seen.total * sheave.slope_sin)
    f.wrap_angle = (end - first) / sheave.radius if seen.loaded > 0 else 0.0
    f.lifted_fraction = min(max(1.0 - seen.length / max(wrap * sheave.radius, 1e-9), 0.0), 1.0)
    # groove margin over the contact points between the two tangent directions, and the nearest one
    body_out = in_block(model, state, unrotate(coord, out))
    body_back = in_block(model, state, unrotate(coord, back))
    low, high = atan2(-body_back[2], -body_back[0]), atan2(-body_out[2], -body_out[0])
    spare, offset = seen.clearance, state.detected[settings.sheave].first
    for i in range(seen.rows):
        if min(low, high) <= table[i, 3] <= max(low, high):
            spare = min(spare, state.contact_points[offset + i].clearance)
    f.groove_margin = max(spare, -settings.groove_depth)
    f.contact_stations = seen.rows
    depth, coarse = read_drums(state)
    f.penetration = max(seen.deepest, depth)
    hold = settings.reseat_ns if now.time.ticks > 0 else 0
    detached = latch(seen.loaded > 0 and spare > 0.0, now.events, now.time.now, hold)
    f.detachments = now.events.detachments
    flags = DETACHED if detached else 0
    if coarse or seen.coarse:
        flags |= COARSE_AT_SURFACE
    return end + ahead, flags


@driver
def fill_winch(drum, state, f):
    """Pay-out, scope, what is left on the drum, and the torque of the cable on it."""
    now = state.memory[NOW]
    winch = now.winch
    f.payout = drum.payout_0 + winch.length
    f.payout_rate, f.payout_acceleration = winch.rate, winch.accel
    f.payout_setpoint = drum.payout_0 + winch.target
    f.scope = f.payout - drum.inboard
    f.cable_on_drum = drum.total - f.payout
    f.drum_turns = turns_of(drum, f.cable_on_drum)
    radius = f.drum_lay_radius = radius_of(drum, f.cable_on_drum)
    f.drum_lay, _ = lay_of(drum, f.cable_on_drum)
    f.drum_layer = layer_of(drum, f.cable_on_drum) if drum.lay_turns > 0.0 else 0
    surface, stretch = winch.length, 1.0
    if drum.feeds != 0:
        surface, stretch = winch.surface, 1.0 + winch.wound[cell(drum, f.cable_on_drum)]
    f.payout_counter = drum.payout_0 + surface
    f.drum_angle = drum.angle_0 - (winch.turned if drum.lay_turns > 0.0 else surface / drum.radius)
    f.drum_rate = -winch.rate * stretch / radius
    torque = pull_of(drum, state)
    f.tension_drum = torque / drum.radius
    f.drum_torque = f.tension_drum * radius if drum.lay_turns > 0.0 else torque
    f.command_age = winch.command_age
    fill_drive(now.drive, winch, f)


@inline
def fill_drive(driving, winch, f):
    """What the drive does: mode, motor and brake."""
    f.winch_mode, f.motor_pull, f.motor_power = driving.mode, driving.motor, -driving.motor * winch.rate
    f.motor_limited = driving.limited / driving.ticked if driving.ticked > 0.0 else 0.0
    f.brake_pull, f.brake_set = driving.held, driving.brake
    f.brake_slip, f.brake_heat, f.drive_rounds = driving.slipped, driving.heat, driving.rounds


@driver
def fill_peaks(settings, state, f):
    """Peaks of the tick with the step that this tick output shows, and what held the winch in it; returns the flags."""
    health, winch, flags = state.memory[NOW].health, state.memory[NOW].winch, 0
    note_peaks(state, f.tension, f.contact_resultant, f.penetration, f.tension_drum)
    f.tension_tick_min, f.tension_tick_max = health.tension_min, health.tension_max
    f.tension_least, f.tension_most = health.cable_min, health.cable_max
    f.contact_resultant_tick_max, f.penetration = health.contact_max, health.depth_max
    f.tension_drum_tick_max = health.pull_max
    f.winch_power_tick_min, f.winch_power_tick_max = health.power_min, health.power_max
    f.payout_rate_tick_max, f.payout_acceleration_tick_max = winch.fastest, winch.hardest
    tick = settings.tick_ns * 1e-9
    f.rate_limited, f.acceleration_limited = winch.held[RATE] / tick, winch.held[ACCELERATION] / tick
    f.travel_limited, f.command_limited = winch.held[TRAVEL] / tick, winch.held[COMMAND] / tick
    f.ramp_limited = winch.held[RAMP] / tick
    f.tension_damped = missing(state.memory[NOW].account)
    if f.penetration > settings.penetration_limit:
        flags |= PENETRATION
    if f.tension_least < -SLACK_TENSION:
        flags |= SLACK
    if f.tension_damped > settings.max_ringing:
        flags |= RINGING_DAMPED
    return flags


@driver
def fill_slam(line, state, f, h, first):
    """Largest slam of the bodies from ``first`` on that were in the water surface in a tick of h [s]; returns the
    flags."""
    q, v, crossed = state.nodes[NOW, Q], state.nodes[NOW, V], 0
    f.slam, f.slam_estimate = 0.0, 0.0
    for i in range(first, line.bodies.shape[0]):
        n, row = line.body_nodes[i], line.bodies[i].rigid
        place, wet, own = row3(q, n), 0.0, 0.0
        if row >= 0:  # of the middle of its hull
            attitude = state.attitude[NOW, row]
            place = add(place, to_world(axes(attitude.quaternion), at3(line.rigid.bodies[row].hull_centre, 0)))
            wet, own = attitude.wet, attitude.slam
        force, left_out = slam(line.bodies[i], place, v[n], state.work.around[n], h)
        if force >= 0.0 or 0.0 < wet < 1.0:
            crossed = SURFACE_CROSSED
            f.slam = max(f.slam, own if row >= 0 else force)
            f.slam_estimate = max(f.slam_estimate, left_out)
    return crossed


@driver
def fill_cable(line, state, f, body):
    """Tension at the towbody at node ``body``, strumming, seabed, health of the solver; returns the flags."""
    health, q, flags = state.memory[NOW].health, state.nodes[NOW, Q], 0
    arc = state.nodes[NOW, ARC]
    f.tension_body = joint_tension(state, body) if is_links(arc) else node_tension(line.elements, q, body)
    f.seabed_length, aground = read_ground(line, state)
    f.amplification_mean, f.strum_amplitude_most = sum_up(line, state)
    f.iterations, f.substeps, f.residual = health.iterations, health.substeps, health.residual
    if aground or f.seabed_length > 0.0:
        flags |= SEABED
    return flags


@driver
def fill_shape(line, state, aboard, table):
    """Rows of the shape table: place, tension, arc length and slope of every node; aboard: arc length of the last bent
    part.

    Curved over drum and sheave the elements know the tension better than the nodes. So they do along a line on which it
    jumps, or the stretch does: the one gradient of a node is between both sides, and those beside it make up for it.
    """
    now, q, arc = state.memory[NOW], state.nodes[NOW, Q], state.nodes[NOW, ARC, :, 0]
    inside = arc[arc.shape[0] - 1] if line.settings[0].jumps != 0 else aboard
    links = is_links(state.nodes[NOW, ARC])
    ox, oy = frame_shift(now, now.time.now)
    for n in range(arc.shape[0]):
        table[n, 0], table[n, 1], table[n, 2] = q[n, 0] + ox, q[n, 1] + oy, q[n, 2]
        if links:
            table[n, 3] = joint_tension(state, n)
        else:
            table[n, 3] = tension_at(state, arc[n]) if arc[n] < inside else node_tension(line.elements, q, n)
        table[n, 4] = arc[n]
        for k in range(3):
            table[n, 5 + k] = 0.0 if links else q[n, 3 + k]
    show(state, table)
    for i in range(state.attitude.shape[1]):
        n, last = line.rigid.bodies[i].node, table.shape[1] - 1
        table[n, last - 2], table[n, last - 1], _ = roll_pitch_yaw(state.attitude[NOW, i].quaternion)
        begin = line.rigid.bodies[i].wings[0]
        for k in range(begin, line.rigid.bodies[i].wings[1]):
            table[k, last] = state.attitude[NOW, i].flap[k - begin]


@driver
def observe(model, state, output, slot, flags, blending) -> int:
    """Fill row ``slot`` of the output from the state; returns the flags with what was seen added."""
    f, body = output.frame[slot], model.line.body_nodes[0]
    fill_motion(state, f, body, model.line.bodies[0].rigid)
    at, sea = state.memory[NOW].sheave.position, model.line.sea
    f.surface_elevation = elevation(sea.waves, state.work.phase, state.memory[NOW].sea.fraction, at[0], at[1])
    aboard, seen = fill_sheave(model, state, f, output.contact[slot])
    flags |= seen
    fill_winch(model.settings[0].drum, state, f)
    fill_energy(model.line, state, f)
    flags |= fill_cable(model.line, state, f, body) | fill_peaks(model.settings[0], state, f)
    vehicle = model.settings[0].vehicle
    flags |= fill_slam(model.line, state, f, model.settings[0].tick_ns * 1e-9, np.int64(vehicle.on))
    if vehicle.on != 0:
        flags |= fill_vehicle(vehicle, state, f)
    for i in range(state.attitude.shape[1]):
        if state.attitude[NOW, i].attack > 1.0:
            flags |= STALLED
        if state.attitude[NOW, i].said & STALE != 0:
            flags |= FLAP_STALE
        if state.attitude[NOW, i].said & LIMITED != 0:
            flags |= FLAP_LIMITED
    if model.line.bodies[0].rigid < 0 and heading_held(model.line.bodies[0], state.nodes[NOW, FLOW, body]):
        flags |= LOW_FLOW
    if slack_gain(state.memory[NOW].account, f, flags & SLACK != 0, model.settings[0].energy_share):
        flags |= SLACK_ENERGY
    if f.motion_age > model.settings[0].ship.stale_after:
        flags |= MOTION_STALE
    if blending:
        flags |= MOTION_BLENDING
    f.status = flags
    fill_shape(model.line, state, aboard, output.shape[slot])
    return flags
