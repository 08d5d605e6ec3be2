"""Commands of the winch: from rates and lengths in the ring to the commanded length, its rate and acceleration bounded.

Lengths are relative to the start, positive out; DRUM and WINCH stand in winch.py. What comes out depends on the ring
and the WINCH record alone, so a run is the same however it is cut.
"""

from math import isnan, sqrt

import numpy as np

from ..compiler.jit import driver, inline
from .inputs import COMMAND_ROWS
from .noise import gauss, spoiled
from .sensor_models import BIAS, DRIFT, FAULT_NONE, FROZEN, LATE, LOST, NOISE, RUNAWAY
from .winch import clip

COMMAND_CHANCE = 78  # seed of the noise of a fault
STREAM = 4  # intervals between lengths of a stream over which their mean is taken
ASKED_WITHIN = 1e-6  # m and 1; asking for so much more than can be is no more than a printed figure's rounding
LANDED = 1e-9  # s; nearer to its end, a line has come there


@driver
def approach(offset, rate, low, high, a, h):
    """Offset [m] and rate [m/s] after h [s] of going to rest at zero as fast as can be: speed up, cruise, brake.

    Rate within [low, high], low <= 0 <= high, acceleration a [m/s^2]; exact, however h is cut.
    """
    if offset == 0.0 and rate == 0.0:
        return 0.0, 0.0
    stop = offset + 0.5 * rate * abs(rate) / a
    way = 1.0 if stop < 0.0 or (stop == 0.0 and rate > 0.0) else -1.0
    e, w, maximum = way * offset, way * rate, high if way > 0.0 else -low
    peak = sqrt(max(0.5 * w * w - a * e, 0.0))
    top = min(peak, maximum)
    t = abs(top - w) / a
    if h < t:
        s = a if top > w else -a
        return way * (e + h * (w + 0.5 * s * h)), way * (w + s * h)
    e, h = e + 0.5 * t * (w + top), h - t
    if peak > maximum:
        if maximum <= 0.0:
            return way * e, 0.0  # what it is measured from goes as fast as can be
        t = max(-e - 0.5 * top * top / a, 0.0) / top
        if h < t:
            return way * (e + top * h), way * top
        h -= t
    w = top - a * h
    return (way * -0.5 * w * w / a, way * w) if w > 0.0 else (0.0, 0.0)


@driver
def steer(h, goal, slope, hurry, low, high, drum, winch):
    """Take the commanded length on for h [s] to one that goes from ``goal`` [m] with ``slope`` [m/s], at a rate within
    [low, high]; where it could no longer stop within the travel, it is brought to rest at the end.

    hurry: what is caught up of the way to one that moves, 1/s.
    """
    x, v, a = winch.commanded, winch.command_rate, drum.ramp
    low, high = low - slope, high - slope
    if slope != 0.0:  # lost way is made good over an interval, or the rate would overshoot by each change of slope
        catch = abs(x - goal) * hurry
        low, high = max(low, -catch), min(high, catch)
    e, w = approach(x - goal, v - slope, low, high, a, h)
    new, rate = goal + slope * h + e, slope + w
    rest = new + 0.5 * rate * abs(rate) / a
    end = clip(rest, drum.min_reach, drum.max_reach)
    if rest != end:
        e, rate = approach(x - end, v, -drum.max_rate, drum.max_rate, a, h)
        new = end + e
    winch.commanded = clip(new, drum.min_reach, drum.max_reach)
    winch.command_rate = clip(rate, -drum.max_rate, drum.max_rate)


@inline
def newest(t, delay, inputs):
    """Number of the newest command that counts at t [ns], delay [ns] after it came, and says something, -1: none."""
    head = inputs.command_seen[0]
    for back in range(1, min(head, COMMAND_ROWS - 8) + 1):
        i = (head - back) % COMMAND_ROWS
        if inputs.command_time[i] + delay <= t and not (isnan(inputs.command[i, 0]) and isnan(inputs.command[i, 1])):
            return head - back
    return -1


@inline
def interval(number, drum, inputs):
    """Mean interval [s] of the stream of lengths that command ``number`` goes on with, 0: it stands alone."""
    timeout, last, count = np.int64(drum.timeout * 1e9), inputs.command_time[number % COMMAND_ROWS], 0
    time = last
    while count < STREAM and number - count > 0:
        i = (number - count - 1) % COMMAND_ROWS
        if isnan(inputs.command[i, 0]) or time - inputs.command_time[i] > timeout:
            break
        time = inputs.command_time[i]
        count += 1
    return (last - time) * 1e-9 / max(count, 1)


@driver
def along_lengths(begin, h, length, every, drum, winch):
    """Carry out a length [m from the start] for h [s] from begin [ns] on: alone (every = 0) it is gone to at the
    largest rate, of a stream the line to it is followed."""
    goal, maximum = clip(length, drum.min_reach, drum.max_reach), drum.max_rate
    if abs(length - goal) > ASKED_WITHIN:
        winch.limited = 1
    left = (winch.line_end - begin) * 1e-9
    while h > 0.0:
        d, slope = h, 0.0
        if left > LANDED:
            d, slope = min(h, left), (goal - winch.line) / left
            if abs(slope) > maximum * (1.0 + ASKED_WITHIN):
                winch.limited = 1
        else:
            winch.line = goal
        steer(d, winch.line, clip(slope, -maximum, maximum), 1.0 / max(every, LANDED), -maximum, maximum, drum, winch)
        winch.line += slope * d
        left -= d
        h -= d


