"""The cable from the side: scales of the panel, ship, sheave, towbody, and the cable coloured by its tension."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..io.recordings.recorded_run import RecordedRun, places_of
from ..io.scenes.document import SceneError
from ..io.scenes.load import scene_from_text
from ..runs.passage import haul_of
from ..runs.summary import tow_axes, turns
from ..sim.scene import Scene
from .heading import force_unit
from .sea_surface import SeaSurface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE, DPI = (12.8, 8.0), 125  # inches, dots an inch: 1600 x 1000, with letters that a telephone shows
INK, FAINT = "#1b2733", "#8a949e"
BLUE, ORANGE, WATER, HULL = "#1f6fb2", "#d4651b", "#9cc4e4", "#b4bcc4"
PAD = (0.95, 1.25, 0.45, 0.45)  # inches beside what is drawn: left, right, below, above
NEEDLE = 0.4  # inches: what is thinner than this to scale is drawn with two scales
SHIP = ((0.02, 0.04), (0.72, 0.05), (0.84, 0.09), (0.74, -0.06), (0.10, -0.06), (0.02, -0.02))  # inches, a symbol
DECK = 0.4  # inches of it ahead of the drum, at least
SHEAVE = 0.1  # inches across, at least
WAVE_POINTS = 800
UNDER_WAY = 0.05  # m/s


def along_tow(frames: np.recarray) -> np.ndarray:
    """Horizontal unit vector along the mean tow; of a turn from the towbody to the sheave at its end."""
    if not turns(frames):
        return tow_axes(frames)[0]
    way = (frames["sheave_position"][-1] - frames["body_position"][-1])[:2]
    return way / max(float(np.hypot(*way)), 1e-9)


def frames_of_shapes(run: RecordedRun) -> np.recarray:
    """The tick output of every recorded shape."""
    return run.frames[places_of([time for time, _ in run.shapes], run.frames)]


def cable_curves(run: RecordedRun) -> list[np.ndarray]:
    """Each recorded shape as [nodes, 2]: along the tow from the sheave, height above the water, m."""
    forward = along_tow(run.frames)
    return [
        np.column_stack([(table[:, :2] - frame["sheave_position"][:2]) @ forward, table[:, 2]])
        for (_, table), frame in zip(run.shapes, frames_of_shapes(run))
    ]


def fit(
    axes: Axes,
    points: np.ndarray,
    pad: tuple[float, float, float, float] = PAD,
    words: tuple[str, str] = ("across", "heights"),
) -> tuple[tuple[float, float], str]:
    """Limits that show points [n, 2] with inches of room beside them, without changing the panel.

    A metre is as long across as up, unless that would draw a needle. Returns the scales [m/inch] and a note by the
    words of the two axes, "" where they are equal.
    """
    box, size = axes.get_position(), axes.figure.get_size_inches()
    left, right, below, above = pad
    low, span = points.min(axis=0), np.ptp(points, axis=0)
    room = np.array([box.width * size[0] - left - right, box.height * size[1] - below - above])
    scale = np.maximum(span, 1e-3) / room
    note = ""
    if span.min() >= NEEDLE * scale.max() or scale.max() == scale.min():
        scale[:] = scale.max()
    else:
        note = f"{words[int(scale.argmin())]} enlarged × {float(f'{scale.max() / scale.min():.2g}'):g}"
    first = low - 0.5 * (room * scale - span) - np.array([left, below]) * scale
    whole = room + np.array([left + right, below + above])
    axes.set_xlim(first[0], first[0] + whole[0] * scale[0])
    axes.set_ylim(first[1], first[1] + whole[1] * scale[1])
    return (float(scale[0]), float(scale[1])), note


def put_note(axes: Axes, note: str) -> None:
    """Say at the right of the title that the two scales differ."""
    axes.set_title(note, loc="right", size=11, weight="normal", color=FAINT)


def ship_and_water(axes: Axes, run: RecordedRun, curve: np.ndarray, scale: tuple[float, float]) -> np.ndarray:
    """Water surface and sheave at the end of the run, and a ship as a symbol that reaches beyond the drum.

    curve: the cable [nodes, 2] of `cable_curves`; scale: m/inch, across and up. With two scales the sheave is an
    ellipse, so that the cable lies on it. Returns half its axes, m.
    """
    from matplotlib.patches import Ellipse, Polygon
    from matplotlib.transforms import ScaledTranslation

    scene, last = _scene(run), run.frames[-1]
    x, y, height = last["sheave_position"]
    sea = None if scene is None else SeaSurface(scene)
    if sea is not None:
        sea.settle(run.frames)
    if sea is not None and sea.agrees:
        left, right = axes.get_xlim()
        along, forward = np.linspace(left, right, WAVE_POINTS), along_tow(run.frames)
        heights = sea(x + forward[0] * along, y + forward[1] * along, sea.at(last))
        axes.plot(along, heights, color=WATER, lw=2, zorder=1)
    else:
        axes.axhline(0.0, color=WATER, lw=2, zorder=1)
    longer = max(0.0, curve[:, 0].max() / scale[0] + DECK - SHIP[2][0])
    symbol = axes.figure.dpi_scale_trans + ScaledTranslation(0.0, 0.0, axes.transData)
    hull = [(across + longer * (across > 0.5), up) for across, up in SHIP]
    axes.add_patch(Polygon(hull, closed=True, facecolor=HULL, lw=0, zorder=2, transform=symbol, clip_on=True))
    axes.plot([0.0, 0.0], [0.0, height], color=HULL, lw=2, zorder=2)
    half = np.maximum(0.0 if scene is None else scene.sheave.radius, 0.5 * SHEAVE * np.array(scale))
    axes.add_patch(Ellipse((0.0, height), *(2.0 * half), facecolor="white", edgecolor=INK, lw=2, zorder=5))
    return half


def _scene(run: RecordedRun) -> Scene | None:
    """The scene that a recording keeps; None where it keeps none that can be read: sheave a symbol, water level."""
    try:
        with warnings.catch_warnings(action="ignore"):  # said when it was simulated
            return scene_from_text(run.custom_data["scene_yaml"], "scene of the recording")
    except (KeyError, SceneError):
        return None


def side_view(axes: Axes, run: RecordedRun) -> None:
    """Cable at the end of the run, coloured by tension; sheave at 0, water surface, ship.

    Earlier ones faint, but not of a turn, where they lie in other planes (run.py), nor of a haul (haul.py).
    """
    from matplotlib.collections import LineCollection

    axes.set(
        title="Cable, end of the run", xlabel="along the tow, from the sheave [m]", ylabel="height above water [m]"
    )
    curves, forward, last = cable_curves(run), along_tow(run.frames), run.frames[-1]
    if turns(run.frames) or haul_of(run.frames)[1]:
        curves = curves[-1:]
    for curve in curves[:: max(1, len(curves) // 20)]:
        axes.plot(*curve.T, color=FAINT, lw=0.6, alpha=0.5)
    if curves:
        factor, unit = force_unit(run.shapes[-1][1][:, 3])
        tension = factor * run.shapes[-1][1][:, 3]
        points = curves[-1][:, None]
        line = LineCollection(
            np.concatenate([points[:-1], points[1:]], axis=1),
            cmap="viridis",
            lw=3,
            array=0.5 * (tension[:-1] + tension[1:]),
            capstyle="round",
            zorder=3,
        )
        axes.add_collection(line, autolim=False)
        bar = axes.figure.colorbar(line, ax=axes, pad=0.015, fraction=0.04)
        bar.set_label(f"tension [{unit}]")
        bar.outline.set_visible(False)
    body = np.array([(last["body_position"] - last["sheave_position"])[:2] @ forward, last["body_position"][2]])
    sheave = np.array([0.0, last["sheave_position"][2]])
    scale, note = fit(axes, np.vstack([*curves, body, sheave, (0.0, 0.0)]))
    put_note(axes, note)
    half = ship_and_water(axes, run, np.vstack([*curves[-1:], sheave]), scale)
    axes.plot(*body, "D", color=ORANGE, ms=9, zorder=4)
    for row in run.bodies[-1][1] if run.bodies else ():
        at = (row[:2] - last["sheave_position"][:2]) @ forward, row[2]
        axes.plot(*at, "D", color=ORANGE, ms=6, mfc="white", zorder=4)
    _labels(axes, body, sheave + half * (-1.0, 1.0), float(np.hypot(*run.frames["ship_velocity"][:, :2].mean(axis=0))))


def _labels(axes: Axes, body: np.ndarray, sheave: np.ndarray, speed: float) -> None:
    """Names where a cable that streams aft leaves room: below the towbody, above the sheave, under the ship."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=3, foreground="white")]

    def name(text: str, at: tuple, offset: tuple[float, float], ha: str = "center", **more) -> None:
        axes.annotate(text, at, xytext=offset, textcoords="offset points", ha=ha, zorder=6, path_effects=halo, **more)

    name("towbody", tuple(body), (0, -10), va="top", color=ORANGE, weight="bold")
    name("sheave", tuple(sheave), (-4, 4), ha="right", weight="bold")
    name("water surface", (0.99, 0.0), (0, -8), ha="right", va="top", color=BLUE, xycoords=axes.get_yaxis_transform())
    if speed >= UNDER_WAY:
        axes.annotate(
            "tow direction",
            (0.99, 0.06),
            xycoords="axes fraction",
            xytext=(0.80, 0.06),
            va="center",
            ha="right",
            arrowprops={"arrowstyle": "->", "color": FAINT, "lw": 1.5},
            color=FAINT,
        )
