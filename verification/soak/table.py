"""The rows, R1 to R11 and S3 to S9.

S1 and S2, names and paths of recordings, are tests of the suite (test/io).
"""

from __future__ import annotations

from collections.abc import Callable

from ..stress.verdict import Stress, Verdict, run_test
from . import faults, files, hostile, pace

SOAK: dict[str, Stress] = {
    "R1": pace.idle,
    "R2": pace.loaded,
    "R3": pace.hoarded,
    "R4": faults.stopped,
    "R5": faults.stepped,
    "R6": faults.flooded,
    "R7": pace.hour,
    "R8": pace.stamp_to_tension,
    "R9": pace.first_ticks,
    "R10": faults.too_big,
    "R11": faults.silent,
    "S3": hostile.giants,
    "S4": hostile.discovery,
    "S5": files.files,
    "S6": hostile.scans,
    "S7": hostile.floods,
    "S8": hostile.foreign,
    "S9": hostile.policy,
}


def run(ids: tuple[str, ...], quick: bool, progress: Callable = lambda *_: None) -> list[Verdict]:
    """Run the chosen rows (all where none are named), in the order of SOAK."""
    chosen = [name for name in SOAK if not ids or name in ids]
    verdicts = []
    for i, name in enumerate(chosen):
        progress(f"{name} {SOAK[name].stimulus}", i, len(chosen))
        verdicts.append(run_test(name, SOAK[name], quick))
    return verdicts
