"""A scenario of faults: a YAML file of what goes wrong when, in the words of hardware-in-the-loop testing at sea."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ...limits import LONGEST_RUN
from ...physics.parameter import REQUIRED, Block, choice, quantity
from ...physics.sensor_models import TARGETS, FaultKind
from ...sim.problem import Problem
from .document import Document, SceneError
from .live_changes import Change

EXAMPLE = "scenario: heave lost"


class FaultError(SceneError):
    """A scenario that cannot be used; every problem in one text each."""


class FaultCase(Block):
    at: float = quantity(REQUIRED, "s", 0.0, LONGEST_RUN, "from the start of the run on")
    until: float | None = quantity(None, "s", 0.0, LONGEST_RUN, "when it is mended; none: never")
    target: str = choice(REQUIRED, "what it is of, docs/instruments.md")
    kind: FaultKind = choice(REQUIRED, "what is wrong, docs/instruments.md")
    size: float = quantity(0.0, "1", -1e7, 1e7, "how much, docs/instruments.md")
    function: str = choice("", "function under test, in your words")
    expected: str = choice("", "what the system under test is to do, in your words")


class FaultPlan(Block):
    scenario: str = choice(REQUIRED, "name of the scenario")
    faults: dict[str, FaultCase] = choice(REQUIRED, "failure modes by name")


def _problems(plan: FaultPlan) -> Iterator[Problem]:
    ends = dict.fromkeys(TARGETS, (0.0, ""))
    if not plan.faults:
        yield Problem("faults", "has no failure mode: nothing would go wrong", "Give one, docs/instruments.md")
    for name, case in sorted(plan.faults.items(), key=lambda item: item[1].at):
        key = f"faults.{name}"
        if case.target not in TARGETS:
            text = f"= {case.target!r:.40} is nothing that can fail"
            yield Problem(f"{key}.target", text, f"Give one of {', '.join(TARGETS)}")
            continue
        if case.kind is FaultKind.NONE:
            text = "= none is no fault: `until` mends one"
            yield Problem(f"{key}.kind", text, "Give what is wrong, or leave the case out")
        if case.until is not None and case.until <= case.at:
            text = f"= {case.until:g} s is not after at = {case.at:g} s: the fault would never be there"
            yield Problem(f"{key}.until", text, "Give a later time, or leave it out")
        end, other = ends[case.target]
        if case.at < end:
            text = f"= {case.at:g} s is before {other} is mended, {end:g} s: {case.target} has one fault at a time"
            yield Problem(f"{key}.at", text, "Give a later time, or an earlier until there")
        ends[case.target] = (LONGEST_RUN if case.until is None else case.until, f"faults.{name}")


PLANS = Document(FaultPlan, "a scenario of faults", "scenario", EXAMPLE, Path, list, _problems, error=FaultError)
load_faults = PLANS.load  # of a YAML file; FaultError with every problem of the file


def timed(plan: FaultPlan) -> list[Change]:
    """Live keys that a scenario changes, in order of time."""
    rows = []
    for name, case in plan.faults.items():
        key, where = f"faults.{case.target}", f"scenario {plan.scenario}, {name}"
        rows.append(Change(case.at, f"{key}.size", case.size, where))
        rows.append(Change(case.at, f"{key}.kind", case.kind.value, where))
        if case.until is not None:
            rows.append(Change(case.until, f"{key}.kind", FaultKind.NONE.value, where))
    return sorted(rows, key=lambda row: (row.time, row.value != FaultKind.NONE.value))
