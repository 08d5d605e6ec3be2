"""Measured tows beside simulated ones: fitted over all, judged by folds that were left out, beside the trade's ways."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...sim.verdict import Reason, Verdict, verdict_of
from ..sweeps.cases import Case
from .fit import HELD, Fitted, Tows, depths, fit, folds_of, widened, wider
from .simulated import Answered, Between, Made, Setting, answered, cases_of, made_of, static_cases, surrogate
from .table import CONSEQUENCE, Table, TowsError, TowsMap

FEWEST = 8  # tows with a depth, for a fit
FEW = 30  # below, an interval for 90 of 100 rests on few
MAD = 1.4826  # of a median absolute deviation, to a standard deviation
ROUGH = 0.01  # share of depth, that the interpolation may be off in the rms
SURE = 2.0  # standard deviations of a share, that what intervals hold may be beside 90 of 100
APART = 0.95  # correlation of two free numbers
FAR = 3.0  # half widths of its interval: a tow so far away is named
SECOND_BEST = 1.02  # times the spread of the cosine, and its median error, that a fit may have


class Way(NamedTuple):
    """A way to a depth on the tows it can be had of: median of its error, spread (1.4826 MAD), median and root mean
    square of the absolute error, shares of the measured depth; held: share of the tows within their intervals."""

    way: str
    tows: int
    bias: float
    spread: float
    median: float
    rms: float
    held: float | None = None


class Judged(NamedTuple):
    """What became of a table of tows. left_out [tows, 3]: depths that 5, 50, 95 of 100 are above, of a fit without the
    fold of the tow, widened; all_in: the same of the fit to all; speeds: true ones [m/s]; itself: depth of each
    tow simulated with these; apart: largest and rms deviation of the interpolation from it, share of depth."""

    table: Table
    made: TowsMap
    fitted: Fitted
    factor: float
    folds: np.ndarray
    left_out: np.ndarray
    all_in: np.ndarray
    speeds: np.ndarray
    itself: np.ndarray
    apart: tuple[float, float]
    ways: list[Way]
    between: Between
    verdict: Verdict


def judge(
    table: Table,
    made: TowsMap,
    setting: Setting,
    speeds: tuple[float, float],
    count: int,
    folds: int | None,
    run: Callable[[Sequence[Case]], list[dict[str, Any]]],
) -> Judged:
    """Simulate, fit and judge the tows of a table; count: tows of the design; folds: None: one a group; run: rows of
    cases. Raises TowsError."""
    refuse(table)
    numbers = folds_of([tow.group or tow.name for tow in table.tows], folds)
    if numbers.max() == 0:
        raise TowsError(
            f"{table.path}: all {len(table.tows)} tows are of one group, {table.tows[0].group}, so that none is left "
            f"to judge the fit; {CONSEQUENCE}. Leave the group out: each tow is then one of its own"
        )
    between = surrogate(setting, table.tows, speeds, count, run)
    tows = Tows(made, table.tows, setting.free, between, speeds)
    every, angled = np.ones(len(tows), bool), np.isfinite(tows.angle)
    best = fit(tows, every, True, curved=True)
    raw, plain = _left_out(tows, numbers, every, True), _left_out(tows, numbers, every, False)
    ours, factor = _held(tows, numbers, raw)
    without, _ = _held(tows, numbers, plain)
    all_in, true = depths(tows, best.at, every, True)
    values = np.tile(best.values, (len(tows), 1))
    last = answered(run(cases_of(setting, _at(table, true), values)))
    beside = np.abs(between(_at(table, true), values)[0] / last.depth - 1.0)
    beside = beside[np.isfinite(beside)]
    apart = (float(beside.max()), float(np.sqrt(np.mean(beside**2)))) if len(beside) else (0.0, 0.0)
    rough = float(np.nanmax([between.error[1], between.over_time[1], apart[1]]))
    still = answered(run(static_cases(setting, _at(table, _first(tows)))))
    cosine = tows.wire * np.cos(tows.angle)
    ratio = np.array([tows.wire[k] * _ratio(tows, numbers != numbers[k]) for k in range(len(tows))])
    ways = [
        _way("this fit", tows.depth, ours[:, 1], angled, ours),
        _way("cosine of the angle", tows.depth, cosine, angled),
        _way("this fit, all tows", tows.depth, ours[:, 1], every, ours),
        _way("this fit without angles", tows.depth, without[:, 1], every, without),
        _way("wire times a ratio", tows.depth, ratio, every),
        _way("static tow of the scene", tows.depth, still.depth, every),
    ]
    ways = [one for one in ways if one.tows]
    reasons = _reasons(table, setting, best, rough, last, ways, tows, ours)
    judged = verdict_of(reasons)
    return Judged(
        table, made, best, factor, numbers, ours, wider(all_in, factor), true, last.depth, apart, ways, between, judged
    )


def refuse(table: Table) -> None:
    """Raise TowsError for a table that no numbers can be fitted to."""
    known = [tow for tow in table.tows if np.isfinite(tow.depth)]
    if len(known) < FEWEST:
        raise TowsError(
            f"{table.path}: has {len(known)} tows with a depth, and a fit needs {FEWEST}; {CONSEQUENCE}. Give more tows"
        )
    if len({(tow.wire, tow.angle, tow.depth, *tow.speeds.values()) for tow in known}) == 1:
        raise TowsError(
            f"{table.path}: all {len(known)} tows are the same to the last digit, so that nothing tells numbers from "
            f"errors; {CONSEQUENCE}. Give tows, not copies of one"
        )


def _left_out(tows: Tows, numbers: np.ndarray, rows: np.ndarray, angle: bool) -> np.ndarray:
    """Depths [tows, 3] of each fold by the fit to the others."""
    out = np.full((len(tows), 3), np.nan)
    for fold in range(numbers.max() + 1):
        out[numbers == fold] = depths(tows, fit(tows, rows & (numbers != fold), angle).at, numbers == fold, angle)[0]
    return out


def _held(tows: Tows, numbers: np.ndarray, raw: np.ndarray) -> tuple[np.ndarray, float]:
    """Intervals of each fold widened by what the other folds need, and the factor that all need."""
    out = np.empty_like(raw)
    for fold in range(numbers.max() + 1):
        own = numbers == fold
        out[own] = wider(raw[own], widened(tows.depth[~own], raw[~own]))
    return out, widened(tows.depth, raw)


def _at(table: Table, speeds: np.ndarray) -> list[Made]:
    return [made_of(tow, float(speed)) for tow, speed in zip(table.tows, speeds)]


def _first(tows: Tows) -> np.ndarray:
    """The first speed of each tow that is not scaled [m/s]."""
    out = np.full(len(tows), np.nan)
    for name, values in tows.readings.items():
        if name not in tows.scaled:
            out = np.where(np.isfinite(out), out, values)
    return out


def _ratio(tows: Tows, rows: np.ndarray) -> float:
    return float(np.nanmedian(tows.depth[rows] / tows.wire[rows]))


def _way(name: str, depth: np.ndarray, found: np.ndarray, rows: np.ndarray, within: np.ndarray | None = None) -> Way:
    rows = rows & np.isfinite(depth) & np.isfinite(found)
    off = found[rows] / depth[rows] - 1.0
    if not len(off):
        return Way(name, 0, np.nan, np.nan, np.nan, np.nan)
    held = None
    if within is not None:
        held = float(np.mean((depth[rows] >= within[rows, 0]) & (depth[rows] <= within[rows, 2])))
    middle = float(np.median(off))
    spread = MAD * float(np.median(np.abs(off - middle)))
    rms = float(np.sqrt(np.mean(off**2)))
    return Way(name, len(off), middle, spread, float(np.median(np.abs(off))), rms, held)


def _reasons(
    table: Table,
    setting: Setting,
    best: Fitted,
    rough: float,
    last: Answered,
    ways: list[Way],
    tows: Tows,
    ours: np.ndarray,
) -> list[Reason]:
    """Why the depths cannot be taken as they are."""
    found = []

    def say(flag: str, text: str) -> None:
        found.append(Reason(flag, 0.0, 0.0, (), text))

    if not best.converged:
        say("UNCONVERGED", "the fit has not converged: its numbers are where it stopped")
    for key in best.at_bound:
        say("AT_BOUND", f"{key} is at an end of its range: the best lies beyond")
    deviation = np.sqrt(np.diag(best.covariance))
    for free, sd in zip(setting.free, deviation):
        if not sd < 0.5 * (free.high - free.low):
            say("UNKNOWN", f"these tows say nothing of {free.key}: the fit is as good in half of its range")
    if len(setting.free) == 2 and abs(best.covariance[0, 1]) > APART * deviation.prod():
        say("NOT_APART", f"these tows cannot tell {' and '.join(one.key for one in setting.free)} apart: fix one")
    if rough > ROUGH:
        say("ROUGH", f"depths between simulated tows are off by {100 * rough:.2g} % rms: raise --design")
    if last.doubts:
        told = ", ".join(f"{flag} in {count}" for flag, count in last.doubts.items())
        say("DOUBTFUL_TOWS", f"of {len(tows)} tows as they were made the runs are doubtful: {told} (docs/flags.md)")
    low, high = (float(tows.true[k]) for k in (0, -1))
    speeds = _first(tows)
    beyond = np.flatnonzero((speeds < low) | (speeds > high))
    if len(beyond):
        names = ", ".join(f"{table.tows[k].name} ({speeds[k]:.3g} m/s)" for k in beyond[:5])
        say("SPEEDS", f"{len(beyond)} tows are outside the simulated speeds, {low:.3g} to {high:.3g} m/s: {names}")
    if last.why:
        say("FAILED_TOWS", f"{len(last.why)} tows could not be simulated as they were made ({last.why[0]:.200})")
    if table.left:
        say(
            "LEFT_OUT",
            f"{len(table.left)} rows are no tows: {'; '.join(table.left[:3])}{' ...' * (len(table.left) > 3)}",
        )
    own = ways[0] if ways[0].way == "this fit" else next(one for one in ways if one.way == "this fit, all tows")
    if own.held is not None and abs(own.held - HELD) > SURE * np.sqrt(HELD * (1.0 - HELD) / own.tows):
        say("COVERAGE", f"intervals for 90 of 100 hold {100 * own.held:.0f} of 100 tows that were left out")
    if own.tows < FEW:
        say("FEW_TOWS", f"{own.tows} tows judge the fit, below {FEW}: the intervals rest on few")
    for one in ways:
        behind = own.spread > SECOND_BEST * one.spread or own.median > SECOND_BEST * one.median
        if one.way.startswith("cosine") and behind:
            say(
                "BEHIND",
                f"the cosine of the angle has a spread of {100 * one.spread:.3g} %, the fit {100 * own.spread:.3g} %",
            )
    half = 0.5 * (ours[:, 2] - ours[:, 0])
    far = np.flatnonzero(np.abs(tows.depth - ours[:, 1]) > FAR * half)
    if len(far):
        names = ", ".join(f"{table.tows[k].name} ({tows.depth[k]:.3g} for {ours[k, 1]:.3g} m)" for k in far[:5])
        say("OUTLIERS", f"{len(far)} tows are far out of their intervals: {names}. Are their units and counters right?")
    return found
