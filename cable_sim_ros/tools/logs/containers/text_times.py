"""Times as tables write them: ISO 8601 and its relatives, date and time apart, time of day, numbers of an epoch."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import date
from decimal import Decimal
from functools import lru_cache

from ..stamps import FARTHEST_ZONE

DAY = 86_400_000_000_000  # ns
EPOCH = date(1970, 1, 1).toordinal()
UNITS = {"s": 10**9, "sec": 10**9, "secs": 10**9, "seconds": 10**9, "ms": 10**6, "us": 10**3, "µs": 10**3, "ns": 1}
UNITS |= {"min": 60 * 10**9, "h": 3600 * 10**9}
SINCE, UNTIL = 10**17, 72 * 10**17  # ns since 1970 that are taken as a date: 1973 to 2198
NUMBER = re.compile(r"[+-]?\d{1,20}(?:\.\d{0,30})?(?:[eE][+-]?\d{1,2})?", re.ASCII)
PARTS = r"(?:(\d{4})([-/.])(\d{1,2})\2(\d{1,2})|(\d{1,2})([-/.])(\d{1,2})\6(\d{4}))"
CLOCK = r"(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,12}))?)?\s*([aApP][mM])?"
ZONE = r"\s*(Z|z|UTC|GMT|[+-]\d{2}:?\d{2})?"
FULL = re.compile(rf"\s*{PARTS}(?:[T ]\s*{CLOCK}{ZONE})?\s*", re.ASCII)
OF_DAY = re.compile(rf"\s*{CLOCK}{ZONE}\s*", re.ASCII)


@lru_cache(1024)
def _days(year: int, month: int, day: int) -> int | None:
    """ns since 1970 of a day, None where there is none, or before 1970 or behind 2200."""
    try:
        days = date(year, month, day).toordinal() - EPOCH
    except ValueError:
        return None
    return days * DAY if 0 <= days and year <= 2200 else None


def _clock(hour: str, minute: str, second: str | None, part: str | None, half: str | None) -> int | None:
    h, m, s = int(hour), int(minute), int(second or 0)
    if half:
        if not 1 <= h <= 12:
            return None
        h = h % 12 + (12 if half.lower() == "pm" else 0)
    if h > 23 or m > 59 or s > 60:  # 60: a leap second
        return None
    return (h * 3600 + m * 60 + s) * 10**9 + int((part or "").ljust(9, "0")[:9])


def instant(text: str, month_first: bool = False) -> int | None:
    """ns since 1970 of a date with or without a time, in UTC where no zone is told; None if it is no date."""
    found = FULL.fullmatch(text)
    if found is None:
        return None
    year, _, month, day, first, _, second, last, *clock, zone = found.groups()
    if year:
        days = _days(int(year), int(month), int(day))
    else:
        days = _days(int(last), int(first if month_first else second), int(second if month_first else first))
    since = _clock(*clock) if clock[0] else 0
    ahead = _offset(zone)
    return None if days is None or since is None or ahead is None else days + since - ahead


def _offset(zone: str | None) -> int | None:
    """ns that a zone is ahead of UTC; None for one that there is not."""
    if not zone or zone[0] not in "+-":
        return 0
    minutes = int(zone[1:3]) * 60 + int(zone[-2:])
    if minutes > FARTHEST_ZONE or int(zone[-2:]) > 59:
        return None
    return (-minutes if zone[0] == "-" else minutes) * 60 * 10**9


def zoned(text: str) -> bool:
    """It says which zone it is of."""
    return bool(re.search(r"(Z|z|UTC|GMT|:\d{2}(?:[.,]\d+)?\s*[+-]\d{2}:?\d{2})\s*$", text))


def of_day(text: str) -> int | None:
    """ns since midnight; None if it is no time of day."""
    found = OF_DAY.fullmatch(text)
    return _clock(*found.groups()[:5]) if found else None


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
