"""Water: density, viscosity, current. World frame ``odom``: ENU, z up, mean water surface at z = 0.

The current varies linearly with depth: V(z) = V_surface - gradient z, Westin (2018) (140); the drag kernels carry it as
four numbers, relative to the tow frame.
"""

from __future__ import annotations

from enum import Enum

from .quantity import Block, quantity


class CurrentFrame(str, Enum):
    """What the two components of the current are counted along."""

    WORLD = "world"  # east and north
    HEADING = "heading"  # ahead and to port of the ship's mean heading at the start


class Water(Block):
    density: float = quantity(1026.0, "kg/m^3", 900.0, 1100.0, "density of the water", "sea water")
    viscosity: float = quantity(1.2e-3, "Pa s", 1e-4, 1e-2, "dynamic viscosity", "sea water at 13 deg C")
    current: tuple[float, float] = quantity((0.0, 0.0), "m/s", -10.0, 10.0, "current at the surface, east and north")
    current_gradient: tuple[float, float] = quantity(
        (0.0, 0.0), "1/s", -1.0, 1.0, "growth of the current per metre of depth, east and north", "Westin (140)"
    )
    current_frame: CurrentFrame = quantity(
        CurrentFrame.WORLD,
        "",
        None,
        None,
        "world: current and its gradient are east and north; heading: ahead and to port of the heading of the start, "
        "so that a current abeam stays abeam whatever the heading of the recorded motion is",
    )
