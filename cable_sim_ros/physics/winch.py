"""Winch: drum with the cable end on its surface, servo of Westin (2018) (136); what is commanded: winch_command.py.

The drum angle phi is positive hauling in; pay-out is positive cable out: payout = payout_0 + R (phi_0 - phi), R the
radius of the cable's centreline on the drum. (136) is written in pay-out and integrated implicitly at 1 ms.
"""

from __future__ import annotations

from enum import Enum
from math import cos, sin, sqrt

import numpy as np

from ..compiler.jit import driver, inline
from .drum_layers import lay_of, radius_of
from .parameter import REQUIRED, Block, choice, quantity
from .sensor_models import FAULT
from .tick_output import COMMAND_LIMITED, COMMAND_STALE, DRUM_END, WINCH_LIMIT, WINCH_SATURATED

# what holds the winch, see WINCH.held
RATE, ACCELERATION, TRAVEL, COMMAND, RAMP = range(5)
LIMITS = 5
WOUND = 256  # cells of the cable's length that remember the strain they were wound with
# lengths relative to the start, positive out
WINCH = np.dtype(
    [
        ("length", "f8"),  # m, paid out
        ("rate", "f8"),  # m/s
        ("accel", "f8"),  # m/s^2
        ("commanded", "f8"),  # m, what the commands add up to, and its rate
        ("command_rate", "f8"),
        ("command_age", "f8"),  # s since it came, -1: none yet
        ("stale", "i8"),  # 1: a rate command or a stream of lengths ran into its time-out
        ("fault", FAULT),  # of the way of a command to the winch
        ("drive_fault", FAULT),  # of the set-point on its way to the drive
        ("limited", "i8"),  # 1: a command asks for more than rate or travel allow
        ("line", "f8"),  # m, where the line between the lengths of a stream has come to
        ("line_end", "i8"),  # ns, when it comes to the newest of them
        ("line_command", "i8"),  # ns, time of that one
        ("on_line", "i8"),  # 1: a length is carried out
        ("at_end", "i8"),  # 1: stopped at an end stop, paying out or hauling in
        ("target", "f8"),  # m, what the servo steers to, and its rate
        ("target_rate", "f8"),
        ("at_limit", "i8"),  # 1: stopped at a soft limit of the scene
        ("flow", "f8", 3),  # rate, acceleration, auxiliary acceleration as the solver has them, see mesh_motion.py
        ("held", "f8", LIMITS),  # s of the tick in which it was held to a limit: by the servo, and of the commands
        ("fastest", "f8"),  # m/s, m/s^2: largest of the tick, either way
        ("hardest", "f8"),
        ("turned", "f8"),  # rad that the drum has turned since the start, positive paying out
        ("surface", "f8"),  # m, length over the drum's surface since the start, as a counter on it shows
        ("wound", "f8", WOUND),  # strain with which the cable was wound, by arc length
    ],
    align=True,
)
DRUM = np.dtype(
    [
        ("centre", "f8", 3),  # m, base_link
        ("radius", "f8"),  # m, of the cable's centreline on the drum
        ("lay_turns", "f8"),  # turns in a layer, 0: one layer without end; see drum_layers.py
        ("lay_pitch", "f8"),  # m from one turn to the next
        ("lay_rise", "f8"),  # m from one layer to the next
        ("angle_0", "f8"),  # rad, drum angle at the start
        ("side", "f8"),  # 1: the sheave lies aft of the drum, else -1
        ("gain_p", "f8"),
        ("gain_d", "f8"),
        ("max_rate", "f8"),
        ("max_accel", "f8"),
        ("timeout", "f8"),  # s
        ("delay", "i8"),  # ns, after which a command counts
        ("ramp", "f8"),  # m/s^2, of what is commanded
        ("feeds", "i8"),  # 1: the cable leaves at the tangent point, 0: its end is on the drum
        ("tangent", "f8"),  # rad, angle of the tangent point
        ("total", "f8"),  # m of cable
        ("payout_0", "f8"),  # m off the drum at the start
        ("inboard", "f8"),  # m from the tangent point to above the sheave's axis
        ("min_length", "f8"),  # end stops
        ("max_length", "f8"),
        ("min_limit", "f8"),  # soft limits
        ("max_limit", "f8"),
        ("min_reach", "f8"),  # ends of what may be commanded
        ("max_reach", "f8"),
        ("exact", "i8"),  # 1: brakes alike in steps of any length, see fastest(); where they are chosen
        ("blend", "f8"),  # m, see mesh_motion.at_least
        ("end_stiffness", "f8"),  # EI of the last element over w L^3, see sim/build.py
    ],
    align=True,
)
SERVO_STEP = 1e-3  # s
END_WITHIN = 1e-9  # m; a set-point this near to an end of the travel is at it
ON_RAMP = 1e-6  # of the ramp; a change of the rate this near to what it gives was held to it
BRAKING = 0.8  # share of the largest acceleration with which the winch brakes ahead of an end


