"""Parquet tables: the source `table`; a column of timestamps, or one named as a time, is the clock."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ....files import open_file
from ..formats import extra
from ..log import Log, LogError, Source
from .bounded import read_bounded
from .csv_log import split_name
from .table_times import numeric_clock

MAGIC = b"PAR1"
UNITS = (b"units", b"unit")  # of a field's metadata


def recognise(head: bytes, path: Path) -> bool:
    """By its first four bytes."""
    return head.startswith(MAGIC)


def read(path: Path) -> Log:
    """Read a Parquet file. LogError if pyarrow is not there or cannot read it."""
    return read_bounded(__name__, path)


def prepare() -> None:
    """Import the library, where it is there, and what it imports when it reads."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return
    pyarrow.chunked_array([[0.0]]).to_numpy()


def read_here(path: Path) -> Log:
    """Read in this process, without bounds."""
    extra("pyarrow", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    log = Log(str(path), "parquet", {}, 0)
    parts = []
    with open_file(path, "rb") as data, pq.ParquetFile(data, pre_buffer=False) as file:
        for k in range(file.num_row_groups):
            rows = file.metadata.row_group(k).num_rows
            try:
                table = file.read_row_group(k, use_threads=False)
                table.validate(full=True)
                parts.append(table)
            except (pa.ArrowException, OSError, ValueError) as error:
                why = " ".join(str(error).split())[:100]
                log.losses.add("row group that cannot be read", f"group {k}: {why}", max(1, rows))
    if not parts:
        raise LogError(f"{path}: {log.losses if log.losses else 'has no rows'}; nothing was read. Give another copy")
    table = pa.concat_tables(parts)
    while any(pa.types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    log.sources["table"] = _source(path, table, log)
    log.records = len(log.sources["table"])
    return log


def _source(path: Path, table: Any, log: Log) -> Source:
    import pyarrow as pa

    clocks: dict[bool, np.ndarray] = {}
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    texts, timed = [], np.ones(table.num_rows, bool)
    for k, field in enumerate(table.schema):
        name, unit = split_name(field.name)
        name = field.name if name in columns else name
        told = next((field.metadata[key] for key in UNITS if key in (field.metadata or {})), b"")
        unit = told.decode("utf-8", "replace") or unit
        kind, column = field.type, table.column(k)
        if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
            if True not in clocks:
                stamps = column.cast(pa.timestamp("ns", getattr(kind, "tz", None)), safe=True).cast(pa.int64())
                timed &= ~np.asarray(column.is_null().to_numpy())
                clocks[True] = np.asarray(stamps.fill_null(0).to_numpy(), np.int64)
                if not getattr(kind, "tz", None):
                    log.notices.append(f"{field.name} names no zone and is taken as UTC")
            continue
        if pa.types.is_boolean(kind):
            column = column.cast(pa.uint8())
        elif pa.types.is_decimal(kind):
            column = column.cast(pa.float64(), safe=False)
        elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
            texts.append(field.name)
            continue
        clock = numeric_clock(field.name, unit, column.to_numpy()) if not column.null_count else None
        if clock is not None and clock[0] not in clocks:
            clocks[clock[0]] = clock[1]
            continue
        columns[name] = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), np.float64)
        if unit:
            units[name] = unit
    if not clocks:
        raise LogError(
            f"{path}: has no column of time among {', '.join(table.schema.names[:12])}; nothing was read. Name one time"
        )
    if texts:
        log.notices.append(f"columns without numbers are left out: {', '.join(texts[:12])}")
    if not timed.all():
        log.losses.add("row without a time", f"row {int(np.argmin(timed)) + 1}", int(len(timed) - timed.sum()))
    columns = {name: values[timed] for name, values in columns.items()}
    logged, device = (clocks[kind][timed] if kind in clocks else None for kind in (True, False))
    return Source("table", "parquet", logged, device, columns, units)
