"""Response by finite differences: the other route, without the assumption that the tension varies slowly."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded
from scipy.sparse import csr_matrix

from .line import Line
from .modes import bands

CELLS_PER_WAVE, MIN_CELLS, MAX_CELLS = 60, 400, 20_000


def cells_for(line: Line, top: float) -> int:
    """Cells of a grid that resolves the waves of frequency top [Hz] where they are shortest."""
    at = np.linspace(0.0, line.length, 401)
    slowest = np.sqrt(line.tension(at) / line.mass(at)).min()
    return int(min(max(CELLS_PER_WAVE * line.length * top / slowest, MIN_CELLS), MAX_CELLS))


def fraction(line: Line, s: np.ndarray, cells: int) -> csr_matrix:
    """Matrix (len(s), cells - 1) that interpolates values of the inner points at s; its transpose shares out forces."""
    at = np.clip(s / line.length * cells, 0.0, cells)
    left = np.minimum(at.astype(int), cells - 1)
    rows = np.tile(np.arange(len(s)), 2)
    columns, weights = np.concatenate((left, left + 1)), np.concatenate((1.0 - (at - left), at - left))
    inner = (columns > 0) & (columns < cells)
    return csr_matrix((weights[inner], (rows[inner], columns[inner] - 1)), shape=(len(s), cells - 1))


def respond(line: Line, s: np.ndarray, mu: np.ndarray, load: np.ndarray, top: float) -> np.ndarray:
    """As `green.respond`; top [Hz], the largest frequency of all, sets the grid."""
    cells = cells_for(line, top)
    stiffness, mass = bands(line, cells)
    order = 2 if line.stiffness else 1
    kept = stiffness[2 - order : 3 + order].astype(complex)
    at = fraction(line, s, cells)
    out = np.empty(load.shape, complex)
    for k, square in enumerate(mu**2):
        matrix = kept.copy()
        matrix[order] -= square * mass
        out[:, k] = at @ solve_banded((order, order), matrix, at.T @ load[:, k], overwrite_ab=True, check_finite=False)
    return out
