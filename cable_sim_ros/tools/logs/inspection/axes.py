"""Signs and axes that contradict each other: heave and antenna height, gravity, roll and pitch against their rates.

A finding of an inspection: where, what, in words, and the numbers that show it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..log import SECOND, Log, Source
from ..not_valid import last_before, stamps_of_both

HEAVE = re.compile(r"(^|[^a-z])heave([^a-z]|$)", re.I)
HEIGHT = re.compile(r"^(alt|altitude|height.*|.*_height|hgt)$", re.I)
UP = re.compile(r"(accel.*(z|\[2\])$|^vertical$|.*acc_z$)", re.I)
RATES = ("roll_rate", "pitch_rate"), ("rate_x", "rate_y")
FEWEST = 60  # records
SURE = 0.7  # correlation that says which sign
WINDOW = 60.0  # s of the mean that is taken off: tide and drift of the satellites
STALE = 2.0  # s


class Finding(NamedTuple):
    """where: source, or source.field; what: a word of KINDS; text: a line; evidence: numbers by name."""

    where: str
    what: str
    text: str
    evidence: dict[str, float]


KINDS = (
    "gap", "jitter", "clock", "clock_jump", "renamed", "constant", "reset", "jump", "rounded", "repeated", "unit",
    "heave_sign", "vertical_axis", "exchanged", "heading_jump", "slow", "negative",
)  # fmt: skip
EXAMPLES = 3  # of one kind in a field


def of_axes(log: Log) -> list[Finding]:
    """All that contradicts, and what proves a sign."""
    return [*_heave(log), *_vertical(log), *_exchanged(log)]


def _fields(log: Log, pattern: re.Pattern) -> Iterator[tuple[Source, str]]:
    for source in log.sources.values():
        for name in source.columns:
            if pattern.search(name) and len(source) >= FEWEST and np.isfinite(source.columns[name]).sum() >= FEWEST:
                yield source, name


def paired(one: Source, field: str, other: Source, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s] and values of a field, and of another source's last record before each, where there is one."""
    stamps, at = stamps_of_both(one, other), last_before(one, other)
    if stamps is None or at is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    a, b = stamps
    usable = (at >= 0) & ((a - b[at]) / SECOND < STALE)
    first, second = one.columns[field], other.columns[name][at]
    usable &= np.isfinite(first) & np.isfinite(second)
    t = (a - a[0]) / SECOND
    usable &= np.concatenate(([True], np.diff(t) > 0))
    return t[usable], first[usable], second[usable]


def waves(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values less their mean over WINDOW."""
    period = float(np.median(np.diff(t)))
    n = max(3, round(WINDOW / max(period, 1e-9)) | 1)
    if n >= len(values):
        return values - values.mean()
    sums = np.cumsum(np.concatenate(([0.0], values)))
    k = np.arange(len(values))
    low, high = np.maximum(0, k - n // 2), np.minimum(len(values), k + n // 2 + 1)
    return values - (sums[high] - sums[low]) / (high - low)


def _heave(log: Log) -> Iterator[Finding]:
    for source, field in _fields(log, HEAVE):
        for other, name in _fields(log, HEIGHT):
            t, heave, height = paired(source, field, other, name)
            if len(t) < FEWEST:
                continue
            heave, height = waves(t, heave), waves(t, height)
            if not heave.std() or not height.std():
                continue
            correlation = float(np.corrcoef(heave, height)[0, 1])
            slope = float(heave @ height / (heave @ heave))
            if abs(correlation) > SURE:
                way = "up" if correlation > 0 else "DOWN"
                text = (
                    f"heave is positive {way}, proven by {other.name}.{name}: correlation {correlation:.4f}, slope "
                    f"{slope:.3f}, {len(t)} records"
                )
                evidence = {"correlation": correlation, "slope": slope, "records": len(t)}
                yield Finding(f"{source.name}.{field}", "heave_sign", text, evidence)
            else:
                text = (
                    f"the sign of heave is not provable by {other.name}.{name}: correlation {correlation:.2f} of "
                    f"{len(t)} records, height noise {float((height - slope * heave).std()):.2g} m, heave "
                    f"{float(heave.std()):.2g} m (std)"
                )
                evidence = {"correlation": correlation, "slope": slope, "records": len(t)}
                yield Finding(f"{source.name}.{field}", "heave_sign", text, evidence)
        for other, name in _fields(log, UP):
            t, heave, up = paired(source, field, other, name)
            if len(t) < FEWEST or np.median(np.diff(t)) > 1.0:
                continue
            bent = np.gradient(np.gradient(waves(t, heave), t), t)
            if not bent.std() or not up.std():
                continue
            correlation = float(np.corrcoef(bent, waves(t, up))[0, 1])
            if abs(correlation) > SURE:
                same = "the same sign as" if correlation > 0 else "the other sign than"
                text = f"heave has {same} {other.name}.{name}: correlation of the accelerations {correlation:.3f}"
                yield Finding(f"{source.name}.{field}", "heave_sign", text, {"correlation": correlation})


def _vertical(log: Log) -> Iterator[Finding]:
    for source, field in _fields(log, UP):
        mean = float(np.nanmean(source.columns[field]))
        for size, unit in ((9.81, "m/s^2"), (1.0, "g")):
            if abs(abs(mean) - size) < 0.15 * size:
                if mean < 0:
                    text = f"mean {mean:.3f} {unit}: z points down (NED), or gravity is taken for specific force"
                else:
                    text = f"mean {mean:.3f} {unit}: z points up, specific force"
                yield Finding(f"{source.name}.{field}", "vertical_axis", text, {"mean": mean})


def _exchanged(log: Log) -> Iterator[Finding]:
    """Roll whose slope is the rate about the other axis."""
    for source in log.sources.values():
        names = {name.lower(): name for name in source.columns}
        rates = next(
            ((r, p) for r, p in (("roll_rate", "pitch_rate"), ("rate_x", "rate_y")) if r in names and p in names), None
        )
        stamps = source.stamps
        if rates is None or stamps is None or not {"roll", "pitch"} <= names.keys() or len(source) < FEWEST:
            continue
        t = (stamps - stamps[0]) / SECOND
        if not (np.diff(t) > 0).all():
            continue
        roll = np.gradient(source.columns[names["roll"]], t)
        own, other = (source.columns[names[one]] for one in rates)
        if not all(np.isfinite(one).all() and one.std() for one in (roll, own, other)):
            continue
        with_own, with_other = (float(np.corrcoef(roll, one)[0, 1]) for one in (own, other))
        if abs(with_other) > SURE > abs(with_own):
            text = (
                f"roll follows {rates[1]} (correlation {with_other:.2f}), not {rates[0]} ({with_own:.2f}): roll "
                f"and pitch are probably exchanged"
            )
            evidence = {"with_own_rate": with_own, "with_other_rate": with_other}
            yield Finding(f"{source.name}.roll", "exchanged", text, evidence)
