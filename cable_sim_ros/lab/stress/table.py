"""The stress table: on the terminal and in docs/stress.md."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table

from .registry import Verdict, told

WORD = {True: "pass", False: "MISS", None: "not measurable"}


def _figures(v: Verdict) -> list[str]:
    """Judged figures as text; the failed ones first."""
    judged = sorted((f for f in v.figures if f.limit is not None), key=lambda f: f.passed is not False)
    return [
        f"{'**' if f.passed is False else ''}{f.name}: {told(f.value)} ({f.bound}){'**' if f.passed is False else ''}"
        for f in judged
    ]


def markdown(verdicts: list[Verdict]) -> str:
    """Rows of docs/stress.md."""
    rows = [
        f"| {v.id} | {v.stimulus} | {'; '.join(_figures(v))} | {WORD[v.passed]} | {v.cpu_s:.0f} |" for v in verdicts
    ]
    return "\n".join(["| id | stimulus | measured (limit) | verdict | CPU s |", "|---|---|---|---|---|", *rows])


def print_verdicts(verdicts: list[Verdict]) -> None:
    """One row a figure."""
    table = Table(title="Stability stress", title_justify="left")
    for name in ("id", "figure", "measured", "limit", "verdict"):
        table.add_column(name, justify="right" if name == "measured" else "left")
    for v in verdicts:
        for i, f in enumerate(f for f in v.figures if f.limit is not None):
            table.add_row(v.id if not i else "", f.name, told(f.value), f.bound, WORD[f.passed])
    console = Console(width=None if sys.stdout.isatty() else 150)
    console.print(table)
    for v in verdicts:
        for note in v.notes:
            console.print(f"{v.id}: {note}", highlight=False)
