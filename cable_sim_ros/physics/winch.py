"""Winch: drum with the cable end on its surface, servo of Westin (2018) (136), commands for rate and length.

The drum angle phi is positive hauling in; pay-out is positive cable out: payout = payout_0 + R (phi_0 - phi), R the
radius of the cable's centreline on the drum. (136) is written in pay-out and integrated implicitly at 1 ms.
"""

from __future__ import annotations

from math import cos, isnan, sin

import numpy as np

from .inputs import COMMAND_ROWS
from .jit import driver, inline
from .quantity import REQUIRED, Block, quantity

# lengths relative to the start, positive out
WINCH = np.dtype(
    [
        ("length", "f8"),  # m, paid out
        ("rate", "f8"),  # m/s
        ("accel", "f8"),  # m/s^2
        ("commanded", "f8"),  # m, what the commands add up to
        ("command_age", "f8"),  # s, -1: none yet
        ("stale", "i8"),  # 1: a rate command ran into its time-out
        ("at_end", "i8"),  # 1: pay-out stopped at either end
        ("target", "f8"),  # m, what the servo steers to, and its rate
        ("target_rate", "f8"),
    ],
    align=True,
)
DRUM = np.dtype(
    [
        ("centre", "f8", 3),  # m, base_link
        ("radius", "f8"),  # m, of the cable's centreline on the drum
        ("angle_0", "f8"),  # rad, drum angle at the start
        ("side", "f8"),  # 1: the sheave lies aft of the drum, else -1
        ("gain_p", "f8"),
        ("gain_d", "f8"),
        ("rate_most", "f8"),
        ("accel_most", "f8"),
        ("timeout", "f8"),  # s
        ("payout_0", "f8"),  # m off the drum at the start
        ("length_least", "f8"),
        ("length_most", "f8"),
    ],
    align=True,
)
SERVO_STEP = 1e-3  # s


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
def drum_point(drum, winch):
    """Cable end in base_link, its velocity and acceleration there, for a DRUM and the WINCH record of now."""
    r = drum.radius
    phi, w, dw = drum.angle_0 - winch.length / r, -winch.rate / r, -winch.accel / r
    s, c = sin(phi), cos(phi)
    x = drum.side
    p = (drum.centre[0] + x * r * s, drum.centre[1], drum.centre[2] + r * c)
    v = (x * r * w * c, 0.0, -r * w * s)
    a = (x * r * (dw * c - w * w * s), 0.0, -r * (dw * s + w * w * c))
    return p, v, a


@driver
def command(t, h, drum, inputs, winch):
    """Commanded length at the end of a tick of h [s] that ends at t [ns]: newest command not younger than the tick.

    A length is approached at the largest rate and then held; a rate is integrated until its time-out. Returns the
    rate.
    """
    head = inputs.command_head[0]
    winch.command_age, winch.stale = -1.0, 0
    for back in range(1, min(head, COMMAND_ROWS - 8) + 1):
        i = (head - back) % COMMAND_ROWS
        if inputs.command_time[i] > t:
            continue
        age = (t - inputs.command_time[i]) * 1e-9
        winch.command_age = age
        payout, rate = inputs.command[i, 0], inputs.command[i, 1]
        move = 0.0
        if not isnan(payout):
            move = clip(payout - drum.payout_0 - winch.commanded, -drum.rate_most * h, drum.rate_most * h)
        elif not isnan(rate):
            if age <= drum.timeout:
                move = clip(rate, -drum.rate_most, drum.rate_most) * h
            elif rate != 0.0:
                winch.stale = 1
        else:
            continue  # nothing commanded: the one before holds
        winch.commanded += move
        return move / h
    return 0.0


@driver
def command_between(begin, end, drum, inputs, winch):
    """Commanded length at the end of a step from begin to end [ns], every command from its stamp on; returns the rate.

    A step of any length is cut where a command begins or runs into its time-out.
    """
    timeout, newest, rate = np.int64(drum.timeout * 1e9), inputs.command_head[0], 0.0
    while begin < end:
        until = end
        for back in range(1, min(newest, COMMAND_ROWS - 8) + 1):
            stamp = inputs.command_time[(newest - back) % COMMAND_ROWS]
            if begin < stamp < until:
                until = stamp
            if begin < stamp + timeout < until:
                until = stamp + timeout
        middle = begin + (until - begin) // 2
        rate = command(middle, (until - begin) * 1e-9, drum, inputs, winch)
        if winch.command_age >= 0.0:
            winch.command_age += (until - middle) * 1e-9
        begin = until
    return rate


@driver
def servo(h, drum, winch, begin, end):
    """Advance (136) by h [s] towards a set-point that goes from begin to end (length, rate), relative to the start."""
    count = max(1, int(h / SERVO_STEP + 0.999))
    d = h / count
    x0, v0 = begin
    x1, v1 = end
    k1, k2 = drum.gain_p, drum.gain_d
    x, v, a = winch.length, winch.rate, winch.accel
    winch.at_end = 0
    b, c = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1), -2.0 * (x1 - x0) + h * (v0 + v1)
    for i in range(count):
        s = (i + 1.0) / count
        target = x0 + s * (h * v0 + s * (b + s * c))
        rate = v0 + s * (2.0 * b + 3.0 * s * c) / h
        if target > drum.length_most or target < drum.length_least:
            target, rate = clip(target, drum.length_least, drum.length_most), 0.0
            winch.at_end = 1
        new = (k1 * (target - x - d * v - 0.25 * d * d * a) + k2 * (rate - v - 0.5 * d * a)) / (
            1.0 + 0.25 * k1 * d * d + 0.5 * k2 * d
        )
        new = clip(new, -drum.accel_most, drum.accel_most)
        speed = clip(v + 0.5 * d * (a + new), -drum.rate_most, drum.rate_most)
        x += 0.5 * d * (v + speed)
        v, a = speed, new
        winch.target, winch.target_rate = target, rate
    winch.length, winch.rate, winch.accel = x, v, a
