"""Contact surfaces: gap, normal and surface speed of drum and two-flank V-groove sheave, Westin (2018) (94)-(102).

Geometry apart from law. A surface is a row of numbers: centre, velocity, spin and axis in the world, radius of the
seated centreline, slope s of the flanks. With rel = r - c: y = rel.e_y, e_r and rho from the remainder, h = rho - R.
Flanks n = +-cos(s) e_y + sin(s) e_r, delta = -(+-y cos s + h sin s); (100) is printed in the wrong plane. A drum is
the groove with s = 90 deg, one flank and no top. The groove top is a smooth fade from h_g/2 to h_g: the cut of (105)
makes Newton unsolvable (trap T4). Beyond the width of the groove at its top there is no flank to press.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np

from .jit import inline
from .quantity import REQUIRED, Block, quantity
from .vec import axpy, cross, dot, scale

(CENTRE, SPEED, SPIN, AXIS, RADIUS, SLOPE_SIN, SLOPE_COS, STIFFNESS, DAMPING, FADE_LOW, FADE_HIGH, LATERAL,
 SECOND_FLANK, BODY) = (0, 3, 6, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21)   # BODY: centre in base_link
SURFACE_COLUMNS = 24
NO_TOP = 1e30


class Sheave(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "sheave centre in base_link (x forward, y left, z up)", "Westin Table 8")
    radius: float = quantity(REQUIRED, "m", 0.005, 10.0, "radius at the root of the groove", "Westin Table 8")
    groove_depth: float = quantity(0.01, "m", 1e-4, 1.0, "depth of the groove", "Westin Table 8")
    throat_angle_deg: float = quantity(60.0, "deg", 5.0, 170.0, "angle between the flanks", "Westin Table 8")


def surface_row(position, seat_radius: float, throat_angle: float | None, groove_depth: float, lateral_slack: float,
                stiffness: float, damping: float) -> np.ndarray:
    """One row: centre in base_link [m], radius of the seated centreline [m], throat angle [rad] (None: drum), SI
    units."""
    row = np.zeros(SURFACE_COLUMNS)
    half = 0.5 * pi if throat_angle is None else 0.5 * throat_angle
    row[BODY:BODY + 3] = position
    row[RADIUS], row[STIFFNESS], row[DAMPING] = seat_radius, stiffness, damping
    if throat_angle is None:
        row[SLOPE_SIN], row[SLOPE_COS], row[SECOND_FLANK] = 1.0, 0.0, 0.0
        row[FADE_LOW], row[FADE_HIGH], row[LATERAL] = NO_TOP, 2.0 * NO_TOP, NO_TOP
    else:
        row[SLOPE_SIN], row[SLOPE_COS], row[SECOND_FLANK] = sin(half), cos(half), 1.0
        row[FADE_LOW], row[FADE_HIGH] = 0.5 * groove_depth, groove_depth
        row[LATERAL] = groove_depth * sin(half) / cos(half) + lateral_slack
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
def flank(side, y, h, er, ey, slope_sin, slope_cos):
    """Penetration delta and normal n of the flank that pushes to +e_y (side = 1) or -e_y (side = -1)."""
    return -(side * y * slope_cos + h * slope_sin), axpy(side * slope_cos, ey, scale(slope_sin, er))
