"""A line of the benchmark table."""

from __future__ import annotations

from typing import NamedTuple

METRES = ("P7", "P8", "P9")  # scenes whose error of position is a distance


class Row(NamedTuple):
    """One line of the table; errors are fractions, of position in P7 to P9 metres.

    metrics: what else was measured, by name with its unit, for the JSON.
    """

    scene: str
    code: str
    setting: str
    elements: int
    dt_s: float
    error_tension: float
    error_position: float
    cpu_s_per_sim_s: float
    us_per_element_iteration: float | None
    iterations_per_step: float | None
    note: str = ""
    metrics: dict[str, float] = {}
