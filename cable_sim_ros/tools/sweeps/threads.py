"""One thread for the libraries of linear algebra; imports nothing that loads them, for they look once, when loaded."""

from __future__ import annotations

import os

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_thread() -> None:
    """Before anything else in a worker: the libraries of linear algebra take one thread."""
    for name in ONE_THREAD:
        os.environ[name] = "1"
