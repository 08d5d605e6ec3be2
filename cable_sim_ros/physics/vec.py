"""3-vectors as tuples of floats: small functions that vanish when inlined."""

from math import sqrt

from ..compiler.jit import inline


@inline
def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@inline
def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inline
def scale(s, a):
    return (s * a[0], s * a[1], s * a[2])


@inline
def axpy(s, a, b):
    """b + s a"""
    return (b[0] + s * a[0], b[1] + s * a[1], b[2] + s * a[2])


@inline
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inline
def norm(a):
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inline
def get3(x, row, e):
    return (x[row, e], x[row + 1, e], x[row + 2, e])


@inline
def put3(x, row, e, v):
    """x[row:row+3, e] = v"""
    x[row, e] = v[0]
    x[row + 1, e] = v[1]
    x[row + 2, e] = v[2]


@inline
def plus3(x, row, e, v):
    """x[row:row+3, e] += v"""
    x[row, e] += v[0]
    x[row + 1, e] += v[1]
    x[row + 2, e] += v[2]


@inline
def at3(x, i):
    return (x[i], x[i + 1], x[i + 2])


@inline
def row3(x, i):
    return (x[i, 0], x[i, 1], x[i, 2])


@inline
def put_matrix(x, row, e, d, a, p, b, q):
    """x[row:row+9, e] = d I + a p^T + b q^T."""
    x[row, e] = d + a[0] * p[0] + b[0] * q[0]
    x[row + 1, e] = a[0] * p[1] + b[0] * q[1]
    x[row + 2, e] = a[0] * p[2] + b[0] * q[2]
    x[row + 3, e] = a[1] * p[0] + b[1] * q[0]
    x[row + 4, e] = d + a[1] * p[1] + b[1] * q[1]
    x[row + 5, e] = a[1] * p[2] + b[1] * q[2]
    x[row + 6, e] = a[2] * p[0] + b[2] * q[0]
    x[row + 7, e] = a[2] * p[1] + b[2] * q[1]
    x[row + 8, e] = d + a[2] * p[2] + b[2] * q[2]


@inline
def plus_matrix(x, row, e, d, a, p, b, q):
    """x[row:row+9, e] += d I + a p^T + b q^T."""
    x[row, e] += d + a[0] * p[0] + b[0] * q[0]
    x[row + 1, e] += a[0] * p[1] + b[0] * q[1]
    x[row + 2, e] += a[0] * p[2] + b[0] * q[2]
    x[row + 3, e] += a[1] * p[0] + b[1] * q[0]
    x[row + 4, e] += d + a[1] * p[1] + b[1] * q[1]
    x[row + 5, e] += a[1] * p[2] + b[1] * q[2]
    x[row + 6, e] += a[2] * p[0] + b[2] * q[0]
    x[row + 7, e] += a[2] * p[1] + b[2] * q[1]
    x[row + 8, e] += d + a[2] * p[2] + b[2] * q[2]
