"""The kernels by numba.njit(cache=True) alone: slower to compile, the same numbers, for a numba that nobody has tried.

Calls go direct, so each kernel is compiled inside each that calls it; nothing is published and nothing prepared.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def _compiler(**options: Any) -> Callable:
    """A decorator as numba.njit(**options), kept on disk."""
    return numba.njit(cache=True, error_model="numpy", **options)


inline = _compiler(forceinline=True)  # physics: scalars and tuples in and out
driver = _compiler(nogil=True)  # arrays and lane loops


def opaque(dispatcher: Any) -> Any:
    """The function itself."""
    return dispatcher


@inline
def by_reference(value):
    """The value itself."""
    return value


def link(dispatcher: Any, *args: Any, needed: bool = True) -> None:
    """Nothing: a caller compiles what it calls."""


def prepare(linker: Any, parts: tuple, entry: Any = None, arguments: tuple = ()) -> None:
    """Nothing: the entry is compiled at its first call."""


def ahead(needed: Callable[[], tuple]) -> None:
    """Nothing: one process compiles."""
