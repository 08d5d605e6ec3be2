"""Picture of a run: cable from the side, tension, towbody and sheave, load along the sheave."""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..io.recorded_run import RecordedRun, load_run, places_of
from ..physics.tick_output import CONTACT_COLUMNS
from ..runs.summary import SKIP, after_start, since_first, summarize, tow_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE = (16.0, 10.0)  # inches; 1600 x 1000 at 100 dots per inch
INK, FAINT = "#1b2733", "#8a949e"
BLUE, ORANGE, PURPLE, WATER = "#1f6fb2", "#d4651b", "#6a4c9c", "#9cc4e4"
STAMP_WIDTH = 75  # characters of a line
PORT, STARBOARD = "#c23b33", "#2a8a5e"  # as the side lights
COLUMN = {name: k for k, (name, _) in enumerate(CONTACT_COLUMNS)}
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 12,
    "axes.titlesize": 14,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 12,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": "#e3e7eb",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "axes.formatter.useoffset": False,
    "lines.solid_capstyle": "round",
}


def draw_run(
    run: RecordedRun | str | os.PathLike,
    out: str | os.PathLike,
    *,
    title: str | None = None,
    skip_s: float = SKIP,
    stamp: str = "",
) -> Path:
    """Draw a run to an image file and return its path.

    run: recording or path of a bag; out: file, its suffix says the format; title: scene name if not given;
    skip_s: start-up, shaded in the time series and left out of the figures; stamp: what a reader must know before any
    figure, "" if nothing. BagError if the bag has no run, RuntimeError if matplotlib is missing.
    """
    return render(run, out, lambda recorded: compose(recorded, title or scene_name(recorded), skip_s, stamp))


def scene_name(run: RecordedRun) -> str:
    """Title of a picture: the scene's name where the recording has it."""
    return run.custom_data.get("scene", "Cable tow")


def render(run: RecordedRun | str | os.PathLike, out: str | os.PathLike, make: Callable[[RecordedRun], Figure]) -> Path:
    """Save the Figure that ``make`` composes of a run; arguments and errors as `draw_run`."""
    try:
        import matplotlib
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no picture was drawn; install cable_sim_ros[viz]") from None
    run = run if isinstance(run, RecordedRun) else load_run(run)
    with matplotlib.rc_context(STYLE):
        metadata = {"Software": None} if Path(out).suffix == ".png" else None  # same run, same bytes
        make(run).savefig(out, metadata=metadata)
    return Path(out)


