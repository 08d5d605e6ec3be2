"""Chance and faults: numbers that belong to a seed and a count, and a value with what is wrong with it."""

from math import cos, log, pi, sqrt

import numpy as np

from ..compiler.jit import inline
from .sensor_models import BIAS, DRIFT, FROZEN, NOISE, RESET, RUNAWAY, STUCK


@inline
def mixed(x):
    """The next 64 bits of a counter, well mixed (splitmix64, Steele et al. 2014); x: uint64."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@inline
def drawn(seed, count, row):
    """Two even numbers in (0, 1) and [0, 1) that belong to a seed, a count and a row below 64."""
    first = mixed((np.uint64(seed) << np.uint64(32)) + np.uint64(64 * count + row + 1))
    second = mixed(first + np.uint64(0x9E3779B97F4A7C15))
    return (np.float64(first >> np.uint64(11)) + 0.5) / 2.0**53, np.float64(second >> np.uint64(11)) / 2.0**53


@inline
def gauss(seed, count, row):
    """A normal number that belongs to them, by Box and Muller."""
    u, w = drawn(seed, count, row)
    return sqrt(-2.0 * log(u)) * cos(2.0 * pi * w)


@inline
def spoiled(fault, x, rate, since, chance):
    """A value with its fault; rate: 1 for the rate of what the fault is of; since: s; chance: a normal number."""
    kind, size = fault.kind, fault.amount
    if kind == FROZEN:
        return fault.at
    if rate != 0:
        return x + size if kind == DRIFT else (0.0 if kind == STUCK else (size if kind == RUNAWAY else x))
    if kind == BIAS:
        return x + size
    if kind == DRIFT:
        return x + size * since
    if kind == NOISE:
        return x + size * chance
    if kind == STUCK:
        return size
    if kind == RUNAWAY:
        return fault.at + size * since
    return x - fault.at if kind == RESET else x
