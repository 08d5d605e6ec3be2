"""How often the band holds the truth: twins drawn from the same ranges, or from outside, under the same inputs.

Several ensembles, each with a seed of its own, are set against twins of their own. The share inside is taken of all
their moments, and the interval from the ensembles, which are independent. Moments of one tow are not.

Picture of an ensemble over a recording: tension, depth and layback of the tow in their band.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from ...plots.run import canvas
from ...sim.scene import Scene
from .copies import FIGURES, Ensemble, EnsembleEnded, band_of, level_of
from .limits import MAX_SEED
from .plan import NOMINAL, OUTSIDE, EnsembleError, EnsemblePlan, draw_of
from .recording import follow_recording

OURS, BAND, MIDDLE = "#0b3c5d", "#a6c8e0", "#5c6873"

ENSEMBLES = 6  # that twins are shared among
TWIN = 1_000_000  # number of the first twin: that of no copy
APART = 1000  # between the first seeds of the ensembles of one seed and of the next


def plot(
    path: Path,
    title: str,
    seconds: np.ndarray,
    panels: list[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]],
    level: float,
) -> Path:
    """Draw it. panels: name with unit, and low, median, high, recorded over ``seconds``; level: share that the band
    holds. RuntimeError where matplotlib is missing."""
    with canvas(path, (15.0, 3.4 * len(panels)), title, "perturbed copies of the tow") as figure:
        axes = np.atleast_1d(figure.subplots(len(panels), 1, sharex=True))
        for axis, (name, low, median, high, tow) in zip(axes, panels, strict=True):
            axis.fill_between(seconds, low, high, color=BAND, label=f"band, {100.0 * level:.3g} %")
            axis.plot(seconds, median, color=MIDDLE, lw=1.0, ls="--", label="median of the copies")
            axis.plot(seconds, tow, color=OURS, lw=2.0, label="recorded")
            axis.set_ylabel(name)
        axes[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
        axes[-1].set_xlabel("time [s]")
    return path


def outside_of(words: tuple[str, ...]) -> dict[str, float]:
    """Values of a Draw from texts NAME=VALUE. Raises EnsembleError."""
    found: dict[str, float] = {}
    for word in words:
        name, _, text = word.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if name not in OUTSIDE or not np.isfinite(value) or (name == "drag" and not 0.1 <= value <= 10.0):
            raise EnsembleError(
                [
                    f"--outside {word}: is none of {', '.join(OUTSIDE)} with a finite number (drag: a factor from 0.1 "
                    "to 10, speed, east, north: m/s, turn_deg: deg, payout: m); nothing was simulated. Give for "
                    "example --outside drag=1.5"
                ]
            )
        found[name] = value
    return found


def seed_of(seed: int, group: int) -> int:
    """Seed of an ensemble and of its twins; seed: of the file or of ``--seed``."""
    return (APART * seed + group) % (MAX_SEED + 1)


def covered(
    path: str | os.PathLike,
    scene: Scene,
    plan: EnsemblePlan,
    twins: int,
    outside: Mapping[str, float] = {},
    progress: Callable[[str, float, float], None] = lambda *_: None,
) -> dict[str, Any]:
    """Coverage of the band over the inputs of a recording, by figure. outside: what is set of the draws of a second
    set of twins.

    Raises EnsembleEnded, BagError.
    """
    groups = min(ENSEMBLES, twins)
    sets: list[dict[str, Any]] = [{}, dict(outside)] if outside else [{}]
    shares: list[list[np.ndarray]] = [[] for _ in sets]
    members = plan.copies
    for group in range(groups):
        progress("twins", group * twins / groups, twins)
        seeded = plan.model_copy(update={"seed": seed_of(plan.seed, group)})
        own = range(TWIN + group, TWIN + twins, groups)
        drawn = [draw_of(seeded, number) for number in range(1, plan.copies + 1)]
        for values in sets:
            drawn += [draw_of(seeded, number)._replace(**values) for number in own]
        ensemble = Ensemble(scene, seeded, draws=[NOMINAL, *drawn])
        one = follow_recording(path, scene, seeded, ensemble)
        if ensemble.lost:
            raise EnsembleEnded(
                f"copy {ensemble.lost[0].number} ({ensemble.lost[0].draw}) was given up: {ensemble.lost[0].why}; no "
                "coverage is told. Narrow the ranges"
            )
        band = band_of((one.time, one.nominal), list(one.values[: plan.copies]))
        for k, found in enumerate(shares):
            first = plan.copies + k * len(own)
            theirs = one.values[first : first + len(own)]
            inside = (theirs >= band.low) & (theirs <= band.high)
            found.append(inside[:, one.counted].mean(axis=(0, 1)))
    told: dict[str, Any] = {"twins": twins, "ensembles": groups, "copies": members, "expected": level_of(members)}
    told["drawn"] = _told(shares[0])
    if outside:
        told |= {"outside": dict(outside), "set_outside": _told(shares[1])}
    return told


def _told(shares: list[np.ndarray]) -> dict[str, Any]:
    """Of each figure: share of time and twins inside, mean over the ensembles, and its 95 % interval by Student's t."""
    rows, groups = np.array(shares), len(shares)
    mean = rows.mean(axis=0)
    half = stats.t.ppf(0.975, groups - 1) * rows.std(axis=0, ddof=1) / np.sqrt(groups)
    return {
        name: {"share": float(m), "low": float(max(m - h, 0.0)), "high": float(min(m + h, 1.0))}
        for name, m, h in zip(FIGURES, mean, half, strict=True)
    }
