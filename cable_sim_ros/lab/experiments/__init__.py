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
    why: str = ""  # what the difference comes from


class Result(NamedTuple):
    experiment: str
    rows: list[Comparison]
    choices: list[dict]  # what had to be chosen, and what choosing otherwise changes: key "choice", then figures
    plot: Callable[[Path], Path]
    chosen: str = "chosen otherwise: what changes"  # heading of the choices


def run(name: str, duration: float, progress=lambda *_: None) -> Result:
    """Run one experiment. Raises KeyError for an unknown name."""
    return EXPERIMENTS[name](duration, progress)


def _pulley(duration: float, progress) -> Result:
    from . import pulley

    return pulley.experiment(duration, progress)


def _segments(duration: float, progress) -> Result:
    from . import segments

    return segments.experiment(duration, progress)


def _viv(duration: float, progress) -> Result:
    from . import viv

    return viv.experiment(progress)


def _viv_tow(duration: float, progress) -> Result:
    from . import viv_tow

    return viv_tow.experiment(duration, progress)


def _wake(duration: float, progress) -> Result:
    from . import wake

    return wake.experiment(progress)


EXPERIMENTS: dict[str, Callable] = {
    "pulley": _pulley,
    "viv": _viv,
    "viv_tow": _viv_tow,
    "wake": _wake,
    "segments": _segments,
}
