"""Ship: pose, velocity and acceleration of any hull point. Yaw-pitch-roll as Rz Ry Rx, Westin (2018) (24)-(25).

Motion arrives as samples of position, attitude and their rates; between samples it is interpolated C1 (cubic
Hermite: a held or extrapolated boundary costs 10 % of the tension's deviation). Samples of one unbroken source share
an epoch number. Where the epoch changes, and at the start, the ship goes over to the new source by a C1 blend;
after the newest sample it returns to its mean track, critically damped.

Positions are relative to the tow frame, which moves with the constant velocity chosen at the start: the numbers stay
small however far the tow goes.
"""

from __future__ import annotations

from math import cos, exp, floor, pi, sin

import numpy as np

from .inputs import EPOCH, MOTION_ROWS, SOURCE
from .jit import driver, inline
from .quantity import Block, quantity
from .vec import add, cross, scale

# State.ship (float64): six coordinates, rates, accelerations of base_link, then the blend
COORD, RATE, ACCEL, EPOCH_NOW, SOURCE_NOW, AGE, BLEND_LENGTH, OFFSET, OFFSET_RATE = 0, 6, 12, 18, 19, 20, 21, 22, 28
SHIP_STATE = 34
NO_EPOCH = -1.0


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
def spin(c, d, dd):
    """Angular velocity and acceleration in the world from angles c[3:6], their rates and accelerations."""
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
    cr, sr, cp, sp, cy, sy = (
        cos(0.5 * c[3]),
        sin(0.5 * c[3]),
        cos(0.5 * c[4]),
        sin(0.5 * c[4]),
        cos(0.5 * c[5]),
        sin(0.5 * c[5]),
    )
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


@inline
def hull_point(c, d, dd, s, ds, dds):
    """World position, velocity, acceleration of the hull point s [m, base_link] that moves with ds, dds
    in base_link."""
    omega, alpha = spin(c, d, dd)
    r, dr, ddr = rotate(c, s), rotate(c, ds), rotate(c, dds)
    turn = cross(omega, r)
    p = add((c[0], c[1], c[2]), r)
    v = add((d[0], d[1], d[2]), add(turn, dr))
    a = add((dd[0], dd[1], dd[2]), add(cross(alpha, r), cross(omega, turn)))
    return p, v, add(a, add(scale(2.0, cross(omega, dr)), ddr))


@inline
def hermite(t, h, x0, v0, x1, v1):
    """Value, rate, acceleration of the cubic through (x0, v0) at 0 and (x1, v1) at h, at time t."""
    s = t / h
    b = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1)
    c = -2.0 * (x1 - x0) + h * (v0 + v1)
    return (
        x0 + s * (h * v0 + s * (b + s * c)),
        v0 + s * (2.0 * b + 3.0 * s * c) / h,
        (2.0 * b + 6.0 * s * c) / (h * h),
    )


@inline
def frame_shift(frame, t, start):
    """Position of the tow frame at time t [ns]: origin + velocity (t - start)."""
    s = (t - start) * 1e-9
    return frame[0] + frame[2] * s, frame[1] + frame[3] * s


