"""Picture of measured tows: depth predicted with its interval against measured, and errors of the ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plots.canvas import canvas
from .tows import Judged

HELD, OUT, OTHER = "#0b3c5d", "#c23b33", "#7f7f7f"


def draw(judged: Judged, path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    depth = np.array([tow.depth for tow in judged.table.tows])
    known = np.isfinite(depth)
    measured, (low, mid, high) = depth[known], judged.left_out[known].T
    inside = (measured >= low) & (measured <= high)
    title = f"{judged.made.tows}: {known.sum()} tows, each by a fit without its group"
    with canvas(path, (12.0, 6.2), title, "`cable-sim tows`, docs/tows.md") as figure:
        against, ways = figure.subplots(1, 2, width_ratios=(3, 2))
        end = 1.05 * max(measured.max(), mid.max())
        against.plot([0.0, end], [0.0, end], color=OTHER, lw=1)
        for rows, color, label in ((inside, HELD, "within 90 % interval"), (~inside, OUT, "outside")):
            against.errorbar(
                measured[rows],
                mid[rows],
                yerr=(mid[rows] - low[rows], high[rows] - mid[rows]),
                fmt="o",
                ms=4,
                lw=1,
                color=color,
                alpha=0.7,
                label=f"{label}: {rows.sum()}",
            )
        against.set_xlabel("measured depth [m]")
        against.set_ylabel("predicted depth [m]")
        against.set_xlim(0.0, end)
        against.set_ylim(0.0, None)
        against.legend(frameon=False, loc="lower right")
        names = [f"{one.way} ({one.tows})" for one in judged.ways][::-1]
        places = np.arange(len(names))
        ways.barh(places + 0.2, [100 * one.spread for one in judged.ways][::-1], 0.35, color=HELD, label="spread")
        ways.barh(
            places - 0.2, [100 * one.median for one in judged.ways][::-1], 0.35, color=OTHER, label="median error"
        )
        ways.set_yticks(places, names)
        ways.set_xlabel("error, share of depth [%]")
        ways.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return path
