"""Block-tridiagonal solve: 6x6 blocks, Gauss-Jordan elimination with row exchange where a pivot asks for it.

Storage: band[i] is the 6x16 row [D_i | U_i | r_i | 0], lower[i] the block that couples node i to node i-1. U_i and r_i
are carried together: after node i they hold D_i^-1 U_i and D_i^-1 r_i. factor[i, k] keeps what was done to eliminate
column k: the multiples taken from the six rows, its own the reciprocal pivot, and the row it changed places with.
"""

from ..compiler.jit import driver, inline
from ..compiler.simd import row_update

COLUMNS = 16
RHS = 12
SWAP, FACTOR_COLUMNS = 6, 7
GROWTH = 10.0  # a pivot this much smaller than another of its column is exchanged for it

less_1, less_2, less_4 = row_update(1), row_update(2), row_update(4)


@inline
def less(a, f, p):
    """a - f p of two rows of six; its first column, which is done with, makes way for the second."""
    return a[1] - f * p[1], a[2] - f * p[2], a[3] - f * p[3], a[4] - f * p[4], a[5] - f * p[5], 0.0


@inline
def eliminate(p, a, b, c, d, e):
    """Take the first column out of six rows by that of row p: reciprocal pivot, multiples of the others, all rows."""
    s = 1.0 / p[0]
    f = (a[0] * s, b[0] * s, c[0] * s, d[0] * s, e[0] * s)
    others = less(a, f[0], p), less(b, f[1], p), less(c, f[2], p), less(d, f[3], p), less(e, f[4], p)
    return s, f, (p[1] * s, p[2] * s, p[3] * s, p[4] * s, p[5] * s, 0.0), others


@inline
def fit(pivot, other):
    """Does a pivot serve beside the largest other of its column, without an exchange?"""
    return GROWTH * abs(pivot) >= other and 0.0 < abs(pivot) < 1e300


@inline
def largest(a, b, c, d, e):
    return max(max(max(abs(a), abs(b)), max(abs(c), abs(d))), abs(e))


@inline
def keep(factor, k, a, b, c, d, e, f):
    """factor[k] of a column without exchange: multiples of six rows, its own the reciprocal pivot."""
    factor[k, 0], factor[k, 1], factor[k, 2], factor[k, 3], factor[k, 4], factor[k, 5] = a, b, c, d, e, f
    factor[k, SWAP] = k


@inline
def first_six(rows, r):
    return rows[r, 0], rows[r, 1], rows[r, 2], rows[r, 3], rows[r, 4], rows[r, 5]


@driver
def factorise(rows, top, factor):
    """Multiples that eliminate the block D_i at row ``top``, into factor[6, FACTOR_COLUMNS]; the rows stay.

    In numbers, not in rows of memory: each pivot waits for the one before. Returns False where a pivot asks for an
    exchange.
    """
    a, b, c = first_six(rows, top), first_six(rows, top + 1), first_six(rows, top + 2)
    d, e, g = first_six(rows, top + 3), first_six(rows, top + 4), first_six(rows, top + 5)
    if not fit(a[0], largest(b[0], c[0], d[0], e[0], g[0])):
        return False
    s, f, a, (b, c, d, e, g) = eliminate(a, b, c, d, e, g)
    keep(factor, 0, s, f[0], f[1], f[2], f[3], f[4])
    if not fit(b[0], largest(c[0], d[0], e[0], g[0], 0.0)):
        return False
    s, f, b, (a, c, d, e, g) = eliminate(b, a, c, d, e, g)
    keep(factor, 1, f[0], s, f[1], f[2], f[3], f[4])
    if not fit(c[0], largest(d[0], e[0], g[0], 0.0, 0.0)):
        return False
    s, f, c, (a, b, d, e, g) = eliminate(c, a, b, d, e, g)
    keep(factor, 2, f[0], f[1], s, f[2], f[3], f[4])
    if not fit(d[0], largest(e[0], g[0], 0.0, 0.0, 0.0)):
        return False
    s, f, d, (a, b, c, e, g) = eliminate(d, a, b, c, e, g)
    keep(factor, 3, f[0], f[1], f[2], s, f[3], f[4])
    if not fit(e[0], abs(g[0])):
        return False
    s, f, e, (a, b, c, d, g) = eliminate(e, a, b, c, d, g)
    keep(factor, 4, f[0], f[1], f[2], f[3], s, f[4])
    if not fit(g[0], 0.0):
        return False
    s, f, g, (a, b, c, d, e) = eliminate(g, a, b, c, d, e)
    keep(factor, 5, f[0], f[1], f[2], f[3], f[4], s)
    return True


