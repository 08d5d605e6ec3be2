"""Set-point algorithms for the winch: Westin (2018) (1)-(2), after Calnan.

Displacements are those of the sheave from its mean track; the set-point is positive paying out. To add an algorithm,
add its name to the enum and its branch to :func:`compensation`.
"""

from __future__ import annotations

from enum import Enum
from math import cos, pi, sin

from .jit import driver
from .quantity import Block, quantity

# State.setpoint (float64): mean track of the sheave x, y, yaw; their rates; set-point and rate at the last tick
TRACK, TRACK_RATE, LENGTH, RATE = 0, 3, 6, 7
SETPOINT_STATE = 8

# Model.setpoint (float64, writeable: the algorithm may be changed between ticks)
ALGORITHM, ANGLE, HEIGHT, WASHOUT = 0, 1, 2, 3
SETPOINT_ROWS = 4


class SetpointLaw(str, Enum):
    HOLD = "hold"
    SIMPLIFIED_SHEAVE = "simplified_sheave"  # (2) with the constant nominal angle
    RIGOROUS_SHEAVE = "rigorous_sheave"  # (2) with the measured departure angle
    SIMPLIFIED_WATERLINE = "simplified_waterline"  # (1) with the constant nominal angle
    RIGOROUS_WATERLINE = "rigorous_waterline"  # (1) with the measured departure angle


LAWS = tuple(SetpointLaw)
ANGLE_MOST = 1.5  # rad; (1) has a pole at the horizontal


class Setpoint(Block):
    algorithm: SetpointLaw = quantity(
        SetpointLaw.HOLD, "", None, None, "set-point algorithm of the compensation", "Westin 2.1", configure=False
    )
    nominal_angle_deg: float | None = quantity(
        None,
        "deg",
        0.0,
        85.0,
        "nominal departure angle from the vertical; none: that of the static start",
        "Westin Table 9",
    )
    washout_period: float = quantity(
        300.0,
        "s",
        0.0,
        1e5,
        "period of the filter that follows the mean track of the sheave; 0: the scene's "
        "tow speed is the mean track exactly",
        configure=False,
    )


@driver
def mean_track(row, state, x, y, yaw, h):
    """Follow the mean track of the sheave over a tick h [s]: second-order tracker, damping 0.707."""
    if row[WASHOUT] <= 0.0:
        return
    w = 2.0 * pi / row[WASHOUT]
    for i in range(3):
        e = (x if i == 0 else (y if i == 1 else yaw)) - state[TRACK + i]
        k = 1.0 + 1.414 * w * h + w * w * h * h
        e = (e - h * state[TRACK_RATE + i]) / k
        state[TRACK_RATE + i] += w * w * h * e
        state[TRACK + i] += h * (state[TRACK_RATE + i] + 1.414 * w * e)


@driver
def compensation(row, state, p, v, angle):
    """Set-point L [m] and its rate for the sheave centre at p with velocity v (tow frame), measured departure angle
    [rad]."""
    law = int(row[ALGORITHM])
    if law == 0:
        return 0.0, 0.0
    c, s = cos(state[TRACK + 2]), sin(state[TRACK + 2])
    dx = c * (p[0] - state[TRACK]) + s * (p[1] - state[TRACK + 1])
    dz = p[2] - row[HEIGHT]
    vx = c * (v[0] - state[TRACK_RATE]) + s * (v[1] - state[TRACK_RATE + 1])
    theta = row[ANGLE] if law == 1 or law == 3 else min(max(angle, 0.0), ANGLE_MOST)
    if law <= 2:
        return dx * sin(theta) + dz * cos(theta), vx * sin(theta) + v[2] * cos(theta)
    return p[2] / cos(theta) - row[HEIGHT] / cos(row[ANGLE]), v[2] / cos(theta)
