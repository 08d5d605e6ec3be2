"""Flux package (FDCHP) of the Ocean Observatories Initiative: wind and motion of a buoy; 55 bytes, big-endian.

    uint16 year | uint8 month, day, hour, minute, second | uint16 millisecond | int16 wind x, y, z
    | uint16 speed of sound | 3 float32 rate [rad/s]
    | 3 float32 acceleration [g] | float32 roll, pitch, heading [rad] | uint8 status 1, 2

A record has no checksum: it is taken where its date, time and numbers can be.
Source: parser fdchp_a of the mi-instrument project; wind [cm/s] of its users' scripts; 32767 is no value.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..log import SECOND, Log, Losses, Source, day_of
from .lines import records_of, with_records

SIZE = 55
NAME, KIND = "fdchp", "FDCHP record"
FORM = np.dtype([
    ("year", ">u2"), ("date", "u1", 5), ("ms", ">u2"), ("wind", ">i2", 3), ("sound", ">u2"), ("motion", ">f4", 9),
    ("status", "u1", 2),
])  # fmt: skip
MOTION = {
    "rate_x": "rad/s", "rate_y": "rad/s", "rate_z": "rad/s",
    "acceleration_x": "g", "acceleration_y": "g", "acceleration_z": "g",
    "roll": "rad", "pitch": "rad", "heading": "rad",
}  # fmt: skip
NO_VALUE = 32_767
FIRST, LAST = 1990, 2100  # years
MOST = 1000.0  # of any rate, acceleration or angle


def recognise(head: bytes, path: Path) -> bool:
    """Whether the file starts with a record, and another follows where there are bytes for it."""
    data = np.frombuffer(head[: 2 * SIZE], np.uint8)
    return len(data) >= SIZE and bool(_valid(data)[[0, -1] if len(data) == 2 * SIZE else [0]].all())


def read(path: Path) -> Log:
    """All records whose date, time and numbers can be."""
    losses = Losses()
    rows = records_of(path, SIZE, _valid, losses).view(FORM)[:, 0]
    columns = {name: rows["motion"][:, k].astype(np.float64) for k, name in enumerate(MOTION)}
    units = dict(MOTION)
    for k, axis in enumerate("xyz"):
        columns[f"wind_{axis}"] = _known(rows["wind"][:, k])
        units[f"wind_{axis}"] = "cm/s"
    columns["speed_of_sound"] = _known(rows["sound"])
    for k in (0, 1):
        columns[f"status_{k + 1}"] = rows["status"][:, k].astype(np.float64)
    source = Source(NAME, KIND, None, _times(rows), columns, units)
    notices = ["records have no checksum: a wrong bit in a number is not seen"]
    return with_records(Log(str(path), "fdchp", {NAME: source}, len(rows), losses, notices), "record of 55 bytes")


def _known(values: np.ndarray) -> np.ndarray:
    return np.where(values == NO_VALUE, np.nan, values.astype(np.float64))


def _times(rows: np.ndarray) -> np.ndarray:
    day = rows["date"].astype(np.int64)
    key = rows["year"].astype(np.int64) * 10_000 + day[:, 0] * 100 + day[:, 1]
    days, back = np.unique(key, return_inverse=True)
    since = np.array([day_of(k // 10_000, k // 100 % 100, k % 100) for k in days.tolist()], np.int64)
    seconds = day[:, 2] * 3600 + day[:, 3] * 60 + day[:, 4]
    return since[back] + seconds * SECOND + rows["ms"].astype(np.int64) * 1_000_000


def _valid(data: np.ndarray) -> np.ndarray:
    """Places whose bytes can be a record."""
    places = len(data) - SIZE + 1
    year = data[:places].astype(np.int64) << 8 | data[1 : places + 1]
    month, day, hour, minute, second = (data[k : places + k].astype(np.int64) for k in range(2, 7))
    ms = data[7 : places + 7].astype(np.int64) << 8 | data[8 : places + 8]
    good = (year >= FIRST) & (year <= LAST) & (month >= 1) & (month <= 12) & (day >= 1)
    good &= (hour < 24) & (minute < 60) & (second < 60) & (ms < 1000)
    for place in np.flatnonzero(good).tolist():  # few: dates and numbers are checked for these alone
        row = np.frombuffer(data[place : place + SIZE].tobytes(), FORM)[0]
        good[place] = _dated(int(row["year"]), int(month[place]), int(day[place])) and _plausible(row["motion"])
    return good


def _dated(year: int, month: int, day: int) -> bool:
    try:
        day_of(year, month, day)
    except ValueError:
        return False
    return True


def _plausible(motion: np.ndarray) -> bool:
    return bool((np.abs(motion) < MOST).all())
