"""Ship: pose, velocity and acceleration of any hull point. Yaw-pitch-roll as Rz Ry Rx, Westin (2018) (24)-(25).

Motion arrives as samples of position, attitude and their rates; between samples it is interpolated C1 (cubic
Hermite: a held or extrapolated boundary costs 10 % of the tension's deviation). Samples of one unbroken source share
an epoch number. Where the epoch changes, and at the start, the ship goes over to the new source by a C1 blend;
after the newest sample it goes over to its mean track, critically damped: on at its mean speed, level, on its heading.

A vehicle at the far end of the cable (vehicle.py) is moved by the same rules, as a craft of its own.

Positions are relative to the tow frame, which moves with the constant velocity chosen at the start: the numbers stay
small however far the tow goes.
"""

from __future__ import annotations

from math import cos, exp, floor, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiler.jit import driver, inline
from .inputs import EPOCH, MOTION_ROWS, SOURCE
from .parameter import Block, quantity
from .vec import add, cross, scale

MOTION = np.dtype([("coord", "f8", 6), ("rate", "f8", 6), ("accel", "f8", 6)])  # x y z roll pitch yaw of base_link
SHIP = np.dtype(
    [
        ("motion", MOTION),  # now, tow frame
        ("mean_coord", "f8", 6),  # mean coordinates, tow frame
        ("epoch", "f8"),  # of the samples that are followed
        ("source", "f8"),  # Source of the newest sample used
        ("age", "f8"),  # s, simulation time less its stamp
        ("blend_length", "f8"),  # s, 0: no blend
        ("blend_at", "i8"),  # ns, when it began
        ("offset", "f8", 6),  # what dies out in a blend
        ("offset_rate", "f8", 6),
        ("mean_rate", "f8", 2),  # m/s, x y, tow frame: running mean of what the samples say
        ("mean_age", "f8"),  # s of motion in it
        ("mean_at", "i8"),  # ns, when it was last brought up to date; 0: never
        ("holds", "i8"),  # 1: after its newest sample it keeps height, roll and pitch; 0: they go to their mean
        ("unblended", MOTION),  # scratch of follow()
    ],
    align=True,
)
TOW_FRAME = np.dtype([("origin", "f8", 2), ("velocity", "f8", 2)])  # m at the start, m/s
TIME = np.dtype([("now", "i8"), ("start", "i8"), ("ticks", "i8")])  # ns, ns, 1
SHIP_TIMES = np.dtype(
    [  # s, and m/s: the fastest that an offset may die out; 0: as fast as it takes
        ("stale_after", "f8"),
        ("stale_decay", "f8"),
        ("start_blend", "f8"),
        ("source_blend", "f8"),
        ("max_speed", "f8"),
    ]
)
NO_EPOCH = -1.0
MEAN_MEMORY = 30.0  # s, of the mean speed: waves of 10 s leave 1/20 of their velocity in it
MIN_MEAN = 5.0  # s of motion, before which the mean speed is that of the start


class Ship(Block):
    tow_speed: float = quantity(
        0.0, "m/s", -15.0, 15.0, "mean speed ahead through the world frame, used by the start and by IMU-only motion"
    )
    heading_deg: float = quantity(
        0.0, "deg", -360.0, 360.0, "mean yaw at the start (ENU, from east to north), where no motion source gives it"
    )
    reference_height: float = quantity(
        0.0, "m", -50.0, 50.0, "mean height of base_link above the water", "Westin 5: origin on the waterline"
    )
    start_blend: float = quantity(
        10.0, "s", 0.1, 600.0, "time over which recorded motion is taken up from the static start"
    )
    source_blend: float = quantity(2.0, "s", 0.1, 600.0, "time over which a changed motion source is taken up")
    stale_decay: float = quantity(
        3.0, "s", 0.05, 600.0, "time constant with which motion dies out after the newest sample"
    )
    stale_after: float = quantity(0.5, "s", 0.01, 60.0, "age of the newest sample at which motion counts as stale")
    max_gap: float = quantity(
        1.5, "s", 0.02, 60.0, "a longer gap between samples begins a new epoch instead of being interpolated"
    )


