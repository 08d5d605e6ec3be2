"""Set-point laws for the winch: which one it is, what all of them know, their limits, and changes without jumps.

Displacements are those of the sheave from its mean track; the set-point is positive paying out. Each law is a file
``setpoint_*.py``; to add one, add its name to the enum and its branch to :func:`compensation`. What every law asks for
goes through :func:`set_point`: what is beyond the motion of the sheave along the cable strains the tow and is limited;
then come feed-forward of the drive and prediction, where they are on; the whole is kept within an amplitude, and a
change is taken up over a time.
"""

from __future__ import annotations

from enum import Enum
from math import atan2, cos, pi, sin

import numpy as np

from ..compiler.jit import driver, inline
from .parameter import Block, choice, quantity
from .setpoint_feed_forward import FEED_FORWARD, begin_lead, lead_drive
from .setpoint_limits import within
from .setpoint_prediction import PREDICTION, begin_prediction, predict
from .setpoint_sheave import along_cable
from .setpoint_tension import TENSION, begin_tension, hold_tension
from .setpoint_waterline import below_water
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
        ("tension", TENSION),
        ("feed_forward", FEED_FORWARD),
        ("prediction", PREDICTION),
    ],
    align=True,
)


class SetpointLaw(str, Enum):
    HOLD = "hold"
    SIMPLIFIED_SHEAVE = "simplified_sheave"  # (2) with the constant nominal angle
    RIGOROUS_SHEAVE = "rigorous_sheave"  # (2) with the measured departure angle, low-passed
    SIMPLIFIED_WATERLINE = "simplified_waterline"  # (1) with the constant nominal angle
    RIGOROUS_WATERLINE = "rigorous_waterline"  # (1) with the measured departure angle, low-passed
    CONSTANT_TENSION = "constant_tension"  # by the measured tension alone


LAWS = tuple(SetpointLaw)
HOLD, CONSTANT_TENSION = 0, 5
MAX_ANGLE = 1.5  # rad; (1) has a pole at the horizontal
CATCH_UP = 1.0  # s, time constant with which what was held back by a limit of the rate is caught up
RATE_TIME = 0.5  # s, in which the excess comes from rest to its largest rate at the soonest
SEEN = 1e-3  # m; so much less than was asked for counts as limited
# share of the static tension that an axial wave of the largest rate of the excess brings, where the scene gives no rate
EXCESS_TENSION = 0.3