class DrumModel(str, Enum):
    """What the drum is to the cable."""

    FEED = "feed"  # material runs through the drum's tangent point, the mesh rides with the ship
    CONTACT = "contact"  # the cable's end is fixed on its surface, the mesh to the material: short travel


class Winch(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED,
        "m",
        -200.0,
        200.0,
        "drum centre in base_link (x forward, y left, z up); forward of the sheave",
        "Westin Table 8",
    )
    drum_radius: float = quantity(REQUIRED, "m", 0.01, 10.0, "radius of the drum surface", "Westin Table 8")
    drum: DrumModel = choice(
        DrumModel.FEED,
        "feed: cable runs in and out at the drum's tangent point, any length; contact: its end is fixed on the drum's "
        "surface, for travel of a few metres and as a check",
    )
    lay_width: float = quantity(
        0.0,
        "m",
        0.0,
        20.0,
        "width of a layer of cable on the drum, between the flanges; 0: one radius for whatever is wound",
    )
    lay_pitch: float | None = quantity(None, "m", 1e-4, 1.0, "from one turn to the next; none: cable.diameter")
    lay_rise: float | None = quantity(
        None,
        "m",
        0.0,
        1.0,
        "from one layer to the next; none: sqrt(3)/2 of cable.diameter, bedded between the turns below",
    )
    flange_radius: float | None = quantity(None, "m", 0.01, 20.0, "radius of the flanges; none: they hold any length")
    drum_friction: float = quantity(
        0.0,
        "1",
        0.0,
        1.0,
        "Coulomb friction of the cable on the drum that turns under it, of its load there; with drum: contact alone",
        "off: as Westin; no source for a value",
    )
    cable_on_drum: float | None = quantity(
        None, "m", 0.0, 2e4, "unstretched cable on the drum at the start; none: what scope, else wrap leaves there"
    )
    scope: float | None = quantity(
        None, "m", 0.0, 2e4, "unstretched cable from above the sheave's axis to the towbody at the start"
    )
    least_scope: float | None = quantity(None, "m", 0.0, 2e4, "soft limit of hauling in; none: the end stop alone")
    most_scope: float | None = quantity(None, "m", 0.0, 2e4, "soft limit of paying out; none: the end stop alone")
    dead_length: float = quantity(
        0.0, "m", 0.0, 1e3, "cable that stays on the drum: paying out ends there, besides a reserve of 0.3 rad"
    )
    wrap: float = quantity(
        3.8, "rad", 0.1, 600.0, "angle from the top of the drum to the fixed cable end at the start", "Westin 5.4"
    )
    proportional_gain: float = quantity(250.0, "1/s^2", 0.0, 1e5, "servo gain k1", "Westin Table 9")
    derivative_gain: float = quantity(50.0, "1/s", 0.0, 1e4, "servo gain k2", "Westin Table 9")
    max_rate: float = quantity(5.0, "m/s", 1e-3, 50.0, "largest pay-out speed")
    max_acceleration: float = quantity(20.0, "m/s^2", 1e-3, 500.0, "largest pay-out acceleration")
    command_timeout: float = quantity(
        0.5,
        "s",
        0.01,
        3600.0,
        "a rate command, or the last of a stream of lengths, that came longer ago than this is stale: the winch holds",
        configure=False,
    )
    command_delay: float = quantity(
        0.0,
        "s",
        0.0,
        10.0,
        "dead time: a command counts so long after it came; what a set-point law asks for is not delayed",
    )
    command_acceleration: float | None = quantity(
        None,
        "m/s^2",
        1e-3,
        500.0,
        "acceleration with which commands are taken up; none, or more than max_acceleration: that",
    )


@inline
def clip(x, low, high):
    return min(max(x, low), high)


@inline
def wound_on(drum, winch):
    """Length of cable on the drum [m]."""
    return drum.total - drum.payout_0 - winch.length


@inline
def drum_point(drum, winch):
    """First node in base_link, its velocity and acceleration there, for a DRUM and the WINCH record of now.

    The cable's end on the drum, or the point where the drum feeds it: that stands.
    """
    r = drum.radius
    if drum.feeds != 0:
        phi, w, dw = drum.tangent, 0.0, 0.0
    else:
        phi, w, dw = drum.angle_0 - winch.length / r, -winch.rate / r, -winch.accel / r
    s, c = sin(phi), cos(phi)
    x = drum.side
    y, slope = lay_of(drum, wound_on(drum, winch))
    p = (drum.centre[0] + x * r * s, drum.centre[1] + y, drum.centre[2] + r * c)
    v = (x * r * w * c, -slope * winch.rate, -r * w * s)
    a = (x * r * (dw * c - w * w * s), -slope * winch.accel, -r * (dw * s + w * w * c))
    return p, v, a


@inline
def drum_turning(drum, winch):
    """Rate [rad/s] at which the drum turns about y in base_link, its surface with the end of the cable on it."""
    return -drum.side * winch.rate / radius_of(drum, wound_on(drum, winch))