@driver
def at_rate(h, rate, drum, winch):
    """Carry out a rate [m/s] for h [s]; it ends at rest at the end of the travel."""
    maximum, x, v = drum.max_rate, winch.commanded, winch.command_rate
    kept = clip(rate, -maximum, maximum)
    if kept == 0.0:
        steer(h, x + 0.5 * v * abs(v) / drum.ramp, 0.0, 0.0, -maximum, maximum, drum, winch)
        return
    end = drum.max_reach if kept > 0.0 else drum.min_reach
    if abs(rate) > maximum * (1.0 + ASKED_WITHIN) or abs(end - x) <= 0.5 * kept * kept / drum.ramp:
        winch.limited = 1
    low, high = (-maximum, kept) if kept > 0.0 else (kept, maximum)
    steer(h, end, 0.0, 0.0, low, high, drum, winch)


@driver
def carry_out(t, begin, h, drum, inputs, winch):
    """Commanded length after h [s] from begin [ns] on, of the newest command that counts at t [ns]."""
    fault, delay = winch.fault, drum.delay
    cut = fault.kind == FROZEN or fault.kind == LOST  # what comes after the fault is not heard
    if fault.kind == LATE:
        delay += np.int64(fault.amount * 1e9)
    number = newest(min(t, fault.since) if cut else t, delay, inputs)
    winch.command_age, winch.stale, winch.limited = -1.0, 0, 0
    if fault.kind == RUNAWAY:
        winch.on_line = 0
        at_rate(h, fault.amount, drum, winch)
        return
    if number < 0:
        winch.on_line = 0
        at_rate(h, 0.0, drum, winch)
        return
    i = number % COMMAND_ROWS
    time, payout, rate = inputs.command_time[i], inputs.command[i, 0], inputs.command[i, 1]
    winch.command_age = (t - time) * 1e-9
    late = winch.command_age - delay * 1e-9 > drum.timeout and fault.kind != FROZEN
    if fault.kind != FAULT_NONE:
        since = (t - fault.since) * 1e-9
        chance = gauss(COMMAND_CHANCE, t, 0) if fault.kind == NOISE else 0.0
        if fault.kind == BIAS or fault.kind == DRIFT or fault.kind == NOISE:
            payout, rate = spoiled(fault, payout, 0, since, chance), spoiled(fault, rate, 0, since, chance)
    if isnan(payout):
        winch.on_line = 0
        winch.stale = 1 if late and rate != 0.0 else 0
        at_rate(h, 0.0 if late else rate, drum, winch)
        return
    every = interval(number, drum, inputs)
    winch.stale = 1 if late and every > 0.0 else 0
    if winch.on_line == 0:
        winch.line_end = begin
    elif winch.line_command != time:
        winch.line_end = time + delay + np.int64(every * 1e9)
    winch.on_line, winch.line_command = 1, time
    along_lengths(begin, h, payout - drum.payout_0, every, drum, winch)


@driver
def command(t, h, drum, inputs, winch):
    """Commanded length at the end of a tick of h [s] that ends at t [ns]: newest command not younger than the tick.

    A length is approached at the largest rate and then held, and hides a rate given with it; of lengths that come as a
    stream the line between them is followed. A rate is kept until its time-out. All with the drum's ramp, and to rest
    at an end of the travel, so the way back begins at once.
    """
    carry_out(t, t - np.int64(round(h * 1e9)), h, drum, inputs, winch)


@driver
def command_between(begin, end, drum, inputs, winch):
    """Commanded length at the end of a step from begin to end [ns], every command from its time on.

    A step of any length is cut where a command begins or runs into its time-out.
    """
    timeout, head, limited = np.int64(drum.timeout * 1e9), inputs.command_seen[0], 0
    while begin < end:
        until = end
        for back in range(1, min(head, COMMAND_ROWS - 8) + 1):
            time = inputs.command_time[(head - back) % COMMAND_ROWS] + drum.delay
            if begin < time < until:
                until = time
            if begin < time + timeout < until:
                until = time + timeout
        middle = begin + (until - begin) // 2
        carry_out(middle, begin, (until - begin) * 1e-9, drum, inputs, winch)
        limited = max(limited, winch.limited)
        if winch.command_age >= 0.0:
            winch.command_age += (until - middle) * 1e-9
        begin = until
    winch.limited = limited


@inline
def between(begin, end, s, h):
    """Length and rate at share s of a step of h [s], on the cubic from ``begin`` to ``end`` (length, rate)."""
    x0, v0 = begin
    x1, v1 = end
    if s >= 1.0:
        return x1, v1
    b, c = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1), -2.0 * (x1 - x0) + h * (v0 + v1)
    return x0 + s * (h * v0 + s * (b + s * c)), v0 + s * (2.0 * b + 3.0 * s * c) / h
