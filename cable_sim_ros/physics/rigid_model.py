"""A rigid body as numbers: inertia and added mass about its tow point, strips of its hull, its wings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

RIGID = np.dtype(  # of one body; places in body axes from the tow point
    [
        ("node", "i8"),
        ("mass", "f8"),  # kg
        ("gravity", "f8"),  # m/s^2
        ("buoyancy", "f8"),  # N
        ("displaced", "f8"),  # kg of water
        ("gravity_centre", "f8", 3),  # m
        ("buoyancy_centre", "f8", 3),
        ("hull_centre", "f8", 3),
        ("inertia", "f8", (3, 3)),  # kg m^2 about the tow point
        ("added", "f8", (6, 6)),  # kg, kg m, kg m^2 about the tow point
        ("drag", "f8"),  # kg/m along x: rho/2 A C_D
        ("air", "f8"),  # density of the air over that of the water; 0: no wind
        ("floor_stiffness", "f8"),  # N/m^1.5 of a floor under each end of its hull
        ("radius", "f8"),  # m, of these ends
        ("length", "f8"),  # m, over which an unbalanced moment counts as a force
        ("strips", "i8", 2),  # first and one past the last of its rows
        ("wings", "i8", 2),
    ],
    align=True,
)
STRIP = np.dtype(
    [
        ("along", "f8"),  # m, from the centre of the hull
        ("share", "f8"),  # of the body's volume
        ("across", "f8", 2),  # kg/m along y and z: rho/2 d dx C_c
        ("half_height", "f8"),  # m
    ],
    align=True,
)


class Rigid(NamedTuple):
    """The rigid bodies of a line; no rows: there is none."""

    bodies: np.ndarray  # RIGID [bodies]
    strips: np.ndarray  # STRIP [strips]
    wings: np.ndarray  # WING [wings]
