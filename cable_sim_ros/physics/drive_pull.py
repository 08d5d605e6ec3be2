"""Pulls on the drum: what its motor gives within curve, power and mode, and what friction and brake leave of a pull.

Curve, power, friction and brake are given for the first layer of the drum; gear: radius of that layer over that of the
layer that runs off. A law of the motor is p v + q within low and high: (p, q, low, high).
"""

from __future__ import annotations

from ..compiler.jit import inline
from .winch import clip

BISECTIONS = 60
STOPPED = 1e-12  # m/s, below which a drum does not move


@inline
def largest_pull(drive, gear, speed):
    """What the motor can pull [N] at a speed of the cable [m/s], either way: its curve and its power.

    gear: radius of the first layer, for which the curve is given, over that of the layer that runs off.
    """
    v, pull = abs(speed) * gear, 0.0
    for i in range(1, drive.points):
        v0, v1 = drive.curve_speed[i - 1], drive.curve_speed[i]
        if v0 <= v <= v1:
            f0, f1 = drive.curve_pull[i - 1], drive.curve_pull[i]
            pull = f0 + (f1 - f0) * (v - v0) / (v1 - v0)
    return gear * (drive.max_power / v if v * pull > drive.max_power else pull)


@inline
def loose(drive, gear, brake, pull):
    """What is left of a pull [N] on a drum at rest that friction and its brake, 0 open to 1 set, do not hold."""
    if abs(pull) <= gear * (drive.dry_friction + brake * drive.brake_pull):
        return 0.0
    slips = gear * (drive.dry_friction + brake * drive.brake_pull * drive.brake_slip)
    return pull - slips if pull > 0.0 else pull + slips


@inline
def motor_pull(drive, gear, law, v):
    """Pull of the motor [N] at speed v: p v + q within low and high, and within what the motor can."""
    p, q, low, high = law
    most = largest_pull(drive, gear, v)
    return clip(clip(p * v + q, low, high), -most, most)


@inline
def root(slope, rest, drive, gear, law, near):
    """The v with slope v + rest + motor_pull(v) = 0; of several the one next to the speed ``near``."""
    p, q, low, high = law
    v = -(rest + q) / (slope + p)
    f = p * v + q
    if not low <= f <= high:
        f = clip(f, low, high)
        v = -(rest + f) / slope
    if abs(f) <= largest_pull(drive, gear, v):
        return v
    most = gear * drive.peak
    if slope * near + rest + motor_pull(drive, gear, law, near) > 0.0:
        begin, end = -(rest + most) / slope, near
    else:
        begin, end = near, -(rest - most) / slope
    for _ in range(BISECTIONS):
        v = 0.5 * (begin + end)
        if slope * v + rest + motor_pull(drive, gear, law, v) > 0.0:
            end = v
        else:
            begin = v
    return v
