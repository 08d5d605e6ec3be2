"""What a report is made of: sections of texts, tables and figures; and how its numbers are written."""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ...runs.summary import format_value

MOST = 1e9  # written without an exponent up to here
UNITS = {"1": "", "-": "", "deg": "°"}


@dataclass
class Table:
    """A table: caption, heads of its columns, rows of text; right: columns of numbers; names: of the rows, by which
    the figures of the JSON are found again; bad: numbers of the rows that are red, their state is a word in them."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: Sequence[int] = ()
    names: Sequence[str] = ()
    bad: Sequence[int] = ()
    kind: str = "table"


@dataclass
class Figure:
    """A drawing as SVG text, what it shows, and in words what a reader who does not see it would miss."""

    svg: str
    caption: str
    words: str
    kind: str = "figure"


@dataclass
class Picture:
    """A picture as PNG, with what it shows in words."""

    png: bytes
    caption: str
    kind: str = "picture"

    @property
    def uri(self) -> str:
        """The picture itself as an address: nothing is loaded."""
        return f"data:image/png;base64,{b64encode(self.png).decode('ascii')}"


@dataclass
class Text:
    """Sentences, a paragraph each; note: set apart."""

    lines: Sequence[str]
    note: bool = False
    kind: str = "text"


Part = Table | Figure | Picture | Text


@dataclass
class Section:
    """A part of the report with a title."""

    name: str
    title: str
    parts: list[Part] = field(default_factory=list)


class Card(NamedTuple):
    """A figure at the top of the report."""

    name: str
    label: str
    value: str
    unit: str


def unit(text: str) -> str:
    """A unit as it is printed: m^2 with a raised 2."""
    return UNITS.get(text, text.replace("^2", "²").replace("^3", "³"))


def number(value: Any, digits: int = 5) -> str:
    """A number in few digits, "-" where there is none; other things as text."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, str)):
        return str(value)
    if isinstance(value, float):
        text = f"{value + 0.0:.{digits}g}"
        return f"{float(text):.0f}" if 10.0**digits <= abs(value) < MOST else text
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {number(part, digits)}" for key, part in value.items()) or "none"
    if isinstance(value, Iterable):
        return ", ".join(number(part, digits) for part in value) or "none"
    return format_value(value)


def share(value: float) -> str:
    """A share in percent."""
    return f"{100.0 * value:.3g}\u00a0%"


def counted(count: int, one: str, many: str = "") -> str:
    """A number of things in words."""
    return f"{count} {one if count == 1 else many or one + 's'}"
