"""Which columns of a table are its time, and how they are read."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from .text_times import DAY, UNITS, instant, month_first, number, of_day, unit_of_epoch, zoned

WORDS = {"time", "timestamp", "datetime", "utc", "gmt", "epoch", "stamp", "seconds", "sec", "elapsed", "date", "clock"}
EXACT = {"t", "s", "datum", "zeit", "uhrzeit", "zeitstempel"}
FEWEST = 0.7  # of the cells of a sample
STRAY = 4  # records in a row, at most, whose time of day is none


@dataclass
class Clock:
    """A column of time, or date and time: numbers of the columns; absolute: since 1970, else of an epoch of its own."""

    columns: tuple[int, ...]
    absolute: bool
    parse: Callable[[str], int | None]
    wraps: bool = False
    _turns: int = field(default=0)
    _last: int = field(default=0)

    def read(self, columns: Sequence[Sequence[str]]) -> tuple[np.ndarray, np.ndarray]:
        """Times of the rows [ns], and which rows tell one."""
        cells = columns[0] if len(columns) == 1 else [f"{a.strip()} {b.strip()}" for a, b in zip(*columns)]
        found = [self.parse(cell) for cell in cells]
        told = np.array([time is not None for time in found], bool)
        times = np.array([0 if time is None else time for time in found], np.int64)
        if self.wraps:
            times[told] = self._unwrapped(times[told])
        return times, told

    def _unwrapped(self, times: np.ndarray) -> np.ndarray:
        """Times of the day, counted on over midnight."""
        steps = np.diff(np.concatenate([[self._last], times]))
        back = steps < -DAY // 2
        for k in np.flatnonzero(back).tolist():  # no midnight where the clock comes back at once: records without it
            back[k] = not (steps[k + 1 : k + 1 + STRAY] > DAY // 2).any()
        turns = self._turns + np.cumsum(back)
        if len(times):
            self._last, self._turns = int(times[-1]), int(turns[-1])
        return times + turns * DAY


def clocks_of(
    names: Sequence[str], units: dict[str, str], sample: Sequence[Sequence[str]], notices: list[str]
) -> list[Clock]:
    """At most one clock since 1970 and one of its own epoch, from names and first rows; none where there is none."""
    named = [k for k, name in enumerate(names) if _is_time(name)] if sample else []
    found: dict[bool, Clock] = {}
    day = next((k for k in named if _most(_date, sample[k]) and not _most(_has_clock, sample[k])), None)
    pair = next((k for k in named if _most(of_day, sample[k])), None)
    if day is not None and pair is not None:
        both = [f"{a.strip()} {b.strip()}" for a, b in zip(sample[day], sample[pair])]
        found[True] = _dated((day, pair), both, notices)
    for k in [*named, *(k for k in range(len(sample)) if k not in named)]:
        if any(k in clock.columns for clock in found.values()):
            continue
        clock = _clock(k, units.get(names[k], ""), sample[k], k in named, notices if True not in found else [])
        if clock is not None and clock.absolute not in found:
            found[clock.absolute] = clock
    return [found[absolute] for absolute in (True, False) if absolute in found]


def _clock(k: int, unit: str, cells: Sequence[str], named: bool, notices: list[str]) -> Clock | None:
    if _most(_date, cells):
        return _dated((k,), cells, notices)
    if not named:
        return None
    if _most(of_day, cells):
        return Clock((k,), False, of_day, wraps=True)
    numbers = [cell for cell in cells if number(cell, 1) is not None]
    if len(numbers) < FEWEST * len(cells) or not numbers:
        return None
    told = UNITS.get(unit.lower())
    scale = unit_of_epoch(numbers) if told is None or unit == "s" else None
    if told is not None and scale is None:
        scale = told if unit_of_epoch([str(number(cell, told)) for cell in numbers]) == 1 else None
    if scale is not None:
        return Clock((k,), True, lambda cell: _since_1970(cell, scale))
    step = told or 10**9
    return Clock((k,), False, lambda cell: number(cell, step))


def _since_1970(cell: str, scale: int) -> int | None:
    time = number(cell, scale)
    return time if time is not None and time >= 0 else None


def _dated(columns: tuple[int, ...], cells: Sequence[str], notices: list[str]) -> Clock:
    order = month_first(cells)
    if order is None:
        notices.append(
            f"dates such as {cells[0].strip()[:40]} are taken as day, month, year: neither order is ruled out"
        )
    if not any(map(zoned, cells)):
        notices.append("times name no zone and are taken as UTC")
    return Clock(columns, True, lambda cell: instant(cell, bool(order)))


def _words(name: str) -> set[str]:
    return set(re.split(r"[^a-z0-9]+", re.sub(r"([a-z])([A-Z])", r"\1_\2", name).lower()))


def _is_time(name: str) -> bool:
    words = _words(name)
    plain = name.strip().lower()
    exact = plain in EXACT or plain.rpartition("_")[0] in EXACT  # also with a unit, t_s
    return bool(words & WORDS) or exact or any(word.startswith("time") for word in words)


def _most(parse: Callable[[str], int | None], cells: Sequence[str]) -> bool:
    return sum(parse(cell) is not None for cell in cells) >= max(1, FEWEST * len(cells))


def _date(cell: str) -> int | None:
    """In either order of day and month."""
    found = instant(cell)
    return instant(cell, True) if found is None else found


def _has_clock(cell: str) -> int | None:
    return 1 if ":" in cell else None


def numeric_clock(name: str, unit: str, values: np.ndarray) -> tuple[bool, np.ndarray] | None:
    """Whether a column is a clock since 1970 or of its own epoch, and its times [ns]; None: it is no time."""
    if not _is_time(name) or not len(values) or not np.isfinite(values).all():
        return None
    sample = [str(value) for value in values[:: max(1, len(values) // 100)].tolist()]
    clock = _clock(0, unit, sample, True, [])
    if clock is None:
        return None
    times, told = clock.read([[str(value) for value in values.tolist()]])
    return (clock.absolute, times) if told.all() else None
