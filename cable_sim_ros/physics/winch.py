"""Winch: drum with the cable end on its surface, servo of Westin (2018) (136), commands for rate and length.

The drum angle phi is positive hauling in; pay-out is positive cable out: payout = payout_0 + R (phi_0 - phi), R the
radius of the cable's centreline on the drum. (136) is written in pay-out and integrated implicitly at 1 ms.
"""

from __future__ import annotations

from math import cos, isnan, sin

from .inputs import COMMAND_ROWS
from .jit import driver, inline
from .quantity import REQUIRED, Block, quantity

# State.winch (float64), lengths relative to the start, positive out
LENGTH_NOW, RATE_NOW, ACCEL_NOW, COMMANDED, COMMAND_AGE, STALE, AT_END, TARGET, TARGET_RATE = range(9)
WINCH_STATE = 9
SERVO_STEP = 1e-3  # s

# Model.winch (float64)
(CENTRE, SEAT, ANGLE_0, SIDE, GAIN_P, GAIN_D, RATE_MOST, ACCEL_MOST, TIMEOUT, PAYOUT_0, LENGTH_LEAST, LENGTH_MOST) = (
    0,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
    12,
    13,
)
WINCH_ROWS = 14


class Winch(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "drum centre in base_link (x forward, y left, z up)", "Westin Table 8"
    )
    drum_radius: float = quantity(REQUIRED, "m", 0.01, 10.0, "radius of the drum surface", "Westin Table 8")
    wrap: float = quantity(
        3.8, "rad", 0.1, 600.0, "angle from the top of the drum to the fixed cable end at the start", "Westin 5.4"
    )
    proportional_gain: float = quantity(250.0, "1/s^2", 0.0, 1e5, "servo gain k1", "Westin Table 9")
    derivative_gain: float = quantity(50.0, "1/s", 0.0, 1e4, "servo gain k2", "Westin Table 9")
    max_rate: float = quantity(5.0, "m/s", 1e-3, 50.0, "largest pay-out speed")
    max_acceleration: float = quantity(20.0, "m/s^2", 1e-3, 500.0, "largest pay-out acceleration")
    command_timeout: float = quantity(
        0.5, "s", 0.01, 3600.0, "a rate command older than this is held at its length", configure=False
    )


@inline
def clip(x, low, high):
    return min(max(x, low), high)


@inline
def drum_point(row, length, rate, accel):
    """Cable end in base_link, its velocity and acceleration there, for pay-out length, rate, accel since the start."""
    r = row[SEAT]
    phi, w, dw = row[ANGLE_0] - length / r, -rate / r, -accel / r
    s, c = sin(phi), cos(phi)
    x = row[SIDE]
    p = (row[CENTRE] + x * r * s, row[CENTRE + 1], row[CENTRE + 2] + r * c)
    v = (x * r * w * c, 0.0, -r * w * s)
    a = (x * r * (dw * c - w * w * s), 0.0, -r * (dw * s + w * w * c))
    return p, v, a


@driver
def command(t, h, row, inputs, winch):
    """Commanded length at the end of a tick of h [s] that ends at t [ns]: newest command not younger than the tick.

    A length is approached at the largest rate and then held; a rate is integrated until its time-out. Returns the
    rate.
    """
    head = inputs.command_head[0]
    winch[COMMAND_AGE], winch[STALE] = -1.0, 0.0
    for back in range(1, min(head, COMMAND_ROWS - 8) + 1):
        i = (head - back) % COMMAND_ROWS
        if inputs.command_time[i] > t:
            continue
        age = (t - inputs.command_time[i]) * 1e-9
        winch[COMMAND_AGE] = age
        payout, rate = inputs.command[i, 0], inputs.command[i, 1]
        move = 0.0
        if not isnan(payout):
            move = clip(payout - row[PAYOUT_0] - winch[COMMANDED], -row[RATE_MOST] * h, row[RATE_MOST] * h)
        elif not isnan(rate):
            if age <= row[TIMEOUT]:
                move = clip(rate, -row[RATE_MOST], row[RATE_MOST]) * h
            elif rate != 0.0:
                winch[STALE] = 1.0
        else:
            continue  # nothing commanded: the one before holds
        winch[COMMANDED] += move
        return move / h
    return 0.0


@driver
def servo(h, row, winch, x0, v0, x1, v1):
    """Advance (136) by h [s] towards a set-point that goes from (x0, v0) to (x1, v1), relative to the start."""
    count = max(1, int(h / SERVO_STEP + 0.999))
    d = h / count
    k1, k2 = row[GAIN_P], row[GAIN_D]
    x, v, a = winch[LENGTH_NOW], winch[RATE_NOW], winch[ACCEL_NOW]
    winch[AT_END] = 0.0
    b, c = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1), -2.0 * (x1 - x0) + h * (v0 + v1)
    for i in range(count):
        s = (i + 1.0) / count
        target = x0 + s * (h * v0 + s * (b + s * c))
        rate = v0 + s * (2.0 * b + 3.0 * s * c) / h
        if target > row[LENGTH_MOST] or target < row[LENGTH_LEAST]:
            target, rate = clip(target, row[LENGTH_LEAST], row[LENGTH_MOST]), 0.0
            winch[AT_END] = 1.0
        new = (k1 * (target - x - d * v - 0.25 * d * d * a) + k2 * (rate - v - 0.5 * d * a)) / (
            1.0 + 0.25 * k1 * d * d + 0.5 * k2 * d
        )
        new = clip(new, -row[ACCEL_MOST], row[ACCEL_MOST])
        speed = clip(v + 0.5 * d * (a + new), -row[RATE_MOST], row[RATE_MOST])
        x += 0.5 * d * (v + speed)
        v, a = speed, new
        winch[TARGET], winch[TARGET_RATE] = target, rate
    winch[LENGTH_NOW], winch[RATE_NOW], winch[ACCEL_NOW] = x, v, a
