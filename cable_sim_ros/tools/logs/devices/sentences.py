"""Fields of NMEA 0183 sentences as numbers: standard ones by the table of pynmeagps, proprietary ones by the one here.

Numbers are as the sentence has them. Latitude, longitude, deviation and variation take the sign of the letter behind
them (north and east positive), PHTRO the signs of its; a status letter is 1 where it says valid, 0 where it says not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache, lru_cache
from importlib import import_module
from typing import NamedTuple

from ..log import SECOND, clock_of, day_of
from .wave_buoy import WAVE_BUOY, Unfit

MOST_COLUMNS = 64  # of a source whose sentences name or number their own fields
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,2})?")
TIME = re.compile(r"(\d\d)(\d\d)(\d\d)(?:\.(\d{1,9})\d*|(\d{1,3}))?")  # also hhmmssfff, without the point
IDENTITY = re.compile(r"P[A-Z0-9]{2,7}|[A-Z][A-Z0-9][A-Z0-9]{3}|TSP[A-Z]{2}|RC[A-Z]{2}")  # RC: Rapp, behind @
LETTER = re.compile(r"[A-Z]")


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
    letters: tuple[str, ...] = ()  # of a sentence that is not known: places and letters beside its numbers


QUALITY = {"horizontal_quality": "", "height_quality": "", "heading_quality": "", "roll_pitch_quality": ""}
SIGNS = {"M": 1.0, "P": -1.0, "T": 1.0, "B": -1.0}  # bow up and down, port side up and down
VALID = set("ATNMO")  # valid, normal, warnings; not V, E, I, nor the alarms L, P
# source -> field and unit, "" for none; in front of it "-": text, "!": a letter of VALID, "~": the sign of that field
PROPRIETARY: dict[str, dict[str, str]] = {
    "PSXN,20": QUALITY,  # Kongsberg Seapath: 0 normal, 1 reduced, 2 invalid
    "PSXN,22": {"gyro_calibration": "deg", "gyro_offset": "deg"},
    "PSXN,23": {"roll": "deg", "pitch": "deg", "heading": "deg", "heave": "m"},  # heave positive down
    "PSXN,24": {"roll_rate": "deg/s", "pitch_rate": "deg/s", "yaw_rate": "deg/s", "vertical_velocity": "m/s"},
    "PASHR": {
        "-time": "", "heading": "deg", "-true": "", "roll": "deg", "pitch": "deg", "heave": "m", "roll_accuracy": "deg",
        "pitch_accuracy": "deg", "heading_accuracy": "deg", "aiding": "", "imu": "",
    },  # as io/telegrams/pashr tells
    "PRDID": {"pitch": "deg", "roll": "deg", "heading": "deg"},  # Teledyne RDI
    "PASHR,ATT": {
        "seconds_of_week": "s", "heading": "deg", "pitch": "deg", "roll": "deg", "carrier_error": "m",
        "baseline_error": "m", "reset": "",
    },  # Ashtech ADU: reset 1 where the attitude is rough
    "PHTRO": {"pitch": "deg", "~pitch": "", "roll": "deg", "~roll": ""},  # iXblue: bow up M, down P; port up T, down B
    "PHOCT": {
        "version": "", "-time": "", "!time_valid": "", "latency": "", "heading": "deg", "!heading_valid": "",
        "roll": "deg", "!roll_valid": "", "pitch": "deg", "!pitch_valid": "", "heave": "m", "!motion_valid": "",
        "heave_at_arm": "m", "surge": "m", "sway": "m", "heave_rate": "m/s", "surge_rate": "m/s", "sway_rate": "m/s",
        "heading_rate": "",
    },  # iXblue: roll port side up, pitch bow down, heave up, sway to port
    "PHLIN": {"surge": "m", "sway": "m", "heave": "m"},  # iXblue: forward, to port, up
    "PTNTHPR": {
        "heading": "deg", "!heading_valid": "", "pitch": "deg", "!pitch_valid": "", "roll": "deg", "!roll_valid": "",
    },  # True North: letters of alarm are not valid
    "PFEC,GPatt": {"heading": "deg", "pitch": "deg", "roll": "deg"},  # Furuno
    "PFEC,GPhve": {"heave": "m", "!valid": ""},
}  # fmt: skip
FEWEST = {"PASHR": 0, "PTNTHPR": 5, "PFEC,GPhve": 1}  # fields that such sentences have at least, where not all
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
        year, month, date = (f"{values.pop(key):.0f}" for key in ("year", "month", "day"))
        day = _day(year, month, date, True)
        values["time_of_day"] = time / SECOND
    if {"lat", "lon"} & values.keys() and not {"NS", "EW"} <= {n for n, t in zip(names, fields) if t}:
        raise Unfit("position without its hemisphere")
    units = _units(tuple(values))
    clock = None if time is None else Clock(time if day is None else day + time, day is not None)
    return Sentence(identity, values, units, clock) if values else None


@lru_cache(maxsize=256)
def _units(names: tuple[str, ...]) -> Mapping[str, str]:
    return {name: UNITS[name] for name in names if name in UNITS}


@cache
def _proprietary_units(source: str) -> Mapping[str, str]:
    return {name: unit for name, unit in PROPRIETARY[source].items() if unit}


def _proprietary(identity: str, fields: list[str]) -> Sentence | None:
    name, rest = identity, fields
    if fields and (identity in KINDS or f"{identity},{fields[0]}" in PROPRIETARY):
        name, rest = f"{identity},{fields[0]}", fields[1:]
    names = PROPRIETARY.get(name)
    if names is None or (name == "PASHR" and not TIME.fullmatch(fields[0] if fields else "")):
        if fields and fields[0].isalpha() and name == identity and len(fields[0]) <= 8:
            name, rest = f"{identity},{fields[0]}", fields[1:]  # such as PASHR,POS
        return _numbered(name, rest)
    if len(rest) < FEWEST.get(name, len(names)):
        raise Unfit("sentence with too few fields")
    values: dict[str, float] = {}
    clock = None
    for key, text in zip(names, rest):
        mark, field = key[0], key[1:]
        if mark == "~" and field in values:
            if text not in SIGNS:
                raise Unfit("number without the letter of its sign")
            values[field] *= SIGNS[text]
        elif key == "-time":
            clock = Clock(_clock(text), False) if text else None
        elif mark == "!" and text:
            values[field] = float(text in VALID)
        elif text and mark.isalpha():
            values[key] = number(text)
    if not values.get("time_valid", 1.0):
        clock = None
    return Sentence(name, values, _proprietary_units(name), clock) if values else None


def by_place(source: str, name: str) -> str:
    """Field of a known sentence that a mapping names by its place, as `field_03`; the name where it is none."""
    names = list(PROPRIETARY.get(source.rpartition("/")[2], ()))
    place = int(name[6:]) if name.startswith("field_") and name[6:].isdecimal() else 0
    return names[place - 1] if 0 < place <= len(names) else name


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
    letters = tuple(
        f"field_{k + 1:02d} {text}" for k, text in enumerate(fields[:MOST_COLUMNS]) if LETTER.fullmatch(text)
    )
    return Sentence(name, values, {}, None, letters) if values else None


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
        hours, minutes, seconds, fraction, more = found.groups()  # type: ignore[union-attr]
        return clock_of(int(hours), int(minutes), int(seconds), (fraction or more or "").encode())
    except (AttributeError, ValueError):
        raise Unfit("time that is none") from None


def _day(year: str, month: str, day: str, whole: bool) -> int:
    try:
        if not whole:
            raise ValueError
        full = int(year) + (0 if len(year) == 4 else 2000 if int(year) < 80 else 1900)
        return day_of(full, int(month), int(day))
    except ValueError:
        raise Unfit("date that is none") from None
