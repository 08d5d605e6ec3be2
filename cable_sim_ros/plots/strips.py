"""Quantities of a run over time, one strip each, and their spectra: small panels for a report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .run import BLUE, FAINT, INK, ORANGE, PURPLE, min_span, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 8.0  # inches
SHADE = "#eef0f2"
LOOKS = ((BLUE, "-"), (ORANGE, (0, (5, 2))), (PURPLE, (0, (1.5, 1.5))), (INK, (0, (6, 2, 1, 2))))  # colour and dash


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
        axes.set_title(row.title)
        axes.set_ylabel(row.axis)
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
    panels[-1].set_xlabel("time since the begin of the run [s]")
    panels[-1].set_xlim(0.0, max(float(time[-1]), 1e-3))
    figure.align_ylabels()


def spectra(figure: Figure, rows: Sequence[Spectrum], band: tuple[float, float], end: float) -> None:
    """Draw spectra up to ``end`` [Hz], the band of the waves shaded."""
    panels = figure.subplots(1, len(rows), squeeze=False)[0]
    for axes, row in zip(panels, rows):
        axes.set_title(row.title)
        axes.set_ylabel(f"density [{row.unit}]")
        axes.set_xlabel("frequency [Hz]")
        axes.axvspan(*band, color=SHADE, lw=0, zorder=0)
        axes.plot(row.frequency, row.density, color=BLUE, lw=1.4)
        axes.set_xlim(0.0, end)
        axes.set_ylim(bottom=0.0)
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
