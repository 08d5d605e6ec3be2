"""What a reader makes of a foreign log: sources with times and columns of numbers, and what could not be read.

A source is what the log itself keeps apart: a topic, a kind of sentence, a message of one device, a table. Numbers are
as the log has them, in its own units and signs; `mapping` says what they mean. Every reader counts its records, keeps
what is before the first damage, and takes no size or count of the file on trust.

Stamps that loggers write in front of a line: forms, and ns since 1970 of each.

2014-08-01T00:00:00.16Z   2015/03/14 00:23:02.260   20140801T000000.16+02:00   calendar time, a zone or none
1397773523.009   1397773523009                                                 seconds, ms, us or ns since 1970
08/01/2014,00:00:00.16                                                         SCS of NOAA: month first
\\c:1397773523,s:gps*5B\\                                                        tag block of NMEA 0183
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from datetime import date
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import NO_PLACE, CableSimError, told_as

SECOND = 1_000_000_000  # ns

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


class LogError(CableSimError, ValueError):
    """A log that cannot be read, or a mapping that does not fit it: file, place, value, consequence, remedy."""


def unread(path: Path) -> AbstractContextManager[None]:
    """LogError in place of what opening and reading a file raise."""
    return told_as(LogError, f"{path}: cannot be read", "; nothing was read. Give a file that is there", NO_PLACE)


@dataclass
class Source:
    """Records of one kind, in the order of the file.

    logged: stamps of the logger, int64 [n] ns since 1970, None where there are none; device: of the device's own clock,
    ns from an epoch of its own, None where it tells none; columns: path of a field -> float64 [n], NaN where a record
    has no such number; units: of the columns whose format tells them; kind: type of the message, or what the format is;
    left: names of columns that were read and not kept; doubts: of every value of it, a line each.
    """

    name: str
    kind: str
    logged: np.ndarray | None
    device: np.ndarray | None
    columns: dict[str, np.ndarray]
    units: dict[str, str] = field(default_factory=dict)
    left: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def stamps(self) -> np.ndarray | None:
        """Of the logger, else of the device; None where there are neither."""
        return self.logged if self.logged is not None else self.device

    def __len__(self) -> int:
        first = self.stamps
        if first is None:
            first = next(iter(self.columns.values()), None)
        return 0 if first is None else len(first)


@dataclass
class Losses:
    """Records that were not read, by cause, with the place of the first of each; false while nothing is lost."""

    counts: dict[str, int] = field(default_factory=dict)
    first: dict[str, str] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.counts)

    def add(self, cause: str, place: str, count: int = 1) -> None:
        """cause: a few words of a fixed set, such as "wrong checksum"; place: "line 12", "byte 4711"."""
        self.counts[cause] = self.counts.get(cause, 0) + count
        self.first.setdefault(cause, place)

    @property
    def total(self) -> int:
        """Records that were lost."""
        return sum(self.counts.values())

    def __str__(self) -> str:
        if not self.counts:
            return "nothing was lost"
        return "; ".join(f"{n} x {cause}, first at {self.first[cause]}" for cause, n in self.counts.items())


@dataclass
class Log:
    """A log as it was read: path, name of the format, sources by name, records that were read, and the losses.

    notices: what a user should know of it that is no loss, each one line; left: names of sources that were not kept;
    begin: first stamp [ns] of all that was read, None: that of the sources.
    """

    path: str
    format: str
    sources: dict[str, Source]
    records: int
    losses: Losses = field(default_factory=Losses)
    notices: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    begin: int | None = None


class Builder:
    """Collects records, one at a time or in blocks, and makes the sources of a Log of them.

    Columns that a later record adds are NaN before it. Numbers only; times in ns.
    """

    def __init__(self) -> None:
        self._rows: dict[str, list[tuple[int | None, int | None, Mapping[str, float], Mapping[str, str]]]] = {}
        self._kinds: dict[str, str] = {}
        self.mixed: list[str] = []  # columns whose records tell several units, a line each

    def add(
        self,
        source: str,
        kind: str,
        values: Mapping[str, float],
        *,
        logged: int | None = None,
        device: int | None = None,
        units: Mapping[str, str] | None = None,
    ) -> None:
        """One record. units: of the fields whose format tells them; of a source those that most records tell."""
        rows = self._rows.get(source)
        if rows is None:
            rows = self._rows[source] = []
            self._kinds[source] = kind
        rows.append((logged, device, values, units or {}))

    @property
    def records(self) -> int:
        """Records so far."""
        return sum(map(len, self._rows.values()))

    def sources(self) -> dict[str, Source]:
        """All sources by name; a clock that some record lacks is not a clock of its source."""
        return {name: self._source(name, rows) for name, rows in self._rows.items()}

    def _source(self, name: str, rows: list) -> Source:
        names = list(dict.fromkeys(column for _, _, values, _ in rows for column in values))
        columns = {
            column: np.array([values.get(column, np.nan) for _, _, values, _ in rows], np.float64) for column in names
        }
        logged, device = (_times([row[k] for row in rows]) for k in (0, 1))
        return Source(name, self._kinds[name], logged, device, columns, self._units_of(name, rows, columns))

    def _units_of(self, name: str, rows: list, columns: dict[str, np.ndarray]) -> dict[str, str]:
        """Unit of each column that most records tell; the values of the others are none."""
        told = Counter(pair for _, _, _, units in rows for pair in units.items())
        found: dict[str, str] = {}
        for (column, unit), count in told.most_common():
            if found.setdefault(column, unit) != unit and column in columns:
                other = np.array([units.get(column) == unit for _, _, _, units in rows])
                columns[column][other] = np.nan
                self.mixed.append(f"{name}: {count} records have {column} in {unit}, not in {found[column]}: left out")
        return found


def _times(stamps: list[int | None]) -> np.ndarray | None:
    return None if None in stamps else np.array(stamps, np.int64)


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
    for form, read in ((_CALENDAR, _calendar), (_NUMBER, _epoch), (_MONTH_FIRST, _month_first), (_TAG, _epoch)):
        found = form.match(line, start)
        with suppress(ValueError, OverflowError):  # a date or time that is none
            if found is not None:
                time, kind = read(found)
                behind = line[found.end() :]
                behind = behind[1:] if behind[:1] in (b",", b";") else behind
                return Stamp(within(time), len(line) - len(behind.lstrip(b" \t")), kind)
    return None


def _calendar(found: re.Match[bytes]) -> tuple[int, str]:
    year, _, month, day, *clock, zone = found.groups()
    return _at(year, month, day, clock) - ahead_of((zone or b"").decode()), UTC if zone else NO_ZONE


def _epoch(found: re.Match[bytes]) -> tuple[int, str]:
    seconds, *fractions = found.groups()
    return int(seconds) * SECOND + nanoseconds(next(filter(None, fractions), None)), EPOCH


def _month_first(found: re.Match[bytes]) -> tuple[int, str]:
    month, day, year, *clock = found.groups()
    return _at(year, month, day, clock), MONTH_FIRST


def _at(year: bytes, month: bytes, day: bytes, clock: list[bytes]) -> int:
    hours, minutes, seconds, fraction = clock
    return day_of(int(year), int(month), int(day)) + clock_of(int(hours), int(minutes), int(seconds), fraction)
