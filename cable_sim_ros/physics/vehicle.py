"""Vehicle: an ROV, AUV, second ship or dock that drives the cable's far end, its pose given from outside.

The place rows of the end node are given, its slope is free: a joint at the attachment. Minus what holds these rows is
the force of the cable on the vehicle, and its power stands in the balance of energy as that of the end at the drum. The
pose moves by the rules of the ship's (ship.py).

Beyond what the cable reaches nothing can be driven there. With l the length of the straight cable from the sheave to
the attachment and L what is out, the end follows to a strain e = l/L - 1 of half the largest one m; above, it gives way
along the cable to a strain of m/2 (1 + tanh(2 e/m - 1)), which is as smooth as the cable needs: twice differentiable.
Nor does it go into the seabed.
"""

from __future__ import annotations

from math import acos, exp, sqrt

import numpy as np

from ..compiler.jit import driver, inline
from .parameter import Block, again, quantity
from .ship import SHIP_TIMES, Ship, hull_point
from .vec import add, at3, axpy, dot, norm, scale, sub

VEHICLE = np.dtype(
    [
        ("on", "i8"),
        ("attachment", "f8", 3),  # m, from its reference point
        ("max_strain", "f8"),
        ("max_tension", "f8"),  # N
        ("bottom", "f8"),  # m, height of the seabed; -inf: none
        ("times", SHIP_TIMES),
    ],
    align=True,
)
DIFFERENCE = 1e-3  # s, over which the end that gives way is differentiated
NOT_MOVING, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


class Vehicle(Block):
    position: tuple[float, float, float] | None = quantity(
        None,
        "m",
        -1e5,
        1e5,
        "reference point at the start: x ahead and y to port of base_link by the heading of the start, z up from the "
        "mean water surface; a pose that is known before the start takes its place",
    )
    attitude_deg: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "deg", -360.0, 360.0, "roll, pitch and yaw at the start, yaw from the heading of the ship"
    )
    attachment: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "m",
        -1e3,
        1e3,
        "where the cable is made fast, from the reference point: x forward, y to port, z up",
    )
    max_tension: float | None = quantity(
        None,
        "N",
        1e-3,
        1e8,
        "tension of straight cable beyond which its end no longer follows; from half of it on it gives way; none: "
        "twice contact.working_tension",
    )
    max_speed: float = quantity(
        5.0,
        "m/s",
        0.01,
        50.0,
        "speed with which a jump of the pose is taken up at most, and beyond which it is refused",
    )
    start_blend: float | None = again(Ship, "start_blend", "that of the ship")
    source_blend: float | None = again(Ship, "source_blend", "that of the ship")
    stale_decay: float | None = again(Ship, "stale_decay", "that of the ship")
    stale_after: float | None = quantity(
        None, "s", 0.01, 60.0, "age of the newest pose at which it counts as stale; none: vehicle.max_gap"
    )
    max_gap: float = quantity(
        2.5, "s", 0.02, 60.0, "a longer gap between poses begins anew instead of being interpolated"
    )


@inline
def limited(strain, largest):
    """Strain to which the end follows, of a straight cable to the vehicle."""
    over = 2.0 * strain / largest - 1.0
    if over <= 0.0:
        return strain
    if over > 20.0:
        return largest
    e = exp(-2.0 * over)
    return 0.5 * largest * (1.0 + (1.0 - e) / (1.0 + e))


@inline
def straight(rel, up, radius):
    """Length of straight cable from the point above the axis of a sheave to a point at ``rel`` from its centre [m], and
    the unit vector along it there; up: unit vector of the ship."""
    d = max(norm(rel), 1.001 * radius)
    n = scale(1.0 / max(norm(rel), 1e-9), rel)
    wrapped = acos(min(max(dot(n, up), -1.0), 1.0)) - acos(radius / d)
    free = sqrt(d * d - radius * radius)
    across = axpy(-dot(n, up), n, up)  # in the plane of the sheave, upward of n
    size = norm(across)
    # the point where it leaves lies off n by acos(radius/d), towards the top
    c, s = radius / d, sqrt(1.0 - radius * radius / (d * d))
    tip = axpy(radius * c, n, scale(radius * s / size if size > 1e-9 else 0.0, across))
    along = sub(scale(d, n), tip)
    return radius * wrapped + free, scale(1.0 / max(norm(along), 1e-9), along)


@inline
def moved(point, tau):
    """Where a point (place, velocity, acceleration) is after tau [s]."""
    return axpy(0.5 * tau * tau, point[2], axpy(tau, point[1], point[0]))


@driver
def drawn(vehicle, end, sheave, top, length, radius, tau):
    """Where the end is, tau [s] from now. end, sheave and top (of the ship, above it): points, see moved();
    length: what is out, with two rates [m]."""
    p, c = moved(end, tau), moved(sheave, tau)
    out = max(length[0] + tau * (length[1] + 0.5 * tau * length[2]), 1e-3)
    reach, along = straight(sub(p, c), sub(moved(top, tau), c), radius)
    p = axpy(out * (1.0 + limited(reach / out - 1.0, vehicle.max_strain)) - reach, along, p)
    return (p[0], p[1], max(p[2], vehicle.bottom))


@driver
def end_of(vehicle, now, sheave, drum):
    """Place, velocity and acceleration of the cable's end, and how far [m] that is from the attachment.

    vehicle: VEHICLE; now: MEMORY; sheave: its SURFACE; drum: DRUM.
    """
    end = hull_point(now.vehicle.motion, at3(vehicle.attachment, 0), NOT_MOVING, NOT_MOVING)
    winch, body = now.winch, at3(sheave.body, 0)
    length = (drum.payout_0 + winch.length - drum.inboard, winch.rate, winch.accel)
    wheel = hull_point(now.ship.motion, body, NOT_MOVING, NOT_MOVING)
    near = length[0] - 4.0 * sheave.radius - abs(winch.rate) * 2.0 * DIFFERENCE
    if norm(sub(end[0], wheel[0])) < near and end[0][2] > vehicle.bottom + 1e-2:
        return end[0], end[1], end[2], 0.0
    top = hull_point(now.ship.motion, add(body, UP), NOT_MOVING, NOT_MOVING)
    here = drawn(vehicle, end, wheel, top, length, sheave.radius, 0.0)
    off = norm(sub(end[0], here))
    if off == 0.0:
        return end[0], end[1], end[2], 0.0
    before = drawn(vehicle, end, wheel, top, length, sheave.radius, -DIFFERENCE)
    after = drawn(vehicle, end, wheel, top, length, sheave.radius, DIFFERENCE)
    v = scale(0.5 / DIFFERENCE, sub(after, before))
    a = scale(1.0 / (DIFFERENCE * DIFFERENCE), add(sub(after, here), sub(before, here)))
    return here, v, a, off
