"""What a stress test is: stimulus, criterion, measured figures with their limits, verdict."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple

MAX, MIN, WITHIN, IS = "<=", ">=", "within", "=="


class Metric(NamedTuple):
    """One measured number and what it is held against. ``limit`` None: shown, not judged."""

    name: str
    value: float | str | bool | None
    unit: str = ""
    limit: float | str | bool | None = None
    how: str = MAX

    @property
    def passed(self) -> bool | None:
        """None where nothing is judged. A number that is not finite never passes."""
        if self.limit is None:
            return None
        if self.how == IS:
            return self.value == self.limit
        value = self.value
        if value is None or not math.isfinite(value):
            return False
        if self.how == WITHIN:
            return abs(value) <= self.limit
        return value <= self.limit if self.how == MAX else value >= self.limit

    @property
    def bound(self) -> str:
        """The limit as text."""
        if self.limit is None:
            return ""
        if self.how == IS:
            return as_text(self.limit)
        sign = {MAX: "<= ", MIN: ">= ", WITHIN: "+-"}[self.how]
        return f"{sign}{as_text(self.limit)}{' ' + self.unit if self.unit else ''}"


def holds(name: str, value) -> Metric:
    """What is to be true."""
    return Metric(name, value, "", True, IS)


def relative(name: str, value, want, limit: float | None) -> Metric:
    """How far a value is off what it should be, of that; of None, no value, likewise None."""
    return Metric(name, None if value is None else float(value / want - 1.0), "", limit, WITHIN)


def as_text(value) -> str:
    """A number in four digits, a truth as yes or no."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


class Verdict(NamedTuple):
    """What one stress test found."""

    id: str
    stimulus: str
    criterion: str
    metrics: list[Metric]
    passed: bool | None  # None: not measurable yet
    notes: list[str]
    cpu_s: float

    def as_dict(self) -> dict:
        """Plain data for JSON: measured {name: value}, limits {name: text}."""
        return {
            "id": self.id,
            "stimulus": self.stimulus,
            "criterion": self.criterion,
            "passed": self.passed,
            "measured": {f.name: _plain(f.value) for f in self.metrics},
            "units": {f.name: f.unit for f in self.metrics},
            "limits": {f.name: f.bound for f in self.metrics if f.limit is not None},
            "failed": [f.name for f in self.metrics if f.passed is False],
            "notes": self.notes,
            "cpu_s": round(self.cpu_s, 2),
        }


def _plain(value):
    """JSON has no NaN and no infinity: they are written as text."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value.item() if hasattr(value, "item") else value


class Found(NamedTuple):
    """What a test returns. ``missing``: why its figures cannot be measured yet, in place of a verdict."""

    metrics: list[Metric]
    notes: list[str] = []
    missing: str = ""


class Stress(NamedTuple):
    """A stress test; its number stands in the Tests of its folder."""

    stimulus: str
    criterion: str
    run: Callable[[bool], Found]


def stress(stimulus: str, criterion: str) -> Callable[[Callable[[bool], Found]], Stress]:
    """Make a Stress of the decorated ``run(quick) -> Found``."""
    return lambda run: Stress(stimulus, criterion, run)


def run_test(id: str, test: Stress, quick: bool = False) -> Verdict:
    """Run one test; an exception is a failure that is reported with its text."""
    begin = time.process_time()
    try:
        found = test.run(quick)
    except Exception as error:  # a stress test that breaks is a finding, and the others must go on
        found = Found([Metric("ran to its end", False, "", True, IS)], [f"{type(error).__name__}: {error}"])
    verdicts = [f.passed for f in found.metrics if f.passed is not None]
    passed = bool(verdicts) and all(verdicts)
    notes = list(found.notes)
    if found.missing:
        notes.append(f"not measurable yet: {found.missing}")
        passed = None if all(verdicts) else False
    return Verdict(id, test.stimulus, test.criterion, found.metrics, passed, notes, time.process_time() - begin)


class Tests(NamedTuple):
    """The tests of a package: by id the module and the name of each, which is loaded as it is run."""

    package: str
    named: dict[str, str]

    def load(self, id: str) -> Stress:
        """A test by its id. Raises KeyError."""
        module, _, name = self.named[id].partition(".")
        return getattr(import_module(f"{self.package}.{module}"), name)

    def run(self, ids: tuple[str, ...], quick: bool, progress: Callable = lambda *_: None) -> list[Verdict]:
        """Run the chosen tests (all where none are named), in their own order."""
        chosen = {id: self.load(id) for id in self.named if not ids or id in ids}
        verdicts = []
        for i, (id, test) in enumerate(chosen.items()):
            progress(f"{id} {test.stimulus}", i, len(chosen))
            verdicts.append(run_test(id, test, quick))
        return verdicts
