"""Rows of a sweep on disk: Parquet files that grow by parts, each whole; what is there need not be computed again."""

from __future__ import annotations

import json
import os
import re
import secrets
import time
from pathlib import Path
from typing import Any

from ...errors import CableSimError, told_as
from ...files import open_file, whole

PART_ROWS, PART_SECONDS = 256, 5.0  # a part is written when it has so many rows, or is so old
COUNT = b"rows"  # in the metadata of a part: checksums are of its pages alone
NUMBER = re.compile(r"part-(\d+)")
EXTRA = "pip install 'cable_sim_ros[sweep]'"


class StoreError(CableSimError, ValueError):
    """Rows that cannot be read or written."""


class Store:
    """Folder of rows: `rows/part-*.parquet`. A part that was cut off by a power failure, or whose bytes are not those
    that were written, is set aside and named."""

    def __init__(self, folder: str | os.PathLike, look: bool = False) -> None:
        """look: nothing is written, made or set aside. Raises StoreError where the folder cannot be made or a library
        is missing."""
        missing = f"rows are kept as Parquet, and pyarrow is not installed: nothing was done; {EXTRA}"
        with told_as(StoreError, missing, of=ImportError):
            import pyarrow  # noqa: F401
        self.folder, self._look = Path(folder) / "rows", look
        self._own = secrets.token_hex(4)  # in the names of its parts: another sweep may be writing here
        if not look:
            with told_as(StoreError, f"{self.folder}: cannot be made", "; nothing was simulated"):
                self.folder.mkdir(parents=True, exist_ok=True)
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
            with open_file(path, "rb") as file:
                table = parquet.read_table(file, columns=["row"], page_checksum_verification=True)
            rows = {row["key"]: row for row in map(json.loads, table["row"].to_pylist())}
            whole = len(rows) == int((table.schema.metadata or {})[COUNT])
        except (pyarrow.ArrowException, OSError, ValueError, KeyError, TypeError):
            whole = False
        if whole:
            self.rows.update(rows)
            return
        self.damaged.append(path.name)
        if not self._look:
            path.rename(path.with_suffix(".damaged"))

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

        numbers = [int(found[1]) for p in self.folder.glob("part-*") if (found := NUMBER.match(p.name))]
        path = self.folder / f"part-{max(numbers, default=-1) + 1:06d}-{self._own}.parquet"
        text = [json.dumps(row, sort_keys=True) for row in self._waiting]
        table = pyarrow.table({"key": [row["key"] for row in self._waiting], "row": text})
        table = table.replace_schema_metadata({COUNT: str(len({row["key"] for row in self._waiting}))})
        lost = f"; {len(self._waiting)} rows are lost, those before are kept"
        after = f"{lost}. Make room, and start the sweep again: it goes on"
        with told_as(StoreError, f"{path}: cannot be written", after), whole(path) as part:
            parquet.write_table(table, part, write_page_checksum=True)
        self._waiting = []
