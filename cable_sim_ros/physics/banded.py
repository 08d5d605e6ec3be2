"""Block-tridiagonal solve: 6x6 blocks, Gauss-Jordan inside each block, partial pivoting only where a block needs it.

Storage: band[i] is the 6x16 row [D_i | U_i | r_i | 0], lower[i] the block that couples node i to node i-1. After
solve() band[i] holds [G_i | V_i | y_i | 0]: V_i = E_i U_i with E_i the inverse of the eliminated diagonal block, y_i
the reduced right-hand side, and in G_i the multipliers by which solve_again() takes another right-hand side.

Work w[3, 6, 8]: [D | two columns of no meaning], [U | r | 0], products of the lower block with [V | y | 0] of the node
before. Loops run over the 8 columns with all six rows in the body: shorter bodies are unrolled before the vectoriser
sees them. Nothing is stored number by number that is loaded as a vector soon after: that stalls.
"""

from __future__ import annotations

import numpy as np

from .jit import driver, inline

COLUMNS = 16
RHS = 12
LEAST_PIVOT = 1e-9   # of the diagonal before elimination; below it digits were lost and the block is pivoted
A, B, C, D, E, F = np.arange(6)   # numpy integers: a literal compiles a version of its own
MASK = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])   # the right-hand side in w[1]


@inline
def eliminate(w, factors, k, p, q, r, s, t):
    """One Gauss-Jordan step on w with pivot w[0, k, k]; p, q, r, s, t are the other rows.

    Column k of factors[6, ..] receives the multipliers, on its diagonal the inverse pivot.
    """
    inverse = 1.0 / w[0, k, k]
    a, b, c, d, e = w[0, p, k], w[0, q, k], w[0, r, k], w[0, s, k], w[0, t, k]
    for j in range(8):
        y, z = inverse * w[0, k, j], inverse * w[1, k, j]
        w[0, k, j] = y
        w[0, p, j] -= a * y
        w[0, q, j] -= b * y
        w[0, r, j] -= c * y
        w[0, s, j] -= d * y
        w[0, t, j] -= e * y
        w[1, k, j] = z
        w[1, p, j] -= a * z
        w[1, q, j] -= b * z
        w[1, r, j] -= c * z
        w[1, s, j] -= d * z
        w[1, t, j] -= e * z
    factors[k, k] = inverse
    factors[p, k], factors[q, k], factors[r, k], factors[s, k], factors[t, k] = a, b, c, d, e


@inline
def sound(pivot, before):
    """Is a pivot finite and of the size of the diagonal before elimination?"""
    return abs(pivot) > LEAST_PIVOT * before and abs(pivot) < 1e300


@inline
def reduce(w, factors):
    """[D | U | r] in w to [I | D^-1 U | D^-1 r] without row exchange. Returns whether every pivot was sound."""
    a, b, c = abs(w[0, A, A]), abs(w[0, B, B]), abs(w[0, C, C])
    d, e, f = abs(w[0, D, D]), abs(w[0, E, E]), abs(w[0, F, F])
    good = sound(w[0, A, A], a)
    eliminate(w, factors, A, B, C, D, E, F)
    good = good and sound(w[0, B, B], b)
    eliminate(w, factors, B, A, C, D, E, F)
    good = good and sound(w[0, C, C], c)
    eliminate(w, factors, C, A, B, D, E, F)
    good = good and sound(w[0, D, D], d)
    eliminate(w, factors, D, A, B, C, E, F)
    good = good and sound(w[0, E, E], e)
    eliminate(w, factors, E, A, B, C, D, F)
    good = good and sound(w[0, F, F], f)
    eliminate(w, factors, F, A, B, C, D, E)
    return good


@inline
def row_of(lower, i, r):
    """Row r of block i as a tuple."""
    return lower[i, r, A], lower[i, r, B], lower[i, r, C], lower[i, r, D], lower[i, r, E], lower[i, r, F]


@inline
def product(l, b0, b1, b2, b3, b4, b5):
    """Scalar product of a row of six with b0..b5, summed in pairs."""
    return ((l[0] * b0 + l[1] * b1) + (l[2] * b2 + l[3] * b3)) + (l[4] * b4 + l[5] * b5)


@inline
def couple(w, lower, i):
    """w[2]: lower block of node i times [V | y] of the node before, which w[1] still holds."""
    la, lb, lc = row_of(lower, i, A), row_of(lower, i, B), row_of(lower, i, C)
    ld, le, lf = row_of(lower, i, D), row_of(lower, i, E), row_of(lower, i, F)
    for c in range(8):
        b0, b1, b2, b3, b4, b5 = w[1, A, c], w[1, B, c], w[1, C, c], w[1, D, c], w[1, E, c], w[1, F, c]
        w[2, 0, c] = product(la, b0, b1, b2, b3, b4, b5)
        w[2, 1, c] = product(lb, b0, b1, b2, b3, b4, b5)
        w[2, 2, c] = product(lc, b0, b1, b2, b3, b4, b5)
        w[2, 3, c] = product(ld, b0, b1, b2, b3, b4, b5)
        w[2, 4, c] = product(le, b0, b1, b2, b3, b4, b5)
        w[2, 5, c] = product(lf, b0, b1, b2, b3, b4, b5)


