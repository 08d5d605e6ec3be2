"""Numbers of a scene fitted to the depths of many tows whose speed through the water nobody knows: errors in variables.

Each tow i has a true speed s_i, of which the ship's speed, a flow meter and the angle of the wire are readings:

    v = s + e_v, or log v = log c s + e_v,   angle = A(s, numbers) + e_a,   log depth = log c D(s, numbers) + e_d,
    s ~ N(mean, deviation)

Scales c are fitted, of what the map says is `scaled`, else 1. True speeds and the errors of angles, read by hand, are
normal; errors of speeds, where currents come in, and of depths follow Student's t of 4 degrees of freedom, so that a
wrong one counts little. s_i is integrated out (Carroll et al. 2006, chapter 8); numbers, scales and deviations have the
largest posterior. The depth of a tow that was left out is the median of what
its speeds and its angle leave, without its own depth.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import product
from math import ceil, log
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.stats import t as student

from ..calibrate.free import Free
from .simulated import Between, made_of
from .table import Tow, TowsMap, error_of

FREEDOM = 4.0  # degrees of Student's t
NODES = 5  # values of a free number at which depths are tabled
SPEEDS, MOST_SPEEDS = 31, 301  # values of the true speed
HELD = 0.9  # share of the tows that the intervals are to hold
TAILS = np.array([0.5 - 0.5 * HELD, 0.5, 0.5 + 0.5 * HELD])
DEPTH = "depth"  # of the scales
SCALE = 0.1  # deviation of the logarithm of the depth's scale. A choice
STEP = 1e-3  # of the search, for its curvature
LEVELS = 301  # depths at which the distribution of one is taken
# deviations that are looked for, each within a factor of e^WIDE of these: of depth (share), angle, speed, scaled speed
# (share), true speeds of all tows. Choices
PRIOR = {"depth": 0.06, "angle": np.radians(4.0), "speed": 0.15, "scaled": 0.25, "true": 0.15}
WIDE = 0.5
FLOOR = 0.1  # of these, below which no deviation is looked for: the true speeds that are tried lie as far apart


class Parameters(NamedTuple):
    """Places of the free numbers in their ranges, deviations of depth (logarithm), angle [rad] and speeds by name (m/s;
    logarithm of scaled ones), scales by name, mean and deviation of the true speeds [m/s]."""

    unit: np.ndarray
    depth: float
    angle: float
    speeds: dict[str, float]
    scales: dict[str, float]
    mean: float
    deviation: float


class Fitted(NamedTuple):
    """The largest posterior: values of the free numbers, at: the point of the search, at_bound: keys at an end of their
    range, covariance: of the free numbers, from the curvature of the posterior, NaN where it has none."""

    values: np.ndarray
    at: Parameters
    at_bound: list[str]
    converged: bool
    covariance: np.ndarray


class Tows:
    """Readings of tows as arrays, and what the simulated ones are at every true speed and node of the free numbers."""

    def __init__(
        self, made: TowsMap, tows: Sequence[Tow], free: Sequence[Free], between: Between, speeds: tuple[float, float]
    ) -> None:
        self.free, self.map = list(free), made
        self.wire = np.array([tow.wire for tow in tows])
        self.depth, self.angle = (np.array([getattr(tow, one) for tow in tows]) for one in ("depth", "angle"))
        self.readings = {name: np.array([tow.speeds[name] for tow in tows]) for name in made.readings}
        self.scaled = [name for name, column in made.readings.items() if column.scaled]
        self.scaled += [DEPTH] * (made.depth is not None and made.depth.scaled)
        errors = {name: error_of(column) for name, column in made.readings.items()}
        self.stated = {name: error for name, error in errors.items() if error is not None}
        fine = ceil(2.0 * (speeds[1] - speeds[0]) / min(self.stated.values(), default=np.inf)) + 1
        self.true = np.linspace(*speeds, min(max(SPEEDS, fine), MOST_SPEEDS))
        units = [np.array(unit) for unit in product(np.linspace(0.0, 1.0, NODES), repeat=len(free))]
        low, high = (np.array([getattr(one, end) for one in free]) for end in ("low", "high"))
        grid = [made_of(tow, float(speed)) for tow in tows for speed in self.true]
        tables = [between(grid, np.tile(low + (high - low) * unit, (len(grid), 1))) for unit in units]
        shape = (len(tows), len(self.true), *[NODES] * len(free))
        self._tables = [np.stack([table[k] for table in tables], -1).reshape(shape) for k in (0, 1)]

    def __len__(self) -> int:
        return len(self.wire)

    def simulated(self, unit: np.ndarray) -> list[np.ndarray]:
        """Depth [m] and angle [rad] of each tow at each true speed [tows, speeds]; unit: places of the free numbers."""
        out = list(self._tables)
        for u in unit:  # Lagrange's polynomial through the nodes, a free number after the other
            weights = float(u) ** np.arange(NODES) @ TO_POWERS
            out = [np.tensordot(values, weights, (2, 0)) for values in out]
        return out

    def values(self, unit: np.ndarray) -> np.ndarray:
        """Values of the free numbers at places in their ranges."""
        return np.array([one.at(float(u)) for one, u in zip(self.free, unit)])


TO_POWERS = np.linalg.inv(np.vander(np.linspace(0.0, 1.0, NODES), increasing=True))


def _named(tows: Tows, x: np.ndarray) -> Parameters:
    count, free = len(tows.free), [name for name in tows.readings if name not in tows.stated]
    depth, angle, deviation = np.exp(x[count : count + 3])
    own = dict(zip(free, np.exp(x[count + 4 : count + 4 + len(free)]).tolist()))
    scales = dict(zip(tows.scaled, np.exp(x[count + 4 + len(free) :]).tolist()))
    return Parameters(
        x[:count], float(depth), float(angle), own | tows.stated, scales, float(x[count + 3]), float(deviation)
    )


def _begin(tows: Tows, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[tuple[float, float]]]:
    """Where the search begins, the middle of the priors; their widths, inf: none; bounds of the search."""
    plain = [tows.readings[name][rows] for name in tows.readings if name not in tows.scaled]
    mean = float(np.nanmedian(np.concatenate(plain)))
    own = ["scaled" if name in tows.scaled else "speed" for name in tows.readings if name not in tows.stated]
    start = [*(one.place(one.start) for one in tows.free), *(log(PRIOR[w]) for w in ("depth", "angle", "true")), mean]
    wide = [*[np.inf] * len(tows.free), *[WIDE] * 3, np.inf]
    found = [(log(FLOOR * PRIOR[one]), 2.0) for one in ("depth", "angle", "true", *own)]
    bounds = [*[(0.0, 1.0)] * len(tows.free), *found[:3], (float(tows.true[0]), float(tows.true[-1])), *found[3:]]
    start += [log(PRIOR[one]) for one in own]
    for name in tows.scaled:
        ratio = 1.0 if name == DEPTH else np.nanmedian(tows.readings[name][rows]) / mean
        start.append(log(ratio) if np.isfinite(ratio) else 0.0)
    wide += [*[WIDE] * len(own), *(SCALE if name == DEPTH else np.inf for name in tows.scaled)]
    bounds += [(v - 1.0, v + 1.0) for v in start[len(bounds) :]]
    for k, one in enumerate(tows.free):
        if one.sd is not None and one.mean is not None:
            start[k], wide[k] = one.place(one.mean), one.sd / (one.high - one.low)
    return np.array(start), np.array(wide), bounds


def _readings(tows: Tows, at: Parameters, rows: np.ndarray, angle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Log of the density of the true speeds [rows, speeds], given speeds and, where asked for, angle; depths there."""
    depth, inclined = (values[rows] for values in tows.simulated(at.unit))
    out = np.broadcast_to(_normal(tows.true - at.mean, at.deviation), depth.shape).copy()
    for name, values in tows.readings.items():
        read = values[rows][:, None]
        off = np.log(read / at.scales[name] / tows.true) if name in tows.scaled else read - tows.true
        out += np.where(np.isfinite(read), _student(np.nan_to_num(off), at.speeds[name]), 0.0)
    if angle:
        off = tows.angle[rows][:, None] - inclined
        out += np.where(np.isfinite(off), _normal(np.nan_to_num(off), at.angle), 0.0)
    return out, at.scales.get(DEPTH, 1.0) * depth


