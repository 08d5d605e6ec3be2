"""Score of one quantity: measured A against simulated B. FIGURES declares each figure once, for JSON, limits, pages.

Heights and cycles of a signal: double amplitudes, rainflow, exceedance, ellipsoids of places.

Limits that scores must keep: a checked YAML file, and what is violated. What could not be scored fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...io.scenes.document import Document, SceneError
from ...physics.parameter import REQUIRED, Block, choice, quantity
from ...sim.problem import Problem
from ...sim.rules.rainflow import Rainflow
from ...sim.tables.elementary import principal
from ..logs.own_signals import QUANTITIES, Signal
from .alignment import wave_part
from .pairing import NotPaired, Pair, clean, paired
from .spectra import (
    BAND,
    Interval,
    band_of,
    blocks,
    coherence_of,
    correlation_time,
    jackknife,
    lag_of,
    left_out,
    spectra,
)

PLAY = 0.25  # standard deviations that a crossing of the mean must go beyond it, either way: noise makes no wave
LEVELS = (0.1, 0.01, 0.001)  # of the time, in which A is above
LEAST_CYCLE = 0.02  # of the largest range: smaller ones are not counted
CHI2_3 = 7.814727903251179  # 95 % of a sum of three squares

SLOPE = 4.0  # of ranges against cycles, in logarithms
TOP = 0.95  # quantile of double amplitudes
LEAST_R = 0.1  # correlation below which a gain is of noise
FEWEST_WAVES = 20  # for a quantile of them
FEWEST_SEGMENTS = 4  # for a coherence: of one it is 1 whatever the two are
SMALL = 1e-12  # of the size of the values: a spread below it is round-off

EXAMPLE = "limits: my tow"
Range = tuple[float, float]


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
    values, ways = _principal(places)
    axes = np.sqrt(CHI2_3 * np.maximum(values, 0.0))[::-1]
    return {
        "centre_m": places.mean(axis=0).tolist(),
        "semi_axes_m": axes.tolist(),
        "volume_m3": float(4.0 / 3.0 * math.pi * axes.prod()),
        "directions": ways[:, ::-1].T.tolist(),
    }


def inside(places: np.ndarray, of: np.ndarray) -> float | None:
    """Share of places in the 95 % ellipsoid of others; None where that has no volume."""
    values, ways = _principal(of)
    if not values[0] > 1e-12 * max(values[-1], 1e-300):
        return None
    turned = np.stack([((places - of.mean(axis=0)) * ways[:, k]).sum(axis=1) for k in range(3)], axis=1)
    return float(((turned**2 / values).sum(axis=1) <= CHI2_3).mean())


def _principal(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Variances [3], rising, of places [n, 3] along their principal directions, and these."""
    rest = places - places.mean(axis=0)
    spread = np.array([[float((rest[:, i] * rest[:, j]).mean()) for j in range(3)] for i in range(3)])
    return principal(spread)


class Figure(NamedTuple):
    """unit: "q" for that of the quantity, "1" for a number; meaning in words; interval: has it one?"""

    unit: str
    meaning: str
    interval: bool = False


