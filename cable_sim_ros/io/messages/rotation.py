"""Vectors turned by unit quaternions x y z w, as plain numbers."""

from __future__ import annotations


def rotate(quaternion: tuple, vector: tuple) -> tuple[float, float, float]:
    """Vector turned by a unit quaternion x y z w: v + 2 w (q x v) + 2 q x (q x v)."""
    qx, qy, qz, qw = quaternion
    vx, vy, vz = vector
    tx, ty, tz = 2 * (qy * vz - qz * vy), 2 * (qz * vx - qx * vz), 2 * (qx * vy - qy * vx)
    return (vx + qw * tx + qy * tz - qz * ty, vy + qw * ty + qz * tx - qx * tz, vz + qw * tz + qx * ty - qy * tx)


def inverse(q: tuple) -> tuple[float, float, float, float]:
    """The rotation back."""
    return (-q[0], -q[1], -q[2], q[3])
