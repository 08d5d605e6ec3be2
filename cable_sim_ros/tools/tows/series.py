"""A tow as a series over time: wire out, and where measured the ship's speed and the depth, of a CSV file.

The winch goes along straight lines that stay within WITHIN of its counter, or its noise, or as far beside it as a winch
needs that cannot follow each digit; the ship along lines through means of its speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import CableSimError
from ..logs.formats import read_log
from ..logs.log import Log, LogError
from ..logs.mapping.units import named

MOST_BYTES = 50_000_000
LASTS = (10.0, 86_400.0)  # s
FEWEST = 4  # rows: the corners of pay-out, hold and haul
LONGEST_WIRE = 20_000.0  # m
SHORTEST = 1.0  # m of wire that is paid out at least
SPEEDS = (0.05, 10.0)  # m/s, of a ship that tows a wire
WITHIN, NOISES = 0.1, 4.0  # m of wire; times the noise of its counter: lines within both do not follow digits
COARSEST = 1.0, 0.01  # m, share of the wire: the larger one is how far the winch may be beside its counter
FASTER = 1.01  # times winch.max_rate, for the digits of a series
OVER, STEADY = 10.0, 0.02  # s of a mean speed; m/s that lines stay within of it
MOST_LINES = 400
GAP = 0.1, 10.0  # share of the tow's time, and times the usual step: without wire for longer than both it is no tow
ALONE = 1.0, 0.05  # m, share of it: the larger one is how far a depth may lie below rows beside it
MISSED = 0.1  # share of the largest depth, by which it may have been larger in a gap


class SeriesError(CableSimError, ValueError):
    """A series that cannot be simulated: key, value, bound and remedy; its row and file the caller knows."""


class Signal(NamedTuple):
    """A column of the file: name, unit (of logs/mapping/units.py), factor to SI, and what is then taken off."""

    field: str
    unit: str
    factor: float
    offset: float = 0.0


class Series(NamedTuple):
    """Ends of straight lines, by time from the tow's beginning: wire in the water [s, m], and speed of the ship
    [s, m/s], none where it is not measured; depth: largest measured [m], NaN: none; notes: on what was left out."""

    time: np.ndarray
    wire: np.ndarray
    speed_time: np.ndarray
    speed: np.ndarray
    depth: float
    notes: list[str]

    @property
    def rates(self) -> np.ndarray:
        """Of the wire along each line [m/s]."""
        return np.diff(self.wire) / np.diff(self.time)

    @property
    def mean(self) -> float:
        """Of the speed [m/s]; NaN: not measured."""
        between = 0.5 * (self.speed[1:] + self.speed[:-1]) * np.diff(self.speed_time)
        return float(between.sum() / self.time[-1]) if len(self.speed) else np.nan

    def plans(self, mean: float) -> tuple[str, str | None, float]:
        """Plans of the winch and of the ship (None: steady), and its speed at the beginning [m/s]; mean: what that of
        the speeds is scaled to [m/s]."""
        winch = ", ".join(f"{t:.2f} rate {rate:.9g}" for t, rate in zip(self.time, self.rates))
        if not len(self.speed) or np.ptp(self.speed) < STEADY:
            return winch, None, mean
        speeds = mean / self.mean * self.speed
        over = np.diff(self.speed_time) - 0.001  # no order overlaps the next by a digit
        ship = ", ".join(f"{t:.2f} speed {v:.6g} over {s:.3f}" for t, v, s in zip(self.speed_time, speeds[1:], over))
        return winch, ship, float(speeds[0])


def read_series(path: Path, signals: Mapping[str, Signal], begin: float, sheave: float, max_rate: float) -> Series:
    """Series of a file, from ``begin`` m of wire in the water on; signals: `wire`, and `speed` and `depth` where they
    are measured; sheave: its height over the water [m]; max_rate: of the winch [m/s]. Raises SeriesError."""
    log, time = _read(path)
    notes = [f"rows left out: {log.losses}"] if log.losses else []
    values = {key: _values(log, key, one, notes) for key, one in signals.items()}
    start, times, wire = _tow(*_finite(time, values["wire"]), begin, sheave)
    times, wire, within = _followed(times, wire, max_rate)
    if within:
        notes.append(f"wire is followed within {within:.2g} m: closer, its rates are beyond winch.max_rate")
    speed_time = speed = np.zeros(0)
    if "speed" in values:
        speed_time, speed = _means(*_finite(time - start, values["speed"]), float(times[-1]))
    time, deep = _finite(time - start, values.get("depth", np.empty(0)))
    during = (time >= 0.0) & (time <= times[-1])
    run = np.cumsum(np.abs(np.diff(wire, prepend=wire[:1])))
    depth = _largest(time[during], deep[during], times, run, notes)
    return Series(times, wire, speed_time, speed, depth, notes)


def _read(path: Path) -> tuple[Log, np.ndarray]:
    """A file, and the times of its rows from the first on [s]."""
    try:
        if (size := path.stat().st_size) > MOST_BYTES:
            raise SeriesError(f"its {size / 1e6:.0f} MB are beyond {MOST_BYTES / 1e6:.0f} MB. Give the tow alone")
        log = read_log(path, "csv")
    except OSError as error:
        raise SeriesError(f"cannot be read ({error.strerror}). Give a CSV file in the folder of the table") from None
    except LogError as error:
        raise SeriesError(str(error).removeprefix(f"{path}: ")) from None
    stamps = log.sources["table"].stamps
    assert stamps is not None  # or it is no table
    time = (stamps - stamps[:1]) * 1e-9
    if len(time) < FEWEST:
        raise SeriesError(f"has {len(time)} rows with a time, and a tow needs {FEWEST}. Give all of it")
    if (back := np.diff(time) <= 0.0).any():
        k = int(np.argmax(back)) + 1
        raise SeriesError(
            f"time of row {k + 1} is {time[k]:.6g} s from the first, not after {time[k - 1]:.6g} s of the row before. "
            "Put rows in the order of time, each time once"
        )
    return log, time


def _values(log: Log, key: str, signal: Signal, notes: list[str]) -> np.ndarray:
    """Values of a column in SI, not finite where it has none."""
    table = log.sources["table"]
    if signal.field not in table.columns:
        text = f"{key} = {signal.field!r:.60} is no column of numbers ({', '.join(list(table.columns)[:20])})"
        if key != "depth":
            raise SeriesError(f"{text}. Name one in the map")
        notes.append(f"{text}: not measured")  # a tow without a recorder
        return np.full(len(table), np.nan)
    told = named(table.units.get(signal.field, ""))
    if told not in (None, signal.unit):
        raise SeriesError(f"{key} is in {told} by its heading, in {signal.unit} by the map. Mend the one that is wrong")
    values = signal.factor * table.columns[signal.field] - signal.offset
    good = np.isfinite(values)
    if good.sum() < FEWEST and key != "depth":
        raise SeriesError(f"{key} has {good.sum()} finite numbers, and a tow needs {FEWEST}. Fill {signal.field!r:.60}")
    if not good.all():
        row = int(np.argmin(good)) + 1
        notes.append(f"{key} is no finite number in {(~good).sum()} of {len(good)} rows, first in row {row}: left out")
    return values


def _largest(time: np.ndarray, deep: np.ndarray, times: np.ndarray, runs: np.ndarray, notes: list[str]) -> float:
    """Largest depth of a tow [m]; NaN: none is known. runs: wire that ran until times, out or in [m]; a towbody hardly
    rises or sinks by more."""
    run = np.interp(time, times, runs)
    reach = np.where(np.diff(time) <= OVER, np.diff(run), -np.inf)
    beside = np.maximum([-np.inf, *(deep[:-1] + reach)], [*(deep[1:] + reach), -np.inf]) if len(deep) else deep
    alone = np.isfinite(beside) & (deep - np.maximum(ALONE[0], ALONE[1] * deep) > beside)
    if alone.any():
        k = int(np.argmax(alone))
        notes.append(
            f"depth stands alone in {alone.sum()} rows, first {deep[k]:.4g} m at {time[k]:.4g} s from the tow's "
            "beginning: left out"
        )
        time, deep, run = time[~alone], deep[~alone], run[~alone]
    if not len(deep):
        return np.nan
    if deep[k := int(np.argmax(deep))] <= 0.0:
        notes.append(f"depth reaches {deep[k]:.4g} m, not below the water: not measured. Is its sign right?")
        return np.nan
    at, ran = np.array([0.0, *time, times[-1]]), np.array([0.0, *run, runs[-1]])
    ends = np.array([deep[0] + run[0], *deep, deep[-1] + runs[-1] - run[-1]])
    steps, within = np.diff(at), 0.5 * (ends[1:] + ends[:-1] + np.diff(ran))
    within[steps <= GAP[1] * np.median(steps[1:-1] if len(deep) > 1 else steps)] = 0.0
    j = int(np.argmax(within))
    if within[j] > (1.0 + MISSED) * deep[k]:
        notes.append(
            f"depth has no number for {steps[j]:.4g} s, {at[j]:.4g} s from the tow's beginning, where it may have "
            f"reached {within[j]:.3g} m, above its largest, {deep[k]:.4g} m: not measured"
        )
        return np.nan
    return float(deep[k])


def _finite(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    good = np.isfinite(values)
    return time[good], values[good]


def _tow(time: np.ndarray, wire: np.ndarray, begin: float, sheave: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Where a tow begins [s]; times from there on and wire in the water, from and to where it is ``begin``."""
    low, high, k = float(wire.min()), float(wire.max()), int(np.argmax(wire))
    sign = "Is its unit right, and its sign (`factor: -1`)?"
    if not (begin + SHORTEST <= high <= LONGEST_WIRE):
        raise SeriesError(
            f"wire reaches {high:.4g} m in the water, outside [{begin + SHORTEST:g}, {LONGEST_WIRE:g}] m, from `begin` "
            f"on. {sign}"
        )
    if low < -sheave:
        raise SeriesError(f"wire = {low:.4g} m in the water, below {-sheave:.4g} m: the towbody at the sheave. {sign}")
    out = np.flatnonzero(wire < begin)
    a, b = int(out[out < k].max(initial=-1)) + 1, int(out[out > k].min(initial=len(wire)))
    times, wires = list(time[a:b]), list(wire[a:b])
    if a > 0 and wire[a] > begin:  # what is before and after is no part of the tow
        times.insert(0, float(np.interp(begin, wire[a - 1 : a + 1], time[a - 1 : a + 1])))
        wires.insert(0, begin)
    if b < len(wire) and wire[b - 1] > begin:
        times.append(float(np.interp(begin, wire[[b, b - 1]], time[[b, b - 1]])))
        wires.append(begin)
    lasts, steps = times[-1] - times[0], np.diff(times)
    across = np.where(np.abs(np.diff(wires)) > WITHIN, steps, 0.0)  # a wire that stands needs no rows
    if not LASTS[0] <= lasts <= LASTS[1]:
        raise SeriesError(f"its tow lasts {lasts:.4g} s, outside [{LASTS[0]:g}, {LASTS[1]:g}] s. Is its time right?")
    if (gap := float(across.max())) > max(GAP[0] * lasts, GAP[1] * float(np.median(steps))):
        raise SeriesError(
            f"wire has no number for {gap:.4g} s, {times[int(np.argmax(across))] - times[0]:.4g} s from the tow's "
            f"beginning, beyond {GAP[0]:.0%} of its {lasts:.4g} s. Fill its column there"
        )
    return float(times[0]), np.array(times) - times[0], np.array(wires)


