"""Which number of a scene decides which figure: Sobol indices of the first and of total order, with intervals.

Saltelli's scheme (Saltelli et al. 2010, Comput. Phys. Commun. 181, 259), as scipy.stats.sobol_indices computes it: n
(d + 2) runs for d ranges. Intervals are percentiles of a bootstrap over the n points, with a seed: the same each time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc, sobol_indices

from ...errors import CableSimError
from ...terminal import print_table, say
from .cases import RNG, within
from .figures import refuse_texts
from .sweep import Progress, Swept, sweep
from .sweep_file import MAX_CASES, Method, SweepPlan

RESAMPLES, LEVEL = 400, 0.95
CAPTION = "Share of the variance: alone (first order), with all others (total); 95 % intervals"
HEAD = ("figure", "key", "first", "interval", "total", "interval")
LEAST = 16  # points; of fewer a bootstrap is no interval
WIDEST = 1.0  # of an interval: an index is a share
NOTHING = 1e-12  # of the mean: a figure that varies by less has no indices


class SensitivityError(CableSimError, ValueError):
    """Indices that cannot be computed."""


class Index(NamedTuple):
    """Of one key on one figure: first order, total order, and their 95 % intervals."""

    figure: str
    key: str
    first: float
    first_low: float
    first_high: float
    total: float
    total_low: float
    total_high: float


class Sensitivity(NamedTuple):
    """Indices; figures that do not vary; mean and standard deviation of each figure over the ranges; the runs; doubts:
    which of the indices are none, in words."""

    indices: list[Index]
    constant: list[str]
    spread: dict[str, tuple[float, float]]
    swept: Swept
    doubts: list[str]


def points(plan: SweepPlan) -> list[dict[str, float]]:
    """Samples of Saltelli's scheme: A, B, then A with the column of each key from B. SensitivityError if the plan does
    not fit it."""
    samples = plan.samples
    if samples is None or not samples.ranges:
        raise SensitivityError(
            f"{plan.sweep}: has no samples.ranges; nothing was simulated. Give the ranges that are to be weighed"
        )
    if plan.grid or len(plan.motions) > 1 or len(plan.plans) > 1 or len(plan.setpoints) > 1 or plan.seeds > 1:
        raise SensitivityError(
            f"{plan.sweep}: varies by grid, motions, plans, setpoints or seeds as well; nothing was simulated. Indices "
            "are of one tow: leave those out"
        )
    if samples.method is not Method.SOBOL:
        raise SensitivityError(
            f"{plan.sweep}: samples.method = {samples.method.value} does not serve here, the scheme has its own points "
            "(sobol); nothing was simulated. Leave samples.method out"
        )
    if samples.count < LEAST:
        raise SensitivityError(
            f"{plan.sweep}: samples.count = {samples.count} is below {LEAST}: intervals of so few points say nothing; "
            f"nothing was simulated. Give {LEAST} or more, better 64: {len(samples.ranges) + 2} runs each"
        )
    if samples.count & (samples.count - 1):
        raise SensitivityError(
            f"{plan.sweep}: samples.count = {samples.count} is no power of 2; nothing was simulated. Give "
            f"{1 << samples.count.bit_length()}"
        )
    d = len(samples.ranges)
    if samples.count * (d + 2) > MAX_CASES:
        raise SensitivityError(
            f"{plan.sweep}: samples.count = {samples.count} with {d} ranges makes {samples.count * (d + 2)} runs, more "
            f"than {MAX_CASES}; nothing was simulated. Give a smaller samples.count"
        )
    drawn = qmc.Sobol(2 * d, **{RNG: np.random.default_rng(samples.seed)}).random(samples.count)
    a, b = drawn[:, :d], drawn[:, d:]
    mixed = []
    for k in range(d):
        one = a.copy()
        one[:, k] = b[:, k]
        mixed.append(one)
    return within(samples.ranges, np.concatenate([a, b, *mixed]))


def sensitivity(
    plan: SweepPlan,
    out: str | Path,
    *,
    workers: int | None = None,
    make: Any = None,
    progress: Progress = lambda done, total: None,
) -> Sensitivity:
    """Run the scheme of a plan and compute the indices of each of its figures.

    Raises SensitivityError where a run failed: its figure is not known, and no index is computed without it.
    """
    refuse_texts(plan.figures, "indices")
    swept = sweep(plan, out, workers=workers, make=make, drawn=points(plan), progress=progress)
    failed = [(case, row) for case, row in zip(swept.cases, swept.rows) if row["verdict"] == "failed"]
    if failed:
        case, row = failed[0]
        where = ", ".join(f"{key} = {value:.6g}" for key, value in case.varied.items())
        raise SensitivityError(
            f"{plan.sweep}: {len(failed)} of {len(swept.rows)} runs failed, the first at {where} ({row['error']}); no "
            f"index was computed. Narrow the ranges"
        )
    assert plan.samples is not None
    n, keys = plan.samples.count, list(plan.samples.ranges)
    names = plan.figures or [name for name in swept.rows[0] if isinstance(swept.rows[0][name], float)]
    indices, constant, spread, gone = [], [], {}, []
    for name in (name for name in names if name not in ("cpu_s", "simulated_s")):
        values = np.array([row.get(name, np.nan) for row in swept.rows]).reshape(len(keys) + 2, n)
        if lost := int((~np.isfinite(values)).sum()):
            if name in plan.figures or lost < values.size:  # what no run has is no figure of these runs
                gone.append(f"{name} has no number in {lost} of {values.size} runs, so no index. Leave it out")
            continue
        spread[name] = float(values[:2].mean()), float(values[:2].std())
        if spread[name][1] <= NOTHING * abs(spread[name][0]):
            constant.append(name)
            continue
        indices += indices_of(name, keys, values, plan.samples.seed)
    return Sensitivity(indices, constant, spread, swept, [*gone, *doubts_of(indices)])


def doubts_of(indices: list[Index]) -> list[str]:
    """Why indices are none: a share of the variance is from 0 to 1, and an interval wider than that says nothing."""
    found = []
    for one in indices:
        for order, value, low, high in (
            ("first", one.first, one.first_low, one.first_high),
            ("total", one.total, one.total_low, one.total_high),
        ):
            if not np.isfinite([value, low, high]).all():
                why = "is no number"
            elif low > 1.0 or high < 0.0:
                why = "lies outside [0, 1]"
            elif high - low > WIDEST:
                why = f"has an interval {high - low:.2g} wide, above {WIDEST:g}"
            else:
                continue
            found.append(
                f"{order} index of {one.figure} on {one.key} = {value:.2f} ({low:.2f} to {high:.2f}) {why}. Give a "
                "larger samples.count, or narrower ranges"
            )
    return found


def indices_of(figure: str, keys: list[str], values: np.ndarray, seed: int) -> list[Index]:
    """Indices of one figure, of its values [keys + 2, n] in the order of `points`."""

    def both(chosen: np.ndarray) -> np.ndarray:
        f = values[:, chosen]
        found = sobol_indices(func={"f_A": f[:1], "f_B": f[1:2], "f_AB": f[2:, None]}, n=f.shape[1])
        return np.array([np.ravel(found.first_order), np.ravel(found.total_order)])

    n = values.shape[1]
    rng = np.random.default_rng(seed)
    again = np.array([both(np.asarray(rng.integers(0, n, n))) for _ in range(RESAMPLES)])
    low, high = np.nanquantile(again, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL], axis=0)
    whole = both(np.arange(n))
    return [
        Index(figure, key, *(float(part[order, k]) for order in (0, 1) for part in (whole, low, high)))
        for k, key in enumerate(keys)
    ]


def rows_of(found: Sensitivity) -> list[list[str]]:
    """Rows of the table of the indices, under HEAD."""
    return [
        [
            one.figure,
            one.key,
            f"{one.first:.2f}",
            f"{one.first_low:.2f} to {one.first_high:.2f}",
            f"{one.total:.2f}",
            f"{one.total_low:.2f} to {one.total_high:.2f}",
        ]
        for one in found.indices
    ]


def tell(found: Sensitivity) -> None:
    """Print the indices."""
    print_table(CAPTION, HEAD, rows_of(found), left=HEAD[:2])
    for name in found.constant:
        say(f"{name}: does not vary over these ranges")
    found.swept.tell()
