"""Heave filter: translation of the ship from specific force alone, by band-limited double integration.

States per world axis: displacement p, velocity v, accelerometer bias b; pseudo-measurement "the displacement of
base_link has zero mean". Its noise is the heave itself, which has no power at low frequency, so the innovation
e = p - (lever arm) is low-passed (q) before it is fed back:

    p' = v - k1 q,   v' = a + b - k2 q,   b' = -k3 q,   q'' = c2 (e - q) - c1 q'

c1 = 5 w, c2 = 10 w^2, k1 = w, k2 = w^2/2, k3 = w^3/10 put all five poles at -w. Estimated over true displacement is
H = s^3 (s^2 + 5 w s + 10 w^2) / (s + w)^5: a constant bias leaves nothing, and the error at wave frequencies falls
as 10 (w/omega)^3 and not as w/omega as in a plain high-pass of the same noise. w falls as 1/t after the
start (an expanding memory) down to that of `period`; before three start periods the velocity at the start is not known
well enough, so the answer is faded in between one and three. Roll- and pitch-induced motion is exact: the lever arm is
part of the pseudo-measurement and passes no filter. Background: Godhavn, Adaptive tuning of heave filter in motion
sensor, OCEANS 1998. States, poles and schedule here are this project's own, with figures in docs/motion.md.
"""

from __future__ import annotations

from enum import Enum
from math import ceil, cos, hypot, pi, sin

import numpy as np

from ..compiler.jit import driver, inline
from .parameter import Block, choice, quantity
from .vec import cross

MEMORY = 10.0  # w = MEMORY / age while the memory expands
SETTLED = 1.5  # periods after which the filter counts as settled
LONGEST_STEP = 0.05  # s; longer sample intervals are divided


class Heave(Block):
    """Parameters of the heave filter: translation from an IMU alone."""

    period: float = quantity(
        60.0,
        "s",
        20.0,
        600.0,
        "corner period of the settled heave filter: about six times the longest wave period",
        "docs/motion.md",
    )
    start_period: float = quantity(
        15.0, "s", 5.0, 600.0, "corner period of the heave filter right after its start; at most `period` is used"
    )
    imu_position: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m", -200.0, 200.0, "IMU in base_link (x forward, y left, z up)"
    )
    imu_rotation_deg: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "deg",
        -360.0,
        360.0,
        "roll, pitch, yaw (Rz Ry Rx) of the IMU's axes, after motion.convention, in base_link",
        "docs/motion.md",
    )
    max_gap: float = quantity(1.0, "s", 0.02, 10.0, "a longer gap between IMU samples restarts the heave filter")
    max_bias: float = quantity(
        0.3, "m/s^2", 0.001, 10.0, "a larger vertical bias estimate (accelerometer and gravity) makes heave not valid"
    )
    max_displacement: float = quantity(
        20.0, "m", 0.1, 100.0, "a larger displacement from the mean track restarts the heave filter"
    )


class Convention(str, Enum):
    """Axes that the motion drivers speak."""

    ENU = "enu"  # REP 103: east north up, x forward y left z up
    NED = "ned"  # north east down, x forward y starboard z down; gravity reads -g


class MotionInput(Block):
    """Parameters of the topics that bring the ship motion."""

    convention: Convention = choice(
        Convention.ENU, "axes of IMU and odometry messages; ned is turned into enu here", "REP 103"
    )
    force_reversed: bool = choice(
        False,
        "linear_acceleration is the negative of specific force, gravity less acceleration: it is turned round",
        "REP 145",
    )
    odometry_timeout: float = quantity(
        0.5, "s", 0.02, 60.0, "odometry silent for longer than this gives way to the IMU"
    )
    max_jump: float = quantity(
        5.0, "m", 0.1, 1000.0, "a larger horizontal jump of the odometry shifts its origin instead of moving the ship"
    )
    max_height_offset: float = quantity(
        2.0,
        "m",
        0.1,
        100.0,
        "odometry whose mean z is further from ship.reference_height is not used: its z has another datum or sign",
        "docs/motion.md",
    )
    stamp_jitter: float = quantity(
        0.2,
        "1",
        0.0,
        0.25,
        "stamps of a periodic topic are made regular while they jitter by up to this part (rms) "
        "of the period; 0: stamps are used as they are",
        "docs/motion.md",
    )
    position_time: float = quantity(
        3.0,
        "s",
        0.0,
        60.0,
        "time constant with which positions and angles that do not fit their rates draw the "
        "integral of the rates; 0: samples are used as they are",
        "docs/motion.md",
    )


# rows of three are axes x y z of odom: displacement, velocity, bias, low-passed innovation and its rate, acceleration
# and lever arm of the sample before
HEAVE = np.dtype(
    [("p", "f8", 3), ("v", "f8", 3), ("b", "f8", 3), ("q", "f8", 3), ("r", "f8", 3), ("a", "f8", 3), ("m", "f8", 3)]
    + [("age", "f8"), ("started", "i8")]
)


@inline
def turn(roll, pitch, yaw, a):
    """Rz(yaw) Ry(pitch) Rx(roll) a: a vector of base_link in the world."""
    y, z = a[1] * cos(roll) - a[2] * sin(roll), a[1] * sin(roll) + a[2] * cos(roll)
    x, z = a[0] * cos(pitch) + z * sin(pitch), z * cos(pitch) - a[0] * sin(pitch)
    return (x * cos(yaw) - y * sin(yaw), x * sin(yaw) + y * cos(yaw), z)


@inline
def corner(age, start, settled):
    """Pole w [rad/s] at the age of the filter [s]; start, settled: its bounds [rad/s]."""
    return max(settled, min(start, MEMORY / max(age, 1e-9)))


