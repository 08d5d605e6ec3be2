"""Picture of strumming: how the cable of a run strums along its length, and what that does to its drag."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io.recordings.recorded_run import RecordedRun
from ..physics.tick_output import STRUM_COLUMNS
from ..runs.summary import after_start
from .heading import put_heading
from .run import PURPLE, draw_run, sheet
from .side import BLUE, FAINT, ORANGE, WATER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN = {name: k for k, (name, _) in enumerate(STRUM_COLUMNS)}
PANELS = (  # column, title, label of its axis, colour
    ("amplitude", "Amplitude of the antinodes", "A / diameter", BLUE),
    ("amplification", "Drag factor in force", "drag / drag at rest", ORANGE),
    ("shedding_frequency", "Shedding frequency", "frequency [Hz]", PURPLE),
    ("normal_speed", "Mean flow across the cable", "normal speed [m/s]", "#2a8a5e"),
)


def draw_strum(run: RecordedRun | str | os.PathLike, out: str | os.PathLike, **asked: Any) -> Path:
    """Draw the strumming of a run to an image file and return its path. Arguments and errors as `draw_run`; ValueError
    where the run has no channel cable/strum."""
    return draw_run(run, out, make=compose, **asked)


def outboard(run: RecordedRun, skip_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Distance along the cable from the sheave [m] of every node outboard of it, and strumming [messages, nodes,
    STRUM_COLUMNS] after the start-up."""
    if not run.strums:
        raise ValueError("the run has no channel cable/strum: nothing was drawn; record it with viv.law other than off")
    start = after_start(run.frames, skip_s)[0]["time"][0]
    tables = np.array([table for time, table in run.strums if time >= start] or [run.strums[-1][1]])
    xyz = tables.mean(axis=0)[:, :3]
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(xyz, axis=0), axis=1))))
    distance = along - along[-1] + float(run.frames["scope"][-1])
    keep = distance >= 0.0
    return distance[keep], tables[:, keep]


def compose(run: RecordedRun, title: str, skip_s: float, stamp: str = "") -> Figure:
    """The matplotlib Figure; see `run.compose`."""
    figure = sheet()
    figure.subplots_adjust(left=0.075, right=0.965, top=0.84, bottom=0.2, wspace=0.24, hspace=0.46)
    distance, tables = outboard(run, skip_s)
    for axes, panel in zip(figure.subplots(2, 2).flat, PANELS, strict=True):
        along_cable(axes, distance, tables, *panel)
    modes = tables[..., COLUMN["mode"]]
    strumming = modes > 0.0
    put_heading(figure, run, f"{title}: strumming", stamp)
    said = "Nothing strums."
    if strumming.any():
        factor = tables[..., COLUMN["amplification"]]
        low, high = sorted((modes[strumming].min(), modes[strumming].max()))
        frequencies = tables[..., COLUMN["shedding_frequency"]][strumming]
        said = (
            f"Modes {low:.0f} to {high:.0f} of the span from the sheave to the towbody, {frequencies.min():.3g} to "
            f"{frequencies.max():.3g} Hz. Drag factor where the cable strums {factor[strumming].mean():.2f} on "
            "average. Line: mean over the run, band: least to largest. Blue ground: in the water."
        )
    figure.text(0.075, 0.045, "\n".join(textwrap.wrap(said, 132)), size=11, linespacing=1.4, va="bottom")
    return figure


def along_cable(axes: Axes, x: np.ndarray, tables: np.ndarray, name: str, title: str, label: str, color: str) -> None:
    """One column against the distance from the sheave: mean and band. A value holds from its node to the next."""
    values = tables[..., COLUMN[name]]
    axes.set(title=title, xlabel="along the cable, from the sheave [m]", ylabel=label)
    wet = tables[:, :, 2].mean(axis=0) < 0.0
    if wet.any():
        axes.axvspan(x[wet.argmax()], x[-1], color=WATER, alpha=0.18, lw=0, zorder=0)
    axes.fill_between(x, values.min(axis=0), values.max(axis=0), step="post", color=color, alpha=0.25, lw=0)
    axes.step(x, values.mean(axis=0), where="post", color=color, lw=2)
    minimum = 1.0 if name == "amplification" else 0.0
    axes.axhline(minimum, color=FAINT, lw=0.8)
    high = max(values.max() - minimum, 0.1)
    axes.set(xlim=(x[0], x[-1]), ylim=(minimum - 0.04 * high, minimum + 1.12 * high))