def _followed(time: np.ndarray, wire: np.ndarray, max_rate: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Corners of a line that the winch can follow, and within how much of the counter it is, 0: as close as that is
    read [m]."""
    most = max(COARSEST[0], COARSEST[1] * float(wire.max()))
    noise = 1.4826 / 6**0.5 * float(np.median(np.abs(np.diff(wire, 2, append=wire[-1:]))))  # deviation from lines
    within = closest = min(max(WITHIN, NOISES * noise), most)
    while True:
        at = _corners(time, wire, within)
        if at is not None:
            times, first = np.unique(np.round(time[at], 2), return_index=True)  # ticks
            rates = np.abs(np.diff(wire[at][first]) / np.diff(times))
            if (fastest := float(rates.max())) <= FASTER * max_rate:
                return times, wire[at][first], within if within > closest else 0.0
        if within == most:
            break
        within = min(2.0 * within, most)
    if at is None:
        raise SeriesError(f"wire needs over {MOST_LINES} lines to be followed within {most:.3g} m. Smooth its column")
    raise SeriesError(
        f"wire runs at {fastest:.3g} m/s, {times[int(np.argmax(rates))]:.4g} s from the tow's beginning, beyond "
        f"winch.max_rate = {max_rate:g} m/s, also within {most:.3g} m of its counter. Is its unit right, and no row a "
        f"jump? Else --set winch.max_rate={fastest + 0.005:.2f}"
    )


def _means(time: np.ndarray, speed: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners of lines through means of the ship's speed over OVER, from 0 to the end [s]."""
    edges = np.linspace(0.0, end, max(1, round(end / OVER)) + 1)
    at = np.union1d(edges, time[(time > 0.0) & (time < end)])
    along = np.interp(at, time, speed)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (along[1:] + along[:-1]) * np.diff(at))])
    means = np.diff(np.interp(edges, at, way)) / np.diff(edges)
    low, high = float(means.min()), float(means.max())
    if low < 0.0 or high > SPEEDS[1] or means.mean() < SPEEDS[0]:
        raise SeriesError(
            f"speed = {low:.3g} to {high:.3g} m/s, {means.mean():.3g} in the mean, is outside [0, {SPEEDS[1]:g}] m/s, "
            f"or below {SPEEDS[0]:g} in the mean. Is its unit right?"
        )
    times = np.concatenate([[0.0], 0.5 * (edges[1:] + edges[:-1]), [end]])
    means = means[[0, *range(len(means)), -1]]
    within = STEADY
    while (corners := _corners(times, means, within)) is None:
        within *= 2.0
    return np.round(times[corners], 2), means[corners]


def _corners(time: np.ndarray, values: np.ndarray, within: float) -> np.ndarray | None:
    """Rows between which straight lines stay within so much of all others, their largest one among them (Douglas and
    Peucker 1973); None: more than MOST_LINES."""
    peak = int(np.argmax(values))
    corners, parts = {0, peak, len(values) - 1}, [(0, peak), (peak, len(values) - 1)]
    while parts and len(corners) <= MOST_LINES:
        a, b = parts.pop()
        ends = [a, b]
        off = np.abs(values[a : b + 1] - np.interp(time[a : b + 1], time[ends], values[ends]))
        k = a + int(np.argmax(off))
        if off[k - a] > within:
            corners.add(k)
            parts += [(a, k), (k, b)]
    return None if len(corners) > MOST_LINES else np.array(sorted(corners))
