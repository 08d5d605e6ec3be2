"""Picture of a layback: tracks from above, layback with its interval, depth beside the measured one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...plots.run import canvas

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection

    from .laid import Laid

NAMES = {
    "pythagoras": ("Pythagoras", "#e08214", "-"),
    "factor": ("factor", "#8c6bb1", "-"),
    "follow_dog": ("follow the dog", "#1a9850", "-"),
    "along_track": ("along the track", "#d73027", "-"),
    "catenary": ("catenary, weights", "#b35806", ":"),
    "catenary_of_depth": ("catenary, depth", "#7f7f7f", "--"),
    "table": ("table", "#c51b7d", "--"),
    "static": ("static tow", "#2166ac", "--"),
}
OURS, BAND, SHIP = "#0b3c5d", "#a6c8e0", "#222222"
MARKS, TINY = 13, 1e-9  # crosses; m
ON_MAP = ("pythagoras", "follow_dog", "along_track", "static")


def _crosses(one: Laid, begin: np.ndarray) -> LineCollection:
    """The interval along and across the layback, about the towbody, as MARKS crosses over the run."""
    rows = np.linspace(0, len(one.samples.fish) - 1, MARKS).astype(int)
    at, lead = one.samples.fish[rows] - begin, (one.samples.fish - one.samples.sheave)[rows]
    along = lead / np.maximum(np.hypot(*lead.T), TINY)[:, None]
    across = np.column_stack((-along[:, 1], along[:, 0]))
    arms = [axis * one.band[rows, k][:, None] for k, axis in ((1, along), (2, across))]
    ends = np.concatenate([np.stack((at - arm, at + arm), axis=1) for arm in arms])
    from matplotlib.collections import LineCollection

    return LineCollection(list(ends), colors=OURS, linewidths=1.5, label="its 95 % interval")


def plot(one: Laid, path: Path, title: str, measured: bool) -> Path:
    """Draw it; title: scene and source. RuntimeError where matplotlib is missing."""
    s = one.samples
    minutes = (s.seconds - s.seconds[0]) / 60.0
    size = np.hypot(*(s.fish - s.sheave).T)
    with canvas(path, (14.0, 10.0), title, "ways: docs/layback.md") as figure:
        top, below = figure.subplots(2, 1, height_ratios=(3, 2))
        top.set_title("From above: sheave and towbody")
        begin = s.sheave[0]
        top.plot(*(s.sheave - begin).T, color=SHIP, lw=2, label="sheave")
        for name in ON_MAP:
            label, colour, line = NAMES[name]
            top.plot(*(one.places[name] - begin).T, color=colour, ls=line, lw=1.5, label=label)
        top.plot(*(s.fish - begin).T, color=OURS, lw=2.5, label="simulated")
        top.add_collection(_crosses(one, begin))
        top.set_xlabel("east [m]")
        top.set_ylabel("north [m]")
        top.set_aspect("equal", adjustable="datalim")
        top.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
        below.set_title("Layback from the sheave, with its 95 % interval, and depth")
        below.fill_between(minutes, size - one.band[:, 0], size + one.band[:, 0], color=BAND, label="95 %")
        for name, (label, colour, line) in NAMES.items():
            if name != "catenary" and np.isfinite(one.places[name]).any():  # steeper by far, it would press the others
                there = np.hypot(*(one.places[name] - s.sheave).T)
                below.plot(minutes, there, color=colour, ls=line, lw=1.5, label=label)
        below.plot(minutes, size, color=OURS, lw=2.5, label="simulated")
        below.plot(minutes, s.fish_depth, color=OURS, lw=1.5, ls="-.", label="depth, simulated")
        if measured:
            below.plot(minutes, s.depth, color="#c23b33", lw=1.5, ls=":", label="depth, measured")
        below.set_xlabel("time [min]")
        below.set_ylabel("layback, depth [m]")
        below.set_ylim(bottom=0.0)
        below.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return path
