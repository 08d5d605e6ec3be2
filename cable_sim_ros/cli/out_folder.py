"""The folder of ``--out``: made and tried before anything is run, so that nothing is run for a folder that is none."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click


def ready(out: Path | None) -> None:
    """Make the folder and try to write in it; None: none was asked for. click.UsageError, code 2, where not."""
    if out is None:
        return
    try:
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        why = getattr(error, "strerror", None) or str(error)
        raise click.UsageError(
            f"--out {out}: cannot be made or written ({why}); nothing was run. Give a folder that can be"
        ) from None
