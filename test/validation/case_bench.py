"""Runs verification cases given as plain numbers and holds their values against closed forms."""

from __future__ import annotations

from verification.cases import Case, Fidelity, run_case
from verification.cases.family import Output


def case_of(inputs: dict, expected: dict) -> Case:
    """A case with the outputs of ``expected``, see compare(), whose values may be left out."""
    outputs = [Output(name, "", rel or None, size or None) for name, (*_, rel, size) in expected.items()]
    return Case("a case", inputs, outputs, [], "inline")


def values(case: Case, fidelity: Fidelity) -> dict:
    metrics = run_case(case, fidelity)
    print(fidelity.value, metrics.notes)
    return {o["name"]: o["value"] for o in metrics.outputs}


def within(meant: dict, tolerances: dict) -> dict:
    """What compare() expects, of values and of their two tolerances."""
    return {name: (meant[name], *tolerance) for name, tolerance in tolerances.items()}


def compare(got: dict, expected: dict) -> None:
    """expected: {output: (value, relative tolerance, absolute tolerance)}, 0: none."""
    for name, (value, rel, size) in expected.items():
        assert got[name] is not None, name
        assert abs(got[name] - value) <= max(rel * abs(value), size), (name, got[name], value)


def check(inputs: dict, expected: dict) -> None:
    """Compare at every fidelity."""
    case = case_of(inputs, expected)
    for fidelity in Fidelity:
        compare(values(case, fidelity), expected)
