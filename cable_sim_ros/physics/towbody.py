"""Towbody: lumped mass at the cable end with net weight, drag and added mass per axis, and hydrofoil lift.

Westin (2018) (85)-(92). Axes: x along the horizontal local flow (forward), y left, z up.
"""

from __future__ import annotations

from .quantity import REQUIRED, Block, quantity


class Towbody(Block):
    mass: float = quantity(REQUIRED, "kg", 1e-6, 1e6, "dry mass", "Westin Table 8")
    net_weight: float = quantity(REQUIRED, "N", -1e6, 1e7, "weight less buoyancy in water", "Westin Table 8")
    added_mass: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "kg", 0.0, 1e7, "added mass along x, y, z: rho V C_m", "Westin (89)")
    drag_area: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m^2", 0.0, 1e4, "drag area A C_D along x, y, z", "Westin (87)")
    lift_area: float = quantity(
        0.0, "m^2", -1e3, 1e3, "lift area S C_L of the hydrofoil, negative pressing down", "Westin 5.2")
    flow_time_constant: float = quantity(
        5.0, "s", 1e-2, 1e3, "time in which the body turns into the local flow", configure=False)
