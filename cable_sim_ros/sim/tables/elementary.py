"""Elementary functions and products of arrays that give the same bits on every processor with AVX2.

numpy computes exp, log, powers and most other functions by code of its own that it chooses by the processor: with
AVX-512 the last bit is another one. Products of matrices are left to a BLAS, which chooses in the same way. What a run
is made of takes these instead: the C library's functions, as the kernels do, and sums from left to right. Which names
depend on the processor is listed in test/house/test_same_bits.py, which looks for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations

import numpy as np
import numpy.typing as npt

MIN_TURN = 1e-17  # of the geometric mean of both diagonals: a smaller element turns nothing
SWEEPS = 50  # six are enough: it converges quadratically


def _of(function: Callable[..., float]) -> Callable[..., np.ndarray]:
    def mapped(*x: npt.ArrayLike) -> np.ndarray:
        arrays = np.broadcast_arrays(*x)
        values = [function(*row) for row in zip(*(array.ravel().tolist() for array in arrays), strict=True)]
        return np.array(values, float).reshape(arrays[0].shape)

    return mapped


# of arrays or numbers, to an array of their common shape; OverflowError and ValueError where `math` raises them
exp, log, tanh = _of(math.exp), _of(math.log), _of(math.tanh)
power, arctan2 = _of(math.pow), _of(math.atan2)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """[..., m] of a [..., k] times the matrix b [k, m], or times the vector b [k]: [...]."""
    total = a[..., 0, None] * b[0] if b.ndim > 1 else a[..., 0] * b[0]
    for k in range(1, len(b)):
        total = total + (a[..., k, None] * b[k] if b.ndim > 1 else a[..., k] * b[k])
    return total


def principal(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues [n], ascending, and eigenvectors [n, n] in columns, of a small symmetric matrix.

    Cyclic rotations after Jacobi: each makes one element zero.
    """
    a, n = np.array(matrix, float).tolist(), len(matrix)
    v = np.eye(n).tolist()
    for _ in range(SWEEPS):
        turned = False
        for p, q in combinations(range(n), 2):
            if abs(a[p][q]) <= MIN_TURN * math.sqrt(abs(a[p][p] * a[q][q])):
                continue
            turned = True
            tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q])
            t = math.copysign(1.0, tau) / (abs(tau) + math.sqrt(1.0 + tau * tau))
            c = 1.0 / math.sqrt(1.0 + t * t)
            for rows in (a, v):  # columns p and q of both
                for row in rows:
                    row[p], row[q] = c * (row[p] - t * row[q]), c * (t * row[p] + row[q])
            a[p], a[q] = (
                [c * (x - t * y) for x, y in zip(a[p], a[q], strict=True)],
                [c * (t * x + y) for x, y in zip(a[p], a[q], strict=True)],
            )
            a[p][q] = a[q][p] = 0.0
        if not turned:
            break
    values = np.array([a[i][i] for i in range(n)])
    order = np.argsort(values, kind="stable")
    return values[order], np.array(v)[:, order]
