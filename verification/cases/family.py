"""What a family of cases is; the table of them is FAMILIES of this folder."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from cable_sim_ros.errors import CableSimError


class CaseError(CableSimError, ValueError):
    """A case file that cannot be taken; the text names file, key and consequence."""


class Output(NamedTuple):
    name: str
    unit: str
    tol_rel: float | None
    tol_abs: float | None


class Case(NamedTuple):
    id: str
    inputs: dict[str, Any]
    outputs: list[Output]
    idealisations: list[str]
    path: str

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number of the inputs. Raises CaseError naming file and key."""
        value = self.inputs.get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e30:
            raise CaseError(f"{self.path}: inputs.{key} = {value!r} is no finite number; the case was not run")
        return float(value)

    def numbers(self, keys: str) -> list[float]:
        """Several of them; keys: separated by spaces."""
        return [self.number(key) for key in keys.split()]

    @property
    def gravity(self) -> float:
        """Acceleration of gravity [m/s^2]."""
        return self.number("g", 9.81)

    def asked(self, pattern: str) -> list[tuple[str, re.Match]]:
        """Outputs whose whole name fits a regular expression, with the match."""
        return [(o.name, m) for o in self.outputs if (m := re.fullmatch(pattern, o.name))]

    def beginning(self, values: dict[str, Any]) -> dict[str, Any]:
        """Values of the outputs whose names begin with these words."""
        return {o.name: value for o in self.outputs for words, value in values.items() if o.name.startswith(words)}


class Level(NamedTuple):
    """How fine to solve: verification level k, or (tick given) the real-time setting."""

    k: int
    tick: float | None

    @property
    def realtime(self) -> bool:
        return self.tick is not None

    def mesh(self, elements: int) -> int:
        """Elements of a family's coarsest mesh at this level."""
        return elements << self.k

    def step(self, coarsest: float) -> float:
        """Step [s] at this level; in real time the shipped tick."""
        return self.tick if self.tick is not None else coarsest / (1 << self.k)


class Values(NamedTuple):
    """Answer of a family: values by output name (a number or a list), mesh, step [s] (0: statics), notes."""

    of: dict[str, Any]
    elements: int
    dt: float
    notes: list[str] = []


class Family(NamedTuple):
    name: str
    keys: frozenset[str]  # inputs that make a case one of the family
    how: str  # one line: what is built and what was chosen
    growth: float  # cost of a level over that before it
    solve: Callable[[Case, Level], Values]


def family(name: str, keys: str, how: str, growth: float = 4.0) -> Callable[[Callable[[Case, Level], Values]], Family]:
    """Make a Family of the decorated function, which solves one case at one level; keys: separated by spaces."""
    return lambda solve: Family(name, frozenset(keys.split()), how, growth, solve)
