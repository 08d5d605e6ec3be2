"""Spectra of a pair after Welch, kept by segment, so that what they give has an interval; lag from their phase.

How well a figure of correlated samples is known: independent samples, blocks, the jackknife that leaves one out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.stats import t as student

from .pairing import Pair

LEVEL = 0.95
BLOCK = 5.0  # times of correlation that a block holds at least
FEW, MANY = 5, 20  # blocks
Interval = tuple[float, float]

BAND = (0.03, 0.5)  # Hz, waves
LONGEST, SHORTEST = 128.0, 20.0  # s of a segment
SEGMENTS = 10.0  # of the record, at least, before they overlap
NYQUIST = 0.8  # of it, up to which a band goes
LEAKS = 1e-3  # of the largest power: what a Hann window may leak
CLEAREST = 0.9999  # squared coherence
STAMP = 1e-9  # s, of the stamps: a lag below it is none
LEAST_LAG = 0.01  # of the sampling interval: no interval of a lag is narrower


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


def blocks(n: int, correlated: float) -> np.ndarray | None:
    """Number of the block of each of n samples; None where they are too few for an interval."""
    count = min(MANY, int(n / (BLOCK * correlated)))
    return None if count < FEW else np.arange(n) * count // n


def jackknife(whole: np.ndarray, without: np.ndarray) -> np.ndarray:
    """Half width of the 95 % interval of figures [...]: whole of all, without [blocks, ...] with one block left out."""
    count = len(without)
    spread = (count - 1) / count * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    return student.ppf(0.5 + 0.5 * LEVEL, count - 1) * np.sqrt(spread) + 0.0 * np.asarray(whole)


def left_out(terms: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Sums of terms [n, ...] with one block left out [blocks, ...]."""
    each = np.stack([terms[block == k].sum(axis=0) for k in range(block[-1] + 1)])
    return each.sum(axis=0) - each


