"""Rounded odometry of a bag, smoothed before an offline run takes it in.

The node can only smooth what has come, with the twist to hold it against (position_rate_fit.py). A bag is known as a
whole: where its poses are rounded, and its twist is absent or rounded as well, they go through the same spline as a
rounded table (`motion_curves.py`). A twist that does not fit the poses is left for plausibility.py to name.
"""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np

from ...physics.heave_filter import Convention
from ...sim.tables.attitude import to_world
from ..messages.messages import Event, Odometry, Refused, decode_odometry
from .motion_curves import Given, Rounding, Samples, through
from .motion_table import COORDINATES, SECOND, odometry_events
from .recorded_tow import RecordedTow
from .rounding import FEWEST, even, resolution

UNEVEN = 0.45  # of the period: stamps further off a line are no jitter
GLANCE = 500  # messages that show whether any coordinate is rounded
GAP = 1.5  # periods
KEPT, LONGEST = 2, 100_000  # bags whose smoothed odometry is kept; their messages, of about 1 kB each
FITS = 0.1, 3.0  # of the rms of the rate, increments of the twist: so far a twist may be from the slope of the poses
DEGREE = np.pi / 180.0


def smooth_odometry(tow: RecordedTow, sheave: tuple[float, float, float]) -> None:
    """Put smoothed odometry in the place of rounded odometry of a bag, and say so in `rounded`, `notices`, `doubts`.

    Left alone: messages that are refused, stamps that are no line, a jump of the clock, poses that are not rounded, a
    twist that is finer than the poses or does not fit them. sheave: in base_link, m.
    """
    if len(tow.spans) > 1:
        return
    places = [k for k, event in enumerate(tow.events) if event.kind == "odometry"]
    smoothed = _smoothed_once([tow.events[k] for k in places], tow.path)
    if smoothed is None:
        return
    events = list(tow.events)
    for k, made in zip(places, smoothed.events):
        events[k] = made._replace(arrival=events[k].arrival)
    tow.events = events
    tow.judge(smoothed.found, smoothed.whole, sheave)


class Smoothed(NamedTuple):
    """What came out of the odometry of a bag. Nobody writes to it: it is kept for the next run under that bag."""

    found: dict[int, Rounding]  # by coordinate
    whole: Samples
    events: list[Event]  # by arrival


_kept: dict[bytes, Smoothed | None] = {}  # by the odometry; the last KEPT


def _smoothed_once(odometry: list[Event], path: str) -> Smoothed | None:
    """As `_smoothed`, worked out at the first run of the process under this odometry: seconds a run of a sweep."""
    if len(odometry) > LONGEST:
        return _smoothed(odometry, path)
    digest = hashlib.sha256()
    for event in odometry:
        digest.update(b"%d %d " % (event.time, len(event.data)))
        digest.update(event.data)
    key = digest.digest()
    if key not in _kept:
        while len(_kept) >= KEPT:
            _kept.pop(next(iter(_kept)), None)
        _kept[key] = _smoothed(odometry, path)
    return _kept[key]


def _smoothed(odometry: list[Event], path: str) -> Smoothed | None:
    """Odometry of a bag, smoothed; None where it is to be left alone."""
    messages = _read(odometry)
    if messages is None:
        return None
    times = np.array([event.time for event in odometry], np.int64)
    t = even((times - times[0]) / SECOND)
    line = _line(t)
    if line is None:
        return None
    counts, t = line
    value = _poses(messages)
    twist = np.array([[*m.velocity, *m.rate] for m in messages])
    steps = [resolution(column) for column in twist.T]
    sent = any(m.twist for m in messages)
    if sent and not (any(steps[:3]) and any(steps[3:])):
        return None
    ends = [*(np.flatnonzero(np.diff(counts) > GAP) + 1).tolist(), len(t)]
    parts = [slice(a, b) for a, b in zip([0, *ends], ends)]
    if min(part.stop - part.start for part in parts) < FEWEST:
        return None
    curves, found = [], {}
    for k, name in enumerate(COORDINATES):
        column = Given(name, "m" if k < 3 else "deg", 1.0 if k < 3 else DEGREE, k > 2)
        lines, report = through(column, [(t[part], value[part, k], None) for part in parts])
        curves.append(lines)
        if report is not None:
            found[k] = report
    if not found:
        return None
    whole = _samples(t, parts, curves, int(times[0]))
    if sent and not _fits(whole, value, twist, steps):
        return None
    return Smoothed(found, whole, odometry_events(whole, path))


def _read(odometry: list[Event]) -> list[Odometry] | None:
    """The messages in the axes of the bag; None where they are not rounded, or not all usable."""
    if len(odometry) < FEWEST:
        return None
    try:
        messages = [decode_odometry(event.data, Convention.ENU) for event in odometry[:GLANCE]]
        if not any(resolution(column) for column in _poses(messages).T):
            return None
        return messages + [decode_odometry(event.data, Convention.ENU) for event in odometry[GLANCE:]]
    except Refused:
        return None


def _poses(messages: list[Odometry]) -> np.ndarray:
    """Position [m] and angles [rad], without whole turns, of each message: [n, 6]."""
    value = np.array([[*m.position, *m.angles] for m in messages])
    value[:, 3:] = np.unwrap(value[:, 3:], axis=0)
    return value


def _line(t: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Numbers of the periods and times on their line, for times [s] that jitter about it; None where they do not."""
    steps = np.diff(t)
    if not (steps > 0.0).all():
        return None
    counts = np.concatenate(([0.0], np.cumsum(np.maximum(1.0, np.round(steps / np.median(steps))))))
    period, begin = np.polyfit(counts, t, 1)
    line = begin + period * counts
    return (counts, line) if np.abs(t - line).max() < UNEVEN * period else None


def _samples(t: np.ndarray, parts: list[slice], curves: list, first: int) -> Samples:
    value, rate = np.empty((len(t), 6)), np.empty((len(t), 6))
    for k, lines in enumerate(curves):
        for part, curve in zip(parts, lines):
            value[part, k], rate[part, k] = curve(t[part]), curve(t[part], 1)
    return Samples(first + np.round(t * SECOND).astype(np.int64), value, rate)


def _fits(whole: Samples, value: np.ndarray, twist: np.ndarray, steps: list[float]) -> bool:
    """Is the twist of the bag the slope of its smoothed poses, within its own rounding?"""
    moved = np.array([to_world(angles, velocity) for angles, velocity in zip(value[:, 3:], twist[:, :3])])
    for k in range(3):
        off = float(np.std(moved[:, k] - whole.rate[:, k]))
        if off > max(FITS[0] * float(np.std(whole.rate[:, k])), FITS[1] * max(steps[:3])):
            return False
    turned = twist[:, 3:5] - whole.rate[:, 3:5]  # of small angles these are the rates of roll and pitch
    maximum = np.maximum(FITS[0] * whole.rate[:, 3:5].std(axis=0), FITS[1] * max(steps[3:]))
    return bool((turned.std(axis=0) <= maximum + 0.05 * np.abs(whole.rate[:, 5]).max()).all())
