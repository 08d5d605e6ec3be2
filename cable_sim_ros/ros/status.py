"""One task of /diagnostics, and numbers in its text."""

from __future__ import annotations

import math
from typing import NamedTuple

OK, WARN, ERROR = 0, 1, 2


class Status(NamedTuple):
    """One task: name, level, a sentence, and figures as text."""

    name: str
    level: int
    message: str
    values: dict[str, str]


def text_of(number: float) -> str:
    """Three decimals; "-" where there is no number."""
    return "-" if math.isnan(number) else f"{number:.3f}"
