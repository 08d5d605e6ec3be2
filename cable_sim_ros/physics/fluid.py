"""A fluid that fills all space, such as the air about a span: water without a surface."""

from __future__ import annotations

from .parameter import Block, quantity
from .sea import ELEVATION
from .water import Water
from .workspace import RISE, Work

NO_SURFACE = 1e30  # m, elevation of a surface that is nowhere


class Fluid(Block):
    """In place of Water for a line of one's own; air by default."""

    density: float = quantity(1.2, "kg/m^3", 0.01, 1100.0, "density of the fluid", "air at 20 deg C")
    viscosity: float = quantity(1.8e-5, "Pa s", 1e-6, 1e-2, "dynamic viscosity", "air at 20 deg C")
    current: tuple[float, float] = quantity((0.0, 0.0), "m/s", -100.0, 100.0, "its velocity, x and y")

    def as_water(self) -> Water:
        """Water of these numbers, which may be none of water."""
        return Water.model_construct(density=self.density, viscosity=self.viscosity, current=self.current)


def fill_space(work: Work) -> None:
    """Raise the surface over every node beyond any height; nothing lowers it where there is no sea."""
    work.around[:, ELEVATION] = NO_SURFACE
    work.lanes[0].lane[RISE : RISE + 2] = NO_SURFACE
