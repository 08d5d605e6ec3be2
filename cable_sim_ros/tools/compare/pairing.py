"""Two signals on one clock: what both cover, resampled without aliasing; gaps and what is no number stay out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from ..logs.own_signals import Signal, later_only

SECOND = 1e-9  # s of a ns
GAP = 3.0  # median intervals without a value
FASTER = 1.5  # times the rate of the grid: from here on a signal is low-passed first
PASSED = 0.8  # of the Nyquist frequency of the grid
CLOSE = 0.1  # of the median interval: two values so near each other are one
MIN_SAMPLES = 8
LARGEST = 1e12  # in SI units: no quantity reaches it, and its powers are numbers
MAX_GRID = 5_000_000  # times on the grid: 14 h at 100 Hz
TURNS = {"yaw", "body_yaw", "course", "longitude", "body_longitude"}  # one turn more is the same
LINES = {"x", "y", "latitude", "longitude", "body_x", "body_y", "body_latitude", "body_longitude"}  # they travel


@dataclass
class Cleaned:
    """Finite values with ascending times [s from a common origin], and what was left out, by cause."""

    time: np.ndarray
    value: np.ndarray
    dropped: dict[str, int] = field(default_factory=dict)

    @property
    def interval(self) -> float:
        """Median interval of the values [s], nan of one value."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else np.nan


@dataclass
class Pair:
    """a and b [n] at the same times [s from the common origin], NaN where either is missing.

    step: of the grid [s]; overlap_s: what both cover; gaps_s: of that without values; cut_hz, removed: above which the
    faster of the two ("a" or "b") was low-passed, and the share of its variance that went; "" and 0: none.
    line: what was taken off both (mean track of a).
    """

    time: np.ndarray
    a: np.ndarray
    b: np.ndarray
    step: float
    overlap_s: float
    gaps_s: float
    faster: str = ""
    cut_hz: float = 0.0
    removed: float = 0.0
    line: bool = False

    @property
    def good(self) -> np.ndarray:
        """Where both have a value."""
        return np.isfinite(self.a) & np.isfinite(self.b)


class NotPaired(Exception):
    """Why two signals cannot be scored, in words."""


def clean(signal: Signal, origin: int) -> Cleaned:
    """The signal without what is no number and without stamps that do not go on; origin: ns."""
    dropped: dict[str, int] = {}
    time = np.asarray(signal.time, np.int64)
    value = np.asarray(signal.value, float)
    usable = np.abs(value) <= LARGEST
    if not usable.all():
        finite = np.isfinite(value[~usable])
        for cause, count in (("not finite", (~finite).sum()), (f"beyond {LARGEST:g} in SI units", finite.sum())):
            dropped |= {cause: int(count)} if count else {}
        time, value = time[usable], value[usable]
    on = later_only(time)
    if not on.all():
        dropped["stamp not after the one before"] = int((~on).sum())
        time, value = time[on], value[on]
    if len(time) > 2:
        steps = np.diff(time)
        far = np.concatenate([[True], steps > CLOSE * np.median(steps)])
        if not far.all():
            dropped["stamps too close"] = int((~far).sum())
            time, value = time[far], value[far]
    if signal.quantity in TURNS and len(value):
        value = np.unwrap(value)
    return Cleaned((time - origin) * SECOND, value, dropped)


def segments(time: np.ndarray, gap: float) -> list[slice]:
    """Parts of a time series between gaps [s]."""
    cuts = np.flatnonzero(np.diff(time) > gap) + 1
    return [slice(i, j) for i, j in zip([0, *cuts], [*cuts, len(time)])]


def sampled(one: Cleaned, grid: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """Values on a uniform grid, NaN in gaps; share of the variance that the low-pass against aliasing took."""
    out = np.full(len(grid), np.nan)
    own = one.interval
    before = after = 0.0
    for part in segments(one.time, GAP * own * (1.0 + 1e-9)):
        time, value = one.time[part], one.value[part]
        if len(time) < 2:
            continue
        inside = slice(
            np.searchsorted(grid, time[0] - 1e-6 * step), np.searchsorted(grid, time[-1] + 1e-6 * step, "right")
        )
        if inside.stop <= inside.start:
            continue
        curve = _curve(time, value)
        if own * FASTER < step and len(time) > 3:
            even = np.arange(time[0], time[-1] + 1e-6 * own, own)
            dense = curve(even)
            sos = butter(4, PASSED * own / step, output="sos")
            smooth = sosfiltfilt(sos, dense, padlen=min(27, len(dense) - 1))
            before += float(((dense - dense.mean()) ** 2).sum())
            after += float(((dense - smooth) ** 2).sum())
            curve = _curve(even, smooth)
        out[inside] = curve(np.clip(grid[inside], time[0], time[-1]))
    return out, after / before if before > 0.0 else 0.0


def _curve(time: np.ndarray, value: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    if len(time) < 4:
        return lambda at: np.interp(at, time, value)
    return CubicSpline(time, value)


def paired(quantity: str, a: Cleaned, b: Cleaned, window: tuple[float, float] = (-np.inf, np.inf)) -> Pair:
    """Both on the grid of the slower one. Raises NotPaired. window: s from the origin that count."""
    for one, name in ((a, "A"), (b, "B")):
        if len(one.time) < MIN_SAMPLES:
            raise NotPaired(f"{name} has {len(one.time)} values, fewer than {MIN_SAMPLES}")
    begin, end = max(a.time[0], b.time[0], window[0]), min(a.time[-1], b.time[-1], window[1])
    if not end > begin:
        raise NotPaired(
            f"no overlap: A has {a.time[0]:.6g} to {a.time[-1]:.6g} s, B {b.time[0]:.6g} to {b.time[-1]:.6g} s"
        )
    slow = a if a.interval >= b.interval * (1.0 - 1e-9) else b
    step = slow.interval
    first = slow.time[np.searchsorted(slow.time, begin - 1e-6 * step)]
    count = int((end - first) / step + 1e-6) + 1
    if count < MIN_SAMPLES:
        raise NotPaired(f"both cover {max(0.0, end - begin):.4g} s: {max(0, count)} values, fewer than {MIN_SAMPLES}")
    if count > MAX_GRID:
        raise NotPaired(f"{count} values on the common grid, more than {MAX_GRID}; give --from and --to")
    grid = first + step * np.arange(count)
    va, cut_a = sampled(a, grid, step)
    vb, cut_b = sampled(b, grid, step)
    if quantity in TURNS:
        vb = vb - 2.0 * np.pi * np.round(np.nanmedian(vb - va) / (2.0 * np.pi)) if np.isfinite(vb - va).any() else vb
    bad = ~(np.isfinite(va) & np.isfinite(vb))
    va, vb = np.where(bad, np.nan, va), np.where(bad, np.nan, vb)
    if (~bad).sum() < MIN_SAMPLES:
        raise NotPaired(f"{(~bad).sum()} values beside the gaps, fewer than {MIN_SAMPLES}")
    faster = "a" if a.interval * FASTER < step else "b" if b.interval * FASTER < step else ""
    line = quantity in LINES
    if line:
        t, v = grid[~bad], va[~bad]
        middle = t.mean()
        slope = float(((t - middle) * v).sum() / ((t - middle) ** 2).sum())
        track = v.mean() + slope * (grid - middle)
        va, vb = va - track, vb - track
    cut_hz, removed = PASSED * 0.5 / step if faster else 0.0, {"a": cut_a, "b": cut_b}.get(faster, 0.0)
    return Pair(grid, va, vb, step, float(end - begin), float(bad.sum() * step), faster, cut_hz, removed, line)
