"""Experiments of the source documents: what was measured, what the product gives, what is allowed and who says so."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import NamedTuple


class Comparison(NamedTuple):
    """One figure of an experiment. measured None: not printed in the source."""

    name: str
    unit: str
    ours: float
    measured: float | None
    allowed: float | None  # largest difference the source reports for its own model; None: not printed
    source: str
    why: str = ""  # what the difference comes from


class Result(NamedTuple):
    experiment: str
    rows: list[Comparison]
    choices: list[dict]  # what had to be chosen, and what choosing otherwise changes: key "choice", then figures
    plot: Callable[[Path], Path]
    chosen: str = "chosen otherwise: what changes"  # heading of the choices
    tables: Callable[[], list[str]] | None = None  # Markdown in place of the table of all rows


# each a module of this folder with experiment(duration, progress); duration: s, None: its own
EXPERIMENTS = (
    "pulley",
    "moving_pulley",
    "drag",
    "viv",
    "viv_tow",
    "wake",
    "segments",
    "turbulence",
    "drive",
    "load_cell",
    "layback",
)


def run(name: str, duration: float | None, progress=lambda *_: None) -> Result:
    """Run one experiment; duration: s, None: its own. Raises KeyError for an unknown name."""
    if name not in EXPERIMENTS:
        raise KeyError(name)
    return import_module(f".{name}", __name__).experiment(duration, progress)
