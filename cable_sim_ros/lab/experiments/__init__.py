"""Experiments of the source documents: what was measured, what the product gives, what is allowed and who says so."""

from __future__ import annotations

from collections.abc import Callable
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


class Result(NamedTuple):
    experiment: str
    rows: list[Comparison]
    choices: list[dict]  # what had to be chosen, and what choosing otherwise changes
    plot: Callable[[Path], Path]


def run(name: str, duration: float | None, progress=lambda *_: None) -> Result:
    """Run one experiment; duration: s, None: its own. Raises KeyError for an unknown name."""
    return EXPERIMENTS[name](duration, progress)


def _pulley(duration: float | None, progress) -> Result:
    from . import pulley

    return pulley.experiment(duration, progress)


def _turbulence(duration: float | None, progress) -> Result:
    from . import turbulence

    return turbulence.experiment(duration, progress)


EXPERIMENTS: dict[str, Callable] = {"pulley": _pulley, "turbulence": _turbulence}
