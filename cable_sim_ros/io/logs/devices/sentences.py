"""Fields of NMEA 0183 sentences as numbers: standard ones by the table of pynmeagps, proprietary ones by the one here.

Numbers are as the sentence has them. Latitude, longitude, deviation and variation take the sign of the letter behind
them (north and east positive); a status letter is 1 where it says valid, 0 where it says not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import NamedTuple

from ..log import SECOND
from ..stamps import clock_of, day_of
from .wave_buoy import WAVE_BUOY

MOST_COLUMNS = 64  # of a source whose sentences name or number their own fields
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,2})?")
TIME = re.compile(r"(\d\d)(\d\d)(\d\d)(?:\.(\d{1,9})\d*)?")
IDENTITY = re.compile(r"P[A-Z0-9]{2,7}|[A-Z][A-Z0-9][A-Z0-9]{3}|TSP[A-Z]{2}")


class Unfit(ValueError):
    """A sentence that is not read: the text is a cause of Losses."""


class Clock(NamedTuple):
    """Time that a sentence tells: ns since 1970 where it tells a date, since midnight otherwise."""

    time: int
    dated: bool


class Sentence(NamedTuple):
    """What a sentence gives: source, values of columns, units of some, its clock or None."""

    source: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    clock: Clock | None


QUALITY = {"horizontal_quality": "", "height_quality": "", "heading_quality": "", "roll_pitch_quality": ""}
PROPRIETARY: dict[str, dict[str, str]] = {  # source -> field and unit, "" for none, "-" in front for one that is text
    "PSXN,20": QUALITY,  # Kongsberg Seapath: 0 normal, 1 reduced, 2 invalid
    "PSXN,22": {"gyro_calibration": "deg", "gyro_offset": "deg"},
    "PSXN,23": {"roll": "deg", "pitch": "deg", "heading": "deg", "heave": "m"},  # heave positive down
    "PSXN,24": {"roll_rate": "deg/s", "pitch_rate": "deg/s", "yaw_rate": "deg/s", "vertical_velocity": "m/s"},
    "PASHR": {
        "-time": "", "heading": "deg", "-true": "", "roll": "deg", "pitch": "deg", "heave": "m", "roll_accuracy": "deg",
        "pitch_accuracy": "deg", "heading_accuracy": "deg", "aiding": "", "imu": "",
    },  # as io/telegrams/pashr tells
    "PRDID": {"pitch": "deg", "roll": "deg", "heading": "deg"},  # Teledyne RDI
    "PTNTHPR": {"heading": "deg", "-magnetic": "", "pitch": "deg", "-pitch": "", "roll": "deg"},  # True North
    "PFEC,GPatt": {"heading": "deg", "pitch": "deg", "roll": "deg"},  # Furuno
    "PFEC,GPhve": {"heave": "m"},
}  # fmt: skip
KINDS = {"PSXN", "PFEC"}  # their first field says which sentence it is
UNITS = {
    "lat": "deg", "lon": "deg", "alt": "m", "sep": "m", "cogt": "deg", "cogm": "deg", "sogn": "kn", "sogk": "km/h",
    "spd": "kn", "cog": "deg", "mv": "deg", "headingT": "deg", "headingM": "deg", "deviation": "deg",
    "variation": "deg", "headt": "deg", "rot": "deg/min", "depth": "m", "offset": "m", "depthf": "ft", "depthm": "m",
    "depthfath": "fathom", "hdgT": "deg", "hdgM": "deg", "spdN": "kn", "spdK": "km/h", "longwaterspd": "kn",
    "transwaterspd": "kn", "longgroundspd": "kn", "transgroundspd": "kn",
}  # fmt: skip
STATUS = {"status", "valid", "mi", "waterspdstatus", "groundspdstatus"}  # V says not valid
XDR_UNITS = {"D": "deg", "M": "m", "C": "degC", "B": "bar", "P": "Pa", "N": "N", "V": "V", "A": "A", "H": "Hz"}


@cache
def standard() -> Mapping[str, Mapping[str, str]]:
    """Name and type of the fields of each standard sentence without repeated groups."""
    table = import_module("pynmeagps.nmeatypes_get").NMEA_PAYLOADS_GET
    return {key: fields for key, fields in table.items() if all(isinstance(kind, str) for kind in fields.values())}


def decode(identity: str, fields: list[str]) -> Sentence | None:
    """Numbers of a sentence, None where it is of a kind that holds none; raises Unfit."""
    if identity in WAVE_BUOY:
        return None  # its own module reads it
    if identity.startswith("P") and len(identity) != 5 or identity in PROPRIETARY:
        return _proprietary(identity, fields)
    formatter = identity[2:]
    if formatter == "XDR":
        return _transducers(identity, fields)
    names = standard().get(formatter)
    if names is None:
        return _numbered(identity, fields)
    return _standard(identity, names, fields)


def _standard(identity: str, names: Mapping[str, str], fields: list[str]) -> Sentence | None:
    values: dict[str, float] = {}
    time = day = None
    for (name, kind), text in zip(names.items(), fields):
        if not text:
            continue
        if kind in ("DE", "IN"):
            values[name] = number(text)
        elif kind in ("LA", "LN"):
            values[name] = _degrees(text, 90 if kind == "LA" else 180)
        elif kind == "TM":
            time = _clock(text)
        elif kind == "DT":
            day = _day(text[4:6], text[2:4], text[:2], 6 == len(text))
        elif name in ("NS", "EW", "deviationEW", "variationEW", "mvEW"):
            _sign({"NS": "lat", "EW": "lon"}.get(name, name[:-2]), text, values)
        elif name in STATUS:
            values[name] = float(text != "V")
        elif name == "posMode":
            values[name] = float(text.strip("N") != "")
    if identity.endswith("ZDA"):
        if not {"day", "month", "year"} <= values.keys() or time is None:
            return None  # a clock that has no time yet
        day = _day(*(f"{values.pop(key):.0f}" for key in ("year", "month", "day")), True)
        values["time_of_day"] = time / SECOND
    if {"lat", "lon"} & values.keys() and not {"NS", "EW"} <= {n for n, t in zip(names, fields) if t}:
        raise Unfit("position without its hemisphere")
    units = {name: UNITS[name] for name in values if name in UNITS}
    clock = None if time is None else Clock(time if day is None else day + time, day is not None)
    return Sentence(identity, values, units, clock) if values else None


def _proprietary(identity: str, fields: list[str]) -> Sentence | None:
    name, rest = identity, fields
    if identity in KINDS and fields:
        name, rest = f"{identity},{fields[0]}", fields[1:]
    names = PROPRIETARY.get(name)
    if names is None or (name == "PASHR" and not TIME.fullmatch(fields[0] if fields else "")):
        if fields and fields[0].isalpha() and name == identity and len(fields[0]) <= 8:
            name, rest = f"{identity},{fields[0]}", fields[1:]  # such as PASHR,POS
        return _numbered(name, rest)
    if len(rest) < len(names) and name != "PASHR":
        raise Unfit("sentence with too few fields")
    values = {key: number(text) for key, text in zip(names, rest) if text and not key.startswith("-")}
    clock = Clock(_clock(rest[0]), False) if name == "PASHR" else None
    units = {key: unit for key, unit in names.items() if unit}
    return Sentence(name, values, units, clock) if values else None


def _transducers(identity: str, fields: list[str]) -> Sentence | None:
    values, units = {}, {}
    for k in range(0, len(fields) - 3, 4):
        kind, text, unit, name = fields[k : k + 4]
        if text:
            column = name.strip() or f"{kind}_{k // 4 + 1}"
            values[column] = number(text)
            if unit in XDR_UNITS:
                units[column] = XDR_UNITS[unit]
    if len(values) > MOST_COLUMNS:
        raise Unfit(f"sentence of more than {MOST_COLUMNS} transducers")
    return Sentence(identity, values, units, None) if values else None


def _numbered(name: str, fields: list[str]) -> Sentence | None:
    """A sentence that is not known: its numbers by their place."""
    values = {
        f"field_{k + 1:02d}": float(text)
        for k, text in enumerate(fields[:MOST_COLUMNS])
        if len(text) < 32 and NUMBER.fullmatch(text)
    }
    return Sentence(name, values, {}, None) if values else None


def number(text: str) -> float:
    """Raises Unfit where it is none."""
    if len(text) > 32 or not NUMBER.fullmatch(text.strip()):
        raise Unfit("field that is no number")
    return float(text)


def _degrees(text: str, most: int) -> float:
    head, point, digits = text.partition(".")
    if len(head) < 3 or not head.isdecimal() or (point and not digits.isdecimal()):
        raise Unfit("position that is none")
    minutes = float(head[-2:] + "." + (digits or "0"))
    value = int(head[:-2]) + minutes / 60
    if minutes >= 60 or value > most or len(head) > 5:
        raise Unfit("position that is none")
    return value


def _sign(name: str, letter: str, values: dict[str, float]) -> None:
    if letter not in ("N", "S", "E", "W"):
        raise Unfit("hemisphere that is none")
    if name in values and letter in ("S", "W"):
        values[name] = -values[name]


def _clock(text: str) -> int:
    found = TIME.fullmatch(text)
    try:
        return clock_of(int(found[1]), int(found[2]), int(found[3]), (found[4] or "").encode())  # type: ignore[index]
    except (TypeError, ValueError):
        raise Unfit("time that is none") from None


def _day(year: str, month: str, day: str, whole: bool) -> int:
    try:
        if not whole:
            raise ValueError
        full = int(year) + (0 if len(year) == 4 else 2000 if int(year) < 80 else 1900)
        return day_of(full, int(month), int(day))
    except ValueError:
        raise Unfit("date that is none") from None
