"""Runs verification cases given as plain numbers and holds their values against closed forms."""

from __future__ import annotations

from verification.cases import Case, Fidelity, run_case
from verification.cases.family import Output

BOTH = tuple(Fidelity)


def check(inputs: dict, expected: dict, fidelities=BOTH) -> None:
    """expected: {output: (value, relative tolerance, absolute tolerance)}, at every fidelity."""
    for fidelity in fidelities:
        case = Case(
            "a case",
            inputs,
            [Output(name, "", rel or None, size or None) for name, (_, rel, size) in expected.items()],
            [],
            "inline",
        )
        metrics = run_case(case, fidelity)
        got = {o["name"]: o["value"] for o in metrics.outputs}
        for name, (value, rel, size) in expected.items():
            assert got[name] is not None, (fidelity.value, name, metrics.notes)
            assert abs(got[name] - value) <= max(rel * abs(value), size), (fidelity.value, name, got[name], value)
