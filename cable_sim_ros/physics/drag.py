"""Drag of a cable section: loading functions f_n, f_t of the angle of attack and C_D(Re).

Sources: Driscoll & Nahon as printed by Westin (2018) (58)-(62), ribbon fairing (145), with the corrections of
the project's theory notes (thrust sign, tangential sign, second line of (145) read as f_t).
"""

from __future__ import annotations

from enum import Enum


class DragLaw(str, Enum):
    """Loading functions of a section."""

    OFF = "off"
    DRISCOLL_NAHON = "driscoll_nahon"                    # 0.011 on sin(2 eta): our default
    DRISCOLL_NAHON_PRINTED = "driscoll_nahon_printed"    # 0.11 as printed by Westin (60a)
    RIBBON = "ribbon"                                    # ribbon fairing, Westin (145)
    CROSSFLOW = "crossflow"                              # f_n = sin^2, f_t = 0