def compose(run: RecordedRun, title: str, skip_s: float, stamp: str = "") -> Figure:
    """The matplotlib Figure of a run; no pyplot, so no window system, no state, any thread."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE, dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, gridspec_kw={"width_ratios": [1.12, 1.0]})
    figure.subplots_adjust(left=0.065, right=0.945, top=0.875, bottom=0.17, wspace=0.27, hspace=0.36)
    side_view(panels[0, 0], run)
    tension(panels[0, 1], run, skip_s)
    heave(panels[1, 0], run, skip_s)
    contact(panels[1, 1], run, skip_s)
    figure.text(0.065, 0.945, title, size=20, weight="bold")
    figure.text(
        0.065, 0.025, "\n".join(textwrap.wrap(caption(run, skip_s), 172)), size=12, linespacing=1.5, va="bottom"
    )
    put_stamp(figure, stamp)
    return figure


def put_stamp(figure: Figure, stamp: str) -> None:
    """Write over the top right corner why the figures cannot be taken as they are; "" writes nothing."""
    if stamp:
        figure.text(
            0.945,
            0.957,
            textwrap.fill(stamp, STAMP_WIDTH, max_lines=2, placeholder=" ..."),
            size=13,
            weight="bold",
            color="white",
            ha="right",
            va="center",
            bbox={"boxstyle": "round,pad=0.5", "facecolor": PORT, "edgecolor": "none"},
        )


def caption(run: RecordedRun, skip_s: float) -> str:
    """Key figures of the run in a few sentences, numbers tied to their units."""
    s = summarize(run.frames, skip_s=skip_s)
    left_out = f", the first {s['skip_s']:.0f} s (grey) left out of these figures" if s["skip_s"] > 0.0 else ""
    if s["tension_std_n"] is None:
        body = (
            f"A haul, by {s['hauled_m']:.1f} m: scope {s['scope_start_m']:.1f} m to {s['scope_end_m']:.1f} m, towbody "
            f"{s['body_depth_start_m']:.1f} m to {s['body_depth_end_m']:.1f} m deep. "
        )
        spread = ""
    else:
        spread = f"{s['tension_std_n'] / 1e3:.3f} kN std, "
        body = (
            f"Towbody {s['body_depth_m']:.1f} m deep, std {s['body_depth_std_m']:.2f} m, "
            f"{-s['body_position_m'][0]:.1f} m astern of the sheave; "
            f"95 % ellipsoid {s['ellipsoid_volume_m3']:.3g} m³. "
        )
    text = (
        f"{s['duration_s']:.0f} s simulated{left_out}. "
        f"Tension at the sheave {s['tension_mean_n'] / 1e3:.2f} kN mean, {spread}"
        f"{s['tension_min_n'] / 1e3:.2f} to {s['tension_max_n'] / 1e3:.2f} kN. {body}"
        f"Sheave heave std {s['sheave_heave_std_m']:.2f} m. "
        f"Contact resultant {s['contact_resultant_mean_n'] / 1e3:.2f} kN mean, "
        f"wrap {s['wrap_angle_mean_deg']:.0f}° mean."
    )
    return re.sub(r"(?<=\d) (?=(s|kN|m|m³|%)\b)", "\u00a0", text)


def seconds(run: RecordedRun) -> np.ndarray:
    """Time of the tick outputs from the first one [s]."""
    return since_first(run.frames) * 1e-9


def side_view(axes: Axes, run: RecordedRun) -> None:
    """Cable at the end of the run, coloured by tension, earlier ones faint; sheave at 0, water surface, ship."""
    from matplotlib.collections import LineCollection

    axes.set_title("Cable from the side, end of the run")
    axes.set_xlabel("along the tow, from the sheave [m]")
    axes.set_ylabel("height above the water [m]")
    forward = tow_axes(run.frames)[0]
    frames = run.frames[places_of([time for time, _ in run.shapes], run.frames)]
    curves = [
        np.column_stack([(table[:, :2] - frame["sheave_position"][:2]) @ forward, table[:, 2]])
        for (_, table), frame in zip(run.shapes, frames)
    ]
    for curve in curves[:: max(1, len(curves) // 20)]:
        axes.plot(*curve.T, color=FAINT, lw=0.6, alpha=0.5)
    last = run.frames[-1]
    if curves:
        tension_kn = run.shapes[-1][1][:, 3] / 1e3
        points = curves[-1][:, None]
        line = LineCollection(
            np.concatenate([points[:-1], points[1:]], axis=1),
            cmap="viridis",
            lw=3,
            array=0.5 * (tension_kn[:-1] + tension_kn[1:]),
            capstyle="round",
        )
        axes.add_collection(line)
        bar = axes.figure.colorbar(line, ax=axes, pad=0.015, fraction=0.04)
        bar.set_label("tension [kN]")
        bar.outline.set_visible(False)
    body = np.array([(last["body_position"] - last["sheave_position"])[:2] @ forward, last["body_position"][2]])
    sheave = np.array([0.0, last["sheave_position"][2]])
    length = 2.0 * max((last["ship_position"] - last["sheave_position"])[:2] @ forward, 5.0)
    hull = np.array([[0.02, 0.05], [0.9, 0.06], [1.05, 0.10], [0.92, -0.07], [0.12, -0.07], [0.02, -0.02]]) * length
    axes.fill(*hull.T, color="#b4bcc4", zorder=2, lw=0)
    axes.annotate(
        "ship", (0.55 * length, 0.10 * length), xytext=(0, 5), textcoords="offset points", ha="center", color=FAINT
    )
    axes.axhline(0.0, color=WATER, lw=2, zorder=1)
    axes.plot(*sheave, "o", color=INK, ms=7, mfc="white", mew=2, zorder=4)
    axes.plot(*body, "D", color=ORANGE, ms=9, zorder=4)
    axes.annotate("towbody", body, xytext=(0, 12), textcoords="offset points", ha="center", color=ORANGE, weight="bold")
    axes.annotate("sheave", sheave, xytext=(-8, 9), textcoords="offset points", ha="right", weight="bold")
    axes.annotate(
        "water surface",
        (0.01, 0.0),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, -16),
        textcoords="offset points",
        color=BLUE,
    )
    axes.annotate(
        "tow direction",
        (0.99, 0.5),
        xycoords="axes fraction",
        xytext=(0.80, 0.5),
        va="center",
        ha="right",
        arrowprops={"arrowstyle": "->", "color": FAINT, "lw": 1.5},
        color=FAINT,
    )
    equal_scales(axes, (body[0], 1.05 * length), (body[1], 0.15 * length), margin=0.1)


def equal_scales(axes: Axes, x: tuple[float, float], y: tuple[float, float], margin: float) -> None:
    """Limits that show x and y with a margin, a metre as long across as up, without changing the panel."""
    box = axes.get_position()
    width, height = box.width * SIZE[0], box.height * SIZE[1]
    scale = (1 + 2 * margin) * max((x[1] - x[0]) / width, (y[1] - y[0]) / height)
    axes.set_xlim(np.mean(x) - 0.5 * scale * width, np.mean(x) + 0.5 * scale * width)
    axes.set_ylim(np.mean(y) - 0.5 * scale * height, np.mean(y) + 0.5 * scale * height)


def min_span(axes: Axes, span: float) -> None:
    """Widen the y axis to ``span``: what hardly moves shall look so."""
    low, high = axes.get_ylim()
    if high - low < span:
        axes.set_ylim(0.5 * (low + high - span), 0.5 * (low + high + span))


def _shade(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    skip = after_start(run.frames, skip_s)[1]
    axes.set_xlim(0, max(seconds(run)[-1], 1e-3))
    axes.axvspan(0, skip, color="#eef0f2", lw=0, zorder=0)
    axes.set_xlabel("time [s]")


def tension(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Tension at the sheave over time with its mean and standard deviation."""
    axes.set_title("Tension at the sheave")
    axes.set_ylabel("tension [kN]")
    axes.plot(seconds(run), run.frames["tension"] / 1e3, color=BLUE, lw=1.2)
    kept = after_start(run.frames, skip_s)[0]["tension"] / 1e3
    mean, std = kept.mean(), kept.std()
    axes.axhspan(mean - std, mean + std, color=BLUE, alpha=0.10, lw=0)
    axes.axhline(mean, color=INK, lw=1, ls=(0, (6, 4)))
    axes.annotate(
        "mean\n± std",
        (1.0, mean),
        xycoords=axes.get_yaxis_transform(),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        size=11,
    )
    min_span(axes, 0.02 * abs(mean))
    _shade(axes, run, skip_s)


