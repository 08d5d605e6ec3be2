"""How the IMU is turned in base_link: from its attitude to that of the ship."""

from __future__ import annotations

from math import radians, sqrt
from typing import NamedTuple

import numpy as np

from ...sim.tables.attitude import quaternion

Rotor = tuple[float, float, float, float]  # quaternion x y z w
NORTH: Rotor = (0.0, 0.0, sqrt(0.5), sqrt(0.5))  # Rz(90 deg)


def times(a: Rotor, b: Rotor) -> Rotor:
    """The rotation b, then a."""
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