FIGURES: dict[str, Figure] = {
    "samples": Figure("1", "times at which both have a value, on the grid of the slower one"),
    "overlap_s": Figure("s", "time that both cover"),
    "gaps_s": Figure("s", "of that without a value of A or B; left out"),
    "rate_hz": Figure("Hz", "of the common grid"),
    "removed": Figure("1", "share of the variance of the faster one above the grid's rate, low-passed away"),
    "independent": Figure("1", "independent samples of the difference, by its autocorrelation"),
    "mean_a": Figure("q", "mean of A"),
    "mean_b": Figure("q", "mean of B"),
    "std_a": Figure("q", "standard deviation of A"),
    "std_b": Figure("q", "standard deviation of B"),
    "bias": Figure("q", "mean of B less A", True),
    "rms": Figure("q", "root mean square of B less A", True),
    "normalised_rms": Figure("1", "rms over the standard deviation of A", True),
    "largest": Figure("q", "largest magnitude of B less A"),
    "correlation": Figure("1", "of A and B at equal times"),
    "gain": Figure(
        "1",
        "B over A about their means: ratio of the standard deviations with the sign of the correlation, a regression "
        "with errors in both; interval from the lower end of B on A to the upper end of A on B, turned round",
        True,
    ),
    "lag_s": Figure("s", "how much later B is, from the phase of the waves", True),
    "peak_hz": Figure("Hz", "frequency where A has most, in the wave band"),
    "phase_deg": Figure("deg", "lag_s as a phase at peak_hz"),
    "spectrum_ratio": Figure("1", "variance of B over that of A in the wave band", True),
    "coherence": Figure("1", "squared coherence in the wave band, weighted by the spectrum of A", True),
    "coherence_of_noise": Figure("1", "a squared coherence that unrelated signals stay below in 95 of 100 cases"),
    "peak_ratio": Figure("1", "largest double amplitude of B over that of A; both without what is slower than waves"),
    "peak_ratio_95": Figure("1", "the same of the 95 % quantile of double amplitudes", True),
    "cycles_a": Figure("1", "cycles of A by rainflow, above 2 % of its largest range"),
    "cycles_b": Figure("1", "cycles of B by rainflow"),
    "damage_range_a": Figure("q", "range of one cycle a second that does the damage of A, at `slope`"),
    "damage_range_b": Figure("q", "that of B"),
    "damage_ratio": Figure("1", "damage_range_b over damage_range_a"),
}


@dataclass
class Score:
    """Figures of FIGURES by name, None where they cannot be told; intervals: of 95 %, by name; notes: why not, and
    what was done. scored: False where nothing could be compared."""

    quantity: str
    unit: str
    source_a: str = ""
    source_b: str = ""
    scored: bool = False
    figures: dict[str, float | None] = field(default_factory=dict)
    intervals: dict[str, Interval] = field(default_factory=dict)
    band_hz: Interval | None = None
    slope: float = SLOPE
    exceedance: list[dict[str, float]] = field(default_factory=list)
    dropped_a: dict[str, int] = field(default_factory=dict)
    dropped_b: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    pair: Pair | None = None  # for pictures; not in the JSON

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.name != "pair"}

    def put(self, name: str, value: float | None, half: float | None = None) -> None:
        """A figure, with half the width of its interval."""
        self.figures[name] = None if value is None or not np.isfinite(value) else float(value)
        if half is not None and self.figures[name] is not None and np.isfinite(half):
            self.intervals[name] = (float(value - half), float(value + half))  # type: ignore[operator]


def score(
    a: Signal,
    b: Signal,
    *,
    origin: int | None = None,
    window: tuple[float, float] = (-np.inf, np.inf),
    band: tuple[float, float] = BAND,
    slope: float = SLOPE,
) -> Score:
    """Score of two signals of one quantity. origin: ns that `window` [s] counts from, None: the first stamp of A;
    band: Hz of the waves; slope: of the damage."""
    origin = int(a.time[0]) if origin is None and len(a.time) else origin or 0
    out = Score(a.quantity, QUANTITIES[a.quantity].unit, a.source, b.source, slope=slope)
    out.figures = dict.fromkeys(FIGURES)
    one, other = clean(a, origin), clean(b, origin)
    out.dropped_a, out.dropped_b = one.dropped, other.dropped
    for name, dropped in (("A", one.dropped), ("B", other.dropped)):
        out.notes += [f"{name}: {count} values left out: {cause}" for cause, count in dropped.items()]
    try:
        pair = paired(a.quantity, one, other, window)
    except NotPaired as why:
        out.notes.append(f"not scored: {why}")
        return out
    out.scored, out.pair = True, pair
    if pair.faster:
        out.notes.append(
            f"{pair.faster.upper()} is the faster one: low-passed at {pair.cut_hz:.3g} Hz, "
            f"{100.0 * pair.removed:.2g} % of its variance"
        )
    if pair.line:
        out.notes.append("the straight track of A was taken off both")
    _in_time(out, pair)
    _in_band(out, pair, band)
    _heights(out, pair, band, slope)
    return out


