"""What the formats share: values of a telegram, numbers in fields, times, checksums, and what is said of a misfit.

A value that its field cannot hold, or that is no number, withholds the telegram: nothing wrong is ever written.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from ...errors import CableSimError

SECOND, MILLI = 1_000_000_000, 1_000_000  # ns
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
ENDS = b"\r\n"


class TelegramError(CableSimError, ValueError):
    """Settings that cannot be used."""


class Withheld(TelegramError):
    """A telegram that is not written; the text names quantity, value and the range of its field."""


class Motion(NamedTuple):
    """What a motion sensor tells, axes of REP 103, `base_link`: x forward, y to port, z up.

    time [ns] since 1970; roll [rad] positive port side up; pitch [rad] positive bow down; yaw [rad] from east to north;
    heave [m] positive up; horizontal and vertical [m/s^2]: acceleration across the vertical, no sign, and along it,
    positive up; nan where a telegram has none.
    """

    time: int
    roll: float
    pitch: float
    yaw: float
    heave: float
    horizontal: float = math.nan
    vertical: float = math.nan


def within(what: str, value: float, low: float, high: float, unit: str, rounding: float = 0.0) -> float:
    """The value, where it is a number from low to high, or rounds to one; else Withheld."""
    if not low - rounding <= value <= high + rounding:  # also nan
        shown = f"{value:.6g} {unit}" if math.isfinite(value) else "no number"
        raise Withheld(f"{what} is {shown}, its field holds {low:.10g} to {high:.10g} {unit}")
    return value


def filled(what: str, value: float, width: int, decimals: int, unit: str) -> str:
    """A number of exactly `width` characters, with zeros in front; Withheld where it needs more."""
    most = 10.0 ** (width - (decimals + 1 if decimals else 0)) - 10.0**-decimals
    least = -(10.0 ** (width - 1 - (decimals + 1 if decimals else 0)) - 10.0**-decimals)
    within(what, value, least, most, unit, 0.499 * 10.0**-decimals)
    return f"{value:0{width}.{decimals}f}"  # a small negative number is -0, as displays show it


def moment(time: int) -> datetime:
    """UTC of a time [ns since 1970], cut to whole milliseconds."""
    seconds, rest = divmod(time, SECOND)
    try:
        return EPOCH + timedelta(seconds=seconds, milliseconds=rest // MILLI)
    except OverflowError:
        raise Withheld(f"the time is {seconds} s since 1970, its field holds the years 1 to 9999") from None


def nanoseconds(at: datetime) -> int:
    """The inverse, for a time without zone."""
    past = at.replace(tzinfo=UTC) - EPOCH
    return (past.days * 86_400 + past.seconds) * SECOND + past.microseconds * 1000


def heading_of(yaw: float) -> str:
    """Compass heading [deg] of a yaw, 0.00 to 359.99."""
    text = f"{(90.0 - math.degrees(yaw)) % 360.0:.2f}"
    return "0.00" if text == "360.00" else text


def exclusive_or(body: bytes) -> int:
    """Checksum of NMEA 0183: of what stands between $ and *."""
    check = 0
    for byte in body:
        check ^= byte
    return check


def sentence(body: str) -> bytes:
    """$body*hh<CR><LF>."""
    data = body.encode("ascii")
    return b"$%s*%02X%s" % (data, exclusive_or(data), ENDS)
