"""A long series drawn with few points: the least and the largest sample of every piece, so that no peak is lost."""

from __future__ import annotations

import numpy as np

PIECES = 1000  # about what a panel has pixels across


def thinned(time: np.ndarray, values: np.ndarray, pieces: int = PIECES) -> tuple[np.ndarray, np.ndarray]:
    """Samples of ``values`` [n] over ``time`` [n]: all, or beyond four a piece the first, the last, and the least and
    the largest of each piece, with their own times. What is not finite is left out of a piece that has other samples.
    """
    count = len(values)
    if count <= 4 * pieces:
        return time, values
    finite = np.isfinite(values)
    low, high = np.where(finite, values, np.inf), np.where(finite, values, -np.inf)
    edges = np.linspace(0, count, pieces + 1).astype(int)
    kept = {0, count - 1}
    for first, end in zip(edges, edges[1:]):
        kept |= {first + int(low[first:end].argmin()), first + int(high[first:end].argmax())}
    at = np.array(sorted(kept))
    return time[at], values[at]