def _in_time(out: Score, pair: Pair) -> None:
    good = pair.good
    a, b = pair.a[good], pair.b[good]
    d = pair.b - pair.a
    n, rest = len(a), (b - a)
    mean_a, mean_b = float(a.mean()), float(b.mean())
    std_a, std_b = float(a.std()), float(b.std())
    size = max(np.abs(a).max(), np.abs(b).max())
    std_a, std_b = (value if value > SMALL * size else 0.0 for value in (std_a, std_b))
    r = float(((a - mean_a) * (b - mean_b)).mean() / (std_a * std_b)) if std_a and std_b else None
    out.put("samples", n)
    out.put("overlap_s", pair.overlap_s)
    out.put("gaps_s", pair.gaps_s)
    out.put("rate_hz", 1.0 / pair.step)
    out.put("removed", pair.removed)
    for name, value in (("mean_a", mean_a), ("mean_b", mean_b), ("std_a", std_a), ("std_b", std_b)):
        out.put(name, value)
    out.put("largest", float(np.abs(rest).max()))
    out.put("correlation", r)
    crossed = (pair.a - mean_a) * (d - rest.mean())
    width = max(correlation_time(d), correlation_time(crossed))
    out.put("independent", n / correlation_time(d))
    block = blocks(len(d), width)
    terms = np.stack([np.ones(n), a - mean_a, b - mean_a, (a - mean_a) ** 2, (b - mean_a) ** 2,
                      (a - mean_a) * (b - mean_a), rest, rest**2], axis=1)  # fmt: skip
    whole, without = terms.sum(axis=0), None
    if block is not None:
        own = block[good]
        present = np.unique(own)
        own = np.searchsorted(present, own)  # blocks that lie in a gap are none
        if len(present) >= 5:
            without = left_out(terms, own)
    if without is None:
        out.notes.append(
            f"no intervals of bias, rms and gain: the record holds {n / width:.0f} independent samples, fewer than 25"
        )

    def put(name: str, function: Callable[[np.ndarray], float]) -> None:
        value = function(whole)
        half = None if without is None else float(jackknife(np.array(value), np.array([function(w) for w in without])))
        out.put(name, value, half)

    put("bias", lambda s: s[6] / s[0])
    put("rms", lambda s: float(np.sqrt(s[7] / s[0])))
    if std_a:
        put("normalised_rms", lambda s: float(np.sqrt(s[7] / s[0] / max(_of(s)[0], 1e-300))))
    if r is None or abs(r) < LEAST_R:
        out.notes.append(
            "no gain: one of them does not change" if r is None else f"no gain: the correlation is {r:.2f}"
        )
        return
    sign = 1.0 if r > 0.0 else -1.0
    out.put("gain", sign * std_b / std_a)
    if without is not None:
        ends = []
        for function in (lambda v: abs(v[2]) / v[0], lambda v: v[1] / abs(v[2])):  # b on a; a on b, turned round
            value = function(_of(whole))
            others = np.array([function(_of(w)) for w in without])
            ends.append((value, float(jackknife(np.array(value), others))))
        low, high = ends[0][0] - ends[0][1], ends[1][0] + ends[1][1]
        out.intervals["gain"] = (low, high) if sign > 0.0 else (-high, -low)


def _of(s: np.ndarray) -> tuple[float, float, float]:
    """Variances of a and b, and their covariance, from the sums."""
    a, b = s[1] / s[0], s[2] / s[0]
    return s[3] / s[0] - a * a, s[4] / s[0] - b * b, s[5] / s[0] - a * b


