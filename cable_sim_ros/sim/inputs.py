"""What a user pushes into a simulation: samples of ship motion and winch commands, checked when they are made.

`push` writes them into the rings that the compiled tick reads (physics/inputs.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, isnan, nan, pi, radians, sqrt
from operator import index
from types import MappingProxyType
from typing import Any

import numpy as np

from ..errors import CableSimError
from ..physics.inputs import (
    EPOCH,
    MAX_WINGS,
    MOTION_ROWS,
    SOURCE,
    Inputs,
    of_vehicle,
    push_command,
    push_flaps,
    push_motion,
)
from ..physics.tick_output import Source
from .tables.attitude import angle_rates, angles_of

MAX_POSITION = 1e7  # m
MAX_SPEED = 50.0  # m/s
MAX_RATE = 5.0  # rad/s
MAX_PITCH = radians(80.0)  # roll and yaw have no meaning near 90 deg
MAX_TURNS = 1e3  # rad, of roll and yaw: an angle beyond it is no attitude
NORM_WITHIN = 1e-2  # a quaternion nearer to norm 1 is renormalised
MAX_COMMAND = 1e5  # m, m/s: a number beyond this is no command
MAX_FLAP = pi  # rad: an angle beyond this is none, or in degrees
SPARE = 16  # rows of a ring that stay free of samples ahead: the tick needs those around the present
YAW = 5  # column of a motion sample
JUMP_FREE = 0.1  # m, between two samples of a vehicle: noise of its position is no jump


class InputError(CableSimError, ValueError):
    """A sample or command that cannot be taken; the text names field, value, unit, bound and remedy."""


@dataclass(frozen=True, kw_only=True)
class ShipMotion:
    """One sample of the ship's motion: base_link (x forward, y left, z up) in odom (ENU, z = 0 mean water surface).

    time_ns: stamp on the clock of the simulation, integer ns; every sample later than the one before.
    position: x, y, z of base_link in odom, m.
    attitude: roll, pitch, yaw of Rz Ry Rx, rad; roll + port side up, pitch + bow down, yaw from east to north.
    quaternion: x, y, z, w of the same rotation, in place of ``attitude``; exactly one of the two is given.
    velocity: of base_link in odom, m/s: the derivative of ``position`` (not in the ship's axes as a ROS twist).
    rate: angular velocity in base_link, rad/s, as a gyro measures it.
    source: what it counts as in the tick output's ``motion_source``.
    jump: True where the motion does not go on from the sample before (another sensor, another place): it is then taken
    up over ``ship.source_blend``. A gap above ``ship.max_gap`` and another source are jumps by themselves.

    Between samples the tick interpolates by the cubic through position and velocity, so these must fit each other.
    Raises InputError.
    """

    time_ns: int
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    rate: tuple[float, float, float]
    attitude: tuple[float, float, float] | None = None
    quaternion: tuple[float, float, float, float] | None = None
    source: Source = Source.ODOMETRY
    jump: bool = False

    def __post_init__(self) -> None:
        _set(self, time_ns=_stamp(self, self.time_ns))
        _set(self, position=_vector(self, "position", "m", (MAX_POSITION,) * 3))
        _set(self, velocity=_vector(self, "velocity", "m/s", (MAX_SPEED,) * 3))
        _set(self, rate=_vector(self, "rate", "rad/s", (MAX_RATE,) * 3))
        if (self.attitude is None) == (self.quaternion is None):
            raise InputError(
                f"{type(self).__name__}.attitude = {self.attitude!r} and quaternion = {self.quaternion!r}: exactly one "
                f"of them is needed; nothing was pushed. Give attitude=(roll, pitch, yaw) in rad, or quaternion=(x, y, "
                f"z, w)"
            )
        if self.attitude is not None:
            _set(self, attitude=_vector(self, "attitude", "rad", (MAX_TURNS, MAX_PITCH, MAX_TURNS)))
        else:
            _set(self, quaternion=_unit(self))
        if self.source not in (Source.ODOMETRY, Source.IMU):
            raise InputError(
                f"{type(self).__name__}.source = {self.source!r} is neither Source.ODOMETRY nor Source.IMU: nothing "
                f"was pushed. Give one of them, of cable_sim_ros.physics.tick_output, or leave it out"
            )

    @property
    def angles(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw, rad, however the attitude was given."""
        if self.attitude is not None:
            return self.attitude
        assert self.quaternion is not None  # __post_init__ saw to it
        return angles_of(*self.quaternion)

    def row(self, epoch: float, near: float = 0.0) -> list[float]:
        """The 14 numbers of `physics.inputs.push_motion`; yaw by whole turns as close as can be to ``near`` [rad]."""
        roll, pitch, yaw = self.angles
        yaw += 2.0 * pi * round((near - yaw) / (2.0 * pi))
        rates = angle_rates(roll, pitch, self.rate)
        return [*self.position, roll, pitch, yaw, *self.velocity, *rates, epoch, float(self.source)]


@dataclass(frozen=True, kw_only=True)
class VehicleMotion(ShipMotion):
    """One sample of the motion of the vehicle at the cable's far end (``towbody.model: vehicle``), as ShipMotion.

    position, attitude and velocity are those of its reference point and axes (x forward, y to port, z up) in odom, the
    same frame as the ship's; rate in its own axes. A sample that the one before does not lead to within
    ``vehicle.max_speed`` is a jump, taken up at that speed. ``source`` has no meaning here.
    """


@dataclass(frozen=True, kw_only=True)
class WinchCommand:
    """One command to the winch; pay-out positive = cable out, unstretched metres off the drum.

    payout: length to go to, m, counted as the tick output's ``payout``: approached at ``winch.max_rate``, then held.
    Lengths that follow each other within ``winch.command_timeout`` are a stream: the winch follows the line between
    them. rate: rate of pay-out, m/s, kept for ``winch.command_timeout``: repeat it in time. Not used where payout is
    given. time_ns: when it comes, integer ns; None: now. It counts ``winch.command_delay`` later. Raises InputError.
    """

    payout: float | None = None
    rate: float | None = None
    time_ns: int | None = None

    def __post_init__(self) -> None:
        if self.time_ns is not None:
            _set(self, time_ns=_stamp(self, self.time_ns))
        if self.payout is None and self.rate is None:
            raise InputError(
                "WinchCommand has neither payout nor rate: nothing was pushed. Give payout=... in m or rate=... in "
                "m/s, positive out; rate=0.0 stops the winch"
            )
        for name, unit in (("payout", "m"), ("rate", "m/s")):
            if getattr(self, name) is not None:
                _set(self, **{name: _number(self, name, getattr(self, name), unit, MAX_COMMAND)})


@dataclass(frozen=True, kw_only=True)
class FlapCommand:
    """Angles of flaps, rad, trailing edge down positive, by the name of the wing (of a body on the line BODY/WING).

    A flap that is not named keeps the angle it was commanded. Each goes there at ``flap_rate``, within ``flap_range``,
    and after ``flap_timeout`` without another to ``flap_neutral``. time_ns: when it comes, integer ns; None: now.
    Raises InputError.
    """

    angles: Mapping[str, float]
    time_ns: int | None = None

    def __post_init__(self) -> None:
        if self.time_ns is not None:
            _set(self, time_ns=_stamp(self, self.time_ns))
        if not isinstance(self.angles, Mapping) or not self.angles:
            raise InputError(
                f"FlapCommand.angles = {self.angles!r:.60} names no flap: nothing was pushed. Give a dict of names of "
                "wings and angles in rad, {'tail': 0.05}"
            )
        taken = {str(k): _number(self, f"angles[{str(k)!r:.40}]", v, "rad", MAX_FLAP) for k, v in self.angles.items()}
        _set(self, angles=MappingProxyType(taken))

    def row(self, flaps: Mapping[str, int]) -> np.ndarray:
        """Columns of `physics.inputs.push_flaps`; flaps: columns by name. Raises InputError for one that is none."""
        row = np.full(MAX_WINGS, nan)
        for name, angle in self.angles.items():
            if name not in flaps:
                raise InputError(
                    f"FlapCommand.angles: {name!r:.60} is no flap of this tow: nothing was pushed. "
                    + (f"Its flaps are {', '.join(flaps)}" if flaps else "It has none: give a wing flap_share")
                )
            row[flaps[name]] = angle
        return row


def push(
    inputs: Inputs,
    item: ShipMotion | WinchCommand | FlapCommand,
    now_ns: int,
    max_gap: float,
    flaps: Mapping[str, int] = MappingProxyType({}),
    max_speed: float = MAX_SPEED,
) -> None:
    """Write one sample or command into its ring. now_ns: time of the last tick; max_gap: `ship.max_gap`, s, or that of
    the vehicle, and its max_speed, m/s; flaps: columns by name.

    Raises InputError for a stamp that does not advance or a full ring, TypeError for anything else.
    """
    if isinstance(item, VehicleMotion):
        _push_motion(of_vehicle(inputs), item, now_ns, max_gap, max_speed)
    elif isinstance(item, ShipMotion):
        _push_motion(inputs, item, now_ns, max_gap, MAX_POSITION)
    elif isinstance(item, WinchCommand):
        stamp = _command_stamp(item, inputs.command_time, int(inputs.command_head[0]), now_ns)
        values = (nan if value is None else value for value in (item.payout, item.rate))
        push_command(inputs, stamp, *values)
    elif isinstance(item, FlapCommand):
        row = item.row(flaps)
        push_flaps(inputs, _command_stamp(item, inputs.flap_time, int(inputs.flap_head[0]), now_ns), row)
    else:
        raise TypeError(
            f"{item!r:.60} is a {type(item).__name__}: push a ShipMotion, VehicleMotion, WinchCommand or FlapCommand"
        )


def _push_motion(inputs: Inputs, item: ShipMotion, now_ns: int, max_gap: float, max_speed: float) -> None:
    owner, speed = type(item).__name__, sqrt(sum(v * v for v in item.velocity))
    if speed > max_speed:
        raise InputError(
            f"{owner}.velocity = {item.velocity!r} m/s is {speed:.4g} m/s, above vehicle.max_speed = {max_speed:g} "
            f"m/s: nothing was pushed. Check its unit and axes, or give a larger vehicle.max_speed"
        )
    head = int(inputs.motion_head[0])
    epoch, near = 1.0, 0.0
    if head:
        last = (head - 1) % MOTION_ROWS
        before = int(inputs.motion_time[last])
        _advances(owner, item.time_ns, before)
        _room(owner, "samples", inputs.motion_time, head, MOTION_ROWS, now_ns)
        row = inputs.motion[last]
        dt = (item.time_ns - before) * 1e-9
        far = sqrt(sum((a - b) ** 2 for a, b in zip(item.position, row[:3].tolist())))
        jump = item.jump or item.source != int(row[SOURCE]) or dt > max_gap or far > max_speed * dt + JUMP_FREE
        epoch, near = float(row[EPOCH]) + jump, float(row[YAW])
    push_motion(inputs, item.time_ns, item.row(epoch, near))


def _command_stamp(item: WinchCommand | FlapCommand, times: np.ndarray, head: int, now_ns: int) -> int:
    """Time [ns] at which a command counts, behind those in its ring. Raises InputError."""
    owner, stamp, rows = type(item).__name__, item.time_ns, len(times)
    if not head:
        return now_ns if stamp is None else stamp
    before = int(times[(head - 1) % rows])
    stamp = max(now_ns, before + 1) if stamp is None else stamp
    _advances(owner, stamp, before)
    _room(owner, "commands", times, head, rows, now_ns)
    return stamp


def _advances(owner: str, stamp: int, before: int) -> None:
    if stamp <= before:
        raise InputError(
            f"{owner}.time_ns = {stamp} ns is not after the newest one, {before} ns: nothing was pushed. Push in order "
            f"of time, or leave the sample out"
        )


def _room(owner: str, what: str, times: np.ndarray, head: int, rows: int, now_ns: int) -> None:
    ahead = rows - SPARE
    if head >= ahead and int(times[(head - ahead) % rows]) > now_ns:
        raise InputError(
            f"{owner}: {ahead} {what} lie ahead of the simulation at {now_ns} ns already, as many as are kept: nothing "
            f"was pushed. Tick in between"
        )


def _set(item: object, **values: object) -> None:
    for name, value in values.items():
        object.__setattr__(item, name, value)


def _stamp(owner: object, value: Any) -> int:
    try:
        stamp = index(value)
    except TypeError:
        stamp = -1
    if isinstance(value, bool) or not 0 <= stamp < 2**63:
        raise InputError(
            f"{type(owner).__name__}.time_ns = {value!r} is no whole number of nanoseconds in [0, 2^63): nothing was "
            f"pushed. Give round(seconds * 1e9)"
        )
    return stamp


def _vector(owner: object, name: str, unit: str, maximum: tuple[float, ...]) -> tuple[float, ...]:
    value = getattr(owner, name)
    try:
        parts = tuple(value)
    except TypeError:
        parts = ()
    if len(parts) != len(maximum) or isinstance(value, str):
        raise InputError(
            f"{type(owner).__name__}.{name} = {value!r} is not {len(maximum)} numbers in {unit}: nothing was pushed. "
            f"Give for example {name}=({', '.join(['0.0'] * len(maximum))})"
        )
    return tuple(
        _number(owner, f"{name}[{i}]", part, unit, limit) for i, (part, limit) in enumerate(zip(parts, maximum))
    )


def _number(owner: object, name: str, value: Any, unit: str, maximum: float) -> float:
    try:
        number = nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError):
        number = nan
    if not isfinite(number):
        what = "not a number" if isnan(number) else "infinite"
        raise InputError(
            f"{type(owner).__name__}.{name} = {value!r} {unit} is {what}: nothing was pushed. Leave the sample out, or "
            f"give a number in [{-maximum:.4g}, {maximum:.4g}] {unit}"
        )
    if abs(number) > maximum:
        raise InputError(
            f"{type(owner).__name__}.{name} = {number:g} {unit} is outside [{-maximum:.4g}, {maximum:.4g}] {unit}: "
            f"nothing was pushed. Check its unit and axes"
        )
    return number


def _unit(item: ShipMotion) -> tuple[float, ...]:
    parts = _vector(item, "quaternion", "1", (1.0 + NORM_WITHIN,) * 4)
    norm = sqrt(sum(part * part for part in parts))
    if abs(norm - 1.0) > NORM_WITHIN:
        raise InputError(
            f"{type(item).__name__}.quaternion = {item.quaternion!r} has the norm {norm:.4g}, allowed 1 +- "
            f"{NORM_WITHIN:g}: nothing was pushed. Give x, y, z, w of a rotation, w last"
        )
    parts = tuple(part / norm for part in parts)
    pitch = angles_of(*parts)[1]
    if abs(pitch) > MAX_PITCH:
        raise InputError(
            f"{type(item).__name__}.quaternion = {item.quaternion!r} is a pitch of {pitch:.4g} rad, outside "
            f"[{-MAX_PITCH:.4g}, {MAX_PITCH:.4g}] rad: nothing was pushed. Check the order of its components (w last)"
        )
    return parts
