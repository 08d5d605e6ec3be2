"""Instruments: from the tick output, which is the truth, to what each device shows of it, once a tick.

Truth of some ticks ago, gain and zero, filter, noise, outliers, resolution, fault, end of range: in this order. The
noise is a function of seed, tick and signal, so a resumed run and a replay show the same.
"""

from __future__ import annotations

from math import atan2, cos, exp, floor, pi, sin

import numpy as np

from ..compiler.jit import driver, inline
from .attitude import roll_pitch_yaw
from .contact_output import in_block
from .instruments import end_strain
from .noise import drawn, gauss, spoiled
from .sea import pressure_head
from .sensor_models import (
    ALTITUDE,
    COUNT,
    DEPTH_SHOWN,
    ENCODED,
    FISH_ROLL,
    FIX,
    HEAVE,
    LATE,
    LOST,
    METERED,
    MRU,
    NOISE,
    PIN,
    ROLL,
)
from .ship import along_heading, frame_shift, hull_point, rotate, unrotate
from .state import NOW, Q
from .vec import at3, axpy, cross, norm

STILL = (0.0, 0.0, 0.0)


@inline
def lean(rules, sensing, motion, velocity, gravity, h):
    """Vertical acceleration [m/s^2] that an MRU believes in while its vertical leans out of a turn."""
    c, s = cos(motion.coord[5]), sin(motion.coord[5])
    ahead = c * (motion.rate[0] + velocity[0]) + s * (motion.rate[1] + velocity[1])
    inward = ahead * motion.rate[5]
    sensing.tilt += (1.0 - exp(-h / rules.settling)) * (atan2(rules.leak * inward, gravity) - sensing.tilt)
    return gravity * (cos(sensing.tilt) - 1.0) + inward * sin(sensing.tilt)


@driver
def follow_mru(model, state, row, h):
    """Truth of an MRU: surge, sway and heave high-passed, their rates, roll and pitch with the lean of its vertical.

    y'' + 2 zeta w y' + w^2 y = x'' + e, e the vertical acceleration that the lean brings; by the trapezoidal rule on
    x - y, which is what the filter follows."""
    now, rules, sensing = state.memory[NOW], model.sensors.rules[0], state.sensors.sensing[0]
    motion, tilt = now.ship.motion, sensing.tilt
    p, v, _ = hull_point(motion, at3(rules.place, 0), STILL, STILL)
    error, w = 0.0, (2.0 * pi / rules.period if rules.period > 0.0 else 0.0)
    if rules.leak > 0.0:
        error = lean(rules, sensing, motion, now.frame.velocity, model.line.settings[0].gravity, h)
    for k in range(3):
        if sensing.begun == 0:
            sensing.track[k], sensing.track_rate[k], sensing.behind[k] = p[k], 0.0, 0.0
        believed, before = (error if k == 2 else 0.0), sensing.behind[k]
        middle = 0.5 * h * w * w
        slope = sensing.track_rate[k] + 2.0 * rules.damping * w * before
        gained = sensing.track_rate[k] + middle * before - h * believed
        e = p[k] - sensing.track[k] - 0.5 * h * (slope + gained)
        e /= 1.0 + 0.5 * h * (middle + 2.0 * rules.damping * w)
        sensing.track_rate[k] += middle * (before + e) - h * believed
        sensing.track[k], sensing.behind[k] = p[k] - e, e
        row[k], row[3 + k] = e, v[k] - sensing.track_rate[k] - 2.0 * rules.damping * w * e
    c, s = cos(motion.coord[5]), sin(motion.coord[5])
    for i in (0, 3):
        x, y = row[i], row[i + 1]
        row[i], row[i + 1] = c * x + s * y, c * y - s * x
    row[ROLL], row[ROLL + 1] = motion.coord[3] + sensing.tilt, motion.coord[4]
    row[ROLL + 2], row[ROLL + 3] = motion.rate[3] + (sensing.tilt - tilt) / h, motion.rate[4]


@inline
def fix_error(rules, motion, place):
    """What place and attitude of the transducer make wrong in a fix of ``place`` [m, tow frame], and the slant range
    [m]: the place is reckoned with the transducer where, and turned as, it is said to be."""
    at, _, _ = hull_point(motion, at3(rules.transducer, 0), STILL, STILL)
    way = axpy(-1.0, at, place)
    true = unrotate(motion.coord, way)
    wrong = axpy(-1.0, true, axpy(-1.0, at3(rules.transducer_error, 0), unrotate(rules.transducer_turn, true)))
    return rotate(motion.coord, wrong), norm(way)


