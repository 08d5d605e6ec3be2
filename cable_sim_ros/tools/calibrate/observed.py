"""Measured signals as a calibration takes them: which of a record, on which times, in which noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...io.sources.rounding import resolution
from ..compare.pairing import GAP, SECOND, Cleaned, clean, sampled
from ..logs.own_signals import QUANTITIES, Signal
from .free import CONSEQUENCE, CalibrateError

# one of each row: the others of a row say the same again, which would make intervals too small
FAMILIES = (("tension", "tension_drum"), ("body_depth", "body_depth_rate"), ("departure_angle",), ("layback",))
ALSO = ("body_x", "body_y")  # where they are asked for: their origin is that of a log
USABLE = (*(name for row in FAMILIES for name in row), *ALSO)
LEAST = 30  # values of a signal in the part that is fitted
LEAST_WINDOWS = 4
FASTER = 1.5  # times the rate of the simulation: from there on a signal is low-passed
WINDOW = 30.0  # s, of the means of a steady tow


class Observed(NamedTuple):
    """A measured signal: quantity, unit, times [s from the origin], values, noise (None: found from the residual).

    fitted: which of its values are fitted, the rest judge; step: of a rounding of the measured values, 0: none that
    shows; spread: by how much they vary about their means (steady: of each window).
    """

    quantity: str
    unit: str
    time: np.ndarray
    value: np.ndarray
    noise: float | None
    fitted: np.ndarray
    step: float = 0.0
    spread: float = 0.0


def chosen(signals: Sequence[Signal], asked: Mapping[str, float | None], name: str) -> dict[str, Signal]:
    """The signals to be used, one of each quantity; asked: quantity -> noise, empty: one of each family."""
    there: dict[str, Signal] = {}
    for one in signals:
        if one.quantity in USABLE and len(one.time):
            there.setdefault(one.quantity, one)
    if not there:
        had = ", ".join(sorted({one.quantity for one in signals})) or "nothing"
        raise CalibrateError(
            f"{name}: has no measured signal of the tow ({', '.join(USABLE)}), it has {had}; {CONSEQUENCE}. Give a "
            f"mapping that names one, docs/mapping.md"
        )
    if not asked:
        first = [next((one for one in row if one in there), None) for row in FAMILIES]
        picked = {one: there[one] for one in first if one is not None}
        return picked or there
    for quantity in asked:
        if quantity not in there:
            raise CalibrateError(
                f"--signal {quantity}: {name} has no such signal; {CONSEQUENCE}. Give one of {', '.join(there)}"
            )
    return {quantity: there[quantity] for quantity in asked}


def observed(
    signals: Mapping[str, Signal],
    noise: Mapping[str, float | None],
    origin: int,
    window: tuple[float, float],
    hold_out: float,
    tick: float,
    steady: bool = False,
) -> list[Observed]:
    """Of each signal the values in a window [s from the origin, ns]; the last share of the window is held out.

    tick: s of the simulation. A faster signal is low-passed to it; steady: means over WINDOW in place of values.
    """
    first, last = window
    split = last - hold_out * (last - first)
    out = []
    for name, one in signals.items():
        series = clean(one, origin)
        time, value = series.time, series.value
        raw = value[(time >= first) & (time <= split)]
        step, spread = resolution(raw), float(np.std(raw)) if len(raw) else 0.0
        if steady:
            spread = _within(time, value, first, split)
            time, value = _means(time, value, first, last)
        elif len(time) > 3 and series.interval * FASTER < tick:
            time, value = _slower(series, tick, first, last)
        inside = (time >= first) & (time <= last)
        time, value = time[inside], value[inside]
        fitted = time <= split
        _enough(name, series, fitted, window, hold_out, steady)
        if noise.get(name) is None and np.ptp(value[fitted]) == 0.0:
            raise CalibrateError(
                f"{name}: shows {value[0]:g} {QUANTITIES[name].unit} throughout; {CONSEQUENCE}. Give a channel that "
                f"has a sensor, or state its noise: --signal {name}~NOISE"
            )
        out.append(Observed(name, QUANTITIES[name].unit, time, value, noise.get(name), fitted, step, spread))
    return out


def _slower(series: Cleaned, tick: float, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Low-passed to the rate of the simulation, from a value before ``first`` to one behind ``last``: a stamp far off
    makes no grid of years."""
    begin = float(series.time[0])
    begin += tick * max(0.0, np.floor((first - begin) / tick) - 1.0)
    grid = np.arange(begin, min(float(series.time[-1]), last + tick), tick)
    value = sampled(series, grid, tick)[0]
    good = np.isfinite(value)
    return grid[good], value[good]


def _within(time: np.ndarray, value: np.ndarray, first: float, last: float) -> float:
    """Standard deviation of values about the mean of their window."""
    number = np.floor((time - first) / WINDOW).astype(np.int64)
    parts = [value[number == k] for k in np.unique(number[(time >= first) & (time <= last)])]
    rest = [part - part.mean() for part in parts if len(part) > 1]
    return float(np.std(np.concatenate(rest))) if rest else 0.0


def _means(time: np.ndarray, value: np.ndarray, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
    centre, mean = [], []
    number = np.floor((time - first) / WINDOW).astype(np.int64)
    least = 0.5 * WINDOW / max(float(np.median(np.diff(time))), SECOND) if len(time) > 1 else np.inf
    for k in np.unique(number[(number >= 0) & (first + (number + 1) * WINDOW <= last)]):
        part = number == k
        if part.sum() >= least:  # a window that is half empty is no mean of it
            centre.append(first + (k + 0.5) * WINDOW)
            mean.append(float(value[part].mean()))
    return np.array(centre), np.array(mean)


def _enough(
    name: str, series: Cleaned, fitted: np.ndarray, window: tuple[float, float], hold_out: float, steady: bool
) -> None:
    least = LEAST_WINDOWS if steady else LEAST
    held = len(fitted) - int(fitted.sum())
    if int(fitted.sum()) >= least and (hold_out == 0.0 or held >= 2):
        return
    span = f"{series.time[0]:.12g} to {series.time[-1]:.12g} s" if len(series.time) else "no time"
    what = f"windows of {WINDOW:g} s" if steady else "values"
    if steady:
        shared = ""
    elif window[1] > window[0]:
        shared = f", of which {window[0]:.6g} to {window[1]:.6g} s are simulated"
    else:
        shared = ", of which none is simulated"
    raise CalibrateError(
        f"{name}: {int(fitted.sum())} {what} to fit and {held} held out; {least} are needed; {CONSEQUENCE}. The record "
        f"is of {span}{shared} (from the start of the tow, whose start-up does not count; gaps are longer than {GAP:g} "
        "intervals). Too short: give a longer record, a longer --duration or another --hold-out; clocks that differ: "
        "cable-sim compare --align clock finds by how much, clock_offset of a mapping takes it out"
    )
