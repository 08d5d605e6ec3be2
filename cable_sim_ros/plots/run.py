"""Picture of a run: cable from the side, tension, towbody and sheave, load along the sheave.

The canvas of every picture is a figure in the style of the house that is saved where it was asked for: same figure,
same bytes; a PNG in 256 colours, a third of the size.
"""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import place
from ..io.recordings.recorded_run import RecordedRun, load_run
from ..physics.tick_output import CONTACT_COLUMNS
from ..runs.summary import SKIP, after_start, pitch_and_roll, since_first, summarize, turns
from ..version import __version__
from .heading import force_unit, places, put_heading, scene_name
from .side import BLUE, DPI, FAINT, INK, ORANGE, SIZE, WATER, fit, put_note, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL import Image

COLOURS, EXACT = 256, 128  # of a picture, and how many of them are its commonest ones as they are

__all__ = ["BLUE", "FAINT", "INK", "ORANGE", "PURPLE", "SIZE", "STYLE", "WATER", "draw_run"]
PURPLE = "#6a4c9c"
LOADED = 0.01  # of the largest line load: what lies below is left out of the panel
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
    "axes.prop_cycle": f"cycler('color', {[BLUE, ORANGE, STARBOARD, PORT, PURPLE]})",
    "legend.frameon": False,
    "legend.fontsize": 10.5,
    "axes.formatter.useoffset": False,
    "lines.solid_capstyle": "round",
}

POINTS = 2000  # of a track
CABLES = 8  # that are drawn, the last one at the end of the run
PIECES = 1000  # about what a panel has pixels across

CANVAS_DPI = 100
LETTER, FOOT = 0.16, 0.3  # inches: a letter of the title, the line of the source
GROW = 1.25  # of the letters beside the drawing: a picture is read on a telephone too


def save(figure: Figure, path: str | os.PathLike) -> Path:
    """Save a figure; the suffix of ``path`` says the format. Returns the path."""
    path = place(path)
    if path.suffix != ".png":
        figure.savefig(path)
        return path
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image as images  # matplotlib needs it too

    drawn = FigureCanvasAgg(figure)  # savefig would obey a user's savefig.dpi
    drawn.draw()
    few(images.fromarray(np.asarray(drawn.buffer_rgba())).convert("RGB")).save(path, optimize=True)
    return path


def few(picture: Image.Image) -> Image.Image:
    """A picture in COLOURS colours: its commonest ones to the bit, so that grey stays grey, and others over the scales
    of colours that it has; each pixel takes the nearest."""
    from PIL import Image

    spread = picture.quantize(COLOURS - EXACT, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).getpalette() or []
    pixels = np.asarray(picture).astype(np.int32)
    packed = (pixels[..., 0] << 16 | pixels[..., 1] << 8 | pixels[..., 2]).ravel()
    begins = np.concatenate(([0], np.flatnonzero(np.diff(packed)) + 1))  # of runs of one colour: most of it is white
    lengths = np.diff(begins, append=len(packed))
    found, which = np.unique(packed[begins], return_inverse=True)
    counts = np.bincount(which, lengths)
    colours = np.stack([found >> 16, found >> 8 & 255, found & 255], axis=1)
    common = colours[np.argsort(-counts, kind="stable")[:EXACT]]
    palette = np.vstack([common, np.reshape(spread[: 3 * (COLOURS - EXACT)], (-1, 3))])
    nearest = np.empty(len(found), np.uint8)
    for k in range(0, len(found), 4096):
        gap = ((colours[k : k + 4096, None, :] - palette) ** 2).sum(axis=2)
        nearest[k : k + 4096] = gap.argmin(axis=1)
    made = Image.fromarray(nearest[which].repeat(lengths).reshape(pixels.shape[:2]), "P")
    made.putpalette(palette.astype(np.uint8).ravel().tolist())
    return made


def thinned(time: np.ndarray, values: np.ndarray, pieces: int = PIECES) -> tuple[np.ndarray, np.ndarray]:
    """Samples of ``values`` [n] over ``time`` [n]: all, or beyond four a piece the first, the last, and the least and
    the largest of each piece, with their own times. What is not finite is left out of a piece that has other samples.
    """
    count = len(values)
    if count <= 4 * pieces:
        return time, values
    finite = np.isfinite(values)
    low, high = np.where(finite, values, np.inf), np.where(finite, values, -np.inf)
    edges = np.linspace(0, count, pieces + 1).astype(int)
    kept = {0, count - 1}
    for first, end in zip(edges, edges[1:]):
        kept |= {first + int(low[first:end].argmin()), first + int(high[first:end].argmax())}
    at = np.array(sorted(kept))
    return time[at], values[at]


