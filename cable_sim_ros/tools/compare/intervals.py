"""How well a figure of correlated samples is known: independent samples, blocks, the jackknife that leaves one out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.stats import t as student

LEVEL = 0.95
BLOCK = 5.0  # times of correlation that a block holds at least
FEW, MANY = 5, 20  # blocks
Interval = tuple[float, float]


def correlation_time(x: np.ndarray) -> float:
    """Samples that count as one: 1 plus twice the sum of the autocorrelations, up to the first pair that is not
    positive (Geyer 1992). x: NaN is left out."""
    good = np.isfinite(x)
    n = int(good.sum())
    if n < 4:
        return 1.0
    y = np.where(good, x - np.mean(x[good]), 0.0)
    if not (np.abs(y) > 1e-12 * np.abs(x[good]).max()).any():
        return 1.0
    size = next_fast_len(2 * len(x))
    sums = irfft(np.abs(rfft(y, size)) ** 2, size)[: len(x)]
    pairs = irfft(np.abs(rfft(good.astype(float), size)) ** 2, size)[: len(x)]
    rho = (sums / np.maximum(pairs, 1.0)) / (sums[0] / n)
    even = len(rho) // 2 * 2
    both = rho[:even:2] + rho[1:even:2]
    end = int(np.argmax(both <= 0.0)) if (both <= 0.0).any() else len(both)
    return float(min(n, max(1.0, 2.0 * both[:end].sum() - 1.0)))


def independent(x: np.ndarray) -> float:
    """Independent samples that x is worth."""
    return float(np.isfinite(x).sum()) / correlation_time(x)


def blocks(n: int, correlated: float) -> np.ndarray | None:
    """Number of the block of each of n samples; None where they are too few for an interval."""
    count = min(MANY, int(n / (BLOCK * correlated)))
    return None if count < FEW else np.arange(n) * count // n


def jackknife(whole: np.ndarray, without: np.ndarray) -> np.ndarray:
    """Half width of the 95 % interval of figures [...]: whole of all, without [blocks, ...] with one block left out."""
    count = len(without)
    spread = (count - 1) / count * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    return student.ppf(0.5 + 0.5 * LEVEL, count - 1) * np.sqrt(spread) + 0.0 * np.asarray(whole)


def left_out(terms: np.ndarray, block: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums of terms [n, ...] over all, and [blocks, ...] with one block left out."""
    each = np.stack([terms[block == k].sum(axis=0) for k in range(block[-1] + 1)])
    return each.sum(axis=0), each.sum(axis=0) - each


def about(value: float, half: float, to: Callable[[float], float] = float) -> Interval:
    """The interval, mapped by a function that goes up."""
    return to(value - half), to(value + half)
