"""The type of every number on the command line: finite, and in a range that is said where it is not kept."""

from __future__ import annotations

import math
from typing import Any

import click


class Number(click.FloatRange):
    """A finite number from ``minimum`` to ``maximum``; above: the least itself is refused; unit: as it stands in
    errors."""

    name = "number"

    def __init__(self, minimum: float, maximum: float, unit: str = "", *, above: bool = False):
        super().__init__(min=minimum, max=maximum, min_open=above)
        self.unit = f" {unit}" if unit else ""
        self.range = f"{'(' if above else '['}{minimum:g}, {maximum:g}]{self.unit}"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """In the help the unit stands for the number."""
        return self.unit.strip().upper() or None

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; a usage error, code 2, where it is none, not finite or out of range."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            self.fail(f"{value!r} is not a number; nothing was done. Give one in {self.range}", param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number; nothing was done. Give one in {self.range}", param, ctx)
        assert self.min is not None and self.max is not None
        if number > self.max or number < self.min or (self.min_open and number == self.min):
            self.fail(f"{number:g}{self.unit} is outside {self.range}; nothing was done", param, ctx)
        return number


class Count(click.IntRange):
    """A whole number from ``minimum`` to ``maximum``."""

    name = "count"

    def __init__(self, minimum: int, maximum: int):
        super().__init__(min=minimum, max=maximum)
        self.range = f"[{minimum}, {maximum}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number; a usage error, code 2, where it is none or out of range."""
        try:
            number = int(value)
        except (TypeError, ValueError):
            self.fail(f"{value!r} is not a whole number; nothing was done. Give one in {self.range}", param, ctx)
        assert self.min is not None and self.max is not None
        if not self.min <= number <= self.max:
            self.fail(f"{number} is outside {self.range}; nothing was done. Give one inside", param, ctx)
        return number