class Ring(NamedTuple):
    """The samples of one craft."""

    time: np.ndarray
    rows: np.ndarray
    seen: np.ndarray


@inline
def ship_ring(inputs):
    """The samples of the ship's motion."""
    return Ring(inputs.motion_time, inputs.motion, inputs.motion_seen)


@inline
def vehicle_ring(inputs):
    """The samples of the vehicle's motion."""
    return Ring(inputs.vehicle_time, inputs.vehicle, inputs.vehicle_seen)


@inline
def rotate(c, s):
    """R s for the attitude c[3:6] = roll, pitch, yaw."""
    cr, sr, cp, sp, cy, sy = cos(c[3]), sin(c[3]), cos(c[4]), sin(c[4]), cos(c[5]), sin(c[5])
    y, z = cr * s[1] - sr * s[2], sr * s[1] + cr * s[2]
    x, z = cp * s[0] + sp * z, cp * z - sp * s[0]
    return (cy * x - sy * y, sy * x + cy * y, z)


@inline
def unrotate(c, s):
    """R^T s for the attitude c[3:6]."""
    cr, sr, cp, sp, cy, sy = cos(c[3]), sin(c[3]), cos(c[4]), sin(c[4]), cos(c[5]), sin(c[5])
    x, y = cy * s[0] + sy * s[1], cy * s[1] - sy * s[0]
    x, z = cp * x - sp * s[2], sp * x + cp * s[2]
    return (x, cr * y + sr * z, cr * z - sr * y)


@inline
def spin(motion):
    """Angular velocity and acceleration in the world of a MOTION."""
    c, d, dd = motion.coord, motion.rate, motion.accel
    cp, sp, cy, sy = cos(c[4]), sin(c[4]), cos(c[5]), sin(c[5])
    axis_pitch, axis_roll = (-sy, cy, 0.0), (cy * cp, sy * cp, -sp)
    yaw = (0.0, 0.0, d[5])
    tilt = add(yaw, scale(d[4], axis_pitch))
    omega = add(tilt, scale(d[3], axis_roll))
    alpha = add((0.0, 0.0, dd[5]), add(scale(dd[4], axis_pitch), scale(dd[3], axis_roll)))
    alpha = add(alpha, add(cross(yaw, scale(d[4], axis_pitch)), cross(tilt, scale(d[3], axis_roll))))
    return omega, alpha


@inline
def quaternion(c):
    """Unit quaternion x y z w of the attitude c[3:6]."""
    cr, sr = cos(0.5 * c[3]), sin(0.5 * c[3])
    cp, sp = cos(0.5 * c[4]), sin(0.5 * c[4])
    cy, sy = cos(0.5 * c[5]), sin(0.5 * c[5])
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


@inline
def hull_point(motion, s, ds, dds):
    """World position, velocity, acceleration of the hull point s [m, base_link] that moves with ds, dds
    in base_link; motion: a MOTION."""
    c, d, dd = motion.coord, motion.rate, motion.accel
    omega, alpha = spin(motion)
    r, dr, ddr = rotate(c, s), rotate(c, ds), rotate(c, dds)
    turn = cross(omega, r)
    p = add((c[0], c[1], c[2]), r)
    v = add((d[0], d[1], d[2]), add(turn, dr))
    a = add((dd[0], dd[1], dd[2]), add(cross(alpha, r), cross(omega, turn)))
    return p, v, add(a, add(scale(2.0, cross(omega, dr)), ddr))


