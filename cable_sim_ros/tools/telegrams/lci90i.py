"""LCI-90i, winch display of Measurement Technology NW: tension, speed and pay-out, twenty times a second.

    <SOH>02RD,2014-08-01T00:28:38.351,STBD TRAWL,00000061,000000.0,-00034.0,3596<CR><LF>

Fields: number of the display and RD; its clock, UTC; name of the winch; tension; speed [m/min]; pay-out [m]; sum of the
bytes from the number to the last comma, four digits, decimal. Numbers have 8 characters with zeros in front, and a
minus in the first where negative. Sources: logs of RVIB Nathaniel B. Palmer, NBP1406 (OpenRVDAS), all 10000 lines of
which fit, checksums included; LCI-90 Operator Manual, 6.6.4, protocol 1, for width, sign, checksum and CR LF (it has
neither clock nor name). Speed is positive paying out in the logs; negative hauling in is the manual's sign, not seen
there. Displays differ: in the log of the CTD winch tension is without zeros and ends in a point, speed is whole.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import NamedTuple

from .fields import ENDS, filled, moment, within

WIDTH = 8  # characters of a number
LONGEST_NAME = 16  # characters; a choice, 10 are seen
SOH = b"\x01"
LINE = re.compile(rb"[\x00-\x1f]*((\d\d)RD,([\dT:.-]{23}),(?:([ -+\--~]+),)?([\d.-]+),([\d.-]+),([\d.-]+),)(\d{4})\s*")


class TensionUnit(str, Enum):
    """Unit of the tension on a display."""

    LB = "lb"
    KGF = "kgf"
    DAN = "daN"


NEWTON = {TensionUnit.LB: 4.4482216152605, TensionUnit.KGF: 9.80665, TensionUnit.DAN: 10.0}


class Winch(NamedTuple):
    """time [ns since 1970], tension [N], speed [m/s] and pay-out [m], positive out."""

    time: int
    tension: float
    speed: float
    payout: float


class Form(NamedTuple):
    """How a display is set: number 0 to 99; name, "": none; tension without zeros, with a point; decimals of speed."""

    number: int = 1
    name: str = "TOW WINCH"
    plain_tension: bool = False
    speed_decimals: int = 1
    unit: TensionUnit = TensionUnit.LB


USUAL = Form()


def name_problem(name: str) -> str:
    """ "" or why this cannot be the name of a winch."""
    if len(name) > LONGEST_NAME or not name.isascii() or not name.isprintable() or "," in name:
        return f"at most {LONGEST_NAME} printable ASCII characters without a comma"
    return ""


def encode(values: Winch, form: Form = USUAL) -> bytes:
    """A telegram; Withheld where a value does not fit its field."""
    at = moment(values.time)
    tension = values.tension / NEWTON[form.unit]
    if form.plain_tension:
        least, most = 1 - 10 ** (WIDTH - 2), 10 ** (WIDTH - 1) - 1
        pull = f"{within('tension', tension, least, most, form.unit.value):.0f}."
    else:
        pull = filled("tension", tension, WIDTH, 0, form.unit.value)
    speed = filled("speed", 60.0 * values.speed, WIDTH, form.speed_decimals, "m/min")
    clock = f"{at.year:04d}-{at:%m-%dT%H:%M:%S}.{at.microsecond // 1000:03d}"
    head = [f"{form.number:02d}RD", clock, *([form.name] if form.name else [])]
    body = ",".join([*head, pull, speed, filled("pay-out", values.payout, WIDTH, 1, "m"), ""]).encode("ascii")
    return b"%s%s%04d%s" % (SOH, body, sum(body) % 10_000, ENDS)
