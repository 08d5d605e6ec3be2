"""Stress tests on the terminal, as Markdown and as JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from .registry import Verdict, told

WORD = {True: "pass", False: "FAIL", None: "not measurable yet"}
HEAD = """# Stress tests

Made by `make stress` (`cable-sim stress`); how each is done stands in `cable_sim_ros/lab/stress/`. Limits are those of
the table, none is fitted to what was measured; a failure stays until its cause is gone. "Finite" means no NaN or Inf in
state or message, T0 is the static top tension.

"""


def print_verdicts(done: list[Verdict]) -> None:
    """One table of all figures, then the notes."""
    from rich.console import Console
    from rich.table import Table
    console = Console(width=None if sys.stdout.isatty() else 140)
    for v in done:
        table = Table(title=f"{v.id} {WORD[v.passed]}: {v.stimulus} ({v.cpu_s:.1f} CPU s)", title_justify="left")
        table.add_column("measured")
        table.add_column("value", justify="right")
        table.add_column("limit", justify="right")
        table.add_column("pass")
        for f in v.figures:
            table.add_row(f.name, f"{told(f.value)} {f.unit}".strip(), f.bound, "" if f.passed is None else
                          WORD[f.passed])
        console.print(table)
        for note in v.notes:
            console.print(f"  {note}", highlight=False, markup=False)


def markdown(done: list[Verdict], quick: bool) -> str:
    """The report: one row a test, one row a figure, notes."""
    lines = [HEAD]
    if quick:
        lines.append("Quick size: durations are shortened.\n\n")
    lines.append("| id | stimulus | pass | worst measured | limit | verdict |\n|---|---|---|---|---|---|\n")
    for v in done:
        worst = _worst(v)
        lines.append(f"| {v.id} | {v.stimulus} | {v.criterion} | "
                     + (f"{worst.name}: {told(worst.value)} {worst.unit}".strip() if worst else "")
                     + f" | {worst.bound if worst else ''} | {WORD[v.passed]} |\n")
    for v in done:
        lines.append(f"\n## {v.id}: {v.stimulus}\n\nPass: {v.criterion}. **{WORD[v.passed]}**, {v.cpu_s:.0f} CPU s.\n\n"
                     "| measured | value | limit | |\n|---|---|---|---|\n")
        lines += [f"| {f.name} | {told(f.value)} {f.unit} | {f.bound} | {'told' if f.passed is None else WORD[f.passed]} "
                  "|\n" for f in v.figures]
        if v.notes:
            lines.append("\n" + "".join(f"* {note}\n" for note in v.notes))
    return "".join(lines)


def _worst(v: Verdict):
    """The figure nearest to its limit, or the first beyond it."""
    failed = [f for f in v.figures if f.passed is False]
    if failed:
        return failed[0]

    def used(f) -> float:
        numbers = not isinstance(f.value, (bool, str)) and not isinstance(f.limit, (bool, str))
        return abs(f.value) / abs(f.limit) if numbers and f.limit and f.how != ">=" else 0.0
    judged = [f for f in v.figures if f.passed is not None]
    return max(judged, key=used, default=None)


def write(done: list[Verdict], quick: bool, page: Path | None, data: Path | None) -> None:
    """Markdown page and JSON file."""
    if page is not None:
        page.write_text(markdown(done, quick), "utf-8")
    if data is not None:
        data.parent.mkdir(parents=True, exist_ok=True)
        data.write_text(json.dumps({"quick": quick, "tests": [v.as_dict() for v in done]}, indent=1) + "\n", "utf-8")
