"""Block-tridiagonal solve: 6x6 blocks, elimination with partial pivoting inside each block.

Storage: band[i] is the 6x16 row [D_i | U_i | r_i | 0], lower[i] the block that couples node i to node i-1. U_i and r_i
are carried together: after node i they hold D_i^-1 U_i and D_i^-1 r_i.
"""

from __future__ import annotations

import numpy as np

from .jit import driver

COLUMNS = 16
RHS = 12


@driver
def solve(band, lower, x):
    """Solve in place; solution into x[n, 6]. Returns False where a pivot vanishes or is not finite."""
    n = band.shape[0]
    row = np.empty(16)
    for i in range(n):
        if i > 0:
            for r in range(6):
                l0, l1, l2 = lower[i, r, 0], lower[i, r, 1], lower[i, r, 2]
                l3, l4, l5 = lower[i, r, 3], lower[i, r, 4], lower[i, r, 5]
                for c in range(7):   # six columns of U and the right-hand side
                    row[c] = (l0 * band[i - 1, 0, 6 + c] + l1 * band[i - 1, 1, 6 + c] + l2 * band[i - 1, 2, 6 + c]
                              + l3 * band[i - 1, 3, 6 + c] + l4 * band[i - 1, 4, 6 + c] + l5 * band[i - 1, 5, 6 + c])
                for c in range(6):
                    band[i, r, c] -= row[c]
                band[i, r, 12] -= row[6]
        for k in range(6):
            p = k
            best = abs(band[i, k, k])
            for r in range(k + 1, 6):
                if abs(band[i, r, k]) > best:
                    best = abs(band[i, r, k])
                    p = r
            if not (best > 0.0 and best < 1e300):
                return False
            if p != k:
                for c in range(13):
                    s = band[i, k, c]
                    band[i, k, c] = band[i, p, c]
                    band[i, p, c] = s
            s = 1.0 / band[i, k, k]
            for c in range(k, 13):
                row[c] = band[i, k, c] * s
            for r in range(k + 1, 6):
                s = band[i, r, k]
                for c in range(k + 1, 13):
                    band[i, r, c] -= s * row[c]
            for c in range(k + 1, 13):
                band[i, k, c] = row[c]
        for k in range(4, -1, -1):   # back substitution inside the block: U and the right-hand side
            for r in range(k + 1, 6):
                s = band[i, k, r]
                for c in range(6, 13):
                    band[i, k, c] -= s * band[i, r, c]
    for k in range(6):
        x[n - 1, k] = band[n - 1, k, 12]
    for j in range(1, n):
        i = n - 1 - j
        for r in range(6):
            s = band[i, r, 12]
            for c in range(6):
                s -= band[i, r, 6 + c] * x[i + 1, c]
            x[i, r] = s
    return True
