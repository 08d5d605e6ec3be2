"""Experiments as data and on the terminal."""

from __future__ import annotations

import sys
from typing import Any

from rich.console import Console
from rich.table import Table

from . import Result


def columns_of(result: Result) -> list[str]:
    """What the choices of an experiment change."""
    return [name for name in result.choices[0] if name != "choice"]


def as_data(result: Result) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {"experiment": result.experiment, "rows": [row._asdict() for row in result.rows], "choices": result.choices}


def markdown(result: Result) -> str:
    """Both tables for docs/validation.md."""

    def text(x):
        return "-" if x is None else f"{x:.4g}"

    rows = [
        f"| {r.name} | {r.unit} | {text(r.measured)} | {text(r.ours)} | {text(r.allowed)} | {r.source} |"
        for r in result.rows
    ]
    choices = [
        "| " + " | ".join((c["choice"], *(f"{c[k]:+.2f}" for k in columns_of(result)))) + " |" for c in result.choices
    ]
    return "\n".join(
        [
            "| figure | unit | measured | ours | allowed | who |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            "| chosen otherwise | " + " | ".join(columns_of(result)) + " |",
            "|---|" + "---|" * len(columns_of(result)),
            *choices,
        ]
    )


def print_result(result: Result) -> None:
    """Comparison and choices."""
    console = Console(width=None if sys.stdout.isatty() else 120)
    table = Table(title=result.experiment, title_justify="left")
    for name in ("figure", "unit", "measured", "ours", "allowed", "who"):
        table.add_column(name, justify="right" if name in ("measured", "ours", "allowed") else "left")
    for r in result.rows:
        table.add_row(
            r.name, r.unit, *("-" if x is None else f"{x:.4g}" for x in (r.measured, r.ours, r.allowed)), r.source
        )
    console.print(table)
    other = Table(title="chosen otherwise: what changes (pulley: of configuration 1)", title_justify="left")
    other.add_column("choice")
    for name in columns_of(result):
        other.add_column(name, justify="right")
    for c in result.choices:
        other.add_row(c["choice"], *(f"{c[name]:+.2f}" for name in columns_of(result)))
    console.print(other)
