"""TSS1 of Teledyne TSS: accelerations, heave, roll, pitch; 27 characters, no checksum.

    :00FFCA -0003F-0325  0319<CR><LF>

Horizontal acceleration, two hexadecimal digits of 3.83 cm/s^2; vertical, four of 0.0625 cm/s^2, two's complement,
positive up; blank; heave [cm] positive up; status (U, G, H, F: settled; u, g, h, f: settling); roll [0.01 deg] positive
port side up; blank; pitch [0.01 deg] positive bow up; each a blank or a minus and four digits. Sources: NovAtel OEM7,
log TSS1 (layout, units, ranges, the example); MAHRS notes of UHDAS (signs, status); Simrad EK80 help (roll is not that
of Tait and Bryan; its formula is a picture). Taken for roll: the angle of the ship's cross axis against the horizontal,
sin(roll of TSS) = sin(roll) cos(pitch). No log of a real sensor was at hand.
"""

from __future__ import annotations

import re
from math import asin, cos, degrees, radians, sin
from typing import NamedTuple

from .fields import ENDS, Motion, TelegramError, within

HORIZONTAL, VERTICAL = 0.0383, 0.000625  # m/s^2 a digit
STATUS = "UGHFughf"
LINE = re.compile(rb":([0-9A-F]{2})([0-9A-F]{4}) ([ -]\d{4})([UGHFughf])([ -]\d{4}) ([ -]\d{4})(?:\r\n?|\n)?")


class Form(NamedTuple):
    """status: one of STATUS."""

    status: str = "F"


USUAL = Form()


def encode(values: Motion, form: Form = USUAL) -> bytes:
    """A telegram; Withheld where a value does not fit its field."""
    across = round(within("horizontal acceleration", values.horizontal, 0.0, 255 * HORIZONTAL, "m/s^2") / HORIZONTAL)
    least, most = -32768 * VERTICAL, 32767 * VERTICAL
    along = round(within("vertical acceleration", values.vertical, least, most, "m/s^2") / VERTICAL)
    heave = _signed(100.0 * within("heave", values.heave, -99.99, 99.99, "m"))
    within("roll", degrees(values.roll), -90.0, 90.0, "deg")
    pitch = within("pitch", degrees(-values.pitch), -90.0, 90.0, "deg")
    roll = degrees(asin(sin(values.roll) * cos(values.pitch)))
    text = f":{across:02X}{along & 0xFFFF:04X} {heave}{form.status}{_signed(100.0 * roll)} {_signed(100.0 * pitch)}"
    return text.encode("ascii") + ENDS


def _signed(value: float) -> str:
    whole = round(value)
    return f"{'-' if whole < 0 else ' '}{abs(whole):04d}"


def decode(telegram: bytes) -> tuple[Motion, Form]:
    """Values and form of a telegram; its yaw is 0."""
    found = LINE.fullmatch(telegram)
    if found is None:
        raise TelegramError(f"{telegram!r} is no telegram of TSS1")
    across, along = int(found[1], 16), int(found[2], 16)
    heave, roll, pitch = (0.01 * float(found[k].replace(b" ", b"")) for k in (3, 5, 6))
    if max(abs(roll), abs(pitch)) > 90.0:
        raise TelegramError(f"{telegram!r}: an angle beyond 90 deg")
    level = cos(radians(pitch))
    share = sin(radians(roll)) / level if level > 0.0 else 0.0
    motion = Motion(
        0,
        asin(max(-1.0, min(1.0, share))),
        -radians(pitch),
        0.0,
        heave,
        across * HORIZONTAL,
        (along - (along >> 15 << 16)) * VERTICAL,
    )
    return motion, Form(found[4].decode())
