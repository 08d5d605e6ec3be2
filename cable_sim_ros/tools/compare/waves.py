"""Heights and cycles of a signal: double amplitudes, rainflow, exceedance, ellipsoids of places."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...sim.rules.rainflow import Rainflow
from ...sim.tables.elementary import principal

PLAY = 0.25  # standard deviations that a crossing of the mean must go beyond it, either way: noise makes no wave
LEVELS = (0.1, 0.01, 0.001)  # of the time, in which A is above
LEAST_CYCLE = 0.02  # of the largest range: smaller ones are not counted
CHI2_3 = 7.814727903251179  # 95 % of a sum of three squares


def double_amplitudes(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest less least value between crossings of the mean upwards, and the sample in which each wave ends.

    x: with mean 0; NaN ends a wave.
    """
    spread = float(np.nanstd(x))
    found, ends = [], []
    if not spread > 0.0:
        return np.zeros(0), np.zeros(0, int)
    state = np.zeros(len(x), np.int8)  # 1 above, -1 below, 0 between
    state[x > PLAY * spread] = 1
    state[x < -PLAY * spread] = -1
    state[~np.isfinite(x)] = 2
    at = np.flatnonzero(state)
    kinds = state[at]
    begin = None
    for k in range(1, len(at)):
        if kinds[k] == 2:
            begin = None
        elif kinds[k] == 1 and kinds[k - 1] == -1:
            if begin is not None:
                piece = x[begin : at[k]]
                found.append(float(piece.max() - piece.min()))
                ends.append(int(at[k]))
            begin = at[k]
    return np.array(found), np.array(ends, int)


def cycles(x: np.ndarray, slope: float, seconds: float) -> tuple[float, float, float]:
    """Cycles of rainflow, the largest range, and the range of a cycle a second that does the same damage.

    slope: of the line of ranges against cycles in logarithms; gaps cut the history.
    """
    good = np.isfinite(x)
    if not good.any():
        return 0.0, 0.0, 0.0
    size = float(np.ptp(x[good]))
    if not size > 0.0:
        return 0.0, 0.0, 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    count = largest = damage = 0.0
    for i, j in zip(edges[::2], edges[1::2]):
        # of its largest range, so that no power overflows
        flow = Rainflow(lambda way: (way / size) ** slope, LEAST_CYCLE * size, size)
        flow.add(_turns(x[i:j]).tolist())
        part = flow.totals()
        count, largest, damage = count + part[0], max(largest, part[1]), damage + flow.damage
    return count, largest, size * (damage / seconds) ** (1.0 / slope)


def _turns(x: np.ndarray) -> np.ndarray:
    """First, last and turning points."""
    x = x[np.concatenate([[True], np.diff(x) != 0.0])]
    if len(x) < 3:
        return x
    ways = np.diff(x) > 0.0
    return x[np.concatenate([[True], ways[1:] != ways[:-1], [True]])]


def exceedance(a: np.ndarray, b: np.ndarray) -> list[dict[str, float]]:
    """Levels that A is above for some shares of the time, and the share of the time in which B is."""
    x, y = a[np.isfinite(a)], b[np.isfinite(b)]
    rows = []
    for share in LEVELS:
        if share * len(x) >= 10.0:  # a level that a few samples make says nothing
            level = float(np.quantile(x, 1.0 - share))
            rows.append({"level": level, "share_a": float((x > level).mean()), "share_b": float((y > level).mean())})
    return rows


def ellipsoid(places: np.ndarray) -> dict[str, Any]:
    """95 % ellipsoid of places [n, 3], were they normally distributed: centre, semi-axes, volume, directions."""
    centre = places.mean(axis=0)
    rest = places - centre
    spread = np.array([[float((rest[:, i] * rest[:, j]).mean()) for j in range(3)] for i in range(3)])
    values, ways = principal(spread)
    axes = np.sqrt(CHI2_3 * np.maximum(values, 0.0))[::-1]
    return {
        "centre_m": centre.tolist(),
        "semi_axes_m": axes.tolist(),
        "volume_m3": float(4.0 / 3.0 * math.pi * axes.prod()),
        "directions": ways[:, ::-1].T.tolist(),
    }


def inside(places: np.ndarray, of: np.ndarray) -> float | None:
    """Share of places in the 95 % ellipsoid of others; None where that has no volume."""
    rest = of - of.mean(axis=0)
    spread = np.array([[float((rest[:, i] * rest[:, j]).mean()) for j in range(3)] for i in range(3)])
    values, ways = principal(spread)
    if not values[0] > 1e-12 * max(values[-1], 1e-300):
        return None
    turned = np.stack([((places - of.mean(axis=0)) * ways[:, k]).sum(axis=1) for k in range(3)], axis=1)
    return float(((turned**2 / values).sum(axis=1) <= CHI2_3).mean())
