"""Attitude as roll, pitch, yaw of Rz Ry Rx, Westin (2018) (24)-(25): to and from quaternions, rates, vectors turned.

For messages, samples and tables; kernels have their own in physics/ship.py.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin
from typing import Any

import numpy as np

Vector = tuple[float, float, float]


def angles_of(x: float, y: float, z: float, w: float) -> Vector:
    """Roll, pitch, yaw [rad] of a unit quaternion; pitch in [-pi/2, pi/2], the others in (-pi, pi]."""
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def angle_rates(roll: float, pitch: float, body_rate: Vector) -> Vector:
    """Rates of roll, pitch, yaw from body rates, rad/s; pitch away from +-90 deg."""
    p, q, r = body_rate
    across = q * sin(roll) + r * cos(roll)
    return p + across * sin(pitch) / cos(pitch), q * cos(roll) - r * sin(roll), across / cos(pitch)


def body_rates(roll: Any, pitch: Any, rates: Any) -> tuple[Any, Any, Any]:
    """Body rates from the rates of roll, pitch, yaw, rad/s, numbers or arrays: the inverse of `angle_rates`."""
    droll, dpitch, dyaw = rates
    across, sr, cr = dyaw * np.cos(pitch), np.sin(roll), np.cos(roll)
    return droll - dyaw * np.sin(pitch), dpitch * cr + across * sr, across * cr - dpitch * sr


def to_world(angles: Vector, vector: Vector) -> Vector:
    """Rz(yaw) Ry(pitch) Rx(roll) vector."""
    (roll, pitch, yaw), (x, y, z) = angles, vector
    y, z = y * cos(roll) - z * sin(roll), y * sin(roll) + z * cos(roll)
    x, z = x * cos(pitch) + z * sin(pitch), z * cos(pitch) - x * sin(pitch)
    return x * cos(yaw) - y * sin(yaw), x * sin(yaw) + y * cos(yaw), z


def rotation(angles: np.ndarray) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll), [n, 3, 3] from [n, 3] roll, pitch, yaw in rad."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles).T, np.cos(angles).T
    return np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], -1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], -1),
            np.stack([-sp, cp * sr, cp * cr], -1),
        ],
        -2,
    )


def quaternion(angles: np.ndarray) -> np.ndarray:
    """x y z w [n, 4] of the same rotation."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles / 2).T, np.cos(angles / 2).T
    return np.column_stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )
