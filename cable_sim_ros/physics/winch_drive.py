"""Drive of the winch: motor, gear and brake that turn the drum against the cable's pull, or a rate loop of known order.

Everything is said of the cable at the drum's radius: pay-out L, rate v and acceleration a positive out, pulls positive
hauling in. A motor turns the drum against the cable's tension T at the drum (Newton's second law about its axis, over
the radius):

    M a + d v + F + s = T                                                                                          (1)

M: inertia of motor, gear and drum over the radius squared; d v: viscous friction; F: the motor's pull, that of a
controller of the rate within the curve of the motor, proportional to the rate and integral to what it lags, so that the
bare drum answers as v'' = w^2 (v_r - v) - 2 zeta w v'; s: dry friction and brake, which hold up to what they bear and
slip with less. L is one more unknown of the step: its velocity and acceleration follow from it by the generalised-alpha
formulas of the cable (integrate.py) and (1) holds at the end of the step, with the T of that end. The step solves (1)
with T as it goes on, T = T* - K (L - L*), solves the cable for that L, and begins again from the T found and the secant
of K until T is the one that (1) took, within DRIVE.balance. So stiffness of the cable and inertia of the drum limit no
step: what takes the tension of the step before is unstable from h omega = 2 on.
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from .drive_pull import STOPPED, largest_pull, loose, motor_pull, root
from .drum_layers import radius_of
from .jit import driver, inline
from .parameter import Block, quantity
from .tick_output import BRAKE_SLIPPED, MOTOR_LIMITED
from .winch import ACCELERATION, RATE, SERVO_STEP, TRAVEL, clip, fastest, wound_on

POINTS = 8  # of the curve of the motor
BALANCED = 1e-4  # of the working tension, that (1) may be out of balance by at the end of a step
MEETINGS = 12  # solutions of the cable in one step, before it is halved
AT_REST = 1e-3  # m/s: below which the brake sets


class DriveModel(str, Enum):
    """What turns the drum."""

    SERVO = "servo"  # (136) of Westin: follows its set-point whatever the cable pulls
    RATE_LOOP = "rate_loop"  # a drive known by its response: first or second order, the cable's pull does not act on it
    MOTOR = "motor"  # (1)


class WinchMode(str, Enum):
    """What the drive is asked to do."""

    FOLLOW = "follow"  # commands and set-point law
    TENSION = "tension"  # the motor pulls with drive.set_pull
    RENDER = "render"  # as follow, with drive.set_pull as the largest pull: pays out above it, recovers below
    BRAKE = "brake"  # brought to rest, then the brake sets and the motor lets go
    EMERGENCY_STOP = "emergency_stop"  # the motor lets go at once and the brake sets


MODELS, MODES = tuple(DriveModel), tuple(WinchMode)
SERVO, RATE_LOOP, MOTOR = range(3)
FOLLOW, TENSION, RENDER, BRAKE, EMERGENCY_STOP = range(5)


class Drive(Block):
    model: DriveModel = quantity(
        DriveModel.SERVO,
        "",
        None,
        None,
        "servo: ideal, of winch.proportional_gain and derivative_gain; rate_loop: a drive of known response that the "
        "cable's pull does not slow; motor: pull, inertia, friction and brake, with the cable's pull on the drum",
    )
    mode: WinchMode = quantity(
        WinchMode.FOLLOW,
        "",
        None,
        None,
        "follow: commands and set-point law; tension, render: drive.set_pull; brake; emergency_stop; all but follow "
        "need drive.model motor",
        configure=False,
    )
    set_pull: float = quantity(
        0.0, "N", 0.0, 1e7, "pull at the drum of mode tension, and largest of mode render", configure=False
    )
    dead_time: float = quantity(0.0, "s", 0.0, 5.0, "between set-point and drive, whatever its model")
    dead_band: float = quantity(0.0, "m/s", 0.0, 1.0, "rates asked for that are smaller move nothing")
    bandwidth: float = quantity(
        6.0, "rad/s", 0.05, 500.0, "natural frequency of the rate loop; of a motor: of the gains of its PI controller"
    )
    damping: float = quantity(
        0.7, "1", 0.0, 10.0, "damping ratio of the rate loop; 0 with rate_loop: a loop of first order"
    )
    length_gain: float | None = quantity(
        None, "1/s", 0.0, 100.0, "rate asked for per metre that length lags; none: a quarter of drive.bandwidth"
    )
    inertia: float = quantity(
        0.0, "kg m^2", 0.0, 1e8, "motor through its gear and drum, with the wound cable unless winch.lay_width adds it"
    )
    controller_mass: float | None = quantity(
        None,
        "kg",
        1e-3,
        1e8,
        "mass at the cable for which the gains of a motor give bandwidth and damping; none: that of drive.inertia",
    )
    curve_speed: tuple[float, ...] = quantity(
        (), "m/s", 0.0, 50.0, "speeds of the cable for curve_pull: 2 to 8, rising from 0 to winch.max_rate or more"
    )
    curve_pull: tuple[float, ...] = quantity(
        (), "N", 0.0, 1e7, "largest pull of the motor at the drum at these speeds, either way; beyond the last: none"
    )
    max_power: float | None = quantity(None, "W", 1.0, 1e9, "largest power of the motor either way; none: the curve's")
    viscous_friction: float = quantity(0.0, "N s/m", 0.0, 1e7, "friction of drum and gear with the speed")
    dry_friction: float = quantity(0.0, "N", 0.0, 1e6, "friction of drum and gear against any motion")
    brake_pull: float = quantity(0.0, "N", 0.0, 1e7, "pull at the drum that the set brake holds")
    brake_slip: float = quantity(0.8, "1", 0.05, 1.0, "share of brake_pull that a slipping brake bears")
    brake_set_time: float = quantity(0.3, "s", 0.01, 60.0, "from open to set")
    brake_lift_time: float = quantity(0.5, "s", 0.01, 60.0, "from set to open")


DRIVE = np.dtype(  # what the scene fixes
    [
        ("model", "i8"),
        ("mode", "i8"),
        ("set_pull", "f8"),
        ("dead_time", "f8"),
        ("dead_band", "f8"),
        ("bandwidth", "f8"),
        ("damping", "f8"),
        ("length_gain", "f8"),
        ("balance", "f8"),  # N, that (1) may be out of balance by
        ("mass", "f8"),  # kg, inertia over the radius of the first layer squared
        ("cable", "f8"),  # kg/m, what is wound
        ("gain_p", "f8"),  # N s/m, N/m
        ("gain_i", "f8"),
        ("peak", "f8"),  # N, largest of the curve
        ("points", "i8"),
        ("curve_speed", "f8", POINTS),
        ("curve_pull", "f8", POINTS),
        ("max_power", "f8"),
        ("viscous_friction", "f8"),
        ("dry_friction", "f8"),
        ("brake_pull", "f8"),
        ("brake_slip", "f8"),
        ("brake_set_time", "f8"),
        ("brake_lift_time", "f8"),
    ],
    align=True,
)
DRIVING = np.dtype(  # what changes
    [
        ("begun", "i8"),
        ("mode", "i8"),  # in force
        ("given", "f8"),  # m, m/s: set-point as it has come to the drive
        ("given_rate", "f8"),
        ("reference", "f8"),  # m/s, rate that the controller holds
        ("integral", "f8"),  # N
        ("motor", "f8"),  # N, pull of the motor
        ("held", "f8"),  # N, of brake and dry friction
        ("brake", "f8"),  # 0 open to 1 set
        ("slipped", "f8"),  # m against the brake since the start, either way
        ("heat", "f8"),  # J of the brake since the start
        ("aux", "f8"),  # m/s^2, auxiliary acceleration of the pay-out
        ("step", "f8"),  # s, the last
        ("tension", "f8"),  # N at the drum, at the end of the last step and of the one before
        ("tension_before", "f8"),
        ("stiffness", "f8"),  # N/m, by which the tension falls as cable is paid out in a step
        ("expected", "f8"),  # N, tension that the pay-out of now was computed with
        ("gear", "f8"),  # radius of the first layer over that of the layer that runs off
        ("mass", "f8"),  # kg, of drum and wound cable at that radius
        ("following", "i8"),  # 1: commands and set-point law move the drum
        ("law", "f8"),  # m, set-point without the commands
        ("stopped", "i8"),  # 1: at an end stop, which bears what comes
        ("limited", "f8"),  # s of the tick in which the motor gave all it could, and those of the tick
        ("ticked", "f8"),
        ("spent", "i8"),  # 1: the motor gives all it can
        ("rounds", "i8"),  # solutions of the cable in the tick
    ],
    align=True,
)


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


@driver
def follow_rate(h, drum, drive, winch, driving, length, rate):
    """Advance a rate loop by h [s] towards a set-point: v'' = w^2 (v_r - v) - 2 zeta w v', or v' = w (v_r - v)."""
    count = max(1, int(h / SERVO_STEP + 0.999))
    d, w, zeta = h / count, drive.bandwidth, drive.damping
    x, v, a, begin, begin_rate = winch.length, winch.rate, winch.accel, driving.given, driving.given_rate
    for i in range(count):
        s = (i + 1.0) / count
        goal, slope = begin + s * (length - begin), begin_rate + s * (rate - begin_rate)
        want, held = wanted_rate(drum, drive, x, v, goal, slope, d)
        if zeta > 0.0:
            a = (a + d * w * w * (want - v - d * a)) / (1.0 + 2.0 * zeta * w * d)
        else:
            a = w * (want - v) / (1.0 + w * d)
        if abs(a) > drum.max_accel:
            a, held = clip(a, -drum.max_accel, drum.max_accel), ACCELERATION
        v = clip(v + d * a, -drum.max_rate, drum.max_rate)
        x += d * v
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


@inline
def drive_flags(driving, winch):
    """Flags of the drive after a tick."""
    flags = MOTOR_LIMITED if driving.ticked > 0.0 and 2.0 * driving.limited >= driving.ticked else 0
    if driving.brake > 0.0 and abs(winch.rate) > STOPPED:
        flags |= BRAKE_SLIPPED
    return flags


@driver
def begin_turn(h, drum, drive, old, before, driving, winch, length, rate):
    """Reference rate, brake and mode of a step of h [s] towards a set-point; ``old``: WINCH at its beginning."""
    mode = drive.mode
    x, v = old.length + h * old.rate, old.rate + h * old.accel
    driving.following = 1 if (mode == FOLLOW or mode == RENDER) and before.brake == 0.0 else 0
    aim = 1.0 if mode == BRAKE or mode == EMERGENCY_STOP else 0.0
    if driving.following != 0:
        want, held = wanted_rate(drum, drive, x, v, length, rate, h)
        ramp = drum.max_accel * h
        driving.reference = clip(want, before.reference - ramp, before.reference + ramp)
        if driving.reference != want and held < 0:
            held = ACCELERATION
        if held >= 0:
            winch.held[held] += h
    elif mode == TENSION:  # the pull decides; speed and travel are what the rate is kept within
        driving.reference, _ = within_limits(drum, x, v, v, h)
    elif mode == BRAKE:
        ramp = drum.max_accel * h
        driving.reference = clip(0.0, before.reference - ramp, before.reference + ramp)
    else:
        driving.reference = v if mode == EMERGENCY_STOP else 0.0  # a brake that lifts is waited for
    if mode == BRAKE and (abs(driving.reference) > AT_REST or abs(v) > 10.0 * AT_REST) and before.brake == 0.0:
        aim = 0.0
    time = drive.brake_set_time if aim > 0.0 else drive.brake_lift_time
    driving.brake = clip(before.brake + (h / time if aim > 0.0 else -h / time), 0.0, 1.0)
    driving.mode = mode
    wound = wound_on(drum, old)
    driving.gear, driving.mass = 1.0, drive.mass
    if drum.lay_turns > 0.0:
        r = radius_of(drum, wound)
        driving.gear = drum.radius / r
        driving.mass = drive.mass * driving.gear**2 + drive.cable * wound * 0.5 * (1.0 + driving.gear**2)
    winch.target, winch.target_rate = length, driving.reference


@driver
def balance(h, alpha, drum, drive, old, before, winch, driving, at, tension):
    """Pay-out at the end of a step of h [s] from (1), with the tension at the drum ``tension`` [N] where the pay-out is
    ``at`` [m] and falling with driving.stiffness.

    old, before: WINCH and DRIVING at its beginning; alpha: integrate.coefficients."""
    am, af, beta, gamma, _, _ = alpha
    a0, x0 = old.accel, before.aux
    if before.step > 0.0 and before.step != h:
        x0 = a0 + h / before.step * (x0 - a0)  # see integrate.stretch_lag
    k, gear, mass = driving.stiffness, driving.gear, driving.mass  # of v: M a - T + d v
    # the motor, p v + q within low and high, and within what it can at that speed
    p, error = drive.gain_p + 0.5 * h * drive.gain_i, old.rate - before.reference
    q = before.integral + 0.5 * h * drive.gain_i * (error - driving.reference)
    mode, near = driving.mode, old.rate + h * a0
    low, high = -np.inf, np.inf
    if mode == TENSION:  # the controller holds what is too fast or near an end
        low = drive.set_pull if near >= driving.reference else low
        high = drive.set_pull if near <= driving.reference else high
    elif mode == RENDER:
        high = drive.set_pull
    elif mode == EMERGENCY_STOP:
        low, high = 0.0, 0.0
    elif mode == BRAKE:
        p, q = p * (1.0 - driving.brake), q * (1.0 - driving.brake)
    law = p, q, low, high
    if mode != before.mode or low == high:  # a pull that jumps: the step begins with the acceleration after it
        begun = motor_pull(drive, gear, law, old.rate)
        if begun != before.motor:
            shift = (before.motor - begun) / mass
            if abs(old.rate) <= STOPPED:
                shift = loose(drive, gear, before.brake, before.tension - begun) / mass - a0
            a0, x0, near = a0 + shift, x0 + shift, near + h * shift
    lag = (af * a0 - am * x0) / (1.0 - am)
    per = (1.0 - af) / (1.0 - am)
    lb, vb = h * h * beta * per, h * gamma * per
    la = old.length + h * old.rate + h * h * ((0.5 - beta) * x0 + beta * lag)
    va = old.rate + h * ((1.0 - gamma) * x0 + gamma * lag)
    slope = mass / vb + k * lb / vb + drive.viscous_friction * gear * gear
    rest = -mass * va / vb + k * (la - lb / vb * va - at) - tension
    bears = gear * (drive.dry_friction + driving.brake * drive.brake_pull)
    slips = gear * (drive.dry_friction + driving.brake * drive.brake_pull * drive.brake_slip)
    v, held, at_rest = 0.0, 0.0, False
    still = rest + motor_pull(drive, gear, law, 0.0)  # what friction has to hold at no speed
    way = 1.0 if old.rate > STOPPED else -1.0 if old.rate < -STOPPED else -1.0 if still > 0.0 else 1.0
    if abs(old.rate) > STOPPED or abs(still) > bears:
        v = root(slope, rest + way * slips, drive, gear, law, near)
        if v * way <= 0.0:
            at_rest = abs(still) <= bears
            if not at_rest:
                way = -1.0 if still > 0.0 else 1.0
                v = root(slope, rest + way * slips, drive, gear, law, near)
        held = way * slips
    else:
        at_rest = True
    if at_rest:
        v, held = 0.0, -still
    motor = motor_pull(drive, gear, law, v)
    new = lb / vb * (v - va) + la
    a = (v - va) / vb
    driving.aux = lag + per * a
    driving.expected, driving.stopped = tension - k * (new - at), 0
    if new >= drum.max_length or new <= drum.min_length:
        new, v, at_rest = clip(new, drum.min_length, drum.max_length), 0.0, True
        driving.stopped = 1
        motor = motor_pull(drive, gear, law, 0.0)
    if at_rest:
        a, driving.aux = 0.0, 0.0
    stand_at_end(drum, winch, new)
    winch.length, winch.rate, winch.accel = new, v, a
    driving.motor, driving.held, driving.step = motor, held, h
    most = largest_pull(drive, gear, v)
    driving.spent = 1 if mode != EMERGENCY_STOP and abs(motor) >= most * (1.0 - 1e-9) else 0
    up = 0.5 * h * drive.gain_i * (error + v - driving.reference)
    free = (up >= 0.0 or motor > max(low, -most)) and (up <= 0.0 or motor < min(high, most))
    driving.integral = before.integral + (up if free else 0.0)
    if mode == TENSION:  # what takes over goes on from the pull of now
        driving.integral = motor - drive.gain_p * v
    elif driving.brake > 0.0:
        driving.integral = tension - drive.gain_p * v
