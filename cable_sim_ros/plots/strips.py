"""Quantities of a run over time, one strip each, and their spectra: small panels for a report.

A figure of the house as SVG text that stands inside an HTML page: nothing from outside, names of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from io import StringIO
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .run import BLUE, FAINT, INK, ORANGE, PURPLE, min_span, styled, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# text stays text: it can be read aloud, searched and scaled; the salt makes the same names for the same drawing
VECTOR = {
    "svg.hashsalt": "cable_sim_ros",
    "svg.fonttype": "none",
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.labelsize": 10,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
    "path.simplify_threshold": 0.2,
}
NOTHING = dict.fromkeys(("Date", "Creator", "Format", "Type"))

WIDTH = 8.0  # inches
SHADE = "#eef0f2"
LOOKS = ((BLUE, "-"), (ORANGE, (0, (5, 2))), (PURPLE, (0, (1.5, 1.5))), (INK, (0, (6, 2, 1, 2))))  # colour and dash


def svg(
    name: str, size: tuple[float, float], draw: Callable[[Figure], None], layout: str | None = "constrained"
) -> str:
    """The SVG element of what ``draw`` puts on a figure of a size [inch]; name: makes its ids unlike those of others.

    RuntimeError where matplotlib is missing.
    """
    text = StringIO()
    with styled(**VECTOR):
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, facecolor="white", layout=layout)
        FigureCanvasSVG(figure)
        draw(figure)
        figure.savefig(text, format="svg", metadata=NOTHING)
    return inlined(text.getvalue(), name)


def inlined(text: str, name: str) -> str:
    """The <svg> element alone: no prolog, no namespaces, no metadata, no style for the whole page, ids with a name."""
    text = text[text.index("<svg") :].strip()
    text = re.sub(r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>|<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' xmlns(:\w+)?="[^"]*"', "", text).replace("xlink:href", "href")
    text = re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', r"<svg \1>", text, count=1)
    used = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text))
    names = {one for pair in used for one in pair if one}
    text = re.sub(r' id="([^"]*)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in names else "", text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = re.sub(r"url\(#", f"url(#{name}-", text)
    return re.sub(r"\s*\n\s*", "\n", text)


class Line(NamedTuple):
    """Values over the time of the run; label: in the legend, "" where the strip has one line."""

    values: np.ndarray
    label: str = ""


class Strip(NamedTuple):
    """A panel: title, axis with unit, its lines; least span of the axis; down: larger values are lower."""

    title: str
    axis: str
    lines: tuple[Line, ...]
    span: float = 0.0
    down: bool = False


class Spectrum(NamedTuple):
    """One-sided power spectral density over frequency [Hz]."""

    title: str
    unit: str
    frequency: np.ndarray
    density: np.ndarray


def strips(figure: Figure, time: np.ndarray, rows: Sequence[Strip], skip_s: float) -> None:
    """Draw strips over one time axis [s]; skip_s: start-up, shaded."""
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for axes, row in zip(panels, rows):
        axes.set(title=row.title, ylabel=row.axis)
        for line, (colour, dash) in zip(row.lines, LOOKS):
            axes.plot(*thinned(time, line.values), color=colour, ls=dash, lw=1.1, label=line.label or None)
        if row.span:
            min_span(axes, row.span)
        if row.down:
            axes.invert_yaxis()
        if any(line.label for line in row.lines):
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.28 * (high - low))  # room for the legend
            axes.legend(loc="upper right", ncols=len(row.lines), borderaxespad=0.1, handlelength=2.6)
        axes.axvspan(0.0, skip_s, color=SHADE, lw=0, zorder=0)
        axes.locator_params(axis="y", nbins=5)
    panels[-1].set(xlabel="time since the begin of the run [s]", xlim=(0.0, max(float(time[-1]), 1e-3)))
    figure.align_ylabels()


def spectra(figure: Figure, rows: Sequence[Spectrum], band: tuple[float, float], end: float) -> None:
    """Draw spectra up to ``end`` [Hz], the band of the waves shaded."""
    panels = figure.subplots(1, len(rows), squeeze=False)[0]
    for axes, row in zip(panels, rows):
        axes.set(title=row.title, ylabel=f"density [{row.unit}]", xlabel="frequency [Hz]")
        axes.axvspan(*band, color=SHADE, lw=0, zorder=0)
        axes.plot(row.frequency, row.density, color=BLUE, lw=1.4)
        axes.set(xlim=(0.0, end), ylim=(0.0, None))
        axes.locator_params(nbins=5)
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 6))


def bars(axes: Axes, names: Sequence[str], values: Sequence[float], unit: str) -> None:
    """Level bars with their values, as of terms of an account."""
    at = range(len(names))
    axes.barh(at, values, color=[BLUE if value >= 0.0 else ORANGE for value in values], height=0.6)
    axes.axvline(0.0, color=INK, lw=1.0)
    for k, value in enumerate(values):
        axes.annotate(
            f"{value:.4g}",
            (max(value, 0.0), k),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            size=9,
            color=INK,
        )
    axes.set_yticks(list(at), list(names))
    axes.invert_yaxis()
    axes.margins(x=0.16)
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(unit)
    axes.spines["left"].set_color(FAINT)
