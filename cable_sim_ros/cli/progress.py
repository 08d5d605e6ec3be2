"""The progress bar of the command line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..terminal import clean, plain_console
from .answer import asks_json


@contextmanager
def progress_bar(unit: str = "s", quiet: bool = False) -> Iterator[Callable[[str, float, float], None]]:
    """Function (what, done, in all) that shows a bar on a terminal, else nothing; unit: of what is counted; quiet:
    show none, as with --json."""
    if quiet or asks_json() or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    texts = (TextColumn(f"{{task.{name}}}", markup=False) for name in ("description", "fields[now]"))
    columns = next(texts), BarColumn(), next(texts), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=plain_console(err=True), transient=True) as bar:
        task = bar.add_task("loading", total=None, now="")
        yield lambda what, done, total: bar.update(
            task,
            description=clean(what),
            completed=done,
            total=total or None,
            now=f"{done:.0f} of {total:.0f} {unit}" if total else "",
        )
