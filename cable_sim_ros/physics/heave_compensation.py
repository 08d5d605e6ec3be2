"""Set-point algorithms for the winch: Westin (2018) (1)-(2), after Calnan, within limits and without jumps.

Displacements are those of the sheave from its mean track; the set-point is positive paying out. To add an algorithm,
add its name to the enum and its branch to :func:`compensation`. What every algorithm asks for goes through
:func:`set_point`: what is beyond the motion of the sheave along the cable strains the tow and is limited, the whole is
kept within an amplitude, and a change of the algorithm is taken up over a time.
"""

from __future__ import annotations

from enum import Enum
from math import atan2, cos, exp, pi, sin

import numpy as np

from .jit import driver, inline
from .parameter import Block, quantity
from .ship import hermite

SETPOINT = np.dtype(
    [
        ("algorithm", "i8"),  # place in LAWS; may be changed between ticks
        ("engaged", "i8"),  # the one that the length below comes from
        ("limited", "i8"),  # 1: the algorithm asks for more than it is given
        ("angle", "f8"),  # rad, nominal departure angle
        ("height", "f8"),  # m, of the sheave at the start
        ("washout", "f8"),  # s
        ("track", "f8", 3),  # mean track of the sheave x, y, yaw, the state of their tracker, and their rates
        ("track_rate", "f8", 3),
        ("track_speed", "f8", 3),
        ("departure", "f8"),  # rad, low-passed departure angle in the plane of the mean track, and its rate
        ("departure_rate", "f8"),
        ("departure_time", "f8"),  # s, of that filter
        ("max_gain", "f8"),  # of the waterline laws
        ("excess", "f8"),  # m, what is given beyond the motion of the sheave along the cable, and its rate
        ("excess_rate", "f8"),
        ("max_excess", "f8"),  # m
        ("max_excess_rate", "f8"),  # m/s
        ("max_amplitude", "f8"),  # m
        ("offset", "f8"),  # m, from the law engaged to the one before as the change began, and its rate
        ("offset_rate", "f8"),
        ("transfer", "f8"),  # s, over which that dies out
        ("left", "f8"),  # s of it
        ("asked", "f8"),  # m, set-point of the compensation alone, and its rate
        ("asked_rate", "f8"),
        ("length", "f8"),  # m, set-point and command at the last step, and its rate
        ("rate", "f8"),
    ],
    align=True,
)


class SetpointLaw(str, Enum):
    HOLD = "hold"
    SIMPLIFIED_SHEAVE = "simplified_sheave"  # (2) with the constant nominal angle
    RIGOROUS_SHEAVE = "rigorous_sheave"  # (2) with the measured departure angle, low-passed
    SIMPLIFIED_WATERLINE = "simplified_waterline"  # (1) with the constant nominal angle
    RIGOROUS_WATERLINE = "rigorous_waterline"  # (1) with the measured departure angle, low-passed


LAWS = tuple(SetpointLaw)
MAX_ANGLE = 1.5  # rad; (1) has a pole at the horizontal
KNEE = 0.8  # share of a limit up to which nothing is changed
CATCH_UP = 1.0  # s, time constant with which what was held back by a limit of the rate is caught up
RATE_TIME = 0.5  # s, in which the excess comes from rest to its largest rate at the soonest
SEEN = 1e-3  # m; so much less than was asked for counts as limited
# share of the static tension that an axial wave of the largest rate of the excess brings, where the scene gives no rate
EXCESS_TENSION = 0.3


