"""Rate loop: a drive known by its response, v'' = w^2 (v_r - v) - 2 zeta w v' or, zeta 0, v' = w (v_r - v).

The loop is linear, so a step d is its exponential, with v_r as it is half-way: exact while v_r stands, of second order
in what v_r follows, the length that lags. With e = v - v_r, a = v' and E = exp(-zeta w d)

    e1 = E ((C + zeta w S) e0 + S a0),   a1 = E ((C - zeta w S) a0 - w^2 S e0)                                     (1)

C = cos(u d), S = sin(u d)/u, u = w sqrt(1 - zeta^2); cosh and sinh beyond zeta = 1, 1 and d at it.
"""

from __future__ import annotations

from math import cos, cosh, exp, sin, sinh, sqrt

from ..compiler.jit import driver, inline, opaque
from .winch import ACCELERATION, RATE, SERVO_STEP, TRAVEL, clip, fastest

AT_REST = 1e-3  # m/s, m: below which a brake sets, and within which a limit is reached


@inline
def wanted_rate(drum, drive, x, v, length, rate, h):
    """Rate [m/s] asked for to come to a set-point (length, rate) from x, within speed and travel, and what held it."""
    want = rate + drive.length_gain * (length - x)
    return within_limits(drum, x, v, 0.0 if abs(want) < drive.dead_band else want, h)


@inline
def within_limits(drum, x, v, want, h):
    """A rate [m/s] within speed and travel, and what held it or -1."""
    low, high = max(drum.min_limit, drum.min_length), min(drum.max_limit, drum.max_length)
    maximum = min(drum.max_rate, fastest(high - x, v, h, drum.max_accel, drum.exact))
    minimum = -min(drum.max_rate, fastest(x - low, -v, h, drum.max_accel, drum.exact))
    if minimum <= want <= maximum:
        return want, -1
    held = RATE if (maximum if want > maximum else -minimum) >= drum.max_rate else TRAVEL
    return clip(want, minimum, maximum), held


@inline
def early(h, begin, end):
    """By how much of its change, -0.5 to 0.5, the rate of a set-point (length, rate) that goes from ``begin`` to
    ``end`` in h [s] changes before half-time: 0 evenly, 0.5 at once, -0.5 at last. The lengths tell."""
    change = end[1] - begin[1]
    return clip(((end[0] - begin[0]) / h - begin[1]) / change - 0.5, -0.5, 0.5) if change != 0.0 else 0.0


@inline
def changed(part, s):
    """Share of its change that the rate of a set-point has made at share s of a step; part: `early`. It changes evenly,
    before it stands or after it stood."""
    if part >= 0.0:
        return min(1.0, s / max(1.0 - 2.0 * part, 1e-9))
    return max(0.0, 1.0 - (1.0 - s) / max(1.0 + 2.0 * part, 1e-9))


@inline
def response(w, zeta, d):
    """Of a loop over d [s]: e1 by e0 and by a0, a1 by e0 and by a0, see (1)."""
    if zeta <= 0.0:
        gone = exp(-w * d)
        return gone, 0.0, -w * gone, 0.0
    u, fades = w * sqrt(abs(1.0 - zeta * zeta)), exp(-zeta * w * d)
    if u * d < 1e-6:
        c, s = 1.0, d
    elif zeta < 1.0:
        c, s = cos(u * d), sin(u * d) / u
    else:
        c, s = cosh(u * d), sinh(u * d) / u
    return fades * (c + zeta * w * s), fades * s, -fades * w * w * s, fades * (c - zeta * w * s)


@driver
def _follow_rate(h, drum, drive, winch, driving, length, rate) -> None:
    """Advance a rate loop by h [s] towards a set-point at the end of it, within rate, acceleration and travel."""
    count = max(1, int(h / SERVO_STEP + 0.999))
    d = h / count
    ee, ea, ae, aa = response(drive.bandwidth, drive.damping, d)
    x, v, a, goal, begin_rate = winch.length, winch.rate, winch.accel, driving.given, driving.given_rate
    part = early(h, (goal, begin_rate), (length, rate))
    # of a length that jumps beside its rate
    off = length - goal - h * (begin_rate + (0.5 + part) * (rate - begin_rate))
    for i in range(count):
        slope = begin_rate + changed(part, (i + 0.5) / count) * (rate - begin_rate)
        run = d * slope + off / count
        want, held = wanted_rate(drum, drive, x + 0.5 * d * v, v, goal + 0.5 * run, slope, 0.5 * d)
        goal += run
        lag = v - want
        new, after = want + ee * lag + ea * a, ae * lag + aa * a
        if abs(after) > drum.max_accel or abs(new - v) > d * drum.max_accel:
            after, held = clip(after, -drum.max_accel, drum.max_accel), ACCELERATION
            new = v + clip(new - v, -d * drum.max_accel, d * drum.max_accel)
        new = clip(new, -drum.max_rate, drum.max_rate)
        x += 0.5 * d * (v + new)
        v, a = new, after
        if x > drum.max_length or x < drum.min_length:
            x, v, a, held = clip(x, drum.min_length, drum.max_length), 0.0, 0.0, TRAVEL
        if held >= 0:
            winch.held[held] += d
        winch.fastest, winch.hardest = max(winch.fastest, abs(v)), max(winch.hardest, abs(a))
    stand_at_end(drum, winch, x)
    winch.length, winch.rate, winch.accel = x, v, a
    winch.target, winch.target_rate = length, rate


@inline
def stand_at_end(drum, winch, x):
    """Note where pay-out x is at an end stop or a soft limit."""
    winch.at_end = 1 if x >= drum.max_length or x <= drum.min_length else 0
    near = x >= drum.max_limit - AT_REST or x <= drum.min_limit + AT_REST
    winch.at_limit = 1 if near and winch.at_end == 0 else 0


follow_rate = opaque(_follow_rate)