def _normal(off: np.ndarray, deviation: float) -> np.ndarray:
    return -0.5 * (off / deviation) ** 2 - log(deviation)


def _student(off: np.ndarray, deviation: float) -> np.ndarray:
    return -0.5 * (FREEDOM + 1.0) * np.log1p((off / deviation) ** 2 / FREEDOM) - log(deviation)


def fit(tows: Tows, rows: np.ndarray, angle: bool, curved: bool = False) -> Fitted:
    """The largest posterior of the tows in ``rows`` (bool [tows]), of those with a depth; angle: use it; curved: with
    the covariance of the free numbers."""
    rows = rows & np.isfinite(tows.depth)
    start, wide, bounds = _begin(tows, rows)
    measured = tows.depth[rows][:, None]

    def cost(x: np.ndarray) -> float:
        at = _named(tows, x)
        out, depth = _readings(tows, at, rows, angle)
        out += _student(np.log(measured / depth), at.depth)
        largest = out.max(axis=1, keepdims=True)
        total = (largest[:, 0] + np.log(np.exp(out - largest).sum(axis=1))).sum()
        return -float(total) + 0.5 * float((((x - start) / wide) ** 2).sum())

    best = minimize(cost, start, method="L-BFGS-B", bounds=bounds)
    at = _named(tows, best.x)
    count = len(tows.free)
    spans = np.array([one.high - one.low for one in tows.free])
    covariance = np.full((count, count), np.nan)
    if curved:
        bent = _curvature(cost, best.x)
        if np.all(np.linalg.eigvalsh(bent) > 0.0):
            covariance = np.linalg.inv(bent)[:count, :count] * np.outer(spans, spans)
    bound = [one.key for one, u in zip(tows.free, at.unit) if min(u, 1.0 - u) < 1e-3]
    return Fitted(tows.values(at.unit), at, bound, bool(best.success), covariance)


