"""Stability stress N1 to N19: stimulus, measured, limit. ``cable-sim stress``."""

from __future__ import annotations

from collections.abc import Callable

from . import contact, detach, endure, exact, loose, sea, snap, stiff, tows  # noqa: F401 - the tests declare themselves
from .registry import TESTS, Verdict, run_test

ORDER = tuple(sorted(TESTS, key=lambda name: int(name[1:])))


def run(ids: tuple[str, ...], quick: bool, progress: Callable = lambda *_: None) -> list[Verdict]:
    """Run the chosen tests (all where none are named), in their order."""
    chosen = [name for name in ORDER if not ids or name in ids]
    verdicts = []
    for i, name in enumerate(chosen):
        progress(f"{name} {TESTS[name].stimulus}", i, len(chosen))
        verdicts.append(run_test(TESTS[name], quick))
    return verdicts