@inline
def fastest(way, speed, d, brake, exact):
    """Largest speed [m/s] towards an end ``way`` [m] off after d [s] begun with ``speed``: brake/2 stops it there.

    From where it will be then, so that it slows down by brake/2 however d changes. Fixed steps, which do not change,
    look from where it began: in a chosen one that is shorter than the last that would be a jump of the speed.
    """
    if exact == 0:
        return sqrt(brake * max(way, 0.0))
    left, half = brake * (way - 0.5 * d * speed), 0.25 * brake * d
    return sqrt(half * half + left) - half if left > 0.0 else 0.0


@driver
def servo(h, drum, winch, begin, end):
    """Advance (136) by h [s] towards a set-point that goes from begin to end (length, rate), relative to the start."""
    count = max(1, int(h / SERVO_STEP + 0.999))
    d = h / count
    x0, v0 = begin
    x1, v1 = end
    k1, k2 = drum.gain_p, drum.gain_d
    x, v, a = winch.length, winch.rate, winch.accel
    winch.at_end, winch.at_limit = 0, 0
    low, high = max(drum.min_limit, drum.min_length), min(drum.max_limit, drum.max_length)
    brake = 2.0 * BRAKING * drum.max_accel
    b, c = 3.0 * (x1 - x0) - h * (2.0 * v0 + v1), -2.0 * (x1 - x0) + h * (v0 + v1)
    for i in range(count):
        s = (i + 1.0) / count
        target = x0 + s * (h * v0 + s * (b + s * c))
        rate = v0 + s * (2.0 * b + 3.0 * s * c) / h
        held = -1
        if target >= high - END_WITHIN or target <= low + END_WITHIN:
            held = TRAVEL
            out = target >= high - END_WITHIN
            end, stop = (high, drum.max_length) if out else (low, drum.min_length)
            target, rate = end, 0.0
            winch.at_end, winch.at_limit = (1, 0) if end == stop else (0, 1)
        new = (k1 * (target - x - d * v - 0.25 * d * d * a) + k2 * (rate - v - 0.5 * d * a)) / (
            1.0 + 0.25 * k1 * d * d + 0.5 * k2 * d
        )
        if abs(new) > drum.max_accel:
            new, held = clip(new, -drum.max_accel, drum.max_accel), ACCELERATION
        maximum = min(drum.max_rate, fastest(high - x, v, d, brake, drum.exact))
        minimum = -min(drum.max_rate, fastest(x - low, -v, d, brake, drum.exact))
        speed = v + 0.5 * d * (a + new)
        if speed > maximum or speed < minimum:
            held = RATE if (maximum if speed > maximum else -minimum) >= drum.max_rate else TRAVEL
            speed = clip(speed, minimum, maximum)
            new = clip((speed - v) / d, -drum.max_accel, drum.max_accel)
        if abs(speed) >= drum.max_rate:
            new = 0.0  # it goes on as fast as it may
        x = clip(x + 0.5 * d * (v + speed), drum.min_length, drum.max_length)
        v, a = speed, new
        winch.fastest, winch.hardest = max(winch.fastest, abs(v)), max(winch.hardest, abs(a))
        if held >= 0:
            winch.held[held] += d
        winch.target, winch.target_rate = target, rate
    winch.length, winch.rate, winch.accel = x, v, a


@driver
def forget(winch):
    """A tick begins: nothing has held the winch in it."""
    for i in range(LIMITS):
        winch.held[i] = 0.0
    winch.fastest, winch.hardest = abs(winch.rate), abs(winch.accel)


@driver
def winch_flags(winch, h):
    """Flags of the winch after a tick of h [s]."""
    flags = 0
    if winch.stale != 0:
        flags |= COMMAND_STALE
    if winch.limited != 0:
        flags |= COMMAND_LIMITED
    if winch.at_end != 0:
        flags |= DRUM_END
    if winch.at_limit != 0:
        flags |= WINCH_LIMIT
    if 2.0 * (winch.held[RATE] + winch.held[ACCELERATION]) >= h:
        flags |= WINCH_SATURATED
    return flags


@inline
def note_command(drum, winch, before, h):
    """Count h [s] of a command that asks for more than rate or travel, or that changed the commanded rate ``before`` as
    fast as the ramp lets it."""
    if winch.limited != 0:
        winch.held[COMMAND] += h
    if abs(winch.command_rate - before) >= (1.0 - ON_RAMP) * drum.ramp * h:
        winch.held[RAMP] += h


@inline
def cell(drum, s):
    """Cell of WINCH.wound at arc length s."""
    return min(max(int(s / drum.total * WOUND), 0), WOUND - 1)


@driver
def wind(drum, winch, moved, strain):
    """Count ``moved`` [m, unstretched, positive out] on the drum's surface.

    Cable leaves the drum with the strain it was wound with; what is wound now has ``strain``.
    """
    s = wound_on(drum, winch)
    if moved < 0.0:
        for i in range(cell(drum, s + moved), cell(drum, s)):
            winch.wound[i] = strain
        winch.wound[cell(drum, s)] = strain
    run = moved * (1.0 + winch.wound[cell(drum, s)])
    winch.surface += run
    winch.turned += run / radius_of(drum, s + 0.5 * moved)