def _curvature(cost: Callable[[np.ndarray], float], x: np.ndarray) -> np.ndarray:
    """Second derivatives of the cost by central differences."""
    steps = STEP * np.eye(len(x))
    out = np.empty((len(x), len(x)))
    for i, a in enumerate(steps):
        for j, b in enumerate(steps[: i + 1]):
            difference = cost(x + a + b) - cost(x + a - b) - cost(x - a + b) + cost(x - a - b)
            out[i, j] = out[j, i] = difference / (4.0 * STEP**2)
    return out


def depths(tows: Tows, at: Parameters, rows: np.ndarray, angle: bool) -> tuple[np.ndarray, np.ndarray]:
    """Depths [rows, 3] that 5, 50 and 95 of 100 are above, without the measured ones; mean true speeds [rows]."""
    out, depth = _readings(tows, at, rows, angle)
    weight = np.exp(out - out.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    found = np.empty((len(weight), 3))
    for k, (own, at_speed, wire) in enumerate(zip(weight, depth, tows.wire[rows])):
        levels = wire * np.linspace(0.02, 1.3, LEVELS)
        below = student.cdf(np.log(levels[:, None] / at_speed) / at.depth, FREEDOM) @ own
        found[k] = np.interp(TAILS, below, levels)
    return found, weight @ tows.true


def folds_of(groups: Sequence[str], count: int | None) -> np.ndarray:
    """Number of the fold of each tow: a fold a group, or ``count`` of them, groups kept together."""
    members = Counter(groups)
    sizes = [0] * min(count or len(members), len(members))
    fold = {}
    for name, own in members.most_common():  # the largest first: even folds
        fold[name] = int(np.argmin(sizes))
        sizes[fold[name]] += own
    return np.array([fold[name] for name in groups])


def widened(depth: np.ndarray, found: np.ndarray) -> float:
    """By how much intervals must be wider about their median so that HELD of these tows, and one more, are held."""
    known = np.isfinite(depth) & np.isfinite(found[:, 1])
    low, mid, high = found[known].T
    own = depth[known]
    need = np.sort(np.where(own > mid, (own - mid) / (high - mid), (mid - own) / (mid - low)))
    rank = ceil(HELD * (len(need) + 1))
    return float(need[min(rank, len(need)) - 1]) if len(need) else 1.0


def wider(found: np.ndarray, factor: float) -> np.ndarray:
    """Intervals widened about their median by a factor."""
    mid = found[:, 1:2]
    return np.maximum(mid + factor * (found - mid), 0.0)
