"""A line of the benchmark table, and the machine and versions that belong to its figures."""

from __future__ import annotations

import math
import platform
import time
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np

from cable_sim_ros.version import __version__

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


def unrun(scene: str, code: str, setting: str, why: str) -> Row:
    """The line of what did not run."""
    return Row(scene, code, setting, 0, 0.0, math.nan, math.nan, math.nan, None, None, why)


def about() -> dict[str, str]:
    """Machine and versions that belong to the figures."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return {
        "machine": next(models, platform.processor() if lines else ""),
        "threads": "1",
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
        "cable_sim_ros": __version__,
        "date": time.strftime("%Y-%m-%d"),
    }