@driver
def path(t, epoch, inputs, frame, start, mean, decay, out):
    """Unblended motion of one epoch at time t [ns] into out[18]; returns (source, age [s]).

    mean: mean coordinates [6] in the tow frame; NO_EPOCH follows them. Past the newest sample of the epoch the motion
    dies out: heave, roll, pitch to their mean, surge, sway, yaw to rest.
    """
    for i in range(18):
        out[i] = mean[i] if i < 6 else 0.0
    if epoch == NO_EPOCH:
        return 0.0, 0.0
    head = inputs.motion_head[0]
    newest = -1
    before = -1
    for back in range(1, min(head, MOTION_ROWS - 8) + 1):
        row = (head - back) % MOTION_ROWS
        if inputs.motion[row, EPOCH] != epoch:
            if newest >= 0:
                break
            continue
        if newest < 0:
            newest = row
        if inputs.motion_time[row] <= t:
            before = row
            break
        newest = row
    if newest < 0:
        return 0.0, 0.0
    row = before if before >= 0 else newest
    fx, fy = frame_shift(frame, inputs.motion_time[row], start)
    if before >= 0 and newest != before:  # newest is now the first sample after t
        h = (inputs.motion_time[newest] - inputs.motion_time[before]) * 1e-9
        gx, gy = frame_shift(frame, inputs.motion_time[newest], start)
        for i in range(6):
            f = fx if i == 0 else (fy if i == 1 else 0.0)
            g = gx if i == 0 else (gy if i == 1 else 0.0)
            w = frame[2] if i == 0 else (frame[3] if i == 1 else 0.0)
            out[i], out[6 + i], out[12 + i] = hermite(
                (t - inputs.motion_time[before]) * 1e-9,
                h,
                inputs.motion[before, i] - f,
                inputs.motion[before, 6 + i] - w,
                inputs.motion[newest, i] - g,
                inputs.motion[newest, 6 + i] - w,
            )
        return inputs.motion[before, SOURCE], (t - inputs.motion_time[newest]) * 1e-9
    tau = (t - inputs.motion_time[row]) * 1e-9
    fade = exp(-tau / decay) if tau > 0.0 else 1.0
    for i in range(6):
        f = fx if i == 0 else (fy if i == 1 else 0.0)
        w = frame[2] if i == 0 else (frame[3] if i == 1 else 0.0)
        x, v = inputs.motion[row, i] - f, inputs.motion[row, 6 + i] - w
        if tau <= 0.0:  # before the first sample of the epoch: straight back
            out[i], out[6 + i] = x + v * tau, v
        else:
            rest = mean[i] if 2 <= i <= 4 else x
            d = x - rest
            k = v + d / decay if 2 <= i <= 4 else v
            out[i] = rest + (d + k * tau) * fade
            out[6 + i] = (k - (d + k * tau) / decay) * fade
            out[12 + i] = (-2.0 * k + (d + k * tau) / decay) / decay * fade
    return inputs.motion[row, SOURCE], tau


@driver
def blend(t, ship, clock, out):
    """Add the dying offset of a changed source to out[18]."""
    length = ship[BLEND_LENGTH]
    tau = (t - clock) * 1e-9
    if length > 0.0 and tau < length:
        for i in range(6):
            x, v, a = hermite(tau, length, ship[OFFSET + i], ship[OFFSET_RATE + i], 0.0, 0.0)
            out[i] += x
            out[6 + i] += v
            out[12 + i] += a
        return True
    return False


@driver
def evaluate(t, ship, clock, inputs, frame, start, mean, decay):
    """Motion of base_link at time t [ns] into ship[COORD..]; ship also receives source and age. True while blending."""
    source, age = path(t, ship[EPOCH_NOW], inputs, frame, start, mean, decay, ship)
    ship[SOURCE_NOW], ship[AGE] = source, age
    return blend(t, ship, clock, ship)


@driver
def follow(t, t_next, ship, clock, inputs, frame, start, mean, decay, start_blend, source_blend, work):
    """At tick start t: take up a new epoch whose samples reach t_next, or late samples of this one.

    Late: the tick before went past the newest sample, and there are newer ones now. Either way the difference between
    the motion used so far and the new path becomes an offset that dies out C1. Returns the time its blend starts,
    else clock.
    """
    head = inputs.motion_head[0]
    old = ship[EPOCH_NOW]
    epoch = old
    for back in range(1, min(head, MOTION_ROWS - 8) + 1):
        row = (head - back) % MOTION_ROWS
        if inputs.motion_time[row] <= t_next:
            epoch = inputs.motion[row, EPOCH]
            break
    if epoch == old:
        newest = (head - 1) % MOTION_ROWS
        if (
            head == 0
            or ship[AGE] <= 0.0
            or inputs.motion[newest, EPOCH] != epoch
            or (inputs.motion_time[newest] <= t - np.int64(ship[AGE] * 1e9) + 1000)
        ):
            return clock
    path(t, epoch, inputs, frame, start, mean, decay, work)
    for i in range(12):
        ship[OFFSET + i] = ship[COORD + i] - work[i]
    turns = floor(ship[OFFSET + 5] / (2.0 * pi) + 0.5)
    ship[OFFSET + 5] -= 2.0 * pi * turns
    ship[BLEND_LENGTH] = start_blend if old == NO_EPOCH else source_blend
    ship[EPOCH_NOW] = epoch
    return t