def from_above(axes: Axes, run: RecordedRun) -> None:
    """Tracks in odom from where the sheave begins, north up, with the cable at even times."""
    frames, begin = run.frames, run.frames["sheave_position"][0, :2]
    axes.set(title="From above", xlabel="east of the beginning [m]", ylabel="north [m]")
    tracks = [frames[name][:, :2] - begin for name in ("sheave_position", "body_position")]
    for track, name, color in zip(tracks, ("sheave", "towbody"), (BLUE, ORANGE), strict=True):
        axes.plot(*track[:: max(1, len(track) // POINTS)].T, color=color, lw=1.8, label=f"track of the {name}")
    shown = sorted({int(k) for k in np.linspace(0, len(run.shapes) - 1, CABLES)}) if run.shapes else []
    for k in shown:
        last = k == shown[-1]
        axes.plot(*(run.shapes[k][1][:, :2] - begin).T, color=INK if last else FAINT, lw=2.2 if last else 0.9, zorder=3)
    axes.plot([], [], color=INK, lw=2.2, label="cable at the end")
    for track, mark, color in zip(tracks, ("o", "D"), (INK, ORANGE), strict=True):
        axes.plot(*track[-1], mark, color=color, mfc="white" if mark == "o" else color, ms=7, mew=2, zorder=4)
    put_note(axes, fit(axes, np.vstack(tracks), words=("east", "north"))[1])
    axes.legend(loc="best", handlelength=1.6)


def draw_run(
    run: RecordedRun | str | os.PathLike,
    out: str | os.PathLike,
    *,
    title: str | None = None,
    skip_s: float = SKIP,
    stamp: str = "",
    make: Callable[..., Figure] | None = None,
) -> Path:
    """Draw a run to an image file and return its path.

    run: recording or path of a bag; out: file, its suffix says the format; title: scene name if not given;
    skip_s: start-up, shaded in the time series and left out of the figures; stamp: what a reader must know before any
    figure, "" if nothing; make: composes another picture, as `compose` this one. BagError if the bag has no run,
    RuntimeError if matplotlib is missing.
    """
    style = styled()  # before anything is read
    run = run if isinstance(run, RecordedRun) else load_run(run)
    with style:
        return save((make or compose)(run, title or scene_name(run), skip_s, stamp), out)


def styled(**more: Any) -> AbstractContextManager:
    """The style of every picture, and more of it. RuntimeError where matplotlib is missing."""
    try:
        import matplotlib
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no picture was drawn; install cable_sim_ros[viz]") from None
    return matplotlib.rc_context(STYLE | more)


def sheet(size: tuple[float, float] = SIZE, dpi: float = DPI, layout: str | None = None) -> Figure:
    """An empty Figure of a size [inch]; no pyplot, so no window system, no state, any thread."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=dpi, facecolor="white", layout=layout)
    FigureCanvasAgg(figure)
    return figure


def compose(run: RecordedRun, title: str, skip_s: float, stamp: str = "") -> Figure:
    """The matplotlib Figure of a run."""
    figure = sheet()
    panels = figure.subplots(2, 2, gridspec_kw={"width_ratios": [1.12, 1.0]})
    figure.subplots_adjust(left=0.085, right=0.935, top=0.84, bottom=0.215, wspace=0.36, hspace=0.48)
    side_view(panels[0, 0], run)
    tension(panels[0, 1], run, skip_s)
    heave(panels[1, 0], run, skip_s)
    if turns(run.frames):
        from_above(panels[1, 1], run)
    elif run.frames["body_quaternion"][:, :2].any():
        attitude(panels[1, 1], run, skip_s)
    else:
        contact(panels[1, 1], run, skip_s)
    put_heading(figure, run, title, stamp)
    figure.text(
        0.085, 0.045, "\n".join(textwrap.wrap(caption(run, skip_s), 132)), size=11, linespacing=1.4, va="bottom"
    )
    return figure


def caption(run: RecordedRun, skip_s: float) -> str:
    """Key figures of the run in a few sentences, numbers tied to their units."""
    s = summarize(run.frames, skip_s=skip_s)
    factor, unit = force_unit(np.array([s["tension_max_n"]]))
    digits = places(factor * s["tension_max_n"])

    def force(name: str, more: int = 0) -> str:
        return f"{factor * s[name]:.{digits + more}f}"

    left_out = f", the first {s['skip_s']:.0f} s (grey) left out of these figures" if s["skip_s"] > 0.0 else ""
    if s["tension_std_n"] is None:
        body = (
            f"A haul: scope {s['scope_start_m']:.1f} m to {s['scope_end_m']:.1f} m, towbody "
            f"{s['body_depth_start_m']:.1f} m to {s['body_depth_end_m']:.1f} m deep. "
        )
        spread = ""
    else:
        spread = f"{force('tension_std_n', 1)} {unit} std, "
        body = f"Towbody {s['body_depth_m']:.1f} m deep, std {s['body_depth_std_m']:.2f} m, "
        if s["body_position_m"] is None:
            body += (
                f"{s['body_depth_min_m']:.1f} m to {s['body_depth_max_m']:.1f} m; a turn, by {s['turned_deg']:.0f}°: "
                f"layback {s['layback_min_m']:.1f} m to {s['layback_max_m']:.1f} m. "
            )
        else:
            body += (
                f"{-s['body_position_m'][0]:.1f} m astern of the sheave; "
                f"95 % ellipsoid {s['ellipsoid_volume_m3']:.3g} m³. "
            )
    if s["body_pitch_std_deg"] is not None:
        body += (
            f"Pitch {s['body_pitch_mean_deg']:.1f}° mean, std {s['body_pitch_std_deg']:.1f}°, roll std "
            f"{s['body_roll_std_deg']:.1f}°. "
        )
    text = (
        f"{s['duration_s']:.0f} s simulated{left_out}. Tension at the sheave {force('tension_mean_n')} {unit} mean, "
        f"{spread}{force('tension_min_n')} to {force('tension_max_n')} {unit}. {body}Sheave heave std "
        f"{s['sheave_heave_std_m']:.2f} m. Contact resultant {force('contact_resultant_mean_n')} {unit} mean, wrap "
        f"{s['wrap_angle_mean_deg']:.0f}° mean."
    )
    return re.sub(r"(?<=\d) (?=(s|kN|N|mN|m|m³|%)\b)", "\u00a0", text)


def seconds(run: RecordedRun) -> np.ndarray:
    """Time of the tick outputs from the first one [s]."""
    return since_first(run.frames) * 1e-9


def min_span(axes: Axes, span: float) -> None:
    """Widen the y axis to ``span`` where the data have less: what hardly moves shall look so."""
    low, high = axes.dataLim.intervaly
    if np.isfinite(high - low) and high - low < span:
        axes.set_ylim(0.5 * (low + high - span), 0.5 * (low + high + span))


def beside(axes: Axes, text: str, y: float, points: float, color: str = INK) -> None:
    """A text so many points to the right of the axes, at a value of theirs."""
    at = {"xycoords": axes.get_yaxis_transform(), "xytext": (points, 0), "textcoords": "offset points"}
    axes.annotate(text, (1.0, y), **at, color=color, va="center", size=11)


def twin(axes: Axes, left: tuple[str, str], right: tuple[str, str], curve: tuple, span: float, **look) -> Axes:
    """Name the left axis and draw a curve, (time [s], values), on one to the right; left, right: name and colour; span:
    as of `min_span`, of the right one. Returns the right one."""
    other = axes.twinx()
    other.grid(False)
    other.spines["right"].set_visible(True)
    other.plot(*curve, color=right[1], lw=1.0, **look)
    min_span(other, span)
    for axis, (name, color) in ((axes, left), (other, right)):
        axis.set_ylabel(name, color=color)
        axis.tick_params(axis="y", colors=color)
    return other


def _shade(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    skip = after_start(run.frames, skip_s)[1]
    axes.set(xlim=(0, max(seconds(run)[-1], 1e-3)), xlabel="time [s]")
    axes.axvspan(0, skip, color="#eef0f2", lw=0, zorder=0)


def tension(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Tension at the sheave over time with its mean and, where the run is no haul, its standard deviation."""
    factor, unit = force_unit(run.frames["tension"])
    axes.set(title="Tension at the sheave", ylabel=f"tension [{unit}]")
    axes.plot(*thinned(seconds(run), factor * run.frames["tension"]), color=BLUE, lw=1.2)
    kept = factor * after_start(run.frames, skip_s)[0]["tension"]
    mean, std = kept.mean(), kept.std()
    min_span(axes, 0.02 * abs(mean))
    hauled = summarize(run.frames, skip_s=skip_s)["tension_std_n"] is None
    if not hauled:
        axes.axhspan(mean - std, mean + std, color=BLUE, alpha=0.10, lw=0)
    axes.axhline(mean, color=INK, lw=1, ls=(0, (6, 4)))
    beside(axes, "mean" if hauled else "mean\n± std", mean, 6)
    _shade(axes, run, skip_s)


def heave(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Depth of the towbody on the left axis, height of the sheave on the right one."""
    axes.set_title("Towbody depth and sheave heave")
    time, kept = seconds(run), after_start(run.frames, skip_s)[0]
    axes.plot(*thinned(time, -run.frames["body_position"][:, 2]), color=ORANGE, lw=1.6)
    min_span(axes, 0.2)
    axes.invert_yaxis()
    sheave = run.frames["sheave_position"][:, 2] - kept["sheave_position"][:, 2].mean()
    names = ("towbody depth [m]", ORANGE), ("sheave heave [m]", PURPLE)
    right = twin(axes, *names, thinned(time, sheave), 0.2, ls=(0, (6, 1.5)))
    for axis in (axes, right):
        axis.locator_params(axis="y", nbins=7)
    _shade(axes, run, skip_s)


def attitude(axes: Axes, run: RecordedRun, skip_s: float) -> None:
    """Pitch and roll of a towbody that is not level, over time."""
    axes.set_title("Attitude")  # no longer: the legend stands beside it
    axes.set_ylabel("towbody [deg]")
    names = ("pitch, nose up", "roll, port side up")
    for angle, name, color in zip(pitch_and_roll(run.frames), names, (ORANGE, BLUE), strict=True):
        axes.plot(*thinned(seconds(run), angle), color=color, lw=1.4, label=name)
    min_span(axes, 1.0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, handlelength=1.6, borderaxespad=0.2)
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
    axes.set(title="Contact along the sheave", xlabel="angle from the sheave's top, outboard positive [°]")
    bands = contact_bands(run, skip_s)
    factor, unit = force_unit(bands[1] if bands else np.zeros(1))
    axes.set_ylabel(f"load of a flank [{unit}/m]")
    if bands is None:
        axes.text(0.5, 0.5, "no contact point recorded", ha="center", transform=axes.transAxes, color=FAINT)
        return
    grid, loads = np.degrees(bands[0]), factor * bands[1]
    sides = (("port, mean", PORT, "-"), ("starboard, mean", STARBOARD, (0, (5, 2))))
    for side, (label, color, style) in enumerate(sides):
        axes.fill_between(grid, loads[:, side].min(axis=0), loads[:, side].max(axis=0), color=color, alpha=0.16, lw=0)
        axes.plot(grid, loads[:, side].mean(axis=0), color=color, lw=2, ls=style, label=label)
    axes.fill_between([], [], color=FAINT, alpha=0.3, lw=0, label="least to largest")
    loaded = grid[loads.max(axis=(0, 1)) > LOADED * loads.max()] if loads.max() > 0.0 else grid
    room = 0.15 * max(np.ptp(loaded), 5.0)
    axes.set_xlim(loaded[0] - room, loaded[-1] + room)
    axes.set_ylim(0, 1.25 * max(loads.max(), 1e-3))  # room for the legend
    axes.legend(loc="upper center", ncols=3, borderaxespad=0.2, handlelength=1.6, columnspacing=1.0, handletextpad=0.5)


@contextmanager
def canvas(
    path: Path, size: tuple[float, float], title: str = "", source: str = "", *, grow: float = GROW
) -> Iterator[Figure]:
    """A `sheet` of a size [inch at DPI] to draw on; it is saved at the end, its folder made. title: over all panels;
    source: at the foot, with the version: what was simulated, and whose figures stand beside it; grow: of the letters.
    RuntimeError where matplotlib is missing.
    """
    with styled():
        inches = size[0] / grow, size[1] / grow
        figure = sheet(inches, grow * CANVAS_DPI, "constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)  # inches: titles keep off the edge and the panel above
        if title:
            wide = textwrap.fill(title, int(inches[0] / LETTER)).replace("$", r"\$")  # a name is no formula
            figure.suptitle(wide, x=0.012, ha="left", size=15, weight="bold")
        foot = FOOT / inches[1] if source else 0.0
        figure.get_layout_engine().set(rect=(0.0, foot, 1.0, 1.0 - foot))
        if source:
            said = f"{source}; simulated by cable_sim_ros {__version__}"
            figure.text(0.012, 0.2 * foot, said, ha="left", va="bottom", size=9, color=FAINT)
        yield figure
        _legends(figure, foot)
        path.parent.mkdir(parents=True, exist_ok=True)
        save(figure, path)


def _legends(figure: Figure, foot: float) -> None:
    """Put the legends of the figure above its source, and the panels above them; foot: height of the source."""
    if not figure.legends:  # a drawing without one may have a layout of its own
        return
    renderer = figure.canvas.get_renderer()
    low = foot
    for legend in figure.legends:
        legend.set_in_layout(False)  # the layout leaves no room for one that is moved
        legend.set_bbox_to_anchor((0.0, low, 1.0, 1.0 - low), transform=figure.transFigure)
        low += legend.get_window_extent(renderer).height / figure.bbox.height + 0.01
    figure.get_layout_engine().set(rect=(0.0, low, 1.0, 1.0 - low))
