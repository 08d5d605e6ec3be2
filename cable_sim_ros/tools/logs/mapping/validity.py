"""Which records of a source a mapping accepts: range, quality, an interval of time."""

from __future__ import annotations

import numpy as np

from ..log import SECOND, Log, LogError
from ..not_valid import last_before
from .find import column_of, find_sources, near
from .time_base import begin_of


def accepted_records(log, where, entry, source, raw, time, said) -> np.ndarray:
    """Which records the mapping accepts; counts of the others are said."""
    good = np.ones(len(source), bool)

    def drop(kept: np.ndarray, why: str) -> None:
        nonlocal good
        lost = int((good & ~kept).sum())
        if lost:
            said.append(f"{where}: {lost} of {len(source)} records of {source.name} left out: {why}")
        good &= kept

    if entry.range is not None:
        low, high = entry.range
        with np.errstate(invalid="ignore"):
            drop(((raw >= low) & (raw <= high)).all(axis=0), f"outside [{low:g}, {high:g}]")
    if entry.quality_field:
        drop(_quality(log, where, entry, source), f"{entry.quality_field} is none of the accepted values")
    if entry.after is not None or entry.until is not None:
        begin = _begin(log)
        since = (time - begin) / SECOND
        inside = np.ones(len(source), bool)
        if entry.after is not None:
            inside &= since >= entry.after
        if entry.until is not None:
            inside &= since <= entry.until
        drop(inside, "outside the interval of `after` and `until`")
    return good


def _begin(log: Log) -> int:
    if log.begin is not None:
        return log.begin
    stamps = [s.logged if s.logged is not None else s.device for s in log.sources.values()]
    return min((begin_of(t) for t in stamps if t is not None and len(t)), default=0)


def _quality(log, where, entry, source) -> np.ndarray:
    told = source
    if entry.quality_source:
        found = find_sources(log, [entry.quality_source])
        if not found:
            raise LogError(
                f"{where}.quality_source = {entry.quality_source}: there is no such source; nothing was used. "
                f"{near(entry.quality_source, [*log.sources, *log.left])}"
            )
        told = found[0]
    column = column_of(told, entry.quality_field)
    if column is None:
        raise LogError(
            f"{where}.quality_field = {entry.quality_field}: {told.name} has no such field; nothing was used. "
            f"{near(entry.quality_field, [*told.columns, *told.left])}"
        )
    accepted = np.isin(told.columns[column], entry.quality_refused, invert=True)
    if entry.quality_accepted:
        accepted &= np.isin(told.columns[column], entry.quality_accepted)
    if told is source:
        return accepted
    at = last_before(source, told)
    if at is None:
        raise LogError(
            f"{where}.quality_source = {told.name} has no clock in common with {source.name}; nothing was used"
        )
    return (at >= 0) & accepted[np.maximum(at, 0)]
