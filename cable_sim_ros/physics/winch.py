"""Winch: drum with the cable end on its surface, servo of Westin (2018) (136), commands for rate and length.

The drum angle phi is positive hauling in; pay-out is positive cable out.
"""

from __future__ import annotations

from .quantity import REQUIRED, Block, quantity


class Winch(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "drum centre in base_link (x forward, y left, z up)", "Westin Table 8")
    drum_radius: float = quantity(REQUIRED, "m", 0.01, 10.0, "radius of the drum surface", "Westin Table 8")
    wrap: float = quantity(
        3.8, "rad", 0.1, 600.0, "angle from the top of the drum to the fixed cable end at the start", "Westin 5.4")
    proportional_gain: float = quantity(250.0, "1/s^2", 0.0, 1e5, "servo gain k1", "Westin Table 9")
    derivative_gain: float = quantity(50.0, "1/s", 0.0, 1e4, "servo gain k2", "Westin Table 9")
    max_rate: float = quantity(5.0, "m/s", 1e-3, 50.0, "largest pay-out speed")
    max_acceleration: float = quantity(20.0, "m/s^2", 1e-3, 500.0, "largest pay-out acceleration")
    command_timeout: float = quantity(
        0.5, "s", 0.01, 3600.0, "a rate command older than this is held at its length", configure=False)
