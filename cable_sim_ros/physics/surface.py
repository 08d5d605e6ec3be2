"""Contact surfaces: gap, normal and surface speed of drum and two-flank V-groove sheave, Westin (2018) (94)-(102)."""

from __future__ import annotations

from .quantity import REQUIRED, Block, quantity


class Sheave(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "sheave centre in base_link (x forward, y left, z up)", "Westin Table 8")
    radius: float = quantity(REQUIRED, "m", 0.005, 10.0, "radius at the root of the groove", "Westin Table 8")
    groove_depth: float = quantity(0.01, "m", 1e-4, 1.0, "depth of the groove", "Westin Table 8")
    throat_angle_deg: float = quantity(60.0, "deg", 5.0, 170.0, "angle between the flanks", "Westin Table 8")