def heave(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Depth of the towbody on the left axis, height of the sheave on the right one."""
    axes.set_title("Towbody depth and sheave heave")
    time, kept = seconds(run), after_start(run.frames, skip_s)[0]
    axes.plot(time, -run.frames["body_position"][:, 2], color=ORANGE, lw=1.6)
    min_span(axes, 0.2)
    axes.invert_yaxis()
    axes.set_ylabel("towbody depth [m]", color=ORANGE)
    axes.tick_params(axis="y", colors=ORANGE)
    right = axes.twinx()
    right.grid(False)
    right.spines["right"].set_visible(True)
    mean = kept["sheave_position"][:, 2].mean()
    right.plot(time, run.frames["sheave_position"][:, 2] - mean, color=PURPLE, lw=1.0)
    min_span(right, 0.2)
    right.set_ylabel("sheave heave [m]", color=PURPLE)
    right.tick_params(axis="y", colors=PURPLE)
    _shade(axes, run, skip_s)


def contact_bands(run: RecordedRun, skip_s: float, points: int = 181) -> tuple[np.ndarray, np.ndarray] | None:
    """Wrap angles [points] rad and line load [messages, 2 flanks, points] N/m of every contact message after the start;
    None if no contact point was ever in the table. Outside the contact points the load is 0."""
    start = after_start(run.frames, skip_s)[0]["time"][0]
    tables = [table for time, table in run.contacts if time >= start and len(table)]
    if not tables:
        return None
    wrap = [table[:, COLUMN["wrap_angle"]] for table in tables]
    grid = np.linspace(min(map(np.min, wrap)), max(map(np.max, wrap)), points)
    loads = np.empty((len(tables), 2, points))
    for k, (table, angle) in enumerate(zip(tables, wrap)):
        order = np.argsort(angle)
        for side, name in enumerate(("load_port", "load_starboard")):
            loads[k, side] = np.interp(grid, angle[order], table[order, COLUMN[name]], left=0.0, right=0.0)
    return grid, loads


def contact(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Line load of both flanks against the wrap angle: mean, and band from least to largest."""
    axes.set_title("Contact along the sheave")
    axes.set_xlabel("angle about the sheave axis from its top, outboard positive [°]")
    axes.set_ylabel("line load of a flank [kN/m]")
    bands = contact_bands(run, skip_s)
    if bands is None:
        axes.text(0.5, 0.5, "no contact point recorded", ha="center", transform=axes.transAxes, color=FAINT)
        return
    grid, loads = np.degrees(bands[0]), bands[1] / 1e3
    sides = (("port flank", PORT, "-"), ("starboard flank", STARBOARD, (0, (5, 2))))
    for side, (label, color, style) in enumerate(sides):
        axes.fill_between(grid, loads[:, side].min(axis=0), loads[:, side].max(axis=0), color=color, alpha=0.16, lw=0)
        axes.plot(grid, loads[:, side].mean(axis=0), color=color, lw=2, ls=style, label=f"{label}, mean")
    axes.fill_between([], [], color=FAINT, alpha=0.3, lw=0, label="least to largest")
    axes.set_xlim(grid[0], grid[-1])
    axes.set_ylim(0, 1.2 * max(loads.max(), 1e-3))  # room for the legend
    axes.legend(loc="upper center", ncols=3, fontsize=11, borderaxespad=0.2)
