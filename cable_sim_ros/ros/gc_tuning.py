"""Keeps the interpreter out of the way of threads that wait for its lock."""

from __future__ import annotations

import gc
import sys

SWITCH = 5e-4  # s; a thread that waits for the lock gets it after this
NEVER = 1_000_000_000


def quiet() -> None:
    """Freeze what is loaded, and collect only young garbage from now on.

    A full collection walks every object with the lock held: 0.1 s with all this loaded, a second with five million
    objects, while inputs and outputs wait. The node makes no cycles that grow old (row R7 of `cable-sim soak`), so what
    a full collection would find does not come up.
    """
    gc.collect()
    gc.freeze()
    young, middle, _ = gc.get_threshold()
    gc.set_threshold(young, middle, NEVER)
    sys.setswitchinterval(SWITCH)
