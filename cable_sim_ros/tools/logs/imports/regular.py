"""Signals of motion on even times, in stretches without a gap, as the curves through motion take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....io.sources.rounding import even
from ..log import SECOND, LogError
from ..own_signals import Signal

JITTER = 0.45  # of the period: stamps further off their line are no jitter
BRIDGED = 1.5  # s, and so many periods: shorter gaps are interpolated
PERIODS = 2.5
FEWEST = 4  # records between gaps, for a cubic
SLOW = 2.0  # s: a seaway needs two records a period at least, and eight make a curve of it
NO_MOTION = 60.0  # s between records, of which no seaway is left


class Regular(NamedTuple):
    """Of a signal: times [s] since an origin, values, and stretches without a gap; said: what was done, a
    line each."""

    t: np.ndarray
    value: np.ndarray
    parts: list[slice]
    period: float
    said: list[str]


def regular(signal: Signal, origin: int) -> Regular:
    """A signal at times that are even but for rows left out; LogError where there are too few."""
    name, said = signal.quantity, []
    t, value = (signal.time - origin) / SECOND, np.asarray(signal.value, float)
    if len(t) < FEWEST:
        raise LogError(
            f"{signal.source}: {name} has {len(t)} records, at least {FEWEST} are needed for motion; nothing was "
            f"imported. Give a longer log"
        )
    steps = np.diff(t)
    period = _period(steps)
    if period > NO_MOTION:
        raise LogError(
            f"{signal.source}: {name} comes every {period:.4g} s, above {NO_MOTION:g} s there is no motion of a ship "
            f"in it; nothing was imported. Give a log with a rate of 1 Hz or more"
        )
    if period > SLOW:
        said.append(
            f"{name} comes every {period:.3g} s: motion with periods below {2 * period:.3g} s is not in it, below "
            f"{8 * period:.3g} s it is too small"
        )
    t = even(t)
    cuts = np.flatnonzero(np.diff(t) > max(BRIDGED, PERIODS * period)) + 1
    ends = [*cuts.tolist(), len(t)]
    kept_t, kept_value, parts, at = [], [], [], 0
    worst = 0.0
    short = 0
    for part in (slice(a, b) for a, b in zip([0, *ends], ends)):
        if part.stop - part.start < FEWEST:
            short += part.stop - part.start
            continue
        line, values, off = _on_line(t[part], value[part], period)
        worst = max(worst, off)
        kept_t.append(line)
        kept_value.append(values)
        parts.append(slice(at, at + len(line)))
        at += len(line)
    if not parts:
        raise LogError(
            f"{signal.source}: {name} has no {FEWEST} records without a gap above {max(BRIDGED, PERIODS * period):g} "
            f"s; nothing was imported. Give a log without such gaps"
        )
    if len(parts) > 1:
        longest = float(np.diff(t).max())
        said.append(f"{name}: {len(parts) - 1} gaps, the longest of {longest:.4g} s: a run bridges them by a blend")
    if short:
        said.append(f"{name}: {short} records between gaps, fewer than {FEWEST} at a time, were left out")
    if worst >= JITTER * period:
        said.append(
            f"{name}: stamps up to {1e3 * worst:.3g} ms off even times: interpolated linearly to {period:.4g} s"
        )
    elif worst > 0.02 * period:
        said.append(f"{name}: stamps up to {1e3 * worst:.3g} ms off even times were put on them")
    return Regular(np.concatenate(kept_t), np.concatenate(kept_value), parts, period, said)


def _period(steps: np.ndarray) -> float:
    """Median step [s]; of records in bursts a 20th of the mean step at least, so that even times stay as many."""
    median = float(np.median(steps))
    usual = steps[steps <= max(BRIDGED, PERIODS * median)]
    return max(median, 0.05 * float(usual.mean())) if len(usual) else median


def _on_line(t: np.ndarray, value: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Times on their line where they jitter about one, else values interpolated to even times; how far off, s."""
    steps = np.diff(t)
    counts = np.concatenate(([0.0], np.cumsum(np.maximum(1.0, np.round(steps / period)))))
    fitted, begin = np.polyfit(counts, t - t[0], 1)
    line = t[0] + begin + fitted * counts
    off = float(np.abs(t - line).max())
    if off < JITTER * period:
        return (line, value, off) if off > 1e-6 * period else (t, value, 0.0)
    steps_to = np.arange(t[0], t[-1] + 1e-9, period)  # bursts, or a rate that changes
    return steps_to, np.interp(steps_to, t, value), off
