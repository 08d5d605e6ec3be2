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
    "table": ("look-up table", "#c51b7d", "-"),
    "static": ("static tow", "#2166ac", "--"),
}
OURS, BAND, SHIP = "#0b3c5d", "#a6c8e0", "#b8bec4"
MARKS, TINY = 13, 1e-9  # crosses; m
WIDE = ("pythagoras", "table")  # that others lie on
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

    return LineCollection(list(ends), colors=OURS, linewidths=3.0, label="95 % along, across")


def plot(one: Laid, path: Path, title: str, measured: bool) -> Path:
    """Draw it; title: scene and source. RuntimeError where matplotlib is missing."""
    s = one.samples
    minutes = (s.seconds - s.seconds[0]) / 60.0
    size = np.hypot(*(s.fish - s.sheave).T)
    with canvas(path, (14.0, 10.0), title, "ways: docs/layback.md") as figure:
        panels = figure.subplot_mosaic([["map", "layback"], ["map", "depth"]])
        top, away, deep = panels["map"], panels["layback"], panels["depth"]
        begin = s.sheave[0]
        top.plot(*(s.sheave - begin).T, color=SHIP, lw=5.0, label="sheave")
        for name, (label, colour, line) in NAMES.items():
            wide = 3.0 if name in WIDE else 1.5
            if name in ON_MAP:
                top.plot(*(one.places[name] - begin).T, color=colour, ls=line, lw=wide)
            if name != "catenary" and np.isfinite(one.places[name]).any():  # steeper by far, it would press the others
                there = np.hypot(*(one.places[name] - s.sheave).T)
                away.plot(minutes, there, color=colour, ls=line, lw=wide, label=label)
        top.plot(*(s.fish - begin).T, color=OURS, lw=1.5)
        top.add_collection(_crosses(one, begin))
        top.set(title="From above", xlabel="east [m]", ylabel="north [m]")
        top.set_aspect("equal", adjustable="datalim")
        away.fill_between(minutes, size - one.band[:, 0], size + one.band[:, 0], color=BAND, lw=0.0, label="95 %")
        away.plot(minutes, size, color=OURS, lw=2.5, label="simulated")
        deep.fill_between(minutes, s.fish_depth - one.band[:, 3], s.fish_depth + one.band[:, 3], color=BAND, lw=0.0)
        deep.plot(minutes, s.fish_depth, color=OURS, lw=2.5)
        away.set(title="Layback from the sheave", ylabel="layback [m]")
        away.tick_params(labelbottom=False)
        if measured:
            deep.plot(minutes, s.depth, color="#c23b33", lw=1.5, ls=":", label="depth, measured")
        deep.set(title="Depth", xlabel="time [min]", ylabel="depth [m]")
        deep.invert_yaxis()
        figure.legend(loc="outside lower center", ncols=6)
    return path