@dataclass
class Spectra:
    """Of each segment [k, f]: power of a and b, cross power conj(A) B; f [Hz] of the band alone; segment [s]."""

    f: np.ndarray
    aa: np.ndarray
    bb: np.ndarray
    ab: np.ndarray
    segment: float
    step: float

    @property
    def groups(self) -> np.ndarray | None:
        """Group of each segment for the jackknife; None: too few."""
        n = len(self.aa)
        count = min(MANY, n // 2)
        return None if count < FEW else np.arange(n) * count // n

    def sums(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """aa, bb, ab [f] over all segments."""
        return self.aa.sum(axis=0), self.bb.sum(axis=0), self.ab.sum(axis=0)

    def without(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """The same with one group of segments left out, for each group; empty: too few."""
        groups = self.groups
        if groups is None:
            return []
        kept = [groups != k for k in range(groups[-1] + 1)]
        return [(self.aa[k].sum(axis=0), self.bb[k].sum(axis=0), self.ab[k].sum(axis=0)) for k in kept]


def band_of(pair_step: float, band: tuple[float, float] = BAND) -> tuple[float, float] | None:
    """The band as far as the sampling has it; None: it has too little of it."""
    high = min(band[1], NYQUIST * 0.5 / pair_step)
    return (band[0], high) if high >= 2.0 * band[0] else None


def spectra(pair: Pair, band: tuple[float, float], shift: int = 0) -> Spectra | None:
    """Hann windows that overlap by half, each without its straight line; None where there is no whole segment.

    shift: samples that the windows of b lie later: windows that lag like b itself do not pull its phase to zero.
    """
    length = len(pair.a) * pair.step
    seconds = min(LONGEST, max(SHORTEST, length / SEGMENTS))
    n = int(seconds / pair.step)
    if n < 16 or n > len(pair.a):
        return None
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
    ramp = np.arange(n) - 0.5 * (n - 1)
    f = np.arange(n // 2 + 1) / (n * pair.step)
    chosen = (f >= band[0] * (1.0 - 1e-9)) & (f <= band[1] * (1.0 + 1e-9))
    rows: list[tuple[np.ndarray, np.ndarray]] = []
    first, last = max(0, -shift), len(pair.a) - max(0, shift)
    va, vb = pair.a[first:last], pair.b[first + shift : last + shift]
    good = np.isfinite(va) & np.isfinite(vb)
    at = 0
    while at + n <= len(good):
        bad = np.flatnonzero(~good[at : at + n])
        if len(bad):  # the next segment begins behind the gap
            at += int(bad[-1]) + 1
            continue
        parts = []
        for x in (va[at : at + n], vb[at : at + n]):
            x = x - x.mean()
            x = x - ramp * ((ramp * x).sum() / (ramp * ramp).sum())
            parts.append(np.fft.rfft(window * x)[chosen])
        rows.append((parts[0], parts[1]))
        at += n // 2
    if not rows or not chosen.any():
        return None
    fa, fb = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    scale = 2.0 * pair.step / (window**2).sum()  # one-sided density
    return Spectra(
        f[chosen], scale * np.abs(fa) ** 2, scale * np.abs(fb) ** 2, scale * np.conj(fa) * fb, n * pair.step, pair.step
    )


def coherence_of(sums: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """Squared coherence [f]."""
    aa, bb, ab = sums
    power = aa * bb
    return np.where(power > 0.0, np.abs(ab) ** 2 / np.where(power > 0.0, power, 1.0), 0.0).clip(0.0, 1.0)


def fitted_lag(sums: tuple[np.ndarray, np.ndarray, np.ndarray], f: np.ndarray, count: int, begin: float) -> float:
    """Lag [s] of b behind a that fits the phase, weighted as Hannan and Thomson (1973); begin: where it is looked for.

    count: of segments; a sign that is reversed is taken out.
    """
    square = coherence_of(sums)
    square = np.clip((count * square - 1.0) / max(count - 1.0, 1.0), 0.0, CLEAREST)
    # a frequency that has next to nothing shows what leaks from the others
    weight = np.where(sums[0] > LEAKS * sums[0].max(), square / (1.0 - square), 0.0)
    omega = 2.0 * np.pi * f
    total = float((weight * omega**2).sum())
    if not total > 0.0:
        return begin
    lag, cross = begin, sums[2]
    if float((weight * np.real(cross * np.exp(1j * omega * lag)) / np.maximum(np.abs(cross), 1e-300)).sum()) < 0.0:
        cross = -cross
    for _ in range(8):
        phase = np.angle(cross * np.exp(1j * omega * lag))
        lag -= float((weight * omega * phase).sum()) / total
    return lag if abs(lag) > STAMP else 0.0


def lag_of(given: Spectra) -> tuple[float, float | None]:
    """Lag of b behind a [s] and the half width of its 95 % interval; None: too few segments."""
    count = len(given.aa)
    lag = fitted_lag(given.sums(), given.f, count, 0.0)
    without = given.without()
    if not without:
        return lag, None
    others = np.array([fitted_lag(sums, given.f, count, lag) for sums in without])
    return lag, max(float(jackknife(np.array(lag), others)), 1.96 * _least_deviation(given), LEAST_LAG * given.step)


def _least_deviation(given: Spectra) -> float:
    """Standard deviation [s] that no estimate of the lag can be below (Cramer and Rao), at the coherence found."""
    sums, count = given.sums(), len(given.aa)
    square = np.clip((count * coherence_of(sums) - 1.0) / max(count - 1.0, 1.0), 0.0, CLEAREST)
    weight = np.where(sums[0] > LEAKS * sums[0].max(), square / (1.0 - square), 0.0)
    # bins of a Hann window are worth 1/1.5, segments that overlap by half 0.95 each
    known = 2.0 * 0.95 * count / 1.5 * float((weight * (2.0 * np.pi * given.f) ** 2).sum())
    return 1.0 / np.sqrt(known) if known > 0.0 else np.inf
