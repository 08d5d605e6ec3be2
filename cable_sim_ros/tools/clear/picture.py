"""Picture of a shoal ahead: the ground, the towbody's way held and with each action, and by when that must begin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...plots.run import canvas
from .advice import Passage

GROUND, HELD = "#8c6d46", "#5c6873"
COLOURS = {"haul": "#0b3c5d", "speed": "#1a9850", "both": "#c23b33"}


def plot(passage: Passage, report: dict[str, Any], path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    itself = passage.copies["itself"]
    title = f"{report['scene']}: {report['answer'].partition(':')[0]}"
    with canvas(path, (14.0, 7.0), title, "docs/clear.md") as figure:
        axis = figure.subplots()
        ground = passage.profile
        bottom = 1.1 * max(float(ground.depth.max()), passage.depth)
        shown = np.unique(np.concatenate([ground.distance, 0.5 * (ground.gaps[:, 0] + ground.gaps[:, 1])]))
        depth = ground.ground(shown)
        axis.fill_between(shown, np.where(np.isfinite(depth), depth, np.nan), bottom, color=GROUND, label="ground")
        held_depth, held_place = passage.track(itself, None, 0.0, 0.0, None)
        axis.plot(held_place, held_depth, color=HELD, ls="--", lw=2, label="held as it is")
        taken = 0.0 if report["held"] is None else report["held"]["allowance_m"] + passage.margin
        label = "not known and margin"
        axis.fill_between(held_place, held_depth, held_depth + taken, color=HELD, alpha=0.15, label=label)
        for way in report["ways"]:
            if not way["clears"]:
                continue
            depth, place = passage.track(itself, way["way"], way["share"], way["begin_by_s"], way["let_out_from_s"])
            colour, begin = COLOURS[way["way"]], way["begin_by_s"]
            axis.plot(place, depth, color=colour, lw=2.5, label=f"{way['way']}, begun by {begin:.0f} s")
            axis.plot(np.interp(begin, passage.t, place), np.interp(begin, passage.t, depth), "o", color=colour, ms=9)
        axis.set_xlim(passage.behind, float(max(held_place[-1], ground.distance[0])))
        axis.set_ylim(bottom, 0.0)
        axis.set_xlabel("ahead of the ship as it is now [m]")
        axis.set_ylabel("depth [m]")
        axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return path
