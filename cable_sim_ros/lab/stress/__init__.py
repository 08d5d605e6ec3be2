"""Stress tests N1 to N19: ``cable-sim stress``. Each has a stimulus, a limit that is not tuned, and measured figures."""

from __future__ import annotations

from . import contact, endure, exact, loose, sea, snap, stiff  # noqa: F401 - the tests declare themselves
from .registry import TESTS, Stress, Verdict, run_test


class StressError(ValueError):
    """A stress test that is asked for and does not exist."""


def chosen(ids: tuple[str, ...] = ()) -> list[Stress]:
    """The tests of these ids, or all, in the order of their numbers. Raises StressError."""
    unknown = [i for i in ids if i.upper() not in TESTS]
    if unknown:
        raise StressError(f"there is no stress test {', '.join(unknown)}; nothing was run. There are {', '.join(order())}")
    wanted = {i.upper() for i in ids}
    return [TESTS[i] for i in order() if not wanted or i in wanted]


def order() -> list[str]:
    """All ids by number."""
    return sorted(TESTS, key=lambda i: int(i[1:]))


__all__ = ["StressError", "Verdict", "chosen", "run_test"]
