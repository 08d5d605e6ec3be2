"""Compilation: decorators, lane count, calls of heavy kernels, by one of two ways.

As it is, what is compiled is kept on disk by its content (kernel_key.py, kernel_cache.py): an edit compiles anew what
it is part of, in whatever file, and nothing else. ``NUMBA_CACHE_DIR`` moves the folder, as usual. This way knows
private parts of numba. With ``CABLE_SIM_COMPILER=numba`` (start.py) the kernels are compiled by numba.njit alone
(plain.py): an edit of any of them compiles all, in one process, to the same numbers.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np

from .kernel_cache import files

PLAIN = os.environ.get("CABLE_SIM_COMPILER") == "numba"
YES, NO = np.bool_(True), np.bool_(False)  # not literals: a literal argument compiles a second version
LANES = 16  # elements per lane loop; 8 is unrolled before the vectoriser sees it


def foreign_folder() -> Path:
    """Folder of what numba itself keeps: named by the sources of kernels, which these may call."""
    digest = hashlib.sha256(numba.__version__.encode())
    rooms = (Path(__file__).parents[1] / name for name in ("compiler", "physics", "sim"))
    for source in sorted(path for room in rooms for path in room.glob("**/*.py")):
        digest.update(source.read_bytes())
    return files.first().parent / digest.hexdigest()[:16]


def plain(function: Callable) -> Callable:
    """What a kernel is compiled from, as plain Python."""
    return getattr(function, "py_func", function)


if PLAIN or numba.config.CACHE_DIR in ("", os.environ.get("NUMBA_CACHE_DIR")):  # else a program's own choice
    numba.config.CACHE_DIR = str(foreign_folder())

if PLAIN:
    from .plain import ahead, by_reference, driver, inline, link, opaque, prepare
else:
    from .by_symbol import by_reference, driver, inline, link, opaque
    from .compiling import ahead, prepare

__all__ = [
    "LANES",
    "NO",
    "PLAIN",
    "YES",
    "ahead",
    "by_reference",
    "driver",
    "foreign_folder",
    "inline",
    "link",
    "opaque",
    "plain",
    "prepare",
]
