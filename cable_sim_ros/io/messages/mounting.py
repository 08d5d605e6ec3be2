"""How the IMU is turned in base_link, from its attitude to that of the ship; messages in other axes.

IMU and odometry messages are turned from north-east-down axes to ENU, or moved on, as bytes, by the same rotation as in
`messages.py`: R_enu = Rz(90 deg) S R_ned S with S = diag(1, -1, -1).
"""

from __future__ import annotations

from math import nan, radians, sqrt
from struct import Struct
from typing import NamedTuple

import numpy as np

from ...sim.tables.attitude import angles_of, quaternion

Rotor = tuple[float, float, float, float]  # quaternion x y z w
NORTH: Rotor = (0.0, 0.0, sqrt(0.5), sqrt(0.5))  # Rz(90 deg)

_NUMBERS = {"imu": Struct("<37d"), "odometry": Struct("<85d")}
QUATERNION = {"imu": 0, "odometry": 3}  # where it begins
VECTORS = {"imu": (13, 25), "odometry": (43, 46)}  # in body axes: rates and force, velocity and rates


def times(a: Rotor, b: Rotor) -> Rotor:
    """Product of unit quaternions x y z w: the rotation b, then a."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


class Mounting(NamedTuple):
    """The sensor's axes (x forward, y left, z up, after `motion.convention`) in base_link."""

    angles: tuple[float, float, float]  # roll pitch yaw of Rz Ry Rx, rad
    back: Rotor  # of the inverse rotation

    def of_ship(self, sensor: Rotor, ned: bool) -> Rotor:
        """Attitude of base_link in ENU from that of the sensor; ned: both world and sensor axes are NED."""
        if ned:  # R_enu = Rz(90 deg) S R_ned S with S = diag(1, -1, -1)
            sensor = times(NORTH, (sensor[0], -sensor[1], -sensor[2], sensor[3]))
        return times(sensor, self.back)


def mounting_of(rotation_deg: tuple[float, float, float]) -> Mounting | None:
    """The mounting for roll, pitch, yaw in degrees; None: not turned."""
    if not any(rotation_deg):
        return None
    roll, pitch, yaw = (radians(angle) for angle in rotation_deg)
    x, y, z, w = quaternion(np.array([[roll, pitch, yaw]]))[0].tolist()
    return Mounting((roll, pitch, yaw), (-x, -y, -z, w))


def in_enu(kind: str, data: bytes) -> bytes:
    """A little-endian CDR message of kind "imu" or "odometry" in NED axes as one in ENU; covariances stay as they are.

    A message too short to be one is returned as it is.
    """
    numbers = _NUMBERS[kind]
    if len(data) < 12 + numbers.size:
        return data
    d = list(numbers.unpack_from(data, len(data) - numbers.size))
    at = QUATERNION[kind]
    x, y, z, w = d[at : at + 4]
    if not (kind == "imu" and d[4] == -1.0):  # no attitude
        d[at : at + 4] = times(NORTH, (x, -y, -z, w))
    for at in VECTORS[kind]:
        d[at + 1], d[at + 2] = -d[at + 1], -d[at + 2]
    if kind == "odometry":
        d[:3] = d[1], d[0], -d[2]
    return data[: len(data) - numbers.size] + numbers.pack(*d)


def heading_of(data: bytes) -> float:
    """Yaw [rad] of a little-endian odometry message, nan of one too short to be one."""
    numbers = _NUMBERS["odometry"]
    if len(data) < 12 + numbers.size:
        return nan
    return angles_of(*numbers.unpack_from(data, len(data) - numbers.size)[3:7])[2]


def moved_on(data: bytes, place: tuple[float, float], velocity: tuple[float, float]) -> bytes:
    """A little-endian odometry message in ENU, with a place [m] and a velocity [m/s] to east and north more."""
    numbers = _NUMBERS["odometry"]
    d = list(numbers.unpack_from(data, len(data) - numbers.size))
    x, y, z, w = d[3:7]
    turned = times(times((-x, -y, -z, w), (*velocity, 0.0, 0.0)), (x, y, z, w))
    d[0], d[1] = d[0] + place[0], d[1] + place[1]
    d[43:46] = [one + more for one, more in zip(d[43:46], turned)]
    return data[: len(data) - numbers.size] + numbers.pack(*d)
