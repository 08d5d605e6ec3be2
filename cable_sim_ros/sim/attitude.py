"""Attitude as roll, pitch, yaw of Rz Ry Rx, Westin (2018) (24)-(25): from quaternions, rates, vectors turned.

In plain Python for single messages and samples; kernels have their own in physics/ship.py.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin


def angles_of(x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a unit quaternion; pitch in [-pi/2, pi/2], the others in (-pi, pi]."""
    return (
        atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def angle_rates(roll: float, pitch: float, body_rate) -> tuple[float, float, float]:
    """Rates of roll, pitch, yaw from body rates, rad/s; pitch away from +-90 deg."""
    p, q, r = body_rate
    across = q * sin(roll) + r * cos(roll)
    return p + across * sin(pitch) / cos(pitch), q * cos(roll) - r * sin(roll), across / cos(pitch)


def body_rates(roll: float, pitch: float, rates) -> tuple[float, float, float]:
    """Body rates from the rates of roll, pitch, yaw, rad/s: the inverse of `angle_rates`."""
    droll, dpitch, dyaw = rates
    across = dyaw * cos(pitch)
    return droll - dyaw * sin(pitch), dpitch * cos(roll) + across * sin(roll), across * cos(roll) - dpitch * sin(roll)


def to_world(angles, vector) -> tuple[float, float, float]:
    """Rz(yaw) Ry(pitch) Rx(roll) vector."""
    (roll, pitch, yaw), (x, y, z) = angles, vector
    y, z = y * cos(roll) - z * sin(roll), y * sin(roll) + z * cos(roll)
    x, z = x * cos(pitch) + z * sin(pitch), z * cos(pitch) - x * sin(pitch)
    return x * cos(yaw) - y * sin(yaw), x * sin(yaw) + y * cos(yaw), z
