"""What a check of a scene says."""

from __future__ import annotations

from math import floor, log10
from typing import NamedTuple


class Problem(NamedTuple):
    """What is wrong (or doubtful) with which key, and the way out. ``number`` and ``threshold`` stand in the text."""

    key: str
    text: str
    remedy: str


def apart(value: float, bound: float, digits: int = 3) -> tuple[str, str]:
    """Both numbers as text with so many digits, and as many more as it takes to tell them apart."""
    for count in range(digits, 17):
        first, second = f"{value:.{count}g}", f"{bound:.{count}g}"
        if first != second:
            break
    return first, second


def one_digit(x: float) -> float:
    """x > 0 rounded down to one digit."""
    decade = 10.0 ** floor(log10(x))
    return float(f"{floor(x / decade) * decade:.0e}")
