"""Picture of a haul: cable at several times, tension, depth and layback, scope and rate, nodes along the cable."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io.recordings.recorded_run import RecordedRun
from ..io.scenes.winch_plan import WinchPlan
from ..runs.summary import extremes
from .heading import force_unit, places, put_heading
from .run import PURPLE, beside, draw_run, min_span, seconds, sheet, twin
from .side import BLUE, FAINT, INK, ORANGE, PAD, cable_curves, fit, frames_of_shapes, put_note, ship_and_water

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GREEN = "#2a8a5e"
SHAPES = 7  # at most, side by side
MAX_LINES = 1200  # times at which the nodes are drawn
LINEAR = 10.0  # m either side of the sheave; logarithmic beyond
RATE_OVER = 1.0  # s of the mean of the rate: waves and steps of a tick are not what a haul is about
MIN_SPANS = {"tension": 0.02, "depth": 0.2, "rate": 0.1}  # share, m, m/s: what hardly moves shall look so


def draw_haul(run: RecordedRun | str | os.PathLike, out: str | os.PathLike, **asked: Any) -> Path:
    """Draw the haul of a run to an image file and return its path. Arguments and errors as `draw_run`."""
    return draw_run(run, out, make=compose, **asked)


def compose(run: RecordedRun, title: str, skip_s: float = 0.0, stamp: str = "") -> Figure:
    """The matplotlib Figure of a haul, which has no start-up: the whole of it is drawn."""
    figure = sheet()
    columns = figure.add_gridspec(1, 2, left=0.085, right=0.925, top=0.84, bottom=0.175, wspace=0.46)
    left, right = columns[0].subgridspec(2, 1, hspace=0.46), columns[1].subgridspec(3, 1, hspace=0.75)
    shapes(figure.add_subplot(left[0]), run)
    nodes(figure.add_subplot(left[1]), run)
    tension(figure.add_subplot(right[0]), run)
    depth(figure.add_subplot(right[1]), run)
    lengths(figure.add_subplot(right[2]), run)
    figure.text(0.085, 0.045, caption(run), size=11, linespacing=1.4, va="bottom")
    put_heading(figure, run, title, stamp)
    return figure


def caption(run: RecordedRun) -> str:
    """Least and largest of the haul."""
    s, f = extremes(run.frames), run.frames
    minimum = np.fmin(f["tension"], f["tension_tick_min"]).min()
    maximum = np.fmax(f["tension"], f["tension_tick_max"]).max()
    factor, unit = force_unit(np.array([maximum]))
    digits = places(factor * maximum)

    def span(name: str) -> str:
        low, high = s[f"{name}_min_m"], s[f"{name}_max_m"]
        return "not recorded" if low is None or high is None else f"{low:.1f} to {high:.1f} m"

    text = (
        f"Whole run: scope {span('scope')}, towbody {span('body_depth')} deep, layback {span('layback')}, tension at "
        f"the sheave {factor * minimum:.{digits}f} to {factor * maximum:.{digits}f} {unit}, "
        f"cable on the drum {span('cable_on_drum')}."
    )
    return textwrap.fill(text, 132)


def shapes(axes: Axes, run: RecordedRun) -> None:
    """Cable from the side at up to SHAPES times, evenly apart; sheave at 0."""
    import matplotlib

    axes.set(title="Cable from the side", xlabel="along the tow, from the sheave [m]", ylabel="height above water [m]")
    if not run.shapes:
        return
    frames, curves = frames_of_shapes(run), cable_curves(run)
    chosen = np.unique(np.linspace(0, len(frames) - 1, SHAPES).round().astype(int))
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, len(chosen)))
    begin = run.frames["time"][0]
    for k, colour in zip(chosen, colours):
        when = (frames[k]["time"] - begin) * 1e-9
        axes.plot(*curves[k].T, color=colour, lw=2, label=f"{when:.0f} s, {frames[k]['scope']:.4g} m")
        axes.plot(*curves[k][-1], "D", color=colour, ms=7, zorder=4)
    points = np.vstack([*(curves[k] for k in chosen), (0.0, 0.0), (0.0, frames[-1]["sheave_position"][2])])
    scale, note = fit(axes, points, (PAD[3], PAD[1], PAD[3], PAD[3]))
    put_note(axes, note)
    ship_and_water(axes, run, curves[-1], scale)
    # beside the panel, not over the ship
    axes.legend(title="time, scope", fontsize=9.5, loc="upper left", bbox_to_anchor=(1.0, 1.08), handlelength=1.0)


def nodes(axes: Axes, run: RecordedRun) -> None:
    """Every node's unstretched length past the sheave over time: how the elements share the cable."""
    from matplotlib.collections import LineCollection

    axes.set(title="Nodes along the cable", ylabel="past the sheave [m]")
    axes.set_yscale("symlog", linthresh=LINEAR)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    if not run.shapes:
        _times(axes, run)
        return
    every = max(1, len(run.shapes) // MAX_LINES)
    frames, tables = frames_of_shapes(run)[::every], [table for _, table in run.shapes[::every]]
    time = (frames["time"] - run.frames["time"][0]) * 1e-9
    scope = np.nan_to_num(frames["scope"])
    past = scope[:, None] - np.array([table[-1, 4] - table[:, 4] for table in tables])
    lines = [np.column_stack([time, column]) for column in past.T]
    axes.add_collection(LineCollection(lines, colors=FAINT, lw=0.5))
    axes.plot(time, past[:, -1], color=ORANGE, lw=2)
    axes.plot(time, scope - frames["payout"], color=PURPLE, lw=2)
    axes.axhline(0.0, color=INK, lw=1.5)
    top = 1.6 * max(past.max(), LINEAR)
    axes.set_ylim(min(past.min(), -1.0) * 1.15, top)
    for name, y, colour in (("towbody", past[-1, -1], ORANGE), ("sheave", 0.0, INK), ("drum", past[-1, -1], PURPLE)):
        y = scope[-1] - frames["payout"][-1] if name == "drum" else y
        beside(axes, name, y, 5, colour)
    _times(axes, run)


def _times(axes: Axes, run: RecordedRun) -> None:
    """Time axis with the items of the plan."""
    end = max(seconds(run)[-1], 1e-3)
    axes.set(xlim=(0, end), xlabel="time [s]")
    plan = run.custom_data.get("winch_plan")
    for item in WinchPlan(plan).items if plan else ():
        if 0.0 < item.time < end:
            axes.axvline(item.time, color=FAINT, lw=1, ls=(0, (2, 3)))


def tension(axes: Axes, run: RecordedRun) -> None:
    """Tension at the sheave and at the towbody over time."""
    factor, unit = force_unit(run.frames["tension"])
    axes.set(title="Tension", ylabel=f"tension [{unit}]")
    axes.plot(seconds(run), factor * run.frames["tension"], color=BLUE, lw=1.2, label="at the sheave")
    axes.plot(seconds(run), factor * run.frames["tension_body"], color=ORANGE, lw=1.0, label="at the towbody")
    min_span(axes, MIN_SPANS["tension"] * factor * abs(run.frames["tension"].mean()))
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, fontsize=11, borderaxespad=0.2)
    _times(axes, run)


