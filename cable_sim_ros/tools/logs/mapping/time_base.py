"""Stamps of a log made one ascending time base: which clock, shifts, steps back, records of one time.

A stamp that steps back is left out while the clock catches up, unless at least CONFIRM records in a row stand there:
then the clock was set, and what comes after is moved on by the jump, so that no record is lost and none stands twice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..log import DAY, SECOND, LogError, Source

CONFIRM = 5  # records behind a step back that make it a setting of the clock
STALE = 5 * SECOND  # ns, of a record whose device clock is taken for another source
WRAP = 0.9  # of a day: a clock without a date that steps back by more goes on with the next day


class Times(NamedTuple):
    """time: ns of each record; kept: which records have a usable one; said: what was done about it, a line each."""

    time: np.ndarray
    kept: np.ndarray
    said: list[str]


def unwrapped(device: np.ndarray) -> np.ndarray:
    """Time of day that goes on over midnight."""
    if not len(device) or np.abs(device).max() > DAY:
        return device
    days = np.cumsum(np.diff(device, prepend=device[:1]) < -WRAP * DAY)
    return device + days * DAY


def ascending(time: np.ndarray, where: str) -> Times:
    """Times that ascend; equal ones stay. Single odd stamps, early or late, are left out, a clock that was set is
    joined."""
    n = len(time)
    time = time.copy()
    kept = np.ones(n, bool)
    said: list[str] = []
    steps = np.diff(time)
    forward = steps[steps > 0]
    usual = int(np.median(forward)) if len(forward) else 0
    odd = jumps = 0
    moved = 0
    back = np.flatnonzero(steps < 0)
    for k in back.tolist():
        # all behind k were shifted by earlier jumps already
        before = time[: k + 1][kept[: k + 1]]
        newest = int(before.max()) if len(before) else None
        if newest is None or time[k + 1] >= newest:
            continue
        after = time[k + 1 : k + 1 + CONFIRM]
        ahead = _ahead(time[: k + 1], kept[: k + 1], int(time[k + 1]), usual)
        if len(ahead) and len(after) == CONFIRM and bool((np.diff(after) >= 0).all()):
            kept[ahead] = False
            odd += len(ahead)
        elif len(after) == CONFIRM and bool((np.diff(after) >= 0).all()) and after[-1] < newest:
            shift = newest + usual - int(time[k + 1])
            time[k + 1 :] += shift
            moved += shift
            jumps += 1
        else:
            kept[k + 1] = False
            odd += 1
        if jumps > 1000:
            raise LogError(
                f"{where}: the clock steps back more than 1000 times; nothing was used of it. It is no clock: "
                f"take the other one with `time:`"
            )
    highest = np.maximum.accumulate(np.where(kept, time, np.iinfo(np.int64).min)) if n else time
    late = kept & (time < highest)
    odd += int(late.sum())
    kept &= ~late
    if jumps:
        said.append(
            f"{where}: the clock was set back {jumps} times, by {moved / SECOND:.6g} s together: what comes after is "
            f"moved on by that"
        )
    if odd:
        said.append(f"{where}: {odd} records with a stamp before that of the last one were left out")
    return Times(time, kept, said)


def _ahead(time: np.ndarray, kept: np.ndarray, now: int, usual: int) -> np.ndarray:
    """The last records, fewer than CONFIRM, whose stamps leapt ahead of a time at which the clock then goes on."""
    before = np.flatnonzero(kept)
    high = before[-CONFIRM:][time[before[-CONFIRM:]] > now]
    if not 0 < len(high) < CONFIRM:
        return before[:0]
    first = int(np.searchsorted(before, high[0]))
    leap = int(time[high[0]] - time[before[first - 1]]) if first else now + 1
    return high if first == 0 or leap > max(CONFIRM * usual, (int(time[high[0]]) - now) // 2) else before[:0]


def device_of(source: Source, stamps: Source, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Device clock of the last record of another source before each record, and which records have one."""
    if stamps.device is None or stamps.logged is None or source.logged is None:
        raise LogError(
            f"{where}: stamped_by {stamps.name} needs the logger's stamps of both and a device clock of {stamps.name}; "
            f"nothing was used of it. Take time: logged"
        )
    order = np.argsort(stamps.logged, kind="stable")
    at = np.searchsorted(stamps.logged[order], source.logged, "right") - 1
    found = at >= 0
    at = np.maximum(at, 0)
    fresh = found & (source.logged - stamps.logged[order][at] <= STALE)
    return unwrapped(stamps.device[order])[at], fresh


def dated(device: np.ndarray, logged: np.ndarray | None) -> np.ndarray:
    """A device's time of day on the day of the logger; other times as they are."""
    device = unwrapped(device)
    if logged is None or not len(device) or abs(int(np.median(device))) > 400 * DAY or np.median(logged) < 400 * DAY:
        return device
    if np.abs(device[:1]).max() > DAY:
        return device  # time since a start, not of a day
    away = float(np.median(logged - device))
    return device + round(away / DAY) * DAY


def least_delay(device: np.ndarray, logged: np.ndarray) -> int:
    """Shift [ns] that puts a device's clock on the logger's by the least delay of the middle of the log: 5 % of the
    records may be quicker, which a stamp that is off is too."""
    away = logged - device
    return int(np.percentile(away, 5.0, method="lower"))


def thinned(time: np.ndarray, values: np.ndarray, which: str) -> tuple[np.ndarray, np.ndarray, int]:
    """One record for each time; how many were left out. time: ascending."""
    first = np.concatenate(([True], np.diff(time) > 0)) if len(time) else np.zeros(0, bool)
    spare = int(len(time) - first.sum())
    if not spare:
        return time, values, 0
    starts = np.flatnonzero(first)
    if which == "first":
        return time[starts], values[starts], spare
    if which == "last":
        ends = np.append(starts[1:], len(time)) - 1
        return time[ends], values[ends], spare
    counts = np.diff(np.append(starts, len(time)))
    return time[starts], np.add.reduceat(values, starts) / counts, spare


def begin_of(stamps: np.ndarray) -> int:
    """The first stamp, or that behind a few which stand further before the log than it is long."""
    for k in range(min(CONFIRM, len(stamps) - 1) - 1, -1, -1):
        if stamps[k + 1] - stamps[k] > stamps[-1] - stamps[k + 1] and len(stamps) > 2 * CONFIRM:
            return int(stamps[k + 1])
    return int(stamps[0])


def every(time: np.ndarray, step: int) -> np.ndarray:
    """Indices of records at least `step` [ns] after the last one kept."""
    kept, at = [], 0
    while at < len(time):
        kept.append(at)
        at = max(at + 1, int(np.searchsorted(time, time[at] + step)))
    return np.array(kept, int)