@inline
def hermite(t, h, at_0, at_h):
    """Value, rate, acceleration at time t of the cubic through (x0, v0) at 0 and (x1, v1) at h."""
    x0, v0 = at_0
    x1, v1 = at_h
    s = t / h
    b = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1)
    c = -2.0 * (x1 - x0) + h * (v0 + v1)
    return (
        x0 + s * (h * v0 + s * (b + s * c)),
        v0 + s * (2.0 * b + 3.0 * s * c) / h,
        (2.0 * b + 6.0 * s * c) / (h * h),
    )


@inline
def frame_shift(memory, t):
    """Position x y of the tow frame at time t [ns]: origin + velocity (t - start)."""
    s = (t - memory.time.start) * 1e-9
    frame = memory.frame
    return frame.origin[0] + frame.velocity[0] * s, frame.origin[1] + frame.velocity[1] * s


@inline
def along_heading(memory, velocity):
    """Velocity [3] relative to the tow frame as speeds ahead, to port and up of the ship, less the mean: that of the
    tow frame in the axes of the start's heading, which turns with the ship."""
    yaw, start, mean = memory.ship.motion.coord[5], memory.ship.mean_coord[5], memory.frame.velocity
    x, y = velocity[0] + mean[0], velocity[1] + mean[1]
    c, s, c0, s0 = cos(yaw), sin(yaw), cos(start), sin(start)
    return c * x + s * y - c0 * mean[0] - s0 * mean[1], c * y - s * x - c0 * mean[1] + s0 * mean[0], velocity[2]


@inline
def axis_of(pair, i):
    """Component i of six coordinates of what only x and y have: pair [2]."""
    return pair[0] if i == 0 else (pair[1] if i == 1 else 0.0)


@driver
def path(t, epoch, ring, craft, memory, decay, out):
    """Unblended motion of one epoch at time t [ns] into the MOTION out; returns (source, age [s]).

    ring: its samples; craft: a SHIP of the memory. NO_EPOCH follows the mean coordinates. Past the newest sample of the
    epoch the motion dies out with time constant decay [s]: heave, roll, pitch to their mean, or where they are, yaw to
    rest, and of surge and sway what differs from the mean speed.
    """
    mean, velocity, going = craft.mean_coord, memory.frame.velocity, craft.mean_rate
    known = craft.mean_age >= MIN_MEAN
    for i in range(6):
        out.coord[i], out.rate[i], out.accel[i] = mean[i], 0.0, 0.0
    if epoch == NO_EPOCH:
        return 0.0, 0.0
    head = ring.seen[0]
    newest = -1
    before = -1
    for back in range(1, min(head, MOTION_ROWS - 8) + 1):
        row = (head - back) % MOTION_ROWS
        if ring.rows[row, EPOCH] != epoch:
            if newest >= 0:
                break
            continue
        if newest < 0:
            newest = row
        if ring.time[row] <= t:
            before = row
            break
        newest = row
    if newest < 0:
        return 0.0, 0.0
    row = before if before >= 0 else newest
    first = frame_shift(memory, ring.time[row])
    if before >= 0 and newest != before:  # newest is now the first sample after t
        h = (ring.time[newest] - ring.time[before]) * 1e-9
        second = frame_shift(memory, ring.time[newest])
        for i in range(6):
            f, g, w = axis_of(first, i), axis_of(second, i), axis_of(velocity, i)
            out.coord[i], out.rate[i], out.accel[i] = hermite(
                (t - ring.time[before]) * 1e-9,
                h,
                (ring.rows[before, i] - f, ring.rows[before, 6 + i] - w),
                (ring.rows[newest, i] - g, ring.rows[newest, 6 + i] - w),
            )
        return ring.rows[before, SOURCE], (t - ring.time[newest]) * 1e-9
    tau = (t - ring.time[row]) * 1e-9
    fade = exp(-tau / decay) if tau > 0.0 else 1.0
    for i in range(6):
        x, v = ring.rows[row, i] - axis_of(first, i), ring.rows[row, 6 + i] - axis_of(velocity, i)
        if tau <= 0.0:  # before the first sample of the epoch: straight back
            out.coord[i], out.rate[i] = x + v * tau, v
        else:
            rest, u = mean[i] if 2 <= i <= 4 and craft.holds == 0 else x, axis_of(going, i) if known else 0.0
            d = x - rest
            k = v - u + d / decay
            out.coord[i] = rest + u * tau + (d + k * tau) * fade
            out.rate[i] = u + (k - (d + k * tau) / decay) * fade
            out.accel[i] = (-2.0 * k + (d + k * tau) / decay) / decay * fade
    return ring.rows[row, SOURCE], tau