@inline
def multiples(factor):
    """What factorise() left of one block, six times six numbers."""
    return (
        first_six(factor, 0),
        first_six(factor, 1),
        first_six(factor, 2),
        first_six(factor, 3),
        first_six(factor, 4),
        first_six(factor, 5),
    )


@inline
def eliminated(f, v):
    """D_i^-1 times a vector of six, from multiples(); in numbers, each waits for the one before."""
    f0, f1, f2, f3, f4, f5 = f
    a, b, c, d, e, g = v
    b, c, d, e, g, a = b - f0[1] * a, c - f0[2] * a, d - f0[3] * a, e - f0[4] * a, g - f0[5] * a, a * f0[0]
    a, c, d, e, g, b = a - f1[0] * b, c - f1[2] * b, d - f1[3] * b, e - f1[4] * b, g - f1[5] * b, b * f1[1]
    a, b, d, e, g, c = a - f2[0] * c, b - f2[1] * c, d - f2[3] * c, e - f2[4] * c, g - f2[5] * c, c * f2[2]
    a, b, c, e, g, d = a - f3[0] * d, b - f3[1] * d, c - f3[2] * d, e - f3[4] * d, g - f3[5] * d, d * f3[3]
    a, b, c, d, g, e = a - f4[0] * e, b - f4[1] * e, c - f4[2] * e, d - f4[3] * e, g - f4[5] * e, e * f4[4]
    return a - f5[0] * g, b - f5[1] * g, c - f5[2] * g, d - f5[3] * g, e - f5[4] * g, g * f5[5]


@driver
def apply(rows, top, factor):
    """D_i^-1 U_i and D_i^-1 r_i from what factorise() left, eight columns at once."""
    if rows.shape[1] != COLUMNS or factor.shape[1] != FACTOR_COLUMNS or top < 0:
        raise ValueError("blocks")
    f = multiples(factor)
    for k in range(6, 14):
        v = (rows[top, k], rows[top + 1, k], rows[top + 2, k], rows[top + 3, k], rows[top + 4, k], rows[top + 5, k])
        a, b, c, d, e, g = eliminated(f, v)
        rows[top, k], rows[top + 1, k], rows[top + 2, k] = a, b, c
        rows[top + 3, k], rows[top + 4, k], rows[top + 5, k] = d, e, g


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
def eliminate_with_exchange(rows, top, factor):
    """factorise() and apply(), column by column, with an exchange of rows where a pivot asks for it: False where one
    vanishes or is not finite."""
    for k in range(6):
        pivot = top + k
        own, other = abs(rows[pivot, k]), 0.0
        for r in range(pivot + 1, top + 6):
            other = max(other, abs(rows[r, k]))
        factor[k, SWAP] = k
        if not GROWTH * own >= other:
            factor[k, SWAP] = exchange(rows, pivot, k) - top
            own = abs(rows[pivot, k])
        if not (own > 0.0 and own < 1e300):
            return False
        s = 1.0 / rows[pivot, k]
        for r in range(6):
            if r != k:
                f = rows[top + r, k] * s
                factor[k, r] = f
                for c in range(COLUMNS):
                    rows[top + r, c] -= f * rows[pivot, c]
        factor[k, k] = s
        for c in range(COLUMNS):
            rows[pivot, c] *= s
    return True


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
        if factorise(rows, top, factor[i]):
            apply(rows, top, factor[i])
        elif not eliminate_with_exchange(rows, top, factor[i]):
            return False
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


@inline
def in_order(factor):
    """Was a block eliminated without an exchange?"""
    at = (factor[0, SWAP], factor[1, SWAP], factor[2, SWAP], factor[3, SWAP], factor[4, SWAP], factor[5, SWAP])
    return at == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)


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
        if in_order(factor[i]):
            v = eliminated(multiples(factor[i]), first_six(x, i))
            x[i, 0], x[i, 1], x[i, 2], x[i, 3], x[i, 4], x[i, 5] = v
            continue
        for k in range(6):
            p = int(factor[i, k, SWAP])
            s, x[i, p] = x[i, p], x[i, k]
            for r in range(6):
                if r != k:
                    x[i, r] -= factor[i, k, r] * s
            x[i, k] = factor[i, k, k] * s
    substitute(band, x)
