"""A fluid that fills all space, such as the air about a span: water laws without a surface."""

from __future__ import annotations

from .quantity import Block, quantity

NO_SURFACE = 1e30  # m, height of the surface of such a fluid: all of a cable lies below it


class Fluid(Block):
    """In place of Water for a line of one's own; air by default."""

    density: float = quantity(1.2, "kg/m^3", 0.01, 1100.0, "density of the fluid", "air at 20 deg C")
    viscosity: float = quantity(1.8e-5, "Pa s", 1e-6, 1e-2, "dynamic viscosity", "air at 20 deg C")
    current: tuple[float, float] = quantity((0.0, 0.0), "m/s", -100.0, 100.0, "its velocity, x and y")

    @property
    def current_gradient(self) -> tuple[float, float]:
        """None: it moves as one."""
        return (0.0, 0.0)
