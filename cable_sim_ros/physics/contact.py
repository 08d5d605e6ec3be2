"""Contact law: force from gap, normal and closing speed (Hunt-Crossley), Westin (2018) (93)."""

from __future__ import annotations

from .quantity import Block, quantity


class Contact(Block):
    penetration_limit: float = quantity(
        0.1, "1", 1e-4, 0.5, "largest penetration at working tension, as a fraction of the cable diameter; "
        "it sets the stiffness", "trap T3: Westin's Table 9 stiffness lets the cable sink 60 mm")
    working_tension: float = quantity(
        4000.0, "N", 1e-3, 1e7, "tension at which the penetration limit holds", "highest static tension expected")
    damping: float = quantity(0.3, "s/m", 0.0, 100.0, "Hunt-Crossley damping D", "Westin (93)")
