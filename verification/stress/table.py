"""The stress table: on the terminal and as Markdown."""

from __future__ import annotations

from rich.table import Table

from cable_sim_ros.terminal import plain_console

from .verdict import Verdict, as_text

WORD = {True: "pass", False: "MISS", None: "not measurable"}


def markdown(verdicts: list[Verdict]) -> str:
    """Two tables: one row a test, and one row a figure, those without a limit for information."""
    tests = [f"| {v.id} | {v.stimulus} | {v.criterion} | {WORD[v.passed]} | {v.cpu_s:.0f} |" for v in verdicts]
    rows = []
    for v in verdicts:
        for i, f in enumerate(v.metrics):
            unit = f" {f.unit}" if f.unit and f.limit is None else ""
            word = WORD[f.passed] if f.bound else ""
            cells = ("" if i else v.id, f.name, f"{as_text(f.value)}{unit}", f.bound, word)
            mark = "**" if f.passed is False else ""
            rows.append("| " + " | ".join(f"{mark}{c}{mark}" if c else "" for c in cells) + " |")
    return "\n".join(
        [
            "| id | stimulus | pass | verdict | CPU s |",
            "|---|---|---|---|---|",
            *tests,
            "",
            "| id | figure | measured | limit | verdict |",
            "|---|---|---|---|---|",
            *rows,
        ]
    )


def print_verdicts(verdicts: list[Verdict]) -> None:
    """One row a figure."""
    table = Table(title="Stability stress", title_justify="left")
    for name in ("id", "figure", "measured", "limit", "verdict"):
        table.add_column(name, justify="right" if name == "measured" else "left")
    for v in verdicts:
        for i, f in enumerate(f for f in v.metrics if f.limit is not None):
            table.add_row(v.id if not i else "", f.name, as_text(f.value), f.bound, WORD[f.passed])
    console = plain_console(150)
    console.print(table)
    for v in verdicts:
        for note in v.notes:
            console.print(f"{v.id}: {note}", highlight=False)
