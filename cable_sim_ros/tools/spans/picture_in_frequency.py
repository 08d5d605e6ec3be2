"""Pictures of spans: spectra at a place and along the cable; motion in the middle and the wake in a cross wind."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...plots.run import BLUE, FAINT, INK, ORANGE, WATER, canvas
from .in_frequency.response import Vibration, leading
from .in_frequency.sensitivity import MAX_MODES
from .in_frequency.span import Span
from .in_time.wake_run import SpanRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SWINGS = 1.3  # of a piece of the envelope: each has a whole one

SIZE = (14.0, 9.0)  # inches
MIN_PLACES = 4  # of a half wave that is drawn
SHOWN = 1e-5  # of the peak of a spectrum: what lies below is left out of the picture


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


def draw(span: Span, result: Vibration, out: Path) -> Path:
    """Draw a vibration to an image file and return its path. RuntimeError if matplotlib is missing."""
    with canvas(out, SIZE, result.name, grow=1.0) as figure:
        panels = figure.subplots(2, 2)
        _spectrum(
            panels[0, 0], result, result.displacement_spectrum * 1e6, "displacement", "mm$^2$/Hz",
            1e3 * result.place_rms_displacement, "mm",
        )  # fmt: skip
        _spectrum(
            panels[1, 0], result, result.acceleration_spectrum, "acceleration", "(m/s$^2$)$^2$/Hz",
            result.place_rms_acceleration, "m/s$^2$",
        )  # fmt: skip
        _along(panels[0, 1], result)
        _damping(panels[1, 1], span, result)
    return out


def _spectrum(axis: Axes, result: Vibration, values, what, unit, rms, rms_unit) -> None:
    """One spectrum at the place, with the modes, the range of shedding and the rms."""
    f = result.frequency
    axis.semilogy(f, values, color=BLUE, lw=1.8, zorder=3)
    low, high = result.shedding
    axis.axvspan(low, high, color=WATER, alpha=0.35, lw=0, label=f"shedding, {low:.3g} to {high:.3g} Hz")
    some = "" if len(result.frequencies) <= MAX_MODES else f", {MAX_MODES} of the largest response"
    for i, f_n in enumerate(result.frequencies[leading(result, MAX_MODES)]):
        axis.axvline(
            f_n, color=ORANGE, lw=0.9, ls=(0, (4, 3)), label=None if i else f"modes with a damping ratio{some}"
        )
    shown = np.flatnonzero(values > SHOWN * values.max())
    axis.set(xlim=(0.0, f[min(shown[-1] + 1, len(f) - 1)]), ylim=(SHOWN * values.max(), 12.0 * values.max()))
    axis.text(
        0.985,
        0.66,
        f"rms {rms:.4g} {rms_unit}",
        transform=axis.transAxes,
        ha="right",
        va="top",
        size=16,
        weight="bold",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 3.0},
        color=INK,
    )
    axis.legend(loc="upper right", fontsize=11)
    axis.set(title=f"Spectrum of the {what} at s = {result.place:.4g} m", xlabel="frequency [Hz]", ylabel=unit)


def _along(axis: Axes, result: Vibration) -> None:
    """Rms displacement along the cable over the shapes of some modes."""
    top = 1e3 * float(result.rms_displacement.max())
    count = len(result.modes)
    drawn = min(count, (len(result.arc) - 1) // MIN_PLACES)  # a shape of fewer places would look like another
    shown = sorted({0, 1, 2, drawn - 1} & set(range(count)))
    scale = 0.8 * top / float(np.abs(result.modes[shown]).max())
    for n in shown:
        axis.plot(result.arc, scale * result.modes[n], color=FAINT, lw=0.9, alpha=0.7)
    axis.plot([], [], color=FAINT, lw=0.9, label=f"shapes of modes {', '.join(str(n + 1) for n in shown)}, no scale")
    axis.plot(result.arc, 1e3 * result.rms_displacement, color=BLUE, lw=2.4, label="rms displacement")
    axis.plot(
        [result.place], [1e3 * result.place_rms_displacement], "o", color=ORANGE, ms=8, label="place of the spectra"
    )
    axis.set(xlim=(0.0, result.arc[-1]), ylim=(-1.0 * top, 1.65 * top))
    axis.legend(loc="upper right", fontsize=11)
    axis.set_title(f"Along the cable: largest rms {float(result.diameters.max()):.3g} diameters")
    axis.set(xlabel="s [m]", ylabel="mm")


def _damping(axis: Axes, span: Span, result: Vibration) -> None:
    """Where each mode is driven, and its damping ratio."""
    shown = leading(result, MAX_MODES)
    count = len(shown)
    for row, n in enumerate(shown, 1):
        axis.plot([0.0, result.arc[-1]], [row, row], color=FAINT, lw=0.6, alpha=0.6)
        for a, b in result.driven[n]:
            axis.plot([a, b], [row, row], color=BLUE, lw=min(9.0, 120.0 / count), solid_capstyle="butt")
        ratio = f"{result.damping_ratios[n]:.4f}"
        axis.text(1.02, row, ratio, transform=axis.get_yaxis_transform(), va="center")
    axis.set_yticks(range(1, count + 1), [str(n + 1) for n in shown])
    axis.set(ylim=(0.4, count + 0.6), xlim=(0.0, result.arc[-1]))
    axis.grid(axis="y", visible=False)
    axis.set(title="Where each mode is driven", xlabel="s [m]", ylabel="mode")
    given = " (given)" if span.damping.ratios else ""
    axis.set_title(f"damping ratio{given}", loc="right", size=12, weight="normal")
