"""Clocks of two signals: lag by correlation, refined by the phase of the waves, its rivals, and the drift."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.stats import t as student

from ..logs.own_signals import Signal
from .pairing import MAX_GRID, Cleaned, NotPaired, Pair, clean, paired
from .spectra import BAND, LEAST_LAG, LEVEL, Interval, band_of, correlation_time, fitted_lag, lag_of, spectra

SEARCH = 60.0  # s either way, where both clocks overlap
SHARE = 0.25  # of the shorter one that both cover at any lag that is tried
RIVAL = 9.0, 6.0  # twice the difference of the log likelihoods that a rival may have, and times the root of the
# independent samples: three standard deviations, of the noise of other samples in B and in A too
EXACT = 1e-7  # of the variance: no two measurements agree better
STILL = 1e-12  # of the values: a spread below it is round-off
MANY_RIVALS = 6
PARTS = 6  # of the record, at least, for a drift; each has at least
PART = 60.0  # s
FALSE = 0.01  # probability that two signals that have nothing in common pass for correlated


@dataclass
class Clock:
    """Lag of B behind A [s] at a time `middle` [s from the origin], with its 95 % interval.

    found: it is one, and known; why: in words where not; rivals: (lag, correlation) that compete; sign: of the
    correlation; drift_ppm: growth of the lag, None where it cannot be told from none.
    """

    quantity: str
    found: bool
    lag: float = 0.0
    interval: Interval | None = None
    correlation: float = 0.0
    sign: int = 1
    rivals: list[tuple[float, float]] = field(default_factory=list)
    drift_ppm: float | None = None
    drift_interval: Interval | None = None
    middle: float = 0.0
    why: str = ""

    def as_dict(self) -> dict:
        """For the JSON."""
        return {
            "quantity": self.quantity,
            "found": self.found,
            "lag_s": self.lag,
            "lag_interval_s": self.interval,
            "correlation": self.correlation,
            "sign": self.sign,
            "rivals": [{"lag_s": lag, "correlation": r} for lag, r in self.rivals],
            "drift_ppm": self.drift_ppm,
            "drift_interval_ppm": self.drift_interval,
            "why": self.why,
        }

    def moved(self, signal: Signal, origin: int) -> Signal:
        """B on the clock of A."""
        since = signal.time - origin
        drift = (since - self.middle * 1e9) * (self.drift_ppm or 0.0) * 1e-6
        time = signal.time - np.round(self.lag * 1e9 + drift).astype(np.int64)
        return Signal(signal.quantity, time, signal.value, signal.source, list(signal.assumed))


def wave_part(x: np.ndarray, step: float, low: float) -> np.ndarray:
    """x without what is slower than a band: less its running mean over 1/low, taken twice; NaN stays."""
    n = max(3, round(1.0 / low / step) | 1)
    good = np.isfinite(x)
    slow = np.where(good, x, 0.0)
    for _ in range(2):
        slow = _running(slow, n) / np.maximum(_running(good.astype(float), n), 1e-12) if n < 2 * len(x) else slow
        slow = np.where(good, slow, 0.0)
    if n >= 2 * len(x):
        slow = np.full(len(x), x[good].mean() if good.any() else 0.0)
    return np.where(good, x - slow, np.nan)


def _running(x: np.ndarray, n: int) -> np.ndarray:
    half = n // 2
    total = np.concatenate([[0.0], np.cumsum(x)])
    at = np.arange(len(x))
    return total[np.minimum(at + half + 1, len(x))] - total[np.maximum(at - half, 0)]


def correlations(a: np.ndarray, b: np.ndarray, least: int) -> tuple[np.ndarray, np.ndarray]:
    """Lags [samples] of b behind a, and correlation over what both cover there, at least so many; NaN is left out."""
    size = next_fast_len(len(a) + len(b))
    ma, mb = np.isfinite(a), np.isfinite(b)
    za, zb = np.where(ma, a, 0.0), np.where(mb, b, 0.0)
    fa, fb, fma, fmb = (rfft(x.astype(float), size) for x in (za, zb, ma, mb))
    cross = irfft(np.conj(fa) * fb, size)
    power_a = irfft(np.conj(rfft(za**2, size)) * fmb, size)
    power_b = irfft(np.conj(fma) * rfft(zb**2, size), size)
    count = irfft(np.conj(fma) * fmb, size)
    lags = np.concatenate([np.arange(len(b)), np.arange(-len(a) + 1, 0)])
    order = np.argsort(lags)
    lags = lags[order]
    at = lags % size
    power = power_a[at] * power_b[at]
    floor = 1e-12 * power_a.max() * power_b.max()
    ok = (count[at] > least - 0.5) & (power > floor)
    return lags[ok], (cross[at] / np.sqrt(np.where(power > floor, power, 1.0)))[ok].clip(-1.0, 1.0)


def clock_of(a: Signal, b: Signal, origin: int, band: tuple[float, float] = BAND, search: float = SEARCH) -> Clock:
    """How far the clock of B is behind that of A. search: s either way; every lag where the two do not overlap."""
    try:
        whole = _side_by_side(a, b, origin)
    except NotPaired as error:
        return Clock(a.quantity, False, why=str(error))
    va, vb, step, shift, apart = whole
    for one in (va, vb):
        if not np.nanstd(one) > STILL * np.nanmax(np.abs(one)):
            return Clock(a.quantity, False, why="one of them does not change")
    part = band_of(step, band)
    if part is not None:
        va, vb = wave_part(va, step, part[0]), wave_part(vb, step, part[0])
    else:
        va, vb = va - np.nanmean(va), vb - np.nanmean(vb)
    least = max(16, int(SHARE * min(np.isfinite(va).sum(), np.isfinite(vb).sum())))
    lags, r = correlations(va, vb, least)
    seconds = lags * step + shift
    if not apart:
        near = np.abs(seconds) <= search + step
        lags, r, seconds = lags[near], r[near], seconds[near]
    if len(r) < 3:
        return Clock(a.quantity, False, why="they overlap too little at every lag that is tried")
    best = int(np.argmax(np.abs(r)))
    width = max(correlation_time(va), correlation_time(vb))
    worth = min(np.isfinite(va).sum(), np.isfinite(vb).sum()) / width
    tried = max(1.0, len(r) / width)
    needed = np.sqrt(2.0 * np.log(2.0 * tried / FALSE) / max(worth, 1.0))
    if abs(r[best]) < needed:
        why = (
            f"the correlation is flat: at most {abs(r[best]):.2f} at any lag, which signals that have nothing in "
            f"common reach too (below {min(needed, 1.0):.2f})"
        )
        return Clock(a.quantity, False, correlation=float(r[best]), why=why)
    found = Clock(a.quantity, True, float(seconds[best]), None, float(r[best]), 1 if r[best] > 0.0 else -1)
    found.rivals = _rivals(va, vb, lags, r, seconds, best)
    if found.rivals:
        found.found = False
        told = ", ".join(f"{lag:+.2f} s ({c:+.3f})" for lag, c in found.rivals)
        found.why = (
            f"the correlation has several peaks that are as good as its largest, {found.correlation:+.3f} at "
            f"{found.lag:+.2f} s: {told}; a regular swell fits itself a period later"
        )
    elif not apart and abs(found.lag) >= search:
        found.found = False
        found.why = (
            f"the largest correlation, {found.correlation:+.2f}, is at the end of the search, {found.lag:+.4g} s; "
            "search further with --search"
        )
    _refine(found, a, b, origin, band, step)
    return found


def _side_by_side(a: Signal, b: Signal, origin: int) -> tuple[np.ndarray, np.ndarray, float, float, bool]:
    """a and b each over its own whole time at one rate, step, lag of equal places [s], do they lie apart?"""
    ca, cb = clean(a, origin), clean(b, origin)
    both = (ca, cb)
    for one, name in zip(both, "AB"):
        if len(one.time) < 16:
            raise NotPaired(f"{name} has {len(one.time)} values: no clock is found from fewer than 16")
    step = max(ca.interval, cb.interval)
    count = max(float(one.time[-1] - one.time[0]) for one in both) / step
    if count > MAX_GRID:
        raise NotPaired(f"{count:.3g} values on a common grid, more than {MAX_GRID}: no clock is looked for")
    values = []
    for one in both:
        grid = one.time[0] + step * np.arange(int((one.time[-1] - one.time[0]) / step + 1e-6) + 1)
        own = paired("", one, Cleaned(grid, np.zeros(len(grid))))  # on the grid of the slower one
        row = np.full(len(grid), np.nan)
        at = np.round((own.time - grid[0]) / step).astype(int)
        ok = (at >= 0) & (at < len(row))
        row[at[ok]] = own.a[ok]
        values.append(row)
    apart = ca.time[0] > cb.time[-1] or cb.time[0] > ca.time[-1]
    return values[0], values[1], step, cb.time[0] - ca.time[0], apart


def _rivals(
    a: np.ndarray, b: np.ndarray, lags: np.ndarray, r: np.ndarray, seconds: np.ndarray, best: int
) -> list[tuple[float, float]]:
    """Other peaks that the residual cannot tell from the largest, by the ratio of their likelihoods."""
    size = np.abs(r)
    peaks = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    lag = int(lags[best])
    x = a[max(0, -lag) : len(b) - lag]
    y = b[max(0, lag) :][: len(x)]
    x = x[: len(y)]
    good = np.isfinite(x) & np.isfinite(y)
    slope = (x[good] * y[good]).sum() / (x[good] ** 2).sum()
    rest = y - slope * x
    worth = float(good.sum()) / correlation_time(rest)
    left = np.maximum(1.0 - size**2, EXACT)
    ratio = worth * np.log(left / left[best])
    near = (ratio < RIVAL[0] + RIVAL[1] * np.sqrt(worth)) & (size > 0.5 * size[best])
    chosen = [int(k) for k in peaks if abs(k - best) > 1 and near[k]]
    chosen.sort(key=lambda k: -size[k])
    return [(float(seconds[k]), float(r[k])) for k in chosen[:MANY_RIVALS]]


def _refine(found: Clock, a: Signal, b: Signal, origin: int, band: tuple[float, float], step: float) -> None:
    """Below the sampling interval, from the phase of the waves; then the drift."""
    moved = found.moved(b, origin)
    try:
        pair = paired(a.quantity, clean(a, origin), clean(moved, origin))
    except NotPaired:
        return
    found.middle = float(0.5 * (pair.time[0] + pair.time[-1]))
    part = band_of(pair.step, band)
    if part is None:
        found.interval = (found.lag - step, found.lag + step)
        return
    for _ in range(0 if found.rivals else 2):  # the second is of what the first has left
        _drift(found, pair, part)
        moved = found.moved(b, origin)
        pair = paired(a.quantity, clean(a, origin), clean(moved, origin))
    given = spectra(pair, part)
    if given is None:
        found.interval = (found.lag - step, found.lag + step)
        return
    rest, half = lag_of(given)
    found.lag += rest
    if half is not None:
        found.interval = (found.lag - half, found.lag + half)
    elif found.found:
        found.found = False
        found.why = "the record is too short for an interval: fewer than 10 segments of waves"


def _drift(found: Clock, pair: Pair, band: tuple[float, float]) -> None:
    count = min(20, int(len(pair.a) * pair.step / PART))
    if count < PARTS:
        return
    times: list[float] = []
    lags: list[float] = []
    edges = np.linspace(0, len(pair.a), count + 1).astype(int)
    for i, j in zip(edges, edges[1:]):
        piece = Pair(pair.time[i:j], pair.a[i:j], pair.b[i:j], pair.step, 0.0, 0.0)
        given = spectra(piece, band)
        if given is not None:
            times.append(float(pair.time[i:j].mean()))
            lags.append(fitted_lag(given.sums(), given.f, len(given.aa), lags[-1] if lags else 0.0))
    if len(times) < PARTS:
        return
    time, lag = np.array(times) - found.middle, np.array(lags)
    before = 1e-6 * (found.drift_ppm or 0.0)
    x = time - time.mean()
    slope = float((x * lag).sum() / (x * x).sum())
    rest = lag - lag.mean() - slope * x
    free = len(lag) - 2
    half = float(student.ppf(0.5 + 0.5 * LEVEL, free) * np.sqrt((rest @ rest) / free / (x * x).sum()))
    half = max(half, LEAST_LAG * pair.step / float(np.ptp(x)))
    slope += before
    found.drift_interval = (1e6 * (slope - half), 1e6 * (slope + half))
    if abs(slope) > half:
        found.drift_ppm = 1e6 * slope
        found.lag += float(lag.mean() - (slope - before) * time.mean())
