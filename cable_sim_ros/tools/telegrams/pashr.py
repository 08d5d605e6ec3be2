"""PASHR of Applanix POS MV: time, heading, roll, pitch, heave, their accuracies.

    $PASHR,145719.272,252.41,T,1.22,0.48,0.01,0.090,0.090,0.116,2,1*11<CR><LF>

UTC hhmmss.sss; heading [deg]; T; roll [deg] positive port side up; pitch [deg] positive bow up; heave [m]; standard
deviations of roll, pitch, heading [deg]; aiding (0 none, 1 GNSS, 2 GNSS and GAMS); IMU (0 out, 1 satisfactory). Angles
are those of Tait and Bryan. Source: POS MV V5 Installation and Operation Guide, PUBS-MAN-004291 rev. 16, table 20, for
fields and ranges; the example above from a public parser. Trimble's receivers leave the heave out, NovAtel's write a
plus: both are read. The sign of the heave was found in none of these: a key sets it.
"""

from __future__ import annotations

import re
from math import degrees, radians
from typing import NamedTuple

from .fields import (
    DAY,
    MILLI,
    Motion,
    TelegramError,
    heading_of,
    moment,
    numbers_of,
    parts_of,
    sentence,
    within,
    yaw_of,
)

CLOCK = re.compile(r"(\d\d)(\d\d)(\d\d)\.(\d{1,3})")


class Form(NamedTuple):
    """What is no motion: standard deviations of roll, pitch, heading [deg], aiding, IMU; sign of the heave."""

    accuracy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    aiding: int = 2
    imu: int = 1
    heave_up: bool = True


USUAL = Form()


def encode(values: Motion, form: Form = USUAL) -> bytes:
    """A telegram; Withheld where a value does not fit its field."""
    at = moment(values.time)
    roll = within("roll", degrees(values.roll), -90.0, 90.0, "deg")
    pitch = within("pitch", degrees(-values.pitch), -90.0, 90.0, "deg")
    heave = within("heave", values.heave if form.heave_up else -values.heave, -99.0, 99.0, "m")
    within("yaw", values.yaw, -7.0, 7.0, "rad")
    spread = [f"{within('accuracy', part, 0.0, 9.999, 'deg'):.3f}" for part in form.accuracy]
    return sentence(
        f"PASHR,{at:%H%M%S}.{at.microsecond // 1000:03d},{heading_of(values.yaw)},T,{roll:.2f},{pitch:.2f},{heave:.2f},"
        f"{','.join(spread)},{form.aiding},{form.imu}"
    )


def decode(telegram: bytes, heave_up: bool = True) -> tuple[Motion, Form]:
    """Values and form of a telegram; heave_up: the sign of its heave."""
    clock, heading, true, *rest = parts_of(telegram, "PASHR,", 11)
    found = CLOCK.fullmatch(clock)
    if found is None or true != "T":
        raise TelegramError(f"{telegram!r} is not the PASHR of roll, pitch and heave")
    yaw, roll, pitch, heave, *spread, aiding, imu = numbers_of(telegram, [heading, *rest])
    hours, minutes, seconds = (int(part) for part in found.groups()[:3])
    time = (3600 * hours + 60 * minutes + seconds) * 1000 + int(found[4].ljust(3, "0"))
    form = Form((spread[0], spread[1], spread[2]), int(aiding), int(imu), heave_up)
    up = heave if heave_up else -heave
    return Motion(time * MILLI % DAY, radians(roll), -radians(pitch), yaw_of(yaw), up), form
