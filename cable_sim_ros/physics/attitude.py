"""Attitude of a rigid body: a unit quaternion that is turned by the rotation vector of a step.

Generalised-alpha on the rotation group, Bruls and Cardona (2010): the unknown of a step is the vector th of its
rotation, R1 = R0 exp(th), in body axes (x forward, y to port, z up); its rates are those of a place.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from ..compiler.jit import driver, inline, opaque
from .inputs import MAX_WINGS
from .sensor_models import FAULT

ATTITUDE = np.dtype(
    [
        ("quaternion", "f8", 4),  # x y z w, from body axes to the world
        ("rate", "f8", 3),  # rad/s, body axes
        ("acceleration", "f8", 3),  # rad/s^2
        ("auxiliary", "f8", 3),
        ("gain", "f8", 3),  # of the acceleration in the step before
        ("turned", "f8", 3),  # rad, since the begin of the step
        # of the last tangent: derivative D of the moment to the rotation, its inverse, and D^-1 C and B D^-1 with the
        # derivatives C of the moment to the place and B of the force to the rotation, see rigid_body.condense
        ("stiffness", "f8", (3, 3)),
        ("inverse", "f8", (3, 3)),
        ("follows", "f8", (3, 3)),
        ("carries", "f8", (3, 3)),
        ("moment", "f8", 3),  # N m that are not balanced, about the tow point
        ("correction", "f8", 3),  # rad, Newton's last
        ("attack", "f8"),  # largest angle of attack of a wing that bears something, over its angle of stall
        ("wet", "f8"),  # share of the hull
        ("slam", "f8"),  # N, of water entry
        ("blown", "f8"),  # W, of the wind
        ("ground", "f8"),  # N, of the seabed
        # see flaps.py
        ("flap", "f8", MAX_WINGS),  # rad, trailing edge down
        ("demanded", "f8", MAX_WINGS),
        ("since", "i8", MAX_WINGS),  # ns, when that came
        ("heard", "i8"),  # ns, of the newest row that was taken
        ("fault", FAULT),
        ("said", "i8"),
    ],
    align=True,
)
SMALL = 1e-4  # rad, below which sines are series


@inline
def axes(e):
    """Rows of the matrix R that takes body axes to the world, of the quaternion x y z w."""
    x, y, z, w = e[0], e[1], e[2], e[3]
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


@inline
def to_world(r, a):
    """R a."""
    return (
        r[0][0] * a[0] + r[0][1] * a[1] + r[0][2] * a[2],
        r[1][0] * a[0] + r[1][1] * a[1] + r[1][2] * a[2],
        r[2][0] * a[0] + r[2][1] * a[1] + r[2][2] * a[2],
    )


@inline
def to_body(r, a):
    """R^T a."""
    return (
        r[0][0] * a[0] + r[1][0] * a[1] + r[2][0] * a[2],
        r[0][1] * a[0] + r[1][1] * a[1] + r[2][1] * a[2],
        r[0][2] * a[0] + r[1][2] * a[1] + r[2][2] * a[2],
    )


@inline
def turn_from(begun, now):
    """Quaternion of ``now`` from that of ``begun``, an ATTITUDE, and the rotation since."""
    t, e = now.turned, begun.quaternion
    angle = sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    s = sin(0.5 * angle) / angle if angle > SMALL else 0.5 - angle * angle / 48.0
    x, y, z, w = s * t[0], s * t[1], s * t[2], cos(0.5 * angle)
    a = e[3] * x + e[0] * w + e[1] * z - e[2] * y
    b = e[3] * y - e[0] * z + e[1] * w + e[2] * x
    c = e[3] * z + e[0] * y - e[1] * x + e[2] * w
    d = e[3] * w - e[0] * x - e[1] * y - e[2] * z
    size = 1.0 / sqrt(a * a + b * b + c * c + d * d)
    q = now.quaternion
    q[0], q[1], q[2], q[3] = a * size, b * size, c * size, d * size


@inline
def jacobian(t):
    """Rows of J: a small change d of the rotation vector t turns the body by J d, in body axes."""
    x, y, z = t[0], t[1], t[2]
    square = x * x + y * y + z * z
    angle = sqrt(square)
    b, c = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    if angle > SMALL:
        b, c = (1.0 - cos(angle)) / square, (angle - sin(angle)) / (square * angle)
    return (
        (1.0 - c * (y * y + z * z), b * z + c * x * y, -b * y + c * x * z),
        (-b * z + c * x * y, 1.0 - c * (x * x + z * z), b * x + c * y * z),
        (b * y + c * x * z, -b * x + c * y * z, 1.0 - c * (x * x + y * y)),
    )


@inline
def roll_pitch_yaw(e):
    """Roll, pitch (nose down) and yaw [rad] of a quaternion, in the order of REP 103."""
    r = axes(e)
    across = sqrt(r[2][1] * r[2][1] + r[2][2] * r[2][2])
    return atan2(r[2][1], r[2][2]), atan2(-r[2][0], across), atan2(r[1][0], r[0][0])


@driver
def _copy_attitudes(table, source, target) -> None:
    """Copy a slot of the attitudes."""
    for i in range(table.shape[1]):
        table[target, i] = table[source, i]


copy_attitudes = opaque(_copy_attitudes)  # by symbol: a record of its size is copied number by number
