"""Units of logs: one table, by name, of what they measure and of their size in SI."""

from __future__ import annotations

import difflib
from math import pi
from typing import NamedTuple

POUND = 4.4482216152605  # N, pound-force
KILOGRAM = 9.80665  # N, kilogram-force; also m/s^2 in a g


class Unit(NamedTuple):
    """dimension: SI unit of what it measures; factor, offset: value in SI = factor * value + offset."""

    dimension: str
    factor: float
    offset: float = 0.0


FACTORS: dict[str, dict[str, float]] = {  # SI unit -> units of the same: SI units that one of it is
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048, "fathom": 1.8288, "nmi": 1852.0},
    "m/s": {
        "m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001, "m/min": 1.0 / 60.0, "ft/min": 0.3048 / 60.0, "ft/s": 0.3048,
        "km/h": 1.0 / 3.6, "kn": 1852.0 / 3600.0,
    },
    "rad": {"rad": 1.0, "deg": pi / 180.0},
    "rad/s": {"rad/s": 1.0, "deg/s": pi / 180.0, "deg/min": pi / 180.0 / 60.0},
    "m/s^2": {"m/s^2": 1.0, "cm/s^2": 0.01, "g": KILOGRAM},
    "N": {
        "N": 1.0, "daN": 10.0, "kN": 1000.0, "lb": POUND, "klb": 1000.0 * POUND, "kgf": KILOGRAM,
        "t": 1000.0 * KILOGRAM, "short_ton": 2000.0 * POUND,
    },
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "dbar": 1e4, "psi": POUND / 0.0254**2},
    "1": {"1": 1.0},
}  # fmt: skip
UNITS = {name: Unit(si, factor) for si, units in FACTORS.items() for name, factor in units.items()}

OTHER_NAMES = {  # as loggers and drivers write them
    "metre": "m", "meter": "m", "metres": "m", "meters": "m",
    "mps": "m/s", "m s-1": "m/s", "meters_per_second": "m/s",
    "m/m": "m/min", "mpm": "m/min", "fpm": "ft/min", "feet": "ft", "fathoms": "fathom",
    "kt": "kn", "kts": "kn", "knot": "kn", "knots": "kn", "kmh": "km/h", "km/hr": "km/h",
    "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad",
    "deg/sec": "deg/s", "°/s": "deg/s", "degrees/s": "deg/s", "rad/sec": "rad/s",
    "m/s2": "m/s^2", "m/s/s": "m/s^2", "m/s**2": "m/s^2", "gal": "cm/s^2",
    "newton": "N", "newtons": "N", "lbs": "lb", "lbf": "lb", "pounds": "lb", "kg": "kgf", "te": "t", "tf": "t",
    "tonne": "t", "tonnes": "t", "short ton": "short_ton", "short tons": "short_ton", "us ton": "short_ton",
    "decibar": "dbar", "dB": "dbar", "db": "dbar", "pascal": "Pa", "pa": "Pa",
}  # fmt: skip


AMBIGUOUS = {  # names that stand for several units
    name: "a ton is 1000 kg or 907.2 kg: give tonne, or short_ton. " for name in ("ton", "tons", "tonf", "tn")
}


def named(unit: str) -> str | None:
    """Name in UNITS of a unit however it is written; None where it is not known."""
    unit = unit.strip()
    for text in (unit, unit.lower()):
        if text in UNITS:
            return text
        if text in OTHER_NAMES:
            return OTHER_NAMES[text]
    return None


def nearest(unit: str, dimension: str) -> str:
    """What may be written in place of an unknown unit, for an error."""
    if hint := AMBIGUOUS.get(unit.strip().lower()):
        return f"{hint}Known for it: {', '.join(units_of(dimension))}"
    known = units_of(dimension)
    near = difflib.get_close_matches(
        unit, [*known, *(one for one, name in OTHER_NAMES.items() if name in known)], 1, 0.6
    )
    return (f"Did you mean {near[0]}? " if near else "") + f"Known for it: {', '.join(known)}"


def units_of(dimension: str) -> list[str]:
    """Units of a dimension, by name."""
    return list(FACTORS.get(dimension, ()))