def depth(axes: Axes, run: RecordedRun) -> None:
    """Depth of the towbody on the left axis, layback on the right one."""
    axes.set_title("Towbody depth and layback")
    axes.plot(seconds(run), -run.frames["body_position"][:, 2], color=ORANGE, lw=1.6)
    min_span(axes, MIN_SPANS["depth"])
    axes.invert_yaxis()
    layback = seconds(run), run.frames["layback"]
    twin(axes, ("depth [m]", ORANGE), ("layback [m]", GREEN), layback, MIN_SPANS["depth"])
    _times(axes, run)


def lengths(axes: Axes, run: RecordedRun) -> None:
    """Scope on the left axis, rate of pay-out on the right one."""
    axes.set_title("Scope and rate of pay-out")
    time = seconds(run)
    axes.plot(time, run.frames["scope"], color=PURPLE, lw=1.8, zorder=3)
    min_span(axes, MIN_SPANS["depth"])
    half = round(0.5 * RATE_OVER / max(float(np.median(np.diff(time))), 1e-6)) if len(time) > 1 else 0
    total = np.concatenate(([0.0], np.cumsum(run.frames["payout_rate"])))
    index = np.arange(len(time))
    first, last = np.maximum(index - half, 0), np.minimum(index + half + 1, len(time))
    rate = (total[last] - total[first]) / (last - first)
    twin(axes, ("scope [m]", PURPLE), ("rate out [m/s]", BLUE), (time, rate), MIN_SPANS["rate"])
    _times(axes, run)