def _in_band(out: Score, pair: Pair, band: tuple[float, float]) -> None:
    part = band_of(pair.step, band)
    if part is None:
        out.notes.append(f"no figures of waves: {1.0 / pair.step:.3g} Hz is too slow for {band[0]:g} to {band[1]:g} Hz")
        return
    if part[1] < band[1]:
        out.notes.append(f"the wave band ends at {part[1]:.3g} Hz: sampled at {1.0 / pair.step:.3g} Hz")
    given = spectra(pair, part)
    if given is None:
        out.notes.append("no figures of waves: no segment without a gap is long enough")
        return
    out.band_hz, sums = part, given.sums()
    size = max(float(np.nanmax(np.abs(pair.a))), float(np.nanmax(np.abs(pair.b))))
    floor = (SMALL * size) ** 2 * given.segment
    power_a, power_b = float(sums[0].sum()), float(sums[1].sum())
    if not (power_a > floor and power_b > floor):
        out.notes.append("no figures of waves: one of them has none")
        return
    count = len(given.aa)
    without = given.without()

    def put(name: str, function: Callable[[tuple], float], limits: Interval) -> None:
        value = function(sums)
        out.put(name, value)
        if without:
            # of the logarithm or the logit the interval stays where the figure can be
            half = float(jackknife(np.array(value), np.array([function(w) for w in without])))
            out.intervals[name] = (max(limits[0], value - half), min(limits[1], value + half))

    put("spectrum_ratio", lambda s: float(s[1].sum() / s[0].sum()), (0.0, np.inf))
    if count < FEWEST_SEGMENTS:
        out.notes.append(
            f"no coherence, lag and intervals of waves: {count} segments of {given.segment:.0f} s, fewer than "
            f"{FEWEST_SEGMENTS}; {0.5 * (FEWEST_SEGMENTS + 1) * given.segment:.0f} s without a gap have them"
        )
        return
    put("coherence", lambda s: float((coherence_of(s) * s[0]).sum() / s[0].sum()), (0.0, 1.0))
    effective = max(1.0, 1.0 + (count - 1) / (1.0 + 2.0 / 36.0))  # Hann, half overlapped: Welch (1967)
    noise = 1.0 - 0.05 ** (1.0 / (effective - 1.0)) if effective > 1.0 else 1.0
    out.put("coherence_of_noise", noise)
    if out.figures["coherence"] is not None and out.figures["coherence"] > noise:
        lag, half = lag_of(given)
        shift = round(lag / pair.step)
        later = spectra(pair, part, shift) if shift and abs(lag) < 0.25 * given.segment else None
        if later is not None:
            lag, half = lag_of(later)
            lag += shift * pair.step
        out.put("lag_s", lag, half)
        peak = int(np.argmax(sums[0]))
        out.put("peak_hz", float(given.f[peak]))
        out.put("phase_deg", 360.0 * float(given.f[peak]) * lag)
    else:
        out.notes.append("no lag: the coherence is that of unrelated signals")
    if not without:
        out.notes.append(f"no intervals of waves: {count} segments of {given.segment:.0f} s, fewer than 10")


def _heights(out: Score, pair: Pair, band: tuple[float, float], slope: float) -> None:
    a, b = pair.a, pair.b
    seconds = float(pair.good.sum()) * pair.step
    for name, x in (("a", a), ("b", b)):
        count, _, damage = cycles(x, slope, seconds)
        out.put(f"cycles_{name}", count)
        out.put(f"damage_range_{name}", damage)
    if out.figures["damage_range_a"]:
        out.put("damage_ratio", out.figures["damage_range_b"] / out.figures["damage_range_a"])  # type: ignore[operator]
    out.exceedance = exceedance(a, b)
    if out.band_hz is None:
        return
    waves = [double_amplitudes(wave_part(x, pair.step, band[0])) for x in (a, b)]
    heights = [found[0] for found in waves]
    if not all(len(found) and found.max() > SMALL * np.nanmax(np.abs(a)) for found in heights):
        out.notes.append("no double amplitudes: one of them has no whole wave")
        return
    out.put("peak_ratio", float(heights[1].max() / heights[0].max()))
    if min(map(len, heights)) < FEWEST_WAVES:
        out.notes.append(f"{min(map(len, heights))} waves: too few for a quantile of their heights")
        return
    ratio = float(np.quantile(heights[1], TOP) / np.quantile(heights[0], TOP))
    count = 10
    edges = np.linspace(0, len(a), count + 1)
    others = []
    for k in range(count):
        left = [h[(e < edges[k]) | (e >= edges[k + 1])] for h, e in waves]
        if all(map(len, left)):
            others.append(np.quantile(left[1], TOP) / np.quantile(left[0], TOP))
    half = float(jackknife(np.array(ratio), np.array(others))) if len(others) == count else None
    out.put("peak_ratio_95", ratio, half)


class LimitsError(SceneError):
    """A file of limits that cannot be used; every problem in one text each."""


