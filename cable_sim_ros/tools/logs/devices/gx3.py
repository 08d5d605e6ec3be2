"""3DM-GX3 of LORD MicroStrain, record 0xCB: acceleration, angular rate, magnetic field, timer; 43 bytes, big-endian.

    0xCB | 3 float32 acceleration [g] | 3 float32 rate [rad/s] | 3 float32 field [gauss] | uint32 timer
    | uint16 checksum

The checksum is the sum of the 41 bytes before it. The timer ticks 62500 times a second and starts again at 0 with the
device, or after 2^32 ticks (19 h), which is counted on. Sources: 3DM-GX3 Data Communications Protocol, 0xCB; logs of
the Ocean Observatories Initiative (mopak), all 14821 records of which fit.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..log import Log, Losses, Source
from .lines import records_of, with_records

SIZE, MARK = 43, 0xCB
TICK = 16_000  # ns
WRAP = 1 << 32
NAME, KIND = "3dm-gx3", "3DM-GX3 0xCB"
COLUMNS = {
    f"{what}_{axis}": unit
    for what, unit in (("acceleration", "g"), ("rate", "rad/s"), ("field", "gauss"))
    for axis in "xyz"
}


def recognise(head: bytes, path: Path) -> bool:
    """Whether a record with a right checksum begins in the first 4 kB and another follows, or the file ends there."""
    data = np.frombuffer(head[:4096], np.uint8)
    if len(data) < SIZE:
        return False
    places = np.flatnonzero(_valid(data))
    after = places + SIZE
    follows = (after >= len(data)) | (data[np.minimum(after, len(data) - 1)] == MARK)
    return bool(follows.any())


def read(path: Path) -> Log:
    """All records whose checksum fits."""
    losses = Losses()
    notices: list[str] = []
    records = records_of(path, SIZE, _valid, losses)
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        values = np.ascontiguousarray(records[:, 1:37]).view(">f4").astype(np.float64)
    fit = np.isfinite(values).all(axis=1)
    if not fit.all():
        losses.add("value that is no number", f"record {int(np.argmin(fit)) + 1}", int((~fit).sum()))
        records, values = records[fit], values[fit]
    ticks = np.ascontiguousarray(records[:, 37:41]).view(">u4").astype(np.int64)[:, 0]
    device = _counted_on(ticks, notices)
    notices.append("time is the timer of the device, from its own start: the log has no stamps")
    columns = {name: values[:, k].copy() for k, name in enumerate(COLUMNS)}
    source = Source(NAME, KIND, None, device, columns, dict(COLUMNS))
    return with_records(Log(str(path), "3dm-gx3", {NAME: source}, len(records), losses, notices), "record 0xCB")


def _counted_on(ticks: np.ndarray, notices: list[str]) -> np.ndarray:
    """ns; a timer that ran over goes on, one that was reset is left as it is and said."""
    steps = np.diff(ticks, prepend=ticks[:1])
    back, over = steps < 0, steps < -WRAP * 15 // 16
    resets = np.flatnonzero(back & ~over)
    if resets.size:
        notices.append(
            f"the timer goes back {resets.size} times (the device started again), first at record "
            f"{int(resets[0]) + 1}: times before and after are not of one clock"
        )
    total = np.cumsum(over)
    at_reset = np.maximum.accumulate(np.where(back & ~over, total, 0))
    return (ticks + WRAP * (total - at_reset)) * TICK  # what ran over since the start of the device


def _valid(data: np.ndarray) -> np.ndarray:
    places = len(data) - SIZE + 1
    sums = np.concatenate(([0], np.cumsum(data, dtype=np.int64)))
    body = sums[SIZE - 2 : SIZE - 2 + places] - sums[:places]
    given = data[SIZE - 2 : SIZE - 2 + places].astype(np.int64) << 8 | data[SIZE - 1 : SIZE - 1 + places]
    return (data[:places] == MARK) & (body & 0xFFFF == given)
