"""``cable-sim stress``, and what it shares with others: figures with a table beside them, verdicts as tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from cable_sim_ros.cli.options import Answer, answers, folder_option, progress_bar, ready
from cable_sim_ros.errors import CODE_FAILED, CODE_OK
from cable_sim_ros.files import write_text
from cable_sim_ros.terminal import markdown_table, print_table, say

from . import STRESS
from .verdict import Tests, Verdict, as_text

WORD = {True: "pass", False: "MISS", None: "not measurable"}
METRICS = ("id", "figure", "measured", "limit", "verdict")


def with_table(
    name: str, figures: Any, text: str, out: Path | None, tell: Callable[[], None] | None = None, code: int = CODE_OK
) -> Answer:
    """An Answer with ``name``.json and ``name``.md in its folder; tell None: the Markdown itself is printed."""
    tell = tell or (lambda: say(text, lines=True))
    if out is None:
        return Answer(figures, tell, code=code)
    table = out / f"{name}.md"
    write_text(table, text + "\n")
    return Answer(figures, tell, out / f"{name}.json", [("table", table)], code=code)


def command_of(name: str, tests: Tests, metavar: str, about: str) -> click.Command:
    """The command that runs these tests."""

    @click.command(name, help=about)
    @click.argument("ids", nargs=-1, type=click.Choice(list(tests.named), case_sensitive=False), metavar=metavar)
    @click.option("--quick", is_flag=True, help="Shorter runs; what was shortened is in the notes.")
    @folder_option("Folder for table and JSON.")
    @answers
    def command(ids: tuple[str, ...], quick: bool, out: Path | None) -> Answer:
        ready(out)
        with progress_bar() as progress:
            verdicts = tests.run(ids, quick, progress)
        figures = [verdict.as_dict() for verdict in verdicts]
        code = CODE_OK if all(verdict.passed for verdict in verdicts) else CODE_FAILED
        return with_table(name, figures, markdown(verdicts), out, lambda: show(name, verdicts), code=code)

    return command


def markdown(verdicts: list[Verdict]) -> str:
    """Two tables: one row a test, and one row a figure, those without a limit for information."""
    tests = [(v.id, v.stimulus, v.criterion, WORD[v.passed], f"{v.cpu_s:.0f}") for v in verdicts]
    rows = []
    for v in verdicts:
        for i, f in enumerate(v.metrics):
            unit = f" {f.unit}" if f.unit and f.limit is None else ""
            word = WORD[f.passed] if f.bound else ""
            cells = ("" if i else v.id, f.name, f"{as_text(f.value)}{unit}", f.bound, word)
            mark = "**" if f.passed is False else ""
            rows.append([f"{mark}{c}{mark}" if c else "" for c in cells])
    return "\n\n".join(
        [markdown_table([("id", "stimulus", "pass", "verdict", "CPU s"), *tests]), markdown_table([METRICS, *rows])]
    )


def show(name: str, verdicts: list[Verdict]) -> None:
    """One row a figure that is judged, then the notes."""
    rows = []
    for v in verdicts:
        for i, f in enumerate(f for f in v.metrics if f.limit is not None):
            rows.append((v.id if not i else "", f.name, as_text(f.value), f.bound, WORD[f.passed]))
    print_table(f"cable-sim {name}", METRICS, rows, left={*METRICS} - {"measured"}, width=150)
    for v in verdicts:
        for note in v.notes:
            say(f"{v.id}: {note}")


stress = command_of(
    "stress",
    STRESS,
    "[N1 ... N28, I10 ... I16, S1 ... S3]",
    "Stability stress (default: all): measured against the limits. Leaves with code 1 where one is missed.",
)
