"""Static Newton on the product's own assembly, for cases that are not a shipboard tow."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "physics"))
from bench_cable import Bench


def settle(bench: Bench, held: list[int], load: np.ndarray, steps: int = 60, tolerance: float = 1e-8) -> np.ndarray:
    """Equilibrium of ``bench`` with the unknowns ``held`` fixed and the nodal load [nodes, 6]; returns the reactions.

    Damped Newton; raises where it does not converge.
    """
    free = np.setdiff1d(np.arange(bench.q.size), held)
    for _ in range(steps):
        r = bench.residual() - load
        if np.abs(r.ravel()[free]).max() < tolerance:
            return r
        k = bench.tangent(0.0, 0.0)
        d = np.zeros(bench.q.size)
        d[free] = -np.linalg.solve(k[np.ix_(free, free)], r.ravel()[free])
        d *= min(1.0, 0.3 / np.abs(d).max())
        bench.q += d.reshape(bench.q.shape)
    raise AssertionError(f"no equilibrium after {steps} steps, residual {np.abs(r.ravel()[free]).max():.3g}")
