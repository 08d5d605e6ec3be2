"""Stamps that loggers write in front of a line: forms, and ns since 1970 of each.

2014-08-01T00:00:00.16Z   2015/03/14 00:23:02.260   20140801T000000.16+02:00   calendar time, a zone or none
1397773523.009   1397773523009                                                 seconds, ms, us or ns since 1970
08/01/2014,00:00:00.16                                                         SCS of NOAA: month first
\\c:1397773523,s:gps*5B\\                                                        tag block of NMEA 0183
"""

from __future__ import annotations

import re
from datetime import date
from functools import lru_cache
from typing import NamedTuple

from .log import SECOND

UTC, NO_ZONE, EPOCH, MONTH_FIRST = "UTC", "no zone", "seconds since 1970", "month first"
DAY = 86_400 * SECOND
FARTHEST_ZONE = 14 * 60  # minutes: Kiribati
LAST = 106_000 * DAY  # the year 2260
_CLOCK = rb"(\d\d):?(\d\d):?(\d\d)(?:[.,](\d{1,9})\d*)?"
_CALENDAR = re.compile(
    rb"[\[(]?(\d{4})([-/]?)(\d\d)\2(\d\d)[T ,;\t_-]" + _CLOCK + rb"(Z|[+-]\d\d:?\d\d)?[\])]?(?![\w.])"
)
_MONTH_FIRST = re.compile(rb"(\d\d)/(\d\d)/(\d{4})[ ,;\t]" + _CLOCK + rb"(?![\d.])")
_NUMBER = re.compile(rb"[\[(]?(\d{10})(?:\.(\d{1,9})\d*|(\d{3}|\d{6}|\d{9}))?[\])]?(?![\w.])")
_TAG = re.compile(rb"\\[^\\]*?\bc:(\d{10})(\d{3})?[^\\]*\\")


class Stamp(NamedTuple):
    """time: ns since 1970; end: where what it stamps begins; form: UTC, NO_ZONE, EPOCH or MONTH_FIRST."""

    time: int
    end: int
    form: str


@lru_cache(maxsize=64)
def day_of(year: int, month: int, day: int) -> int:
    """ns since 1970 of midnight; ValueError for a date that is none."""
    return within((date(year, month, day).toordinal() - 719_163) * DAY)


def clock_of(hours: int, minutes: int, seconds: int, fraction: bytes | None) -> int:
    """ns since midnight; a leap second is read, ValueError for a time that is none."""
    if hours > 23 or minutes > 59 or seconds > 60:
        raise ValueError(f"{hours}:{minutes}:{seconds} is no time")
    return (3600 * hours + 60 * minutes + seconds) * SECOND + nanoseconds(fraction)


def ahead_of(zone: str | None) -> int:
    """ns that a zone such as +02:00 is ahead of UTC, 0 where it has no sign; ValueError for one that there is not."""
    if not zone or zone[0] not in "+-":
        return 0
    minutes = 60 * int(zone[1:3]) + int(zone[-2:])
    if minutes > FARTHEST_ZONE or int(zone[-2:]) > 59:
        raise ValueError(f"{zone} is no zone")
    return (-minutes if zone[0] == "-" else minutes) * 60 * SECOND


def within(time: int) -> int:
    """The time [ns since 1970]; ValueError for a year that int64 does not hold."""
    if not -LAST <= time <= LAST:
        raise ValueError(f"{time // SECOND} s since 1970 is beyond what int64 holds in ns")
    return time


def nanoseconds(fraction: bytes | None) -> int:
    """Of the digits behind a point."""
    return int(fraction.ljust(9, b"0")) if fraction else 0


def stamp_of(line: bytes) -> Stamp | None:
    """The stamp in front of a line, or None."""
    start = len(line) - len(line.lstrip(b" \t"))
    for read in (_calendar, _number, _month_first, _tag):
        try:
            found = read(line, start)
        except (ValueError, OverflowError):
            continue  # a date or time that is none
        if found is not None:
            behind = line[found.end :]
            behind = behind[1:] if behind[:1] in (b",", b";") else behind
            return found._replace(end=len(line) - len(behind.lstrip(b" \t")))
    return None


def _calendar(line: bytes, start: int) -> Stamp | None:
    found = _CALENDAR.match(line, start)
    if found is None:
        return None
    year, _, month, day, hours, minutes, seconds, fraction, zone = found.groups()
    time = day_of(int(year), int(month), int(day)) + clock_of(int(hours), int(minutes), int(seconds), fraction)
    return Stamp(within(time - ahead_of((zone or b"").decode())), found.end(), UTC if zone else NO_ZONE)


def _number(line: bytes, start: int) -> Stamp | None:
    found = _NUMBER.match(line, start)
    if found is None:
        return None
    return Stamp(within(int(found[1]) * SECOND + nanoseconds(found[2] or found[3])), found.end(), EPOCH)


def _month_first(line: bytes, start: int) -> Stamp | None:
    found = _MONTH_FIRST.match(line, start)
    if found is None:
        return None
    month, day, year, hours, minutes, seconds, fraction = found.groups()
    time = day_of(int(year), int(month), int(day)) + clock_of(int(hours), int(minutes), int(seconds), fraction)
    return Stamp(within(time), found.end(), MONTH_FIRST)


def _tag(line: bytes, start: int) -> Stamp | None:
    found = _TAG.match(line, start)
    return None if found is None else Stamp(within(int(found[1]) * SECOND + nanoseconds(found[2])), found.end(), EPOCH)
