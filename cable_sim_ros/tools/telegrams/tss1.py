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
from math import asin, cos, degrees, sin

from .fields import ENDS, Motion, within

HORIZONTAL, VERTICAL = 0.0383, 0.000625  # m/s^2 a digit
LINE = re.compile(rb":([0-9A-F]{2})([0-9A-F]{4}) ([ -]\d{4})([UGHFughf])([ -]\d{4}) ([ -]\d{4})(?:\r\n?|\n)?")


def encode(values: Motion) -> bytes:
    """A telegram of a settled sensor; Withheld where a value does not fit its field."""
    across = round(within("horizontal acceleration", values.horizontal, 0.0, 255 * HORIZONTAL, "m/s^2") / HORIZONTAL)
    least, most = -32768 * VERTICAL, 32767 * VERTICAL
    along = round(within("vertical acceleration", values.vertical, least, most, "m/s^2") / VERTICAL)
    heave = _signed(100.0 * within("heave", values.heave, -99.99, 99.99, "m"))
    within("roll", degrees(values.roll), -90.0, 90.0, "deg")
    pitch = within("pitch", degrees(-values.pitch), -90.0, 90.0, "deg")
    roll = degrees(asin(sin(values.roll) * cos(values.pitch)))
    text = f":{across:02X}{along & 0xFFFF:04X} {heave}F{_signed(100.0 * roll)} {_signed(100.0 * pitch)}"
    return text.encode("ascii") + ENDS


def _signed(value: float) -> str:
    whole = round(value)
    return f"{'-' if whole < 0 else ' '}{abs(whole):04d}"