@driver
def blend(t, ship):
    """Add the dying offset of a changed source to the ship's motion at t [ns]. True while it lasts."""
    length, out = ship.blend_length, ship.motion
    tau = (t - ship.blend_at) * 1e-9
    if length > 0.0 and tau < length:
        for i in range(6):
            x, v, a = hermite(tau, length, (ship.offset[i], ship.offset_rate[i]), (0.0, 0.0))
            out.coord[i] += x
            out.rate[i] += v
            out.accel[i] += a
        return True
    return False


@inline
def learn_mean(t, ship):
    """Take the path's velocity at t [ns] into the mean speed, once for each time that passes."""
    h = (t - ship.mean_at) * 1e-9
    if ship.mean_at > 0 and 0.0 < h < 1.0:
        ship.mean_age = min(ship.mean_age + h, MEAN_MEMORY)
        for i in range(2):
            ship.mean_rate[i] += h / ship.mean_age * (ship.motion.rate[i] - ship.mean_rate[i])
    ship.mean_at = t


@driver
def evaluate(t, ring, ship, memory, decay):
    """Motion at time t [ns] into the SHIP ``ship`` of the memory, with source and age. True while blending."""
    ship.source, ship.age = path(t, ship.epoch, ring, ship, memory, decay, ship.motion)
    if ship.epoch != NO_EPOCH and ship.age <= 0.0:
        learn_mean(t, ship)
    return blend(t, ship)


@driver
def follow(t, t_next, ring, ship, memory, times):
    """At tick start t: take up a new epoch whose samples reach t_next, or late samples of this one.

    Late: the tick before went past the newest sample, and there are newer ones now. Either way the difference between
    the motion used so far and the new path becomes an offset that dies out C1, from now on. times: SHIP_TIMES.
    """
    head = ring.seen[0]
    old = ship.epoch
    epoch = old
    for back in range(1, min(head, MOTION_ROWS - 8) + 1):
        row = (head - back) % MOTION_ROWS
        if ring.time[row] <= t_next:
            epoch = ring.rows[row, EPOCH]
            break
    if epoch == old:
        newest = (head - 1) % MOTION_ROWS
        if (
            head == 0
            or ship.age <= 0.0
            or ring.rows[newest, EPOCH] != epoch
            or ring.time[newest] <= t - np.int64(ship.age * 1e9) + 1000
        ):
            return
    path(t, epoch, ring, ship, memory, times.stale_decay, ship.unblended)
    for i in range(6):
        ship.offset[i] = ship.motion.coord[i] - ship.unblended.coord[i]
        ship.offset_rate[i] = ship.motion.rate[i] - ship.unblended.rate[i]
    turns = floor(ship.offset[5] / (2.0 * pi) + 0.5)
    ship.offset[5] -= 2.0 * pi * turns
    ship.blend_length = times.start_blend if old == NO_EPOCH else times.source_blend
    if times.max_speed > 0.0:  # a cubic from there to 0 is at most 3/2 of its mean speed
        far = sqrt(ship.offset[0] ** 2 + ship.offset[1] ** 2 + ship.offset[2] ** 2)
        ship.blend_length = max(ship.blend_length, 1.5 * far / times.max_speed)
    ship.epoch = epoch
    ship.blend_at = t
