"""What a reader makes of a foreign log: sources with times and columns of numbers, and what could not be read.

A source is what the log itself keeps apart: a topic, a kind of sentence, a message of one device, a table. Numbers are
as the log has them, in its own units and signs; `mapping` says what they mean. Every reader counts its records, keeps
what is before the first damage, and takes no size or count of the file on trust.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...errors import CableSimError

SECOND = 1_000_000_000  # ns


class LogError(CableSimError, ValueError):
    """A log that cannot be read, or a mapping that does not fit it: file, place, value, consequence, remedy."""


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
        return Source(
            name,
            self._kinds[name],
            _times([row[0] for row in rows]),
            _times([row[1] for row in rows]),
            columns,
            self._units_of(name, rows, columns),
        )

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
