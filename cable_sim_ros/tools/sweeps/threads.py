"""What a worker begins with; imports nothing that loads a library of linear algebra, for these look once, when loaded.

A worker imports the module of this function before it calls it.
"""

from __future__ import annotations

import multiprocessing
import os
import threading

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def begun() -> None:
    """First of all in a worker: one thread, and an end with the caller, of whom a signal leaves nobody to say it."""
    for name in ONE_THREAD:
        os.environ[name] = "1"
    threading.Thread(target=_end_with_caller, name="end_with_caller", daemon=True).start()


def _end_with_caller() -> None:
    caller = multiprocessing.parent_process()
    if caller is not None:
        caller.join()
        os._exit(1)  # the case in hand is lost; its rows are the caller's
