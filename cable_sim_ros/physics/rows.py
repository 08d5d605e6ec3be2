"""Loops over rows of as many numbers: few rows in each, so that they become loops of machine vectors."""

from __future__ import annotations

from ..compiler.jit import driver


@driver
def zero(row):
    """row = 0"""
    for i in range(row.shape[0]):
        row[i] = 0.0


@driver
def subtract(a, b, out):
    """out = a - b"""
    for i in range(out.shape[0]):
        out[i] = a[i] - b[i]


@driver
def difference(new, kept):
    """kept = new and new = new - kept: the next backward difference."""
    for i in range(new.shape[0]):
        new[i], kept[i] = new[i] - kept[i], new[i]


@driver
def add(row, s, x):
    """row += s x"""
    for i in range(row.shape[0]):
        row[i] += s * x[i]


@driver
def add_two(row, s, x, t, y):
    """row += s x + t y"""
    for i in range(row.shape[0]):
        row[i] += s * x[i] + t * y[i]


@driver
def leave_held(row, held):
    """row = 0 where held is 1"""
    for i in range(row.shape[0]):
        row[i] *= 1.0 - held[i]
