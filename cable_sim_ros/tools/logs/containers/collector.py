"""Numbers of many records of one source, kept compactly: a row for what each record has, a list for what some have."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence

import numpy as np

from ..log import LogError, Source
from .leaves import MAX_COLUMNS

MAX_NUMBERS = 2**28  # of one log, 2 GB
BLOCK = 4096  # rows that are lists
LAST = 2**63 - 1  # ns


class Collector:
    """Records of one source as they come; `source` makes columns of them."""

    def __init__(self, name: str, kind: str, columns: Sequence[str]) -> None:
        self.name, self.kind, self.columns = name, kind, list(columns)
        self.left_out: set[str] = set()  # columns above the limit
        self._rows: list[list[float]] = []
        self._blocks: list[np.ndarray] = []
        self._more: dict[str, tuple[array, array]] = {}  # column: numbers of records, values
        self._logged, self._device = array("q"), array("q")
        self._stamped = True

    def __len__(self) -> int:
        return len(self._logged)

    @property
    def numbers(self) -> int:
        """That its columns will have."""
        return len(self) * (len(self.columns) + len(self._more))

    def add(self, fixed: list[float], more: Mapping[str, float], logged: int, device: int | None) -> None:
        """One record; times in ns. OverflowError for one that no clock shows, before anything is kept."""
        stamp = device if device is not None else 0
        if not (0 <= logged <= LAST and -LAST <= stamp <= LAST):
            raise OverflowError("a time is beyond the year 2262")
        number = len(self._logged)
        for column, value in more.items():
            kept = self._more.get(column)
            if kept is None:
                if len(self._more) + len(self.columns) >= MAX_COLUMNS:
                    self.left_out.add(column[:80] if len(self.left_out) < MAX_COLUMNS else "")
                    continue
                kept = self._more[column] = array("q"), array("d")
            kept[0].append(number)
            kept[1].append(value)
        self._logged.append(logged)
        self._device.append(stamp)
        self._stamped = self._stamped and device is not None
        self._rows.append(fixed)
        if len(self._rows) == BLOCK:
            self._pack()

    def _pack(self) -> None:
        self._blocks.append(np.array(self._rows, np.float64).reshape(len(self._rows), len(self.columns)))
        self._rows = []

    def source(self) -> Source:
        """The source; a device's clock that always shows zero is none. LogError where its numbers are too many."""
        if self.numbers > MAX_NUMBERS:
            raise LogError(f"{self.name}: {self.numbers} numbers are more than {MAX_NUMBERS}; cut the log into parts")
        self._pack()
        rows = np.concatenate(self._blocks)
        columns = {name: np.ascontiguousarray(rows[:, k]) for k, name in enumerate(self.columns)}
        for name, (numbers, values) in self._more.items():
            column = np.full(len(self), np.nan)
            column[np.frombuffer(numbers, np.int64)] = np.frombuffer(values, np.float64)
            columns[name] = column
        device = np.array(self._device, np.int64)
        told = self._stamped and bool(device.any())
        return Source(self.name, self.kind, np.array(self._logged, np.int64), device if told else None, columns)
