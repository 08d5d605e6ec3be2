"""Picture of a span in a cross wind: its motion in the middle and its wake."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plots.canvas import canvas
from ...plots.run import BLUE, FAINT, ORANGE
from .in_time.wake_run import SpanRun

SWINGS = 1.3  # of a piece of the envelope: each has a whole one


def draw_span(run: SpanRun, path: Path) -> Path:
    """Vertical motion in the middle and its wake, one row a case. RuntimeError where matplotlib is missing."""
    with canvas(path, (14.0, 1.8 + 2.8 * len(run.rows)), "Span in a cross wind", "file for `cable-sim span`") as figure:
        axes = figure.subplots(len(run.rows), 2, width_ratios=(2.0, 1.0), squeeze=False)
        for (whole, close), row in zip(axes, run.rows, strict=True):
            report = run.histories[row.case]
            near = report.time >= report.time[-1] - 3.0 / (row.wake_frequency_hz or row.natural_frequency_hz)
            scale, unit = _unit(row.vertical_peak_m)
            swings = (report.time[-1] - report.time[0]) * (row.wake_frequency_hz or row.natural_frequency_hz)
            pieces = max(2, int(swings / SWINGS))
            whole.fill_between(*_envelope(report.time, scale * report.vertical, pieces), color=BLUE, alpha=0.6, lw=0.7)
            whole.set_title(f"{row.case}: {row.length_m:g} m, {row.tension_n:g} N, wind {row.wind_m_s:g} m/s; envelope")
            whole.set_ylabel(f"vertical [{unit}]")
            close.plot(report.time[near], scale * report.vertical[near], color=BLUE, lw=1.6, label=f"vertical [{unit}]")
            other, small = _unit(row.streamwise_peak_m)
            part = report.streamwise[near] - report.streamwise[near].mean()
            close.plot(report.time[near], other * part, color=ORANGE, lw=1.6, label=f"streamwise [{small}]")
            close.plot(report.time[near], report.wake[near], color=FAINT, lw=1.2, ls="--", label="wake q [1]")
            close.set_title("the last three periods")
            low, high = close.get_ylim()
            close.set_ylim(low, high + 0.25 * (high - low))
            close.legend(loc="upper right", ncols=3, fontsize=8, handlelength=1.3, columnspacing=0.8, borderaxespad=0.1)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
    return path


def _envelope(time: np.ndarray, values: np.ndarray, pieces: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, least and largest value of each piece: what a line of many swings would fill anyhow."""
    first = np.unique(np.linspace(0, len(time) - 1, pieces + 1).astype(int))[:-1]
    return time[first], np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)


def _unit(size: float) -> tuple[float, str]:
    """Factor and unit in which a length [m] reads well."""
    for factor, unit in ((1.0, "m"), (1e3, "mm"), (1e6, "um")):
        if size * factor >= 1.0:
            return factor, unit
    return 1e6, "um"