class Setpoint(Block):
    algorithm: SetpointLaw = quantity(
        SetpointLaw.HOLD, "", None, None, "set-point algorithm of the compensation", "Westin 2.1", configure=False
    )
    nominal_angle_deg: float | None = quantity(
        None,
        "deg",
        -85.0,
        85.0,
        "nominal departure angle from the vertical, positive aft; none: that of the static start",
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
    angle_filter_time: float = quantity(
        5.0, "s", 0.05, 1e3, "time constant of the filter of the departure angle that the rigorous laws go by"
    )
    transfer_time: float = quantity(
        10.0, "s", 0.1, 600.0, "time over which a change of the algorithm under way is taken up"
    )
    max_gain: float = quantity(
        2.0, "1", 1.0, 20.0, "largest pay-out per height of the sheave of the waterline laws, in place of 1/cos theta"
    )
    max_excess: float = quantity(
        1.0,
        "m",
        0.0,
        1e3,
        "largest pay-out either way that a law is given beyond the motion of the sheave along the cable",
    )
    max_excess_rate: float | None = quantity(
        None,
        "m/s",
        1e-3,
        50.0,
        "largest rate of that; none: that whose axial wave in the cable brings 0.3 of the static tension",
    )
    max_amplitude: float = quantity(20.0, "m", 0.1, 1e4, "largest pay-out either way that a law is given in all")


@driver
def mean_track(state, sheave, yaw, h):
    """Follow the mean track of the sheave over a step h [s]: second-order tracker, damping 0.707.

    The track moves by the mean of its speeds before and after, as everything in a set-point does: the winch follows
    the cubic through both lengths and rates, and what they disagree by costs 6/h^2 of it in acceleration.
    """
    if state.washout <= 0.0:
        return
    w = 2.0 * pi / state.washout
    for i in range(3):
        before = state.track_speed[i]
        rate = state.track_rate[i] + 0.5 * h * w * (before - state.track_rate[i]) / 1.414  # of the deviation before
        e = (yaw if i == 2 else sheave.position[i]) - state.track[i] - 0.5 * h * (before + rate)
        e /= 1.0 + 0.5 * h * (1.414 * w + 0.5 * w * w * h)
        state.track_rate[i] = rate + 0.5 * w * w * h * e
        state.track_speed[i] = state.track_rate[i] + 1.414 * w * e
        state.track[i] += 0.5 * h * (before + state.track_speed[i])


@inline
def by_angle(law):
    """Does a law, a place in LAWS, go by the measured departure angle?"""
    return law == 2 or law == 4


@inline
def signed_departure(state, out):
    """Angle [rad] of a direction of the cable from the downward vertical in the plane of the mean track: positive where
    it leads aft."""
    yaw = state.track[2]
    return atan2(-cos(yaw) * out[0] - sin(yaw) * out[1], -out[2])


@inline
def follow_departure(state, measured, h):
    """Low-pass the measured lead [rad] over a step of h [s]: two equal time constants.

    It moves by the mean of its rates before and after."""
    r, before = h / state.departure_time, state.departure_rate
    ahead = (measured - state.departure - 0.5 * h * before) / state.departure_time
    state.departure_rate = (before + r * ahead) / (1.0 + 2.0 * r + 0.5 * r * r)
    state.departure += 0.5 * h * (before + state.departure_rate)


@inline
def within(x, maximum):
    """x within +-most, and the derivative: x itself up to KNEE of it, from there on an exponential approach."""
    size, knee = abs(x), KNEE * maximum
    if size <= knee:
        return x, 1.0
    if maximum <= 0.0:
        return 0.0, 0.0
    slope = exp((knee - size) / (maximum - knee))
    y = maximum - (maximum - knee) * slope
    return (y if x > 0.0 else -y), slope


@inline
def height_gain(theta, maximum):
    """Pay-out per height of the sheave, 1/cos theta up to ``maximum``, and its derivative; theta: rad, less than
    pi/2."""
    c = cos(theta)
    gain, slope = within(1.0 / c, maximum)
    return gain, slope * sin(theta) / (c * c)


@driver
def compensation(state, sheave):
    """What the law of a SETPOINT record asks for: L [m] along the cable and its rate, and what is beyond, and its rate.

    sheave: its place and velocity, tow frame. Along the cable moves the sheave itself: to pay that out keeps the
    tension. What is beyond strains the tow.
    """
    law = state.algorithm
    if law == 0:
        return 0.0, 0.0, 0.0, 0.0
    p, v = sheave.position, sheave.velocity
    c, s = cos(state.track[2]), sin(state.track[2])
    x, y = p[0] - state.track[0], p[1] - state.track[1]
    dx, dy, dz = c * x + s * y, c * y - s * x, p[2] - state.height
    vx = c * (v[0] - state.track_speed[0]) + s * (v[1] - state.track_speed[1]) + dy * state.track_speed[2]
    theta, turn = (state.departure, state.departure_rate) if by_angle(law) else (state.angle, 0.0)
    if abs(theta) > MAX_ANGLE:
        theta, turn = (MAX_ANGLE if theta > 0.0 else -MAX_ANGLE), 0.0
    length = dx * sin(theta) + dz * cos(theta)
    rate = vx * sin(theta) + v[2] * cos(theta) + (dx * cos(theta) - dz * sin(theta)) * turn
    if law <= 2:
        return length, rate, 0.0, 0.0
    gain, slope = height_gain(theta, state.max_gain)
    still, _ = height_gain(state.angle, state.max_gain)
    whole, whole_rate = p[2] * gain - state.height * still, v[2] * gain + p[2] * slope * turn
    return length, rate, whole - length, whole_rate - rate


@inline
def follow_excess(state, wanted, wanted_rate, h):
    """Follow what a law asks for beyond the motion of the sheave over a step of h [s], within amplitude, rate and what
    the rate may change by."""
    end, slope = within(wanted, state.max_excess)
    end_rate = slope * wanted_rate
    behind = end - state.excess - 0.5 * h * (state.excess_rate + end_rate)
    rate, _ = within(end_rate + behind / (CATCH_UP + 0.5 * h), state.max_excess_rate)
    change = state.max_excess_rate * h / RATE_TIME
    rate = min(max(rate, state.excess_rate - change), state.excess_rate + change)
    state.excess += 0.5 * h * (state.excess_rate + rate)
    state.excess_rate = rate


@driver
def set_point(state, sheave, departure, h):
    """Set-point [m] of the compensation and its rate at the end of a step of h [s]; lead: measured angle, see
    signed_departure.

    Within its limits, and without a jump where the law was changed: the difference dies out over the transfer time.
    """
    follow_departure(state, departure, h)
    length, rate, beyond, beyond_rate = compensation(state, sheave)
    follow_excess(state, beyond, beyond_rate, h)
    whole, slope = within(length + state.excess, state.max_amplitude)
    rate = slope * (rate + state.excess_rate)
    state.limited = 1 if abs(whole - length - beyond) > SEEN else 0
    if state.engaged != state.algorithm:
        state.engaged, state.left = state.algorithm, state.transfer
        state.offset, state.offset_rate = state.asked + h * state.asked_rate - whole, state.asked_rate - rate
    elif state.left > 0.0:
        state.left -= h
    if state.left > 0.0:
        off, off_rate, _ = hermite(
            state.transfer - state.left, state.transfer, (state.offset, state.offset_rate), (0.0, 0.0)
        )
        whole, rate = whole + off, rate + off_rate
    state.asked, state.asked_rate = whole, rate
    return whole, rate
