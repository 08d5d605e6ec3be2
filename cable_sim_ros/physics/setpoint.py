"""Set-point algorithms for the winch: Westin (2018) (1)-(2), after Calnan.

Displacements are those of the sheave from its mean track; the set-point is positive paying out.
"""

from __future__ import annotations

from enum import Enum

from .quantity import Block, quantity


class SetpointLaw(str, Enum):
    HOLD = "hold"
    SIMPLIFIED_SHEAVE = "simplified_sheave"            # (2) with the constant nominal angle
    RIGOROUS_SHEAVE = "rigorous_sheave"                # (2) with the measured departure angle
    SIMPLIFIED_WATERLINE = "simplified_waterline"      # (1) with the constant nominal angle
    RIGOROUS_WATERLINE = "rigorous_waterline"          # (1) with the measured departure angle


class Setpoint(Block):
    algorithm: SetpointLaw = quantity(
        SetpointLaw.HOLD, "", None, None, "set-point algorithm of the compensation", "Westin 2.1", configure=False)
    nominal_angle_deg: float | None = quantity(
        None, "deg", 0.0, 89.0, "nominal departure angle from the vertical; none: that of the static start",
        "Westin Table 9")
    washout_period: float = quantity(
        300.0, "s", 0.0, 1e5, "period of the filter that follows the mean track of the sheave; 0: the scene's "
        "tow speed is the mean track exactly", configure=False)
