"""Set-point algorithms for the winch: Westin (2018) (1)-(2), after Calnan.

Displacements are those of the sheave from its mean track; the set-point is positive paying out. To add an algorithm,
add its name to the enum and its branch to :func:`compensation`.
"""

from __future__ import annotations

from enum import Enum
from math import cos, pi, sin

import numpy as np

from .jit import driver, inline
from .quantity import Block, quantity

SETPOINT = np.dtype(
    [
        ("algorithm", "i8"),  # place in LAWS; may be changed between ticks
        ("angle", "f8"),  # rad, nominal departure angle
        ("height", "f8"),  # m, of the sheave at the start
        ("washout", "f8"),  # s
        ("track", "f8", 3),  # mean track of the sheave x, y, yaw, and their rates
        ("track_rate", "f8", 3),
        ("length", "f8"),  # m, set-point at the last step, and its rate
        ("rate", "f8"),
    ],
    align=True,
)


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
def mean_track(state, sheave, yaw, h):
    """Follow the mean track of the sheave over a tick h [s]: second-order tracker, damping 0.707."""
    if state.washout <= 0.0:
        return
    w = 2.0 * pi / state.washout
    for i in range(3):
        e = (yaw if i == 2 else sheave.position[i]) - state.track[i]
        k = 1.0 + 1.414 * w * h + w * w * h * h
        e = (e - h * state.track_rate[i]) / k
        state.track_rate[i] += w * w * h * e
        state.track[i] += h * (state.track_rate[i] + 1.414 * w * e)


@inline
def by_angle(law):
    """Does a law, a place in LAWS, go by the measured departure angle?"""
    return law == 2 or law == 4


@driver
def compensation(state, sheave, angle):
    """Set-point L [m] and its rate for a SETPOINT record, the sheave's place and velocity (tow frame), the measured
    departure angle [rad]."""
    law = state.algorithm
    if law == 0:
        return 0.0, 0.0
    p, v = sheave.position, sheave.velocity
    c, s = cos(state.track[2]), sin(state.track[2])
    dx = c * (p[0] - state.track[0]) + s * (p[1] - state.track[1])
    dz = p[2] - state.height
    vx = c * (v[0] - state.track_rate[0]) + s * (v[1] - state.track_rate[1])
    theta = state.angle if law == 1 or law == 3 else min(max(angle, 0.0), ANGLE_MOST)
    if law <= 2:
        return dx * sin(theta) + dz * cos(theta), vx * sin(theta) + v[2] * cos(theta)
    return p[2] / cos(theta) - state.height / cos(state.angle), v[2] / cos(theta)
