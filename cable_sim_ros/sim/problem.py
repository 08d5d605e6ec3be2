"""What a check of a scene says."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from math import floor, log10
from typing import NamedTuple

from ..physics.parameter import Block

FAILED = {"<": "not below", "<=": "more than", ">": "not above", ">=": "less than"}  # by what was to hold
UNDIVIDED = {"at", "from", "of", "with"}  # first words of what a bound is, before which no comma stands
ROUND_OFF = 1e-9  # of a bound that may be reached


class Problem(NamedTuple):
    """What is wrong (or doubtful) with which key, and the way out. Value and bound of a limit stand in the text too."""

    key: str
    text: str
    remedy: str
    value: float | None = None
    bound: float | None = None
    unit: str = ""


class Limit(NamedTuple):
    """``value relation bound`` is to hold; bounds: what the bound is, a key or words; lead: around
    the value, a #, or before it."""

    key: str
    value: float
    relation: str
    bound: float
    unit: str = ""
    bounds: str = ""
    lead: str = "="

    def problems(self, why: str, remedy: str) -> list[Problem]:
        """The problem where it does not hold, with what follows and the way out; else none."""
        if holds(self.value, self.relation, self.bound):
            return []
        text = self.text(*apart(self.value, self.relation, self.bound), why)
        return [Problem(self.key, text, remedy, self.value, self.bound, self.unit)]

    def text(self, value: str, bound: str, why: str) -> str:
        """What is wrong, of both numbers as text."""
        unit = self.unit and f" {self.unit}"
        first, *more = self.bounds.split(" ", 1)
        comma = "" if first in UNDIVIDED else ","
        bound = (
            f"{first} = {bound}{unit}" if first and not more else f"{bound}{unit}{first and f'{comma} {self.bounds}'}"
        )
        lead = self.lead if "#" in self.lead else f"{self.lead} #"
        lead = lead.replace("#", f"{value}{unit}") + (" is" if lead == "= #" else ",")
        return f"{lead} {FAILED.get(self.relation, '…')} {bound}{why and f': {why}'}"


def holds(value: float, relation: str, bound: float) -> bool:
    """Is a value within its bound? One that may be reached is, but for round-off."""
    near = ROUND_OFF * abs(bound)
    return {"<": value < bound, "<=": value <= bound + near, ">": value > bound, ">=": value >= bound - near}[relation]


def apart(value: float, relation: str, bound: float) -> tuple[str, str]:
    """Both numbers as they were written or with four digits, and with as many more as show which is larger."""
    for digits in range(4, 17):
        formats = ("" if isinstance(x, int) else "g" if float(f"{x:g}") == x else f".{digits}g" for x in (value, bound))
        first, second = map(format, (value, bound), formats)
        if not holds(float(first), relation, float(second)):
            break
    return first, second


def rounded_down(x: float, digits: int = 1) -> float:
    """x > 0 rounded down to so many digits."""
    unit = 10.0 ** (floor(log10(x)) - digits + 1)
    return float(f"{floor(x / unit) * unit:.{digits}g}")


def changed(block: Block, names: Iterable[str] | None = None) -> list[str]:
    """Keys of a block that are not at their defaults, of those named or all."""
    fields = type(block).model_fields
    return [name for name in (fields if names is None else names) if getattr(block, name) != fields[name].default]


def idle(key: str, block: Block, names: Iterable[str], why: str, other: str = "") -> list[Problem]:
    """Keys of a block that are not at their defaults and act on nothing without what the other gives."""
    return [Problem(f"{key}.{name}", *without_effect(said(block, name), why, other)) for name in changed(block, names)]


def without_effect(value: str, why: str, other: str = "") -> tuple[str, str]:
    """Text and remedy of a key that acts on nothing."""
    return f"{value} has no effect: {why}".lstrip(), "Leave it out" + (other and f", or give {other}")


def said(block: Block, name: str) -> str:
    """Value and unit of a key, as a message shows them; "" of a block."""
    value, unit = getattr(block, name), type(block).model_fields[name].json_schema_extra["unit"]  # type: ignore
    if isinstance(value, Mapping | Block):
        return ""
    shown = f"{value:g}" if isinstance(value, float) else json.dumps(value).strip('"')
    return f"= {shown if len(shown) <= 60 else f'{shown:.57}...'} {'' if unit == '1' else unit}".rstrip()
