"""Limits that scores must keep: a checked YAML file, and what is violated. What could not be scored fails."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from ...io.scenes.document import Document, SceneError
from ...physics.parameter import REQUIRED, Block, quantity
from ...sim.problem import Problem
from ..logs.own_signals import QUANTITIES
from .score import FIGURES, Score

EXAMPLE = "limits: my tow"
Range = tuple[float, float]


class LimitsError(SceneError):
    """A file of limits that cannot be used; every problem in one text each."""


class QuantityLimits(Block):
    bias: float | None = quantity(None, "unit of the quantity", 0.0, None, "magnitude of the mean of B less A, at most")
    rms: float | None = quantity(None, "unit of the quantity", 0.0, None, "rms of B less A, at most")
    largest: float | None = quantity(None, "unit of the quantity", 0.0, None, "magnitude of B less A, at most")
    normalised_rms: float | None = quantity(None, "1", 0.0, None, "rms over the deviation of A, at most")
    lag: float | None = quantity(None, "s", 0.0, None, "magnitude of the lag in the waves, at most")
    correlation: float | None = quantity(None, "1", -1.0, 1.0, "of A and B, at least")
    coherence: float | None = quantity(None, "1", 0.0, 1.0, "squared, in the wave band, at least")
    gain: Range | None = quantity(None, "1", None, None, "B over A about their means, from and to")
    spectrum_ratio: Range | None = quantity(None, "1", 0.0, None, "variance in the wave band, B over A, from and to")
    peak_ratio: Range | None = quantity(None, "1", 0.0, None, "largest double amplitude, B over A, from and to")
    peak_ratio_95: Range | None = quantity(None, "1", 0.0, None, "95 % quantile of them, B over A, from and to")
    damage_ratio: Range | None = quantity(None, "1", 0.0, None, "damage-equivalent range, B over A, from and to")


class Limits(Block):
    limits: str = quantity(REQUIRED, "", None, None, "name of these limits")
    quantities: dict[str, QuantityLimits] = quantity(REQUIRED, "", None, None, "limits by quantity")


LEAST = {"correlation", "coherence"}  # the others are at most, or from and to
FIGURE = {"lag": "lag_s"}  # of the limits whose figure has another name
MAGNITUDE = {"bias", "lag"}


class Judged(NamedTuple):
    """A limit and what was found: passed, and one line on it."""

    quantity: str
    limit: str
    value: float | None
    passed: bool
    text: str


def _problems(given: Limits) -> list[Problem]:
    found = []
    if not given.quantities:
        found.append(Problem("quantities", "has none: nothing would be judged", "Give one, docs/compare.md"))
    for name, block in given.quantities.items():
        key = f"quantities.{name}"
        if name not in QUANTITIES:
            found.append(Problem(key, "is no quantity", f"Give one of {', '.join(QUANTITIES)}"))
        elif not block.model_fields_set:
            found.append(Problem(key, "has no limit: it would pass whatever it is", "Give one, docs/compare.md"))
        for limit in sorted(block.model_fields_set):
            value = getattr(block, limit)
            if value is None:
                found.append(Problem(f"{key}.{limit}", "= null limits nothing", "Give a value, or leave it out"))
            elif isinstance(value, tuple) and value[0] > value[1]:
                text = f"= [{value[0]:g}, {value[1]:g}] is upside down: nothing would pass"
                found.append(Problem(f"{key}.{limit}", text, "Give the lower value first"))
    return found


FILES = Document(Limits, "a file of limits", "file of limits", EXAMPLE, Path, list, _problems, error=LimitsError)


def load_limits(path: str | os.PathLike) -> Limits:
    """Limits of a YAML file. Raises LimitsError with every problem of it."""
    return FILES.load(path)


def judge(given: Limits, scores: list[Score]) -> list[Judged]:
    """Every limit, in the order of the file."""
    table = {score.quantity: score for score in scores}
    out = []
    for name, block in given.quantities.items():
        for limit in [one for one in type(block).model_fields if one in block.model_fields_set]:
            out.append(_judged(name, limit, getattr(block, limit), table.get(name)))
    return out


def _judged(name: str, limit: str, bound: float | Range, score: Score | None) -> Judged:
    figure = FIGURE.get(limit, limit)
    value = None if score is None else score.figures.get(figure)
    unit = FIGURES[figure].unit.replace("q", QUANTITIES[name].unit)
    unit = "" if unit == "1" else f" {unit}"
    if value is None:
        why = "not in both of the two" if score is None else "; ".join(score.notes) or "it cannot be told"
        return Judged(name, limit, None, False, f"{name}.{limit}: not scored ({why}); what is not scored fails")
    size = abs(value) if limit in MAGNITUDE else value
    if isinstance(bound, tuple):
        passed, told = bound[0] <= value <= bound[1], f"[{bound[0]:g}, {bound[1]:g}]{unit}"
    elif limit in LEAST:
        passed, told = value >= bound, f"at least {bound:g}{unit}"
    else:
        passed, told = size <= bound, f"at most {bound:g}{unit}"
    interval = score.intervals.get(figure) if score is not None else None
    known = f", 95 % interval [{interval[0]:.5g}, {interval[1]:.5g}]" if interval else ""
    return Judged(name, limit, value, passed, f"{name}.{limit} = {value:.6g}{unit}{known}; allowed: {told}")
