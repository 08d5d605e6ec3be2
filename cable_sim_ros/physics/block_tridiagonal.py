"""Block-tridiagonal solve: 6x6 blocks, Gauss-Jordan elimination with row exchange where a pivot asks for it.

Storage: band[i] is the 6x16 row [D_i | U_i | r_i | 0], lower[i] the block that couples node i to node i-1. U_i and r_i
are carried together: after node i they hold D_i^-1 U_i and D_i^-1 r_i. factor[i, k] keeps what was done to eliminate
column k: the multiples taken from the six rows, its own the reciprocal pivot, and the row it changed places with.
"""

from __future__ import annotations

from ..compiler.jit import driver
from ..compiler.simd import row_update

COLUMNS = 16
RHS = 12
SWAP, FACTOR_COLUMNS = 6, 7
GROWTH = 10.0  # a pivot this much smaller than another of its column is exchanged for it

less_1, less_2, less_4, less_row = row_update(1), row_update(2), row_update(4), row_update(COLUMNS)


@driver
def exchange(rows, row, k):
    """Bring the largest of column k, of the rows from ``row`` to the end of their block, to ``row``; returns whence."""
    p, best = row, abs(rows[row, k])
    for r in range(row + 1, row + 6 - k):
        if abs(rows[r, k]) > best:
            best, p = abs(rows[r, k]), r
    for c in range(COLUMNS):
        s = rows[row, c]
        rows[row, c] = rows[p, c]
        rows[p, c] = s
    return p


@driver
def solve(band, lower, factor, x):
    """Solve in place; solution into x[n, 6]. Returns False where a pivot vanishes or is not finite.

    band [n, 6, COLUMNS], lower [n, 6, 6]; they and factor [n, 6, FACTOR_COLUMNS] then serve solve_again().
    """
    n = band.shape[0]
    if band.shape[1] != 6 or band.shape[2] != COLUMNS or lower.shape[1] != 6 or lower.shape[2] != 6:
        raise ValueError("blocks")
    rows = band.reshape(6 * n, COLUMNS)
    for i in range(n):
        top = 6 * i
        if i > 0:
            for r in range(6):
                s = (lower[i, r, 0], lower[i, r, 1], lower[i, r, 2], lower[i, r, 3], lower[i, r, 4], lower[i, r, 5])
                less_4(rows, top + r, 0, s, rows, top - 6, 6)
                less_2(rows, top + r, 4, s, rows, top - 6, 10)
                less_1(rows, top + r, RHS, s, rows, top - 6, RHS)
        for k in range(6):
            pivot = top + k
            own, other = abs(rows[pivot, k]), 0.0
            for r in range(pivot + 1, top + 6):
                other = max(other, abs(rows[r, k]))
            factor[i, k, SWAP] = k
            if not GROWTH * own >= other:
                factor[i, k, SWAP] = exchange(rows, pivot, k) - top
                own = abs(rows[pivot, k])
            if not (own > 0.0 and own < 1e300):
                return False
            s = 1.0 / rows[pivot, k]
            for r in range(6):
                if r != k:
                    f = rows[top + r, k] * s
                    factor[i, k, r] = f
                    less_row(rows, top + r, 0, (f,), rows, pivot, 0)
            factor[i, k, k] = s
            for c in range(COLUMNS):
                rows[pivot, c] *= s
    for i in range(n):
        for r in range(6):
            x[i, r] = band[i, r, RHS]
    substitute(band, x)
    return True


@driver
def substitute(band, x):
    """Back substitution: x holds D_i^-1 r_i and becomes the solution."""
    n = band.shape[0]
    for j in range(1, n):
        i = n - 1 - j
        for r in range(6):
            s = x[i, r]
            for c in range(6):
                s -= band[i, r, 6 + c] * x[i + 1, c]
            x[i, r] = s


@driver
def solve_again(band, lower, factor, x):
    """Solve for a new right-hand side in column RHS with what solve() left in band, lower and factor."""
    for i in range(band.shape[0]):
        for r in range(6):
            s = band[i, r, RHS]
            if i > 0:
                for c in range(6):
                    s -= lower[i, r, c] * x[i - 1, c]
            x[i, r] = s
        for k in range(6):
            p = int(factor[i, k, SWAP])
            s, x[i, p] = x[i, p], x[i, k]
            for r in range(6):
                if r != k:
                    x[i, r] -= factor[i, k, r] * s
            x[i, k] = factor[i, k, k] * s
    substitute(band, x)
