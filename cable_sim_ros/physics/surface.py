"""Contact surfaces: gap, normal and surface speed of drum and two-flank V-groove sheave, Westin (2018) (94)-(102).

Geometry apart from law. A surface is a row of numbers: centre, velocity, spin and axis in the world, radius of the
seated centreline, slope s of the flanks. With rel = r - c: y = rel.e_y, e_r and rho from the remainder, h = rho - R.
The sheave is two halves, mirror images, each a solid ring as the centreline meets it: its flank n = -+cos(s) e_y +
sin(s) e_r, delta = |y| cos s - h sin s, a round rim, and its cheek, delta = half width - |y|; (100) is printed in the
wrong plane. Flank and cheek meet inside below the crest, nowhere nearer to the outside than the rim is round. The rim
is what (105) cuts off, which makes Newton unsolvable (trap T4); on it the normal turns from that of the flank to that
of the cheek. A drum is the groove with s = 90 deg, one flank and no rim.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np

from .jit import inline
from .quantity import REQUIRED, Block, quantity
from .vec import axpy, cross, dot, scale

(CENTRE, SPEED, SPIN, AXIS, RADIUS, SLOPE_SIN, SLOPE_COS, STIFFNESS, DAMPING, RIM, TOP, CREST, SECOND_FLANK, BODY) = (
    0,
    3,
    6,
    9,
    12,
    13,
    14,
    15,
    16,
    17,
    18,
    19,
    20,
    21,
)  # BODY: centre in base_link
SURFACE_COLUMNS = 24
NO_TOP = 1e30


class Sheave(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "sheave centre in base_link (x forward, y left, z up)", "Westin Table 8"
    )
    radius: float = quantity(REQUIRED, "m", 0.005, 10.0, "radius at the root of the groove", "Westin Table 8")
    groove_depth: float = quantity(0.01, "m", 1e-4, 1.0, "depth of the groove", "Westin Table 8")
    throat_angle_deg: float = quantity(60.0, "deg", 5.0, 170.0, "angle between the flanks", "Westin Table 8")
    rim_radius: float = quantity(
        0.005,
        "m",
        0.0,
        0.5,
        "rounding of the rim, from the flank into the cheek; reaching at most half-way down the groove",
        "no source: half the shipped cable's diameter",
    )


def surface_row(
    position,
    seat_radius: float,
    throat_angle: float | None,
    groove_depth: float,
    rim: float,
    stiffness: float,
    damping: float,
) -> np.ndarray:
    """One row: centre in base_link [m], radius of the seated centreline [m], throat angle [rad] (None: drum), SI
    units.

    rim: radius of the round rim as the centreline meets it, the sheave's own and half a diameter.
    """
    row = np.zeros(SURFACE_COLUMNS)
    half = 0.5 * pi if throat_angle is None else 0.5 * throat_angle
    row[BODY : BODY + 3] = position
    row[RADIUS], row[STIFFNESS], row[DAMPING] = seat_radius, stiffness, damping
    if throat_angle is None:
        row[SLOPE_SIN], row[SLOPE_COS], row[SECOND_FLANK] = 1.0, 0.0, 0.0
        row[RIM], row[TOP], row[CREST] = 0.0, NO_TOP, NO_TOP
    else:
        row[SLOPE_SIN], row[SLOPE_COS], row[SECOND_FLANK] = sin(half), cos(half), 1.0
        rim = min(rim, 0.5 * groove_depth / (1.0 - sin(half)))
        row[RIM], row[TOP] = rim, groove_depth
        row[CREST] = (rim + (groove_depth - rim) * sin(half)) / cos(half)
    return row


@inline
def place(rel, ey, radius):
    """Cylinder coordinates of a point relative to a surface: y, e_r, t = e_y x e_r, rho, h."""
    y = dot(rel, ey)
    radial = axpy(-y, ey, rel)
    rho = sqrt(dot(radial, radial) + 1e-30)
    er = scale(1.0 / rho, radial)
    return y, er, cross(ey, er), rho, rho - radius


@inline
def own_half(side, y, h, er, ey, s):
    """Penetration delta, normal n and curvature [1/m] of the half on the point's own side: flank, rim or cheek.

    side: 1 where the point is at +e_y, -1 at -e_y.
    """
    u, w = side * y - s[CREST], h - (s[TOP] - s[RIM])  # from the middle of the round rim
    reach = sqrt(u * u + w * w + 1e-30)
    rim, cheek = w > 0.0 and u * s[SLOPE_SIN] + w * s[SLOPE_COS] > 0.0, u > 0.0
    across = u / reach if rim else (1.0 if cheek else -s[SLOPE_COS])
    out = w / reach if rim else (0.0 if cheek else s[SLOPE_SIN])
    flat = s[RIM] - u if cheek else side * y * s[SLOPE_COS] - h * s[SLOPE_SIN]
    return s[RIM] - reach if rim else flat, axpy(side * across, ey, scale(out, er)), (1.0 / reach if rim else 0.0)


@inline
def other_half(side, y, h, er, ey, s):
    """Penetration delta and normal n of the half across the groove: its flank, up to the crest of the own half."""
    delta = -(side * y * s[SLOPE_COS] + h * s[SLOPE_SIN])
    return delta if side * y < s[CREST] else 0.0, axpy(side * s[SLOPE_COS], ey, scale(s[SLOPE_SIN], er))


@inline
def margin(y, h, s):
    """Distance [m] of a centreline below the top of its groove; beyond a crest minus the distance from it."""
    below = s[TOP] - h
    beyond = s[CREST] - abs(y)
    return below if beyond >= 0.0 else min(below, beyond)


@inline
def beside(y, h, s):
    """1 or -1 where a centreline is beside the sheave, beyond a crest and nearer the axis than the seat; else 0."""
    if h >= 0.0 or abs(y) <= s[CREST]:
        return 0.0
    return 1.0 if y > 0.0 else -1.0