@inline
def axis_step(state, i, dt, w0, w1, a1, m1):
    """Advance axis i by dt. w0, w1: pole at both ends; a1: acceleration, m1: lever arm at the new sample.

    Between samples both are linear, and p is the exact integral of the published velocity v - k1 q to O(dt^4): the
    simulator interpolates with a cubic through both, and a mismatch would show as false acceleration.
    """
    p0, v0, b0, q0, r0, a0, m0 = (state.p[i], state.v[i], state.b[i], state.q[i], state.r[i], state.a[i], state.m[i])
    c1, c2, k2, k3 = 5.0 * w0, 10.0 * w0 * w0, 0.5 * w0 * w0, 0.1 * w0 * w0 * w0
    e0 = p0 - m0
    e1 = p0 + dt * (v0 - w0 * q0 + dt * (2.0 * a0 + a1) / 6.0) - m1
    f0 = c2 * (e0 - q0) - c1 * r0
    f1 = c2 * (e1 - q0 - dt * r0) - c1 * (r0 + dt * f0)
    r1 = r0 + 0.5 * dt * (f0 + f1)
    q1 = q0 + 0.5 * dt * (r0 + r1) - dt * dt * (f1 - f0) / 12.0
    q = 0.5 * (q0 + q1)
    b1 = b0 - k3 * dt * q
    v1 = v0 + dt * (0.5 * (a0 + a1 + b0 + b1) - k2 * q)
    state.p[i] = p0 + 0.5 * dt * (v0 + v1 - w0 * q0 - w1 * q1) - dt * dt * (a1 - a0 - w0 * (r1 - r0)) / 12.0
    state.v[i], state.b[i], state.q[i], state.r[i], state.a[i], state.m[i] = v1, b1, q1, r1, a1, m1


@driver
def step(states, out, dt, tuning, sample):
    """Take one IMU sample.

    states: HEAVE [1]; out: float64 [6], displacement [m] and velocity [m/s] of base_link from the mean track, in
    odom; dt: s since the sample before (ignored for the first); tuning: poles of start and settled [rad/s], gravity
    [m/s^2], IMU in base_link [m, 3]; sample: specific force of the IMU point in base_link [m/s^2], roll pitch yaw
    [rad], body rates [rad/s], three each.
    """
    state = states[0]
    start, settled, gravity, arm = tuning
    f, angles, spin = sample
    a = turn(angles[0], angles[1], angles[2], f)
    a = (a[0], a[1], a[2] - gravity)
    m = turn(angles[0], angles[1], angles[2], arm)
    swing = turn(angles[0], angles[1], angles[2], cross(spin, arm))
    if state.started == 0:
        state.started = 1
        for i in range(3):
            state.p[i], state.v[i], state.a[i], state.m[i] = m[i], swing[i], a[i], m[i]
    else:
        n = max(1, int(ceil(dt / LONGEST_STEP - 1e-9)))
        h = dt / n
        for k in range(n):
            x = 1.0 / (n - k)
            w0 = corner(state.age, start, settled)
            state.age += h
            w1 = corner(state.age, start, settled)
            for i in range(3):
                axis_step(
                    state, i, h, w0, w1, state.a[i] + x * (a[i] - state.a[i]), state.m[i] + x * (m[i] - state.m[i])
                )
    w = corner(state.age, start, settled)
    rise = start / (4.0 * pi)  # 1 / (two start periods)
    x = max(0.0, min(1.0, state.age * rise - 0.5))
    fade, growth = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * rise
    for i in range(3):
        out[i] = fade * (state.p[i] - m[i])
        out[3 + i] = fade * (state.v[i] - w * state.q[i] - swing[i]) + growth * (state.p[i] - m[i])


class HeaveFilter:
    """Heave filter of all three axes; compiled at construction.

    heave: parameters; gravity: m/s^2, a wrong value is taken up as bias.
    """

    def __init__(self, heave: Heave, gravity: float = 9.81) -> None:
        self.heave, self.gravity = heave, float(gravity)
        settled = 2.0 * pi / heave.period
        start = max(2.0 * pi / heave.start_period, settled)
        self._tuning = (start, settled, float(gravity), tuple(float(x) for x in heave.imu_position))
        self._out = np.zeros(6)
        self.reset()
        self.push(0.0, np.zeros(3), np.zeros(3), np.zeros(3))
        self.reset()

    def reset(self) -> None:
        """Forget everything; the next sample starts anew."""
        self._state = np.zeros(1, HEAVE).view(np.recarray)
        self._out[:] = 0.0

    def push(self, dt: float, force, angles, rate) -> np.ndarray:
        """Take one sample, see `step`; returns displacement and velocity from the mean track, float64 [6]."""
        sample = tuple(tuple(float(x) for x in vector) for vector in (force, angles, rate))
        step(self._state, self._out, float(dt), self._tuning, sample)
        return self._out.copy()

    @property
    def age(self) -> float:
        """Seconds since the start."""
        return float(self._state[0].age)

    @property
    def bias(self) -> tuple[float, float, float]:
        """Estimated bias of the acceleration in odom, m/s^2: what the sensor reads too much."""
        return tuple(0.0 - float(b) for b in self._state[0].b)

    @property
    def settled(self) -> bool:
        """True once the memory has had its full length for long enough."""
        return self.age >= SETTLED * self.heave.period

    @property
    def valid(self) -> bool:
        """True when settled and the vertical bias is one that an accelerometer may have."""
        return self.settled and abs(float(self._state[0].b[2])) <= self.heave.max_bias

    @property
    def diverged(self) -> bool:
        """True when the displacement is not one of a ship at sea, or not finite."""
        distance = hypot(self._out[0], self._out[1], self._out[2])
        return not distance <= self.heave.max_displacement  # also for NaN
