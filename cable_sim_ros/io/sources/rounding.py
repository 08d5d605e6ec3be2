"""Resolution of measured numbers: the smallest common increment of their values, found from the values themselves.

A motion sensor gives heave to 1 cm and angles to 0.1 deg. At 10 Hz the curve through such numbers has a false
acceleration of 0.7 m/s^2: `smoothing.py` takes it out, once it is known how coarse the numbers are.
"""

from __future__ import annotations

from math import comb

import numpy as np

FEWEST = 30  # numbers; of fewer nothing can be said
STEPS = 10  # changes of value, at least
EXACT = 0.02  # of an increment: rms by which values may be off their multiples (another unit, few digits)
FLOAT = 1e4  # times the float's own step: a finer increment is that of the number format
APART = 10.0  # an increment is so many times larger than what lies between values that mean the same
EUCLID = 6  # rounds of taking differences of differences, to find a common part that is none of them
ORDER = 6  # of the differences in which a ship's motion leaves nothing
SEEN = 1e-3  # of increment^2/12: less of it in the differences is a motion that happens to run on multiples
OWN_NOISE = 5.0, 1.5  # Hz, times increment^2/12: from this rate and ratio on the differences tell of noise beside it


def resolution(values: np.ndarray) -> float:
    """Smallest common increment of numbers in order of time, in their unit; 0 where there is none that shows.

    Numbers that are not rounded have none, nor have those that run on multiples without an error, as a straight line.
    Multiples may be off by EXACT: those of a tenth of a degree written in rad with six digits are still found.
    """
    if len(values) < FEWEST:
        return 0.0
    moves = np.diff(values)
    floor = FLOAT * np.finfo(float).eps * max(float(np.abs(values).max()), 1e-300)
    sizes = np.unique(np.abs(moves))
    gaps = np.sort(np.diff(sizes, prepend=0.0))
    gaps = gaps[gaps > floor]
    if not len(gaps):
        return 0.0
    coarser = np.flatnonzero(gaps[1:] > APART * gaps[:-1]) + 1
    candidates = [float(gaps[start]) for start in (*coarser[::-1], 0)]
    for _ in range(EUCLID):  # few different moves, as of a regular wave: their common part may be none of the gaps
        gaps = np.unique(np.diff(gaps, prepend=0.0))
        gaps = gaps[gaps > floor]
        if not len(gaps):
            break
        candidates.append(float(gaps[0]))
    for first in candidates:
        found = _increment(values, moves, first)
        if found > 0.0:
            return found if difference_noise(values) > SEEN * found * found / 12.0 else 0.0
    return 0.0


def _increment(values: np.ndarray, moves: np.ndarray, first: float) -> float:
    """The increment near `first` of which all values are multiples, 0 where they are not."""
    counts = np.round(moves / first)
    if np.count_nonzero(counts) < STEPS:
        return 0.0
    place = np.concatenate(([0.0], np.cumsum(counts)))
    place -= place.mean()
    increment = float(place @ values / (place @ place))
    rest = values - values.mean() - increment * place
    off = rest - increment * np.round(rest / increment)
    exact = np.sqrt(np.mean(off * off)) <= EXACT * increment and np.abs(rest).max() < 0.5 * increment
    return increment if exact and abs(increment - first) < 0.1 * first else 0.0


def even(times: np.ndarray) -> np.ndarray:
    """Rounded times of rows that come evenly, some of them left out, as they were before the rounding; others as given.

    They are taken for that where all of them lie within half an increment of a straight line.
    """
    increment = resolution(times)
    if increment == 0.0:
        return times
    counts = np.cumsum(np.concatenate(([0.0], np.round(np.diff(times) / np.median(np.diff(times))))))
    for _ in range(2):
        period, begin = np.polyfit(counts, times - times[0], 1)
        counts = np.round((times - times[0] - begin) / period)
    line = times[0] + begin + period * counts
    off = float(np.abs(times - line).max())
    rounded = EXACT * increment < off <= (0.5 + EXACT) * increment
    return line if rounded and (np.diff(counts) > 0.0).all() else times


def difference_noise(values: np.ndarray) -> float:
    """Mean square of the white noise in values at equal steps, from their differences of sixth order."""
    if len(values) <= ORDER:
        return 0.0
    rest = np.diff(values - values.mean(), ORDER)
    return float(np.mean(rest * rest)) / comb(2 * ORDER, ORDER)


def noise(parts: list[np.ndarray], increment: float, rate: float) -> tuple[float, float]:
    """Standard deviations of values rounded to an increment: to smooth by, and as it seems to be.

    Both are those of the rounding. Where the values are noisier, and their rate is at least 5 Hz so that their
    differences tell of it, both are as large as seen, the first one up to one increment: more is not rounding.
    parts: stretches without a gap; rate: Hz.
    """
    rounded = increment * increment / 12.0
    count = sum(len(part) for part in parts)
    seen = sum(difference_noise(part) * len(part) for part in parts) / count
    if rate < OWN_NOISE[0] or seen < OWN_NOISE[1] * rounded:
        return rounded**0.5, rounded**0.5
    return min(seen**0.5, increment), seen**0.5