@driver
def truths(model, state, f, row, h):
    """What there is to be measured at this tick, a row of SIGNALS; returns the slant range of the fix [m]."""
    rules, sensing, payout_0 = model.sensors.rules[0], state.sensors.sensing[0], model.settings[0].drum.payout_0
    follow_mru(model, state, row, h)
    pull = in_block(model, state, at3(f.contact_force, 0))
    if sensing.begun == 0:
        sensing.encoded_at, sensing.metered_at = f.payout_counter, f.payout
        sensing.encoded, sensing.metered = f.payout_counter - payout_0, f.payout - payout_0
        sensing.axis = atan2(-pull[0], -pull[2]) if np.isnan(rules.axis) else rules.axis
        shown = -sin(sensing.axis) * pull[0] - cos(sensing.axis) * pull[2]
        sensing.newtons = rules.newtons
        if np.isnan(rules.newtons):
            sensing.newtons = shown / f.tension if f.tension > 0.0 else 0.0
    counted = (1.0 + rules.slip) * (1.0 + rules.wrong_layer / f.drum_lay_radius)
    sensing.encoded += counted * (f.payout_counter - sensing.encoded_at)
    passed = 1.0 + end_strain(model.line.elements, state) if f.tension_drum >= rules.metering_least else 0.0
    sensing.metered += passed * (f.payout - sensing.metered_at)
    sensing.encoded_at, sensing.metered_at = f.payout_counter, f.payout
    row[ENCODED], row[ENCODED + 1] = payout_0 + sensing.encoded, -counted * f.drum_rate * f.drum_lay_radius
    row[METERED], row[METERED + 1] = payout_0 + sensing.metered, passed * f.payout_rate
    row[PIN] = -sin(sensing.axis) * pull[0] - cos(sensing.axis) * pull[2]
    for k in range(3):
        row[FIX + k] = f.body_position[k]
    place, sea = at3(state.nodes[NOW, Q, model.line.body_nodes[0]], 0), model.line.sea
    head = pressure_head(sea.waves, state.work.phase, state.memory[NOW].sea.fraction, place[0], place[1], place[2])
    row[DEPTH_SHOWN] = max(head - place[2], 0.0)
    row[FISH_ROLL], row[FISH_ROLL + 1], row[FISH_ROLL + 2] = roll_pitch_yaw(f.body_quaternion)
    row[ALTITUDE] = f.body_position[2] + rules.seabed
    if model.sensors.signals[FIX].on == 0:
        return 0.0
    off, distance = fix_error(rules, state.memory[NOW].ship.motion, place)
    for k in range(3):
        row[FIX + k] += off[k]
    return distance


@driver
def sheave_by_mru(model, state, shown):
    """Place and velocity of the sheave in the tow frame by the readings of the MRU and the true heading."""
    now, rules, sensing = state.memory[NOW], model.sensors.rules[0], state.sensors.sensing[0]
    yaw = now.ship.motion.coord[5]
    c, s = cos(yaw), sin(yaw)
    body = at3(rules.sheave, 0), at3(rules.declared, 0)
    lever = (body[0][0] - body[1][0], body[0][1] - body[1][1], body[0][2] - body[1][2])
    roll, pitch = shown[ROLL].shown, shown[ROLL + 1].shown
    arm = rotate((0.0, 0.0, 0.0, roll, pitch, yaw), lever)
    if sensing.begun == 0:
        for k in range(3):
            sensing.rest[k], sensing.arm[k] = now.sheave.position[k], arm[k]
    dr, dp = shown[ROLL + 2].shown, shown[ROLL + 3].shown
    turn = (c * cos(pitch) * dr - s * dp, s * cos(pitch) * dr + c * dp, now.ship.motion.rate[5] - sin(pitch) * dr)
    swept = cross(turn, arm)
    for k in range(3):
        x, v = shown[HEAVE].shown, shown[HEAVE + 3].shown
        if k < 2:
            ahead, aside = shown[0].shown, shown[1].shown
            x = c * ahead - s * aside if k == 0 else s * ahead + c * aside
            ahead, aside = shown[3].shown, shown[4].shown
            v = c * ahead - s * aside if k == 0 else s * ahead + c * aside
        now.seen.position[k] = sensing.rest[k] + x + arm[k] - sensing.arm[k]
        now.seen.velocity[k] = v + swept[k]


@inline
def pin_tension(sensors):
    """Tension [N] that the load pin shows; 0 where none is aboard."""
    newtons = sensors.sensing[0].newtons
    return sensors.sensed[PIN].shown / newtons if newtons > 0.0 else 0.0