class QuantityLimits(Block):
    bias: float | None = quantity(None, "unit of the quantity", 0.0, None, "magnitude of the mean of B less A, at most")
    rms: float | None = quantity(None, "unit of the quantity", 0.0, None, "rms of B less A, at most")
    largest: float | None = quantity(None, "unit of the quantity", 0.0, None, "magnitude of B less A, at most")
    normalised_rms: float | None = quantity(None, "1", 0.0, None, "rms over the deviation of A, at most")
    lag: float | None = quantity(None, "s", 0.0, None, "magnitude of the lag in the waves, at most")
    correlation: float | None = quantity(None, "1", -1.0, 1.0, "of A and B, at least")
    coherence: float | None = quantity(None, "1", 0.0, 1.0, "squared, in the wave band, at least")
    gain: Range | None = quantity(None, "1", None, None, "B over A about their means, from and to")
    spectrum_ratio: Range | None = quantity(None, "1", 0.0, None, "variance in the wave band, B over A, from and to")
    peak_ratio: Range | None = quantity(None, "1", 0.0, None, "largest double amplitude, B over A, from and to")
    peak_ratio_95: Range | None = quantity(None, "1", 0.0, None, "95 % quantile of them, B over A, from and to")
    damage_ratio: Range | None = quantity(None, "1", 0.0, None, "damage-equivalent range, B over A, from and to")


class Limits(Block):
    limits: str = choice(REQUIRED, "name of these limits")
    quantities: dict[str, QuantityLimits] = choice(REQUIRED, "limits by quantity")


LEAST = {"correlation", "coherence"}  # the others are at most, or from and to
FIGURE = {"lag": "lag_s"}  # of the limits whose figure has another name
MAGNITUDE = {"bias", "lag"}


class Judged(NamedTuple):
    """A limit and what was found: passed, and one line on it."""

    quantity: str
    limit: str
    value: float | None
    passed: bool
    text: str


def _problems(given: Limits) -> Iterator[Problem]:
    if not given.quantities:
        yield Problem("quantities", "has none: nothing would be judged", "Give one, docs/compare.md")
    for name, block in given.quantities.items():
        key = f"quantities.{name}"
        if name not in QUANTITIES:
            yield Problem(key, "is no quantity", f"Give one of {', '.join(QUANTITIES)}")
        elif not block.model_fields_set:
            yield Problem(key, "has no limit: it would pass whatever it is", "Give one, docs/compare.md")
        for limit in sorted(block.model_fields_set):
            value = getattr(block, limit)
            if value is None:
                yield Problem(f"{key}.{limit}", "= null limits nothing", "Give a value, or leave it out")
            elif isinstance(value, tuple) and value[0] > value[1]:
                text = f"= [{value[0]:g}, {value[1]:g}] is upside down: nothing would pass"
                yield Problem(f"{key}.{limit}", text, "Give the lower value first")


FILES = Document(Limits, "a file of limits", "file of limits", EXAMPLE, Path, list, _problems, error=LimitsError)
load_limits = FILES.load  # of a YAML file; LimitsError with every problem of it


def judge(given: Limits, scores: list[Score]) -> list[Judged]:
    """Every limit, in the order of the file."""
    table = {score.quantity: score for score in scores}
    out = []
    for name, block in given.quantities.items():
        for limit in [one for one in type(block).model_fields if one in block.model_fields_set]:
            out.append(_judged(name, limit, getattr(block, limit), table.get(name)))
    return out


def _judged(name: str, limit: str, bound: float | Range, score: Score | None) -> Judged:
    figure = FIGURE.get(limit, limit)
    value = None if score is None else score.figures.get(figure)
    unit = FIGURES[figure].unit.replace("q", QUANTITIES[name].unit)
    unit = "" if unit == "1" else f" {unit}"
    if value is None:
        why = "not in both of the two" if score is None else "; ".join(score.notes) or "it cannot be told"
        return Judged(name, limit, None, False, f"{name}.{limit}: not scored ({why}); what is not scored fails")
    size = abs(value) if limit in MAGNITUDE else value
    if isinstance(bound, tuple):
        passed, told = bound[0] <= value <= bound[1], f"[{bound[0]:g}, {bound[1]:g}]{unit}"
    elif limit in LEAST:
        passed, told = value >= bound, f"at least {bound:g}{unit}"
    else:
        passed, told = size <= bound, f"at most {bound:g}{unit}"
    interval = score.intervals.get(figure) if score is not None else None
    known = f", 95 % interval [{interval[0]:.5g}, {interval[1]:.5g}]" if interval else ""
    return Judged(name, limit, value, passed, f"{name}.{limit} = {value:.6g}{unit}{known}; allowed: {told}")