class Setpoint(Block):
    algorithm: SetpointLaw = choice(
        SetpointLaw.HOLD, "set-point algorithm of the compensation", "Westin 2.1", configure=False
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
    tension: float = quantity(
        0.0,
        "N",
        0.0,
        1e7,
        "set tension at the sheave of constant_tension; 0: that of the static start",
        configure=False,
    )
    tension_gain: float | None = quantity(
        None,
        "m/(N s)",
        1e-9,
        1e3,
        "rate per newton of constant_tension; none: 0.4 over sqrt(EA m), down to 0.05 with a late drive",
    )
    tension_integral_time: float | None = quantity(
        None, "s", 1e-3, 1e3, "integral time of constant_tension; none: what drive and dead time allow, 0.1 s or more"
    )
    tension_filter_time: float = quantity(
        0.02, "s", 1e-3, 60.0, "time constant of the low-pass of the tension that constant_tension goes by"
    )
    tension_max_rate: float | None = quantity(
        None, "m/s", 1e-3, 50.0, "largest rate of constant_tension; none: winch.max_rate"
    )
    tension_return_time: float | None = quantity(
        None,
        "s",
        0.0,
        1e5,
        "time constant with which constant_tension goes back to the length that has the set tension at rest; 0: never; "
        "none: what dT/dL at rest allows, 60 s or less",
    )
    feed_forward: bool = choice(
        False, "invert the known response of the drive, so that the drum follows the law", configure=False
    )
    feed_forward_bandwidth: float = quantity(
        20.0, "rad/s", 1.0, 100.0, "of the filter from which the feed-forward has acceleration and jerk of the law"
    )
    prediction: bool = choice(False, "ask for what the law will ask for after setpoint.horizon", configure=False)
    horizon: float | None = quantity(None, "s", 0.0, 5.0, "how far the prediction looks ahead; none: drive.dead_time")


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
    """Does a law, a place in LAWS, go by what is measured of the departing cable: its angle, or its tension?"""
    return law == 2 or law == 4 or law == CONSTANT_TENSION


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


@driver
def compensation(state, sheave, tension, paid, h):
    """What the law of a SETPOINT record asks for after a step of h [s]: L [m] along the cable and its rate, and what is
    beyond, and its rate.

    sheave: its place and velocity, tow frame; tension: measured at the sheave, N; paid: m that the compensation has
    moved the drum. Along the cable moves the sheave itself: to pay that out keeps the tension. What is beyond strains
    the tow.
    """
    law = state.algorithm
    if law == HOLD:
        return 0.0, 0.0, 0.0, 0.0
    if law == CONSTANT_TENSION:
        length, rate = hold_tension(state.tension, tension, paid, state.max_amplitude, h)
        return length, rate, 0.0, 0.0
    theta, turn = (state.departure, state.departure_rate) if by_angle(law) else (state.angle, 0.0)
    if abs(theta) > MAX_ANGLE:
        theta, turn = (MAX_ANGLE if theta > 0.0 else -MAX_ANGLE), 0.0
    length, rate = along_cable(state, sheave, theta, turn)
    if law <= 2:
        return length, rate, 0.0, 0.0
    whole, whole_rate = below_water(state, sheave, theta, turn)
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


@inline
def take_up(option, follows, h, transfer):
    """Share to which an option of the laws is taken up after a step of h [s], and its rate [1/s]."""
    goal = 1.0 if option.on != 0 and follows else 0.0
    if option.share == goal:
        return (1.0 if goal > 0.0 else 0.0), 0.0
    way = 1.0 if goal > option.share else -1.0
    option.share = min(max(option.share + way * h / transfer, 0.0), 1.0)
    x = option.share
    return x * x * (3.0 - 2.0 * x), way * 6.0 * x * (1.0 - x) / transfer


@driver
def ahead_of_drive(state, length, rate, h):
    """What feed-forward and prediction add to a set-point (length [m], rate [m/s]) at the end of a step of h [s]."""
    follows = state.algorithm != HOLD and state.algorithm != CONSTANT_TENSION
    lead, prediction = state.feed_forward, state.prediction
    more, more_rate = 0.0, 0.0
    before = lead.share
    share, growth = take_up(lead, follows, h, state.transfer)
    if share > 0.0:
        if before == 0.0:
            begin_lead(lead, rate)
        x, v = lead_drive(lead, rate, h)
        more, more_rate = share * x, share * v + growth * x
    before = prediction.share
    share, growth = take_up(prediction, follows and prediction.horizon > 0.0, h, state.transfer)
    if share > 0.0:
        if before == 0.0:
            begin_prediction(prediction, length + more, rate + more_rate)
        x, v = predict(prediction, length + more, rate + more_rate, h)
        more, more_rate = more + share * x, more_rate + share * v + growth * x
    return more, more_rate


@driver
def set_point(state, sheave, departure, h, tension, paid):
    """Set-point [m] of the compensation and its rate at the end of a step of h [s]; departure: measured angle, see
    signed_departure; tension, paid: see compensation.

    Within its limits, and without a jump where the law was changed: the difference dies out over the transfer time.
    """
    changed = state.engaged != state.algorithm
    if changed:
        state.feed_forward.share, state.prediction.share = 0.0, 0.0
        if state.algorithm == CONSTANT_TENSION:
            begin_tension(state.tension, state.asked, state.asked_rate, tension)
    follow_departure(state, departure, h)
    length, rate, beyond, beyond_rate = compensation(state, sheave, tension, paid, h)
    follow_excess(state, beyond, beyond_rate, h)
    more, more_rate = ahead_of_drive(state, length + state.excess, rate + state.excess_rate, h)
    whole, slope = within(length + state.excess + more, state.max_amplitude)
    rate = slope * (rate + state.excess_rate + more_rate)
    state.limited = 1 if abs(whole - length - beyond - more) > SEEN else 0
    if state.algorithm == CONSTANT_TENSION:  # its limits are its own
        whole, rate, state.limited = length, state.tension.rate, state.tension.held
    if changed:
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
