"""Signals of whatever was recorded: a run of this product, an imported bag, or a foreign log with a mapping."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from .log import LogError
from .own_signals import signals_of_bag
from .signals import Signal

Paths = str | os.PathLike | Sequence[str | os.PathLike]


def read_signals(path: Paths, mapping: str | os.PathLike | None = None, format: str | None = None) -> list[Signal]:
    """Signals of one or several files or folders.

    A recording of this product and an imported bag need no mapping. mapping: name of a ready one, or a YAML file;
    None: the first ready one whose sources are there; format: of FORMATS, None: found from the first bytes.
    LogError if nothing can be used.
    """
    paths = [Path(path)] if isinstance(path, (str, os.PathLike)) else [Path(one) for one in path]
    if not paths:
        raise LogError("no file was given: nothing was read. Give a log")
    if mapping is None and format is None and len(paths) == 1:
        own = signals_of_bag(paths[0])
        if own:
            return own
    raise LogError(f"{paths[0]}: is no recording of this program; nothing was read. Give one, or a mapping")
