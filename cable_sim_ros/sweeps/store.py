"""Rows of a sweep on disk: Parquet files that grow by parts, each whole; what is there need not be computed again."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import CableSimError

PART_ROWS, PART_SECONDS = 256, 5.0  # a part is written when it has so many rows, or is so old
EXTRA = "pip install 'cable_sim_ros[sweep]'"


class StoreError(CableSimError, ValueError):
    """Rows that cannot be read or written."""


class Store:
    """Folder of rows: `rows/part-*.parquet`. A part that was cut off by a power failure is set aside and named."""

    def __init__(self, folder: str | os.PathLike) -> None:
        """Raises StoreError where the folder cannot be made or a library is missing."""
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise StoreError(
                f"rows are kept as Parquet, and pyarrow is not installed: nothing was done; {EXTRA}"
            ) from None
        self.folder = Path(folder) / "rows"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot be made ({error.strerror}); nothing was simulated") from None
        self.damaged: list[str] = []
        self.rows: dict[str, dict[str, Any]] = {}
        self._waiting: list[dict[str, Any]] = []
        self._since = time.monotonic()
        for path in sorted(self.folder.glob("part-*.parquet")):
            self._load(path)

    def _load(self, path: Path) -> None:
        import pyarrow
        import pyarrow.parquet as parquet

        try:
            rows = [json.loads(text) for text in parquet.read_table(path, columns=["row"])["row"].to_pylist()]
        except (pyarrow.ArrowException, OSError, ValueError, KeyError):
            path.rename(path.with_suffix(".damaged"))
            self.damaged.append(path.name)
            return
        self.rows.update((row["key"], row) for row in rows)

    def add(self, row: dict[str, Any]) -> None:
        """Keep a row; it is on disk at the latest PART_SECONDS after the next row that comes, or at `flush`."""
        self.rows[row["key"]] = row
        self._waiting.append(row)
        if len(self._waiting) >= PART_ROWS or time.monotonic() - self._since > PART_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Write what waits as a part of its own, whole or not at all."""
        self._since = time.monotonic()
        if not self._waiting:
            return
        import pyarrow
        import pyarrow.parquet as parquet

        numbers = [int(p.stem.partition("-")[2]) for p in self.folder.glob("part-*")]
        path = self.folder / f"part-{max(numbers, default=-1) + 1:06d}.parquet"
        text = [json.dumps(row, sort_keys=True) for row in self._waiting]
        table = pyarrow.table({"key": [row["key"] for row in self._waiting], "row": text})
        try:
            parquet.write_table(table, path.with_suffix(".writing"))
            path.with_suffix(".writing").rename(path)
        except OSError as error:
            raise StoreError(
                f"{path}: cannot be written ({error.strerror}); {len(self._waiting)} rows are lost, those before are "
                "kept. Make room, and start the sweep again: it goes on"
            ) from None
        self._waiting = []

    def of(self, keys: Iterable[str]) -> list[dict[str, Any]]:
        """Rows by key, in the order that is asked for; KeyError for one that is not there."""
        return [self.rows[key] for key in keys]
