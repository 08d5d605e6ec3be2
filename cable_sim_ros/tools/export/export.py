"""A recorded run into a file of another program, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ...files import whole
from .content import TABLES, Content, ExportError, gather
from .formats import WRITERS, need

NEEDS = {"nc": ("xarray", "h5netcdf"), "parquet": ("pyarrow",)}


class Exported(NamedTuple):
    """What was written: files, tick outputs, columns of one number, verdict of the run."""

    files: tuple[Path, ...]
    ticks: int
    columns: int
    verdict: str


def export(
    run: str | os.PathLike,
    out: str | os.PathLike,
    form: str | None = None,
    fields: Sequence[str] = (),
    every: float | None = None,
    tables: Sequence[str] = (),
    force: bool = False,
) -> Exported:
    """Write a recording, or the folder of a run, to `out`. form: csv, nc, parquet, mat; none: by the suffix.

    Raises ExportError, BagError, ResourceError.
    """
    out = Path(out)
    form = form or out.suffix.lower().removeprefix(".")
    if form not in WRITERS:
        raise ExportError(
            f"--out {out}: its ending says no format; nothing was written. Give a file that ends in "
            f"{', '.join(f'.{name}' for name in WRITERS)}, or --format"
        )
    for name in tables:
        if name not in TABLES:
            known = ", ".join(TABLES)
            raise ExportError(f"--tables {name}: there is no such table; nothing was written. Known: {known}")
    for module in NEEDS.get(form, ()):
        need(module, form)
    tables = list(dict.fromkeys(tables))
    write, write_table = WRITERS[form]
    beside = {name: out.with_name(f"{out.stem}.{name}{out.suffix}") for name in tables} if write_table else {}
    for path in (out, *beside.values()):
        _free(path, force)
    content = gather(run, fields, every, tables)
    _whole(out, partial(write, content))
    if write_table:
        for table in content.tables:
            _whole(beside[table.name], partial(write_table, content, table))
    columns = sum(len(field.axes) or 1 for field in content.fields)
    return Exported((out, *beside.values()), content.ticks, columns, _state(content))


def _state(content: Content) -> str:
    return content.provenance["verdict"]


def _free(path: Path, force: bool) -> None:
    if path.is_dir():
        raise ExportError(f"--out {path}: is a folder; nothing was written. Give the name of a file in it")
    if path.exists() and not force:
        raise ExportError(
            f"--out {path}: is there already; nothing was written. Give another name, or --force to replace it"
        )


def _whole(path: Path, write: Callable[[Path], None]) -> None:
    """Write it, so that a full disk leaves no half of it."""
    try:
        with whole(path) as part:
            write(part)
    except ExportError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise ExportError(
            f"--out {path}: cannot be written ({getattr(error, 'strerror', None) or error}); what was there before is "
            f"as it was. Give a file in a folder that is there, on a disk with room"
        ) from None
