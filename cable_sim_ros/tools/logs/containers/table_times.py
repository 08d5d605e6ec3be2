"""Which columns of a table are its time, and how they are read."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal

import numpy as np

from ..log import DAY, ahead_of, clock_of, day_of

UNITS = {"s": 10**9, "sec": 10**9, "secs": 10**9, "seconds": 10**9, "ms": 10**6, "us": 10**3, "µs": 10**3, "ns": 1}
UNITS |= {"min": 60 * 10**9, "h": 3600 * 10**9}
SINCE, UNTIL = 10**17, 72 * 10**17  # ns since 1970 that are taken as a date: 1973 to 2198
NUMBER = re.compile(r"[+-]?\d{1,20}(?:\.\d{0,30})?(?:[eE][+-]?\d{1,2})?", re.ASCII)
PARTS = r"(?:(\d{4})([-/.])(\d{1,2})\2(\d{1,2})|(\d{1,2})([-/.])(\d{1,2})\6(\d{4}))"
CLOCK = r"(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,12}))?)?\s*([aApP][mM])?"
ZONE = r"\s*(Z|z|UTC|GMT|[+-]\d{2}:?\d{2})?"
FULL = re.compile(rf"\s*{PARTS}(?:[T ]\s*{CLOCK}{ZONE})?\s*", re.ASCII)
OF_DAY = re.compile(rf"\s*{CLOCK}{ZONE}\s*", re.ASCII)


def _time_of_day(hour: str, minute: str, second: str | None, part: str | None, half: str | None) -> int:
    h = int(hour)
    if half:
        if not 1 <= h <= 12:
            raise ValueError(f"{h} {half} is no time")
        h = h % 12 + (12 if half.lower() == "pm" else 0)
    return clock_of(h, int(minute), int(second or 0), (part or "")[:9].encode())


def instant(text: str, month_first: bool = False) -> int | None:
    """ns since 1970 of a date with or without a time, in UTC where no zone is told; None if it is no date, or one
    before 1970 or behind 2200."""
    found = FULL.fullmatch(text)
    if found is None:
        return None
    year, _, month, day, first, _, second, last, *clock, zone = found.groups()
    if not year:
        year, month, day = (last, first, second) if month_first else (last, second, first)
    try:
        days = day_of(int(year), int(month), int(day))
        time = days + (_time_of_day(*clock) if clock[0] else 0) - ahead_of(zone)
    except ValueError:
        return None
    return time if 0 <= days and int(year) <= 2200 else None


def zoned(text: str) -> bool:
    """It says which zone it is of."""
    return bool(re.search(r"(Z|z|UTC|GMT|:\d{2}(?:[.,]\d+)?\s*[+-]\d{2}:?\d{2})\s*$", text))


def of_day(text: str) -> int | None:
    """ns since midnight; None if it is no time of day."""
    found = OF_DAY.fullmatch(text)
    try:
        return _time_of_day(*found.groups()[:5]) if found else None
    except ValueError:
        return None


def number(text: str, unit: int) -> int | None:
    """ns of a number of units, exact; None if it is none, or beyond 146 years either way of an epoch of its own."""
    text = text.strip().replace("D", "E").replace("d", "e")
    if NUMBER.fullmatch(text) is None:
        return None
    value = int(Decimal(text) * unit)
    return value if abs(value) < 2**63 else None


def unit_of_epoch(texts: Iterable[str]) -> int | None:
    """ns of the unit that makes dates of all these numbers, the largest that does; None: they count from a start."""
    for unit in (10**9, 10**6, 10**3, 1):
        values = [number(text, unit) for text in texts]
        if values and all(value is not None and SINCE <= value <= UNTIL for value in values):
            return unit
    return None


def month_first(texts: Iterable[str]) -> bool | None:
    """Whether dates such as 08/01/2014 have the month first; None: neither order is ruled out."""
    seen = [(int(found[5]), int(found[7])) for text in texts if (found := FULL.fullmatch(text)) and found[5]]
    days, months = sum(first > 12 for first, _ in seen), sum(second > 12 for _, second in seen)
    if days or months:
        return months > days
    return None if seen else False


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
