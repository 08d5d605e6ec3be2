"""The one score of an entrant on a track: the mean of four capped metrics over all cells of the track. Declared here
alone; the command prints what stands here, and ahc.json and docs/ahc.md have it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from typing import Any, NamedTuple

from ...sim.verdict import FAILED

Row = dict[str, Any]
Figures = dict[str, float]


class Metric(NamedTuple):
    """A part of the score: name, formula in words, and its value of the figures of a run and of its twin; 1 is best."""

    name: str
    formula: str
    of: Callable[[Figures, Figures], float]


def _left(name: str) -> Callable[[Figures, Figures], float]:
    return lambda run, twin: 1.0 - run[name] / twin[name] if twin[name] else 0.0


WAVE = 20.0 * pi  # rms speed of a wave of 10 s over its rms, times the 100 s that count; the same at every scale
METRICS = (
    Metric("tension", "1 - tension_std_n over that of the twin", _left("tension_std_n")),
    Metric("place", "1 - depth_rms_m over that of the twin", _left("depth_rms_m")),
    Metric(
        "energy",
        "1 - energy_j over 20 pi x tension_mean_n of the twin x input_rms_m: hauling at the rms speed of a 10 s wave",
        lambda run, twin: 1.0 - run["energy_j"] / (WAVE * twin["tension_mean_n"] * run["input_rms_m"]),
    ),
    Metric(
        "slack",
        "tension_min_n over tension_mean_n of the twin",
        lambda run, twin: run["tension_min_n"] / twin["tension_mean_n"],
    ),
)
RULES = (
    "capped to 0 and 1 each; the score is 100 x their mean over all cells",
    "a cell with a snap, a crash, no answer or a broken rule counts as 0, and so does one not run",
    "`hold` has 0 in tension and place, 1 in energy: a score below its own is worse than none",
)


def points(row: Row) -> dict[str, float] | None:
    """The capped metrics of a row; None where it is disqualified."""
    run, twin = row["figures"], row["twin"]
    if run is None or not twin or row["state"] == FAILED or run["snaps"]:
        return None
    return {one.name: min(1.0, max(0.0, one.of(run, twin))) for one in METRICS}


def score_of(rows: Sequence[Row]) -> dict[str, Any]:
    """Definition, and by entrant: score, mean of each metric, cells, those disqualified, and those not run."""
    found = {}
    for name in dict.fromkeys(row["entrant"] for row in rows):
        mine = [row for row in rows if row["entrant"] == name]
        all_points = [points(row) or dict.fromkeys((one.name for one in METRICS), 0.0) for row in mine]
        means = {one.name: sum(each[one.name] for each in all_points) / len(mine) for one in METRICS}
        found[name] = {
            "score": round(100.0 * sum(means.values()) / len(METRICS), 2),
            **{metric: round(mean, 4) for metric, mean in means.items()},
            "cells": len(mine),
            "disqualified": sum(row["figures"] is not None and points(row) is None for row in mine)
            + sum(row["state"] == FAILED for row in mine if row["figures"] is None),
            "not_run": sum(row["state"] != FAILED for row in mine if row["figures"] is None),
        }
    return {"definition": [*(f"{one.name}: {one.formula}" for one in METRICS), *RULES], "entrants": found}