@inline
def load(w, band, mask, i):
    """Node i into w, less the products in w[2]."""
    for c in range(8):
        w[0, 0, c], w[1, 0, c] = band[i, 0, c] - w[2, 0, c], band[i, 0, 6 + c] - mask[c] * w[2, 0, c]
        w[0, 1, c], w[1, 1, c] = band[i, 1, c] - w[2, 1, c], band[i, 1, 6 + c] - mask[c] * w[2, 1, c]
        w[0, 2, c], w[1, 2, c] = band[i, 2, c] - w[2, 2, c], band[i, 2, 6 + c] - mask[c] * w[2, 2, c]
        w[0, 3, c], w[1, 3, c] = band[i, 3, c] - w[2, 3, c], band[i, 3, 6 + c] - mask[c] * w[2, 3, c]
        w[0, 4, c], w[1, 4, c] = band[i, 4, c] - w[2, 4, c], band[i, 4, 6 + c] - mask[c] * w[2, 4, c]
        w[0, 5, c], w[1, 5, c] = band[i, 5, c] - w[2, 5, c], band[i, 5, 6 + c] - mask[c] * w[2, 5, c]


@inline
def keep(w, factors, band, i):
    """[G | V | y | 0] of node i into band, G from factors."""
    for c in range(8):
        band[i, 0, 6 + c] = w[1, 0, c]
        band[i, 1, 6 + c] = w[1, 1, c]
        band[i, 2, 6 + c] = w[1, 2, c]
        band[i, 3, 6 + c] = w[1, 3, c]
        band[i, 4, 6 + c] = w[1, 4, c]
        band[i, 5, 6 + c] = w[1, 5, c]
    for r in range(6):
        for c in range(6):
            band[i, r, c] = factors[r, c]


@driver
def reduce_pivoted(w, factors):
    """reduce() with partial pivoting; factors becomes zero: no other right-hand side can be taken.

    Returns False where a pivot vanishes or is not finite.
    """
    for k in range(6):
        p = k
        for r in range(k + 1, 6):
            if abs(w[0, r, k]) > abs(w[0, p, k]):
                p = r
        if not (abs(w[0, p, k]) > 0.0 and abs(w[0, p, k]) < 1e300):
            return False
        s = 1.0 / w[0, p, k]
        for h in range(2):
            for c in range(8):
                z = w[h, p, c] * s
                w[h, p, c] = w[h, k, c]
                w[h, k, c] = z
        for r in range(6):
            factors[r, k] = 0.0
            if r != k:
                s = w[0, r, k]
                for h in range(2):
                    for c in range(8):
                        w[h, r, c] -= s * w[h, k, c]
    return True


@driver
def substitute(band, x):
    """Backward sweep: x[n, 6] from V and y in band."""
    n = band.shape[0]
    if band.shape[1] != 6 or band.shape[2] != COLUMNS or x.shape[1] != 6:
        raise ValueError("columns")
    for k in range(6):
        x[n - 1, k] = band[n - 1, k, RHS]
    for j in range(1, n):
        i = n - 1 - j
        x0, x1, x2, x3, x4, x5 = x[i + 1, 0], x[i + 1, 1], x[i + 1, 2], x[i + 1, 3], x[i + 1, 4], x[i + 1, 5]
        for r in range(6):
            x[i, r] = band[i, r, RHS] - product((band[i, r, 6], band[i, r, 7], band[i, r, 8], band[i, r, 9],
                                                 band[i, r, 10], band[i, r, 11]), x0, x1, x2, x3, x4, x5)


@driver
def solve(band, lower, x):
    """Solve in place; solution into x[n, 6]. Returns False where a pivot vanishes or is not finite."""
    n = band.shape[0]
    if band.shape[1] != 6 or band.shape[2] != COLUMNS or lower.shape[1] != 6 or lower.shape[2] != 6:
        raise ValueError("columns")
    w, factors = np.zeros((3, 6, 8)), np.zeros((6, 6))
    for i in range(n):
        if i > 0:
            couple(w, lower, i)
        load(w, band, MASK, i)
        if not reduce(w, factors):
            load(w, band, MASK, i)
            if not reduce_pivoted(w, factors):
                return False
        keep(w, factors, band, i)
    substitute(band, x)
    return True


@driver
def solve_again(band, lower, x):
    """Solve for another right-hand side r in column 12 with the factors that solve() left in band."""
    n = band.shape[0]
    if band.shape[1] != 6 or band.shape[2] != COLUMNS or lower.shape[1] != 6 or lower.shape[2] != 6:
        raise ValueError("columns")
    y0, y1, y2, y3, y4, y5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    s = np.empty(6)
    for i in range(n):
        for r in range(6):
            s[r] = band[i, r, RHS] - product(row_of(lower, i, r), y0, y1, y2, y3, y4, y5)
        for k in range(6):
            z = s[k] * band[i, k, k]
            for r in range(6):
                s[r] -= band[i, r, k] * z
            s[k] = z
        y0, y1, y2, y3, y4, y5 = s[0], s[1], s[2], s[3], s[4], s[5]
        for r in range(6):
            band[i, r, RHS] = s[r]
    substitute(band, x)
