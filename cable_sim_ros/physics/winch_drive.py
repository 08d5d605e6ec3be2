"""Drive of the winch: motor, gear and brake that turn the drum against the cable's pull, or a rate loop of known order.

Everything is said of the cable at the drum's radius: pay-out L, rate v and acceleration a positive out, pulls positive
hauling in. A motor turns the drum against the cable's tension T at the drum (Newton's second law about its axis, over
the radius):

    M (a + v^2 r'/r) + d v + F + s = T                                                                             (1)

M: inertia of motor, gear, drum and wound cable over r^2, r the radius at which the cable runs off and r' its change per
length wound: v/r is what turns; d v: viscous friction; F: the motor's pull, that of a controller of the rate within the
curve of the motor, proportional to the rate and integral to what it lags, so that the bare drum answers as
v'' = w^2 (v_r - v) - 2 zeta w v'; s: dry friction and brake, which hold up to what they bear and slip with less. A drum
that they stop within a step goes as far as it comes until then. L is one more unknown of the step: its velocity and
acceleration follow from it by the generalised-alpha formulas of the cable (integrate.py) and (1) holds at the end of
the step, with the T of that end. The step solves (1) with T as it goes on, T = T* - K (L - L*), solves the cable for
that L, and begins again from the T found and the secant of K until T is the one that (1) took, within DRIVE.balance. So
stiffness of the cable and inertia of the drum limit no step: what takes the tension of the step before is unstable from
h omega = 2 on.

Curve, power, friction and brake are given for the first layer of the drum; gear: radius of that layer over that of the
layer that runs off. A law of the motor is p v + q within low and high: (p, q, low, high).
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from ..compiler.jit import driver, inline
from .drum_layers import radius_and_slope, second_moment
from .parameter import Block, choice, quantity
from .rate_loop import AT_REST, early, stand_at_end, wanted_rate, within_limits
from .tick_output import BRAKE_SLIPPED, MOTOR_LIMITED
from .winch import ACCELERATION, clip, wound_on

POINTS = 8  # of the curve of the motor
BALANCED = 1e-4  # of the working tension, that (1) may be out of balance by at the end of a step
LIFTED = 1e-9  # of a set brake: what is left of it after its time is round-off of the steps
UNLED = 20.0  # by which an error of the drum counts more that its motor, at a bound, does not lead back: they add
MEETINGS = 12  # solutions of the cable in one step, before it is halved
BISECTIONS = 60
STOPPED = 1e-12  # m/s, below which a drum does not move


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
    model: DriveModel = choice(
        DriveModel.SERVO,
        "servo: ideal, of winch.proportional_gain and derivative_gain; rate_loop: a drive of known response that the "
        "cable's pull does not slow; motor: pull, inertia, friction and brake, with the cable's pull on the drum",
    )
    mode: WinchMode = choice(
        WinchMode.FOLLOW,
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
        ("lead", "f8"),  # m, by which the way of the reference in the step is more than that of an even change of it
        ("motor", "f8"),  # N, pull of the motor, and as the step began
        ("begun_pull", "f8"),
        ("held", "f8"),  # N, of brake and dry friction, and what they bear of a drum that slips
        ("slips", "f8"),
        ("brake", "f8"),  # 0 open to 1 set
        ("setting", "f8"),  # 1/s, its rate
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
        ("climb", "f8"),  # kg/m, mass r'/r
        ("shed", "f8"),  # kg/m, cable that takes its motion off the drum with it
        ("error", "f8"),  # m, estimated error of the pay-out that the step brought, see step_error.py
        ("hit", "f8"),  # J that an end stop took
        ("supplied", "f8"),  # J since the start: work of cable and motor on the drum; what friction, brake and end took
        ("lost", "f8"),
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
def largest_pull(drive, gear, speed):
    """What the motor can pull [N] at a speed of the cable [m/s], either way: its curve and its power."""
    v, pull = abs(speed) * gear, 0.0
    for i in range(1, drive.points):
        v0, v1 = drive.curve_speed[i - 1], drive.curve_speed[i]
        if v0 <= v <= v1:
            f0, f1 = drive.curve_pull[i - 1], drive.curve_pull[i]
            pull = f0 + (f1 - f0) * (v - v0) / (v1 - v0)
    return gear * (drive.max_power / v if v * pull > drive.max_power else pull)


@inline
def loose(drive, gear, brake, pull):
    """What is left of a pull [N] on a drum at rest that friction and its brake, 0 open to 1 set, do not hold."""
    if abs(pull) <= gear * (drive.dry_friction + brake * drive.brake_pull):
        return 0.0
    slips = gear * (drive.dry_friction + brake * drive.brake_pull * drive.brake_slip)
    return pull - slips if pull > 0.0 else pull + slips


@inline
def motor_pull(drive, gear, law, v):
    """Pull of the motor [N] at speed v: p v + q within low and high, and within what the motor can."""
    p, q, low, high = law
    most = largest_pull(drive, gear, v)
    return clip(clip(p * v + q, low, high), -most, most)


@inline
def root(slope, rest, drive, gear, law, near):
    """The v with slope v + rest + motor_pull(v) = 0; of several the one next to the speed ``near``."""
    p, q, low, high = law
    v = -(rest + q) / (slope + p)
    f = p * v + q
    if not low <= f <= high:
        f = clip(f, low, high)
        v = -(rest + f) / slope
    if abs(f) <= largest_pull(drive, gear, v):
        return v
    most = gear * drive.peak
    if slope * near + rest + motor_pull(drive, gear, law, near) > 0.0:
        begin, end = -(rest + most) / slope, near
    else:
        begin, end = near, -(rest - most) / slope
    for _ in range(BISECTIONS):
        v = 0.5 * (begin + end)
        if slope * v + rest + motor_pull(drive, gear, law, v) > 0.0:
            end = v
        else:
            begin = v
    return v


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
    driving.lead = 0.0
    if driving.following != 0:
        want, held = wanted_rate(drum, drive, x, v, length, rate, h)
        ramp = drum.max_accel * h
        driving.reference = clip(want, before.reference - ramp, before.reference + ramp)
        if driving.reference != want and held < 0:
            held = ACCELERATION
        if held >= 0:
            winch.held[held] += h
        else:
            step = 0.5 * h * abs(driving.reference - before.reference)
            part = early(h, (before.given, before.given_rate), (length, rate))
            driving.lead = clip(h * part * (rate - before.given_rate), -step, step)
    elif mode == TENSION:  # the pull decides; speed and travel are what the rate is kept within
        driving.reference, _ = within_limits(drum, x, v, v, h)
    elif mode == BRAKE:
        ramp = drum.max_accel * h
        driving.reference = clip(0.0, before.reference - ramp, before.reference + ramp)
        driving.lead = -0.5 * h * before.reference * max(1.0 - abs(before.reference) / ramp, 0.0)  # at rest before h
    else:
        driving.reference = v if mode == EMERGENCY_STOP else 0.0  # a brake that lifts is waited for
    if mode == BRAKE and (abs(driving.reference) > AT_REST or abs(v) > 10.0 * AT_REST) and before.brake == 0.0:
        aim = 0.0
    time = drive.brake_set_time if aim > 0.0 else drive.brake_lift_time
    driving.brake = clip(before.brake + (h / time if aim > 0.0 else -h / time), 0.0, 1.0)
    if driving.brake < LIFTED:
        driving.brake = 0.0
    driving.setting, driving.mode = (driving.brake - before.brake) / h, mode
    driving.gear, driving.mass, driving.climb, driving.shed = 1.0, drive.mass, 0.0, 0.0
    if drum.lay_turns > 0.0:  # as it is at the end of the step
        wound = wound_on(drum, old) - h * (old.rate + 0.5 * h * old.accel)
        r, slope = radius_and_slope(drum, wound)
        driving.gear, driving.shed = drum.radius / r, drive.cable
        driving.mass = drive.mass * driving.gear**2 + drive.cable * second_moment(drum, wound) / r**2
        driving.climb = driving.mass * slope / r
    winch.target, winch.target_rate = length, driving.reference


@inline
def taken_up(gain, integral, speed, new, up, motor):
    """What of its change ``up`` [N] an integral takes in a step whose motor ends at a bound, ``motor`` [N]: none while
    the law, gain times the speed and the integral, is past the bound, and what keeps it there where the speed falls."""
    before, after = gain * speed + integral, gain * new + integral + up
    part = clip((motor - before) / (after - before), 0.0, 1.0) if (after - before) * up > 0.0 else 0.0
    return clip(motor - gain * new - integral, min(part * up, up), max(part * up, up))


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
    if abs(old.rate) > STOPPED:  # the lag of x goes with the jerk, and a brake that begins or ends to set changes it
        pull = gear * drive.brake_pull * drive.brake_slip * (1.0 if old.rate > 0.0 else -1.0)
        x0 += (af - am) * h * (driving.setting - before.setting) * pull / mass
    # the motor, p v + q within low and high, and within what it can at that speed
    p, error = drive.gain_p + 0.5 * h * drive.gain_i, old.rate - before.reference
    q = before.integral + drive.gain_i * (0.5 * h * (error - driving.reference) - driving.lead)
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
    driving.begun_pull = before.motor
    if mode != before.mode or low == high:  # a pull that jumps: the step begins with the acceleration after it
        begun = motor_pull(drive, gear, law, old.rate)
        if begun != before.motor:
            shift = (before.motor - begun) / mass
            if abs(old.rate) <= STOPPED:
                shift = loose(drive, gear, before.brake, before.tension - begun) / mass - a0
            a0, x0, near = a0 + shift, x0 + shift, near + h * shift
            driving.begun_pull = begun
    lag = (af * a0 - am * x0) / (1.0 - am)
    per = (1.0 - af) / (1.0 - am)
    lb, vb = h * h * beta * per, h * gamma * per
    la = old.length + h * old.rate + h * h * ((0.5 - beta) * x0 + beta * lag)
    va = old.rate + h * ((1.0 - gamma) * x0 + gamma * lag)
    slope = mass / vb + k * lb / vb + drive.viscous_friction * gear * gear + driving.climb * near
    rest = -mass * va / vb + k * (la - lb / vb * va - at) - tension
    bears = gear * (drive.dry_friction + driving.brake * drive.brake_pull)
    slips = gear * (drive.dry_friction + driving.brake * drive.brake_pull * drive.brake_slip)
    v, held, at_rest, part = 0.0, 0.0, False, 1.0
    still = rest + motor_pull(drive, gear, law, 0.0)  # what friction has to hold at no speed
    way = 1.0 if old.rate > STOPPED else -1.0 if old.rate < -STOPPED else -1.0 if still > 0.0 else 1.0
    if abs(old.rate) > STOPPED or abs(still) > bears:
        v = root(slope, rest + way * slips, drive, gear, law, near)
        if v * way <= 0.0:
            at_rest = abs(still) <= bears
            if at_rest and abs(old.rate) > STOPPED:
                part = old.rate / (old.rate - v)
            if not at_rest:
                way = -1.0 if still > 0.0 else 1.0
                v = root(slope, rest + way * slips, drive, gear, law, near)
        held = way * slips
    else:
        at_rest = True
    if at_rest:
        v, held = 0.0, -still
    motor = motor_pull(drive, gear, law, v)
    new = old.length + 0.5 * part * h * old.rate if at_rest else lb / vb * (v - va) + la
    a = (v - va) / vb
    driving.aux, driving.slips, driving.hit = lag + per * a, way * slips, 0.0
    driving.expected, driving.stopped = tension - k * (new - at), 0
    past = max(new - drum.max_length, drum.min_length - new, 0.0) if abs(old.rate) > STOPPED else 0.0
    if new >= drum.max_length or new <= drum.min_length:
        new, v, at_rest = clip(new, drum.min_length, drum.max_length), 0.0, True
        driving.stopped, driving.hit = 1, 0.5 * mass * old.rate**2
        motor = motor_pull(drive, gear, law, 0.0)
    if at_rest:
        a, driving.aux = 0.0, 0.0
    most = largest_pull(drive, gear, v)
    driving.spent = 1 if mode != EMERGENCY_STOP and abs(motor) >= most * (1.0 - 1e-9) else 0
    driving.error = abs((beta + 0.5 * (am - af) - 1.0 / 6.0) * h * h * (a - a0)) * mass / (vb * slope)
    if motor <= low or motor >= high or driving.spent != 0:
        driving.error *= UNLED
    driving.error += past
    if before.brake > 0.0 and driving.brake == 0.0:  # commands count from the next step on, not from when it is open
        driving.error += (h - before.brake * drive.brake_lift_time) * abs(before.given_rate)
    stand_at_end(drum, winch, new)
    winch.length, winch.rate, winch.accel = new, v, a
    driving.motor, driving.held, driving.step = motor, held, h
    up = drive.gain_i * (0.5 * h * (error + v - driving.reference) - driving.lead)
    if (up > 0.0 and motor >= min(high, most)) or (up < 0.0 and motor <= max(low, -most)):
        up = taken_up(drive.gain_p, before.integral, old.rate, v, up, motor)
    driving.integral = before.integral + up
    if mode == TENSION:  # what takes over goes on from the pull of now
        driving.integral = motor - drive.gain_p * v
    elif driving.brake > 0.0:
        driving.integral = tension - drive.gain_p * v


@inline
def count_work(drive, old, before, winch, driving):
    """Count the work of a solved step on the drum and what friction, brake and end stop took: mean pulls of its
    beginning and end over its way, of cable that runs off the drum its motion."""
    way, speeds, brakes = winch.length - old.length, old.rate + winch.rate, before.brake + driving.brake
    pull = before.tension + driving.tension - driving.begun_pull - driving.motor
    driving.supplied += 0.5 * way * (pull - 0.25 * driving.shed * speeds**2)
    friction = before.slips + driving.slips + drive.viscous_friction * driving.gear**2 * speeds
    driving.lost += 0.5 * way * friction + driving.hit
    if driving.brake > 0.0:
        driving.slipped += abs(way)
        driving.heat += 0.5 * brakes * abs(way) * driving.gear * drive.brake_pull * drive.brake_slip
