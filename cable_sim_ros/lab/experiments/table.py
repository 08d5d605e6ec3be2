"""Experiments as data and on the terminal."""

from __future__ import annotations

import sys
from typing import Any

from rich.console import Console
from rich.table import Table

from . import Result


def columns_of(result: Result) -> list[str]:
    """What choosing otherwise changes."""
    return [name for name in result.choices[0] if name != "choice"] if result.choices else []


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
    columns = columns_of(result)
    choices = ["| " + " | ".join((c["choice"], *(f"{c[k]:+.2f}" for k in columns))) + " |" for c in result.choices]
    return "\n".join(
        [
            "| figure | unit | measured | ours | allowed | who |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            "| chosen otherwise | " + " | ".join(columns) + " |",
            "|---" * (1 + len(columns)) + "|",
            *choices,
        ]
    )


def print_result(result: Result) -> None:
    """Comparison and choices."""
    console = Console(width=None if sys.stdout.isatty() else 120)
    table = Table(title=result.experiment, title_justify="left")
    for name in ("figure", "unit", "printed", "ours", "allowed", "who"):
        table.add_column(name, justify="right" if name in ("printed", "ours", "allowed") else "left")
    for r in result.rows:
        table.add_row(
            r.name, r.unit, *("-" if x is None else f"{x:.4g}" for x in (r.measured, r.ours, r.allowed)), r.source
        )
    console.print(table)
    other = Table(title="chosen otherwise: what changes", title_justify="left")
    other.add_column("choice")
    columns = columns_of(result)
    for name in columns:
        other.add_column(name, justify="right")
    for c in result.choices:
        other.add_row(c["choice"], *(f"{c[name]:+.2f}" for name in columns))
    console.print(other)