@driver
def read(model, state, i, tick, h, distance):
    """Take a reading of row i of SIGNALS, where one is due: 1, there is one; 0, none is due; -1, it is lost.

    distance: m, to the towbody."""
    signal, one, rules = model.sensors.signals[i], state.sensors.sensed[i], model.sensors.rules[0]
    truth, late = state.sensors.truth, signal.latency
    if one.fault.kind == LATE:
        late += np.int64(round(one.fault.amount / h))
    x = signal.gain * truth[max(tick - late, 0) % truth.shape[0], i] + signal.zero
    if signal.filter_time > 0.0 and state.sensors.sensing[0].begun != 0:
        x = one.filtered + (1.0 - exp(-h / signal.filter_time)) * (x - one.filtered)
    one.filtered = x
    if tick % signal.every != 0:
        return 0
    deviation = signal.noise + signal.range_noise * distance
    if deviation > 0.0:
        x += deviation * gauss(rules.seed, tick, i)
    if signal.outlier > 0.0 and drawn(rules.seed, tick, FIX + 32)[0] < signal.outlier:
        x += signal.outlier_size * gauss(rules.seed, tick, 32 + i)
    if signal.resolution > 0.0:
        x = signal.resolution * floor(x / signal.resolution + 0.5)
    fault = one.fault
    if state.sensors.sensing[0].begun == 0:
        fault.at = x
    if fault.kind == LOST or (signal.device == MRU and tick < rules.alignment):
        return -1
    since = (state.memory[NOW].time.now - fault.since) * 1e-9
    chance = gauss(rules.seed + 1, tick, i) if fault.kind == NOISE else 0.0
    one.shown = min(max(spoiled(fault, x, signal.rate_of, since, chance), -signal.maximum), signal.maximum)
    return 1


@driver
def show(state, f):
    """Readings into the tick output."""
    shown = state.sensors.sensed
    f.mru_surge, f.mru_sway, f.mru_heave = shown[0].shown, shown[1].shown, shown[2].shown
    f.mru_surge_rate, f.mru_sway_rate, f.mru_heave_rate = shown[3].shown, shown[4].shown, shown[5].shown
    f.mru_roll, f.mru_pitch = shown[6].shown, shown[7].shown
    f.mru_roll_rate, f.mru_pitch_rate = shown[8].shown, shown[9].shown
    f.encoder_payout, f.encoder_rate = shown[ENCODED].shown, shown[ENCODED + 1].shown
    f.metering_payout, f.metering_rate = shown[METERED].shown, shown[METERED + 1].shown
    f.load_pin, f.load_pin_tension = shown[PIN].shown, pin_tension(state.sensors)
    for k in range(3):
        f.usbl_position[k] = shown[FIX + k].shown
    f.depth_reading, f.altitude_reading = shown[DEPTH_SHOWN].shown, shown[ALTITUDE].shown
    f.fish_roll, f.fish_pitch = shown[FISH_ROLL].shown, shown[FISH_ROLL + 1].shown
    f.fish_heading = shown[FISH_ROLL + 2].shown


@driver
def sense(model, state, f) -> None:
    """Let every device that is aboard show what it has at this tick; f: tick output, filled up to the truth."""
    now, sensors, h = state.memory[NOW], state.sensors, model.settings[0].tick_ns * 1e-9
    tick, new, lost = now.time.ticks, 0, 0
    distance = truths(model, state, f, sensors.truth[tick % sensors.truth.shape[0]], h)
    for i in range(COUNT):
        signal = model.sensors.signals[i]
        if signal.on != 0:
            got = read(model, state, i, tick, h, distance)
            if got > 0:
                new |= 1 << signal.device
            elif got < 0:  # one value lost: the device gives no reading
                lost |= 1 << signal.device
    f.readings_new = new & ~lost
    show(state, f)
    if model.sensors.signals[MRU].on != 0:
        sheave_by_mru(model, state, sensors.sensed)
        ox, oy = frame_shift(now, now.time.now)
        for k in range(3):
            o = ox if k == 0 else (oy if k == 1 else 0.0)
            w = now.frame.velocity[0] if k == 0 else (now.frame.velocity[1] if k == 1 else 0.0)
            f.mru_sheave_position[k] = now.seen.position[k] + o
            f.mru_sheave_velocity[k] = now.seen.velocity[k] + w
        f.mru_sheave_ahead_rate, f.mru_sheave_port_rate, f.mru_sheave_up_rate = along_heading(now, now.seen.velocity)
    sensors.sensing[0].begun = 1
