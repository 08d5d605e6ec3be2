"""TRIAXYS wave buoy of AXYS: statistics, spectrum, and the displacements of each measurement as a series.

    $TSPWA,20150313,230059,05981,buoyID,,,144,1.02,7.4,2.92,1.58,9.6,2.01,11.2,7.8,14.3,14.0,1.72,180.1,42.2*52
    $TSPHA,20150313,230059,05981,buoyID,,,1382,60.164,0.781,0,-0.27,-0.18,-0.01,0.02,...*62

Date, time (start of the measurement, UTC), serial number, name, latitude, longitude; then, of TSPHA: samples, time of
the first after the start [s], time between two [s], 0 where a solution was found, and heave, north, east of each [m].
Sources: TRIAXYS Directional Wave Buoy User's Manual; log of the Ocean Observatories Initiative, all 120 sentences of
which fit.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from ..log import SECOND, clock_of, day_of

STATISTICS = {
    "zero_crossings": "", "mean_height": "m", "mean_spectral_period": "s", "largest_height": "m",
    "significant_height": "m", "significant_period": "s", "height_10": "m", "period_10": "s", "mean_period": "s",
    "peak_period": "s", "peak_period_5": "s", "significant_height_spectral": "m", "mean_direction": "deg",
    "mean_spread": "deg",
}  # fmt: skip
SERIES = {"heave": "m", "north": "m", "east": "m"}
SPECTRA = {"TSPNA", "TSPFB", "TSPMA"}  # counted, not read
WAVE_BUOY = {"TSPWA", "TSPHA", *SPECTRA}
HEAD = 6  # fields in front of each
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][+-]?\d{1,2})?")


class Unfit(ValueError):
    """A sentence that is not read: the text is a cause of Losses."""


class Burst(NamedTuple):
    """time: of each row, ns since 1970 by the buoy's clock; values: float64 [n, columns]; units of the columns."""

    time: np.ndarray
    values: np.ndarray
    units: dict[str, str]


def decode(identity: str, fields: list[str]) -> Burst:
    """Rows of TSPWA (one) or TSPHA (a series); raises Unfit."""
    start = _start(fields)
    if identity == "TSPWA":
        values = _numbers(fields[HEAD:], len(STATISTICS))
        return Burst(np.array([start], np.int64), values[None, :], STATISTICS)
    head = _numbers(fields[HEAD : HEAD + 4], 4)
    rest = fields[HEAD + 4 :]
    if head[3]:
        raise Unfit("series for which the buoy found no solution")
    if len(rest) != 3 * head[0]:  # the count of the sentence is compared, never allocated
        raise Unfit("series with another count of displacements than it says")
    if not (0.0 <= head[1] <= 86_400.0 and 0.0 < head[2] <= 3600.0):
        raise Unfit("series whose times cannot be")
    samples = np.arange(len(rest) // 3)
    time = start + np.round((head[1] + head[2] * samples) * SECOND).astype(np.int64)
    return Burst(time, _numbers(rest, len(rest)).reshape(-1, 3), SERIES)


def _start(fields: list[str]) -> int:
    try:
        day, time = fields[0], fields[1]
        if len(day) != 8 or len(time) != 6:
            raise ValueError
        return day_of(int(day[:4]), int(day[4:6]), int(day[6:])) + clock_of(
            int(time[:2]), int(time[2:4]), int(time[4:]), None
        )
    except (ValueError, IndexError):
        raise Unfit("date that is none") from None


def _numbers(texts: list[str], count: int) -> np.ndarray:
    if len(texts) != count:
        raise Unfit("sentence with too few fields")
    if not all(_NUMBER.fullmatch(text) and len(text) < 32 for text in texts):
        raise Unfit("field that is no number")
    return np.array([float(text) for text in texts], np.float64)
