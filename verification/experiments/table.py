"""Experiments as data, on the terminal, and as one HTML file that prints: misses red, the picture of each."""

from __future__ import annotations

import tempfile
import textwrap
from collections.abc import Iterable, Sequence
from math import ceil, isfinite, log10
from pathlib import Path
from typing import Any

from cable_sim_ros.sim.flag_rules import FAILED, OK
from cable_sim_ros.terminal import markdown_table, print_table
from cable_sim_ros.tools.report.subject import Card, Picture, Section, Table, Text, counted, typed, unit
from cable_sim_ros.tools.report.write import write_page

from . import KEPT, MISSED, OPEN, Comparison, Result, module_of, verdict_of

NUMBERS = ("measured", "their simulation", "ours", "difference", "allowed")  # measured: or printed, of a computation
COLUMNS = ("figure", "unit", *NUMBERS, "verdict", "who", "why apart")


def as_data(result: Result) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "experiment": result.experiment,
        "rows": [row._asdict() for row in result.rows],
        "choices": result.choices,
        "shortened": result.shortened,
    }


def text(x: float | None, row: Comparison | None = None) -> str:
    """A figure with four digits; one of ``row`` with those that what it allows asks for."""
    if x is None:
        return "-"
    if row is None or not row.allowed or not isfinite(x):
        return f"{x:.4g}"
    return f"{x:.{max(4, ceil(log10(max(abs(x), row.allowed) / row.allowed)) + 2)}g}"


def columns(result: Result, difference: bool = False) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Heads and cells of the comparison; the source's simulation, verdicts and reasons only where there are any.

    difference: also how far ours is off the measured one.
    """
    rows = [
        (
            r.name,
            r.unit,
            text(r.measured, r),
            text(r.simulated, r),
            text(r.ours, r),
            text(None if r.measured is None else r.ours - r.measured),
            text(r.allowed),
            "-" if verdict_of(r) == OPEN else verdict_of(r),
            r.source,
            r.why,
        )
        for r in result.rows
    ]
    optional = {
        "difference": difference,
        "their simulation": any(r.simulated is not None for r in result.rows),
        "verdict": any(verdict_of(r) != OPEN for r in result.rows),
        "why apart": any(r.why for r in result.rows),
    }
    kept = [k for k, name in enumerate(COLUMNS) if optional.get(name, True)]
    return tuple(COLUMNS[k] for k in kept), [tuple(row[k] for k in kept) for row in rows]


def choices(result: Result) -> list[tuple[str, ...]]:
    """A line a choice, the first is the head."""
    names = [name for name in result.choices[0] if name != "choice"]
    return [
        ("chosen otherwise", *names),
        *((c["choice"], *(f"{c[name]:+.2f}" for name in names)) for c in result.choices),
    ]


def markdown(result: Result) -> str:
    """Both tables for the documentation."""
    heads, rows = columns(result)
    parts = [markdown_table([heads, *rows])]
    if result.choices:
        parts += [f"{result.chosen[0].upper()}{result.chosen[1:]}:", markdown_table(choices(result))]
    return "\n\n".join(parts)


MEANT = """`measured` is what the source measured or printed, `their simulation` what its own model gave,
`allowed` the largest difference that it reports for its own model. In `drive` `measured` is a
closed form, and `allowed` a share of it. `-`: nobody measured it, or nobody says what is allowed."""
NEAREST = ("who says so", "within", "missed", "nearest to its limit", "unit", "measured", "ours", "allowed")


def page(results: Iterable[Result]) -> str:
    """``validate.md``: the tables of every experiment."""
    parts = ["# Experiments: every figure", f"Made by `cable-sim validate --out DIR` as `DIR/validate.md`.\n{MEANT}"]
    for result in results:
        parts += _heading(result)
        parts += result.tables() if result.tables else [markdown(result)]
    return "\n\n".join(parts)


def digest(results: Iterable[Result]) -> str:
    """docs/experiments.md: of every experiment what each source says, all that is missed, and what stays unjudged."""
    parts = [
        "# Experiments: what is kept and what is missed",
        "Made by `cable-sim validate --out DIR` as `DIR/experiments.md`; do not edit. Every row, and\n"
        f"what other choices change: `DIR/validate.md`.\n\n{MEANT}",
    ]
    for result in results:
        states = [verdict_of(row) for row in result.rows]
        counts = ", ".join(f"{states.count(state)} {word}" for state, word in WORDS.items() if state in states)
        about = " ".join((module_of(result.experiment).__doc__ or "").partition("\n\n")[0].split())
        parts += [*_heading(result), textwrap.fill(f"{about} Figures: {counts}.", 100)]
        parts += _nearest(result)
        for rows in (
            [row for row in result.rows if verdict_of(row) == MISSED],
            [row for row in result.rows if verdict_of(row) == OPEN and row.measured is not None and row.why],
        ):
            if rows:
                parts.append(markdown(result._replace(rows=rows, choices=[])))
        parts += result.shown() if result.shown else []
    return "\n\n".join(parts)


WORDS = {KEPT: "within what is allowed", MISSED: "missed", OPEN: "not judged"}


def _heading(result: Result) -> list[str]:
    shortened = [f"Shortened by `--quick`: {result.shortened}."] if result.shortened else []
    return [f"## {result.experiment}", *shortened]


def _nearest(result: Result) -> list[str]:
    """A row for each source that judges: how many figures are kept, and the one nearest to its limit."""
    judged: dict[str, list[Comparison]] = {}
    for row in result.rows:
        if verdict_of(row) != OPEN:
            judged.setdefault(row.source, []).append(row)
    lines = []
    for source, rows in judged.items():
        kept = [row for row in rows if verdict_of(row) == KEPT]
        cells = [source, str(len(kept)), str(len(rows) - len(kept))]
        if kept:
            r = max(kept, key=lambda row: abs(row.ours - row.measured) / row.allowed if row.allowed else 0.0)
            cells += [r.name, r.unit, text(r.measured, r), text(r.ours, r), text(r.allowed)]
        else:
            cells += ["-"] * 5
        lines.append(cells)
    return [markdown_table([NEAREST, *lines])] if lines else []


def print_result(result: Result) -> None:
    """Comparison and choices."""
    heads, rows = columns(result)
    title = f"{result.experiment}, shortened: {result.shortened}" if result.shortened else result.experiment
    print_table(title, heads, rows, left={*heads} - {*NUMBERS})
    if result.choices:
        head, *lines = choices(result)
        print_table(result.chosen, head, lines, left=head[:1])


def write_report(results: Sequence[Result], path: Path, command: Sequence[str] = ()) -> Path:
    """Write the report of experiments that ran and return its path. Raises ReportError."""
    states = [verdict_of(row) for result in results for row in result.rows]
    judged, missed = len(states) - states.count(OPEN), states.count(MISSED)
    count = counted(len(results), "experiment")
    said = f"{missed} of {judged} figures miss what is allowed; they are red below" if missed else "every figure is"
    sentence = f"{count}: {said}{'' if missed else f' within what is allowed ({judged} of them judged)'}."
    if not judged:
        sentence = f"{count}: no source allows a difference, so that no figure is judged."
    words = typed(command)
    cards = [
        Card("experiments", "experiments", str(len(results)), ""),
        Card("within", "figures within what is allowed", str(states.count(KEPT)), ""),
        Card("missed", "figures that miss it", str(missed), ""),
        Card("open", "figures that nobody judges", str(states.count(OPEN)), ""),
    ]
    about = [
        "Measured: what the source measured or printed; of a closed form its value. Ours: what this program gives for "
        "the same experiment. Allowed: the largest difference that the source reports of its own simulation, so that "
        "within means at least as near to the measurement as the source came; of a formula a share of its value."
    ]
    if words:
        about.append(f"Command: cable-sim {words}")
    overview = Section("overview", "Every experiment", [Text(about), _overview(results)])
    return write_page(
        path,
        title="Validation: experiments of the sources",
        line=f"repetition of {count} from publications, by the product's own cable, water and winch",
        state=FAILED if missed else OK,
        sentence=sentence,
        beside=[],
        cards=cards,
        sections=[overview, *(_section(result) for result in results)],
    )


def _overview(results: Sequence[Result]) -> Table:
    rows, bad = [], []
    for k, result in enumerate(results):
        states = [verdict_of(row) for row in result.rows]
        if MISSED in states:
            bad.append(k)
        counts = (str(states.count(state)) for state in (KEPT, MISSED, OPEN))
        rows.append((result.experiment, str(len(states)), *counts))
    head = ("experiment", "figures", "within", "missed", "not judged")
    return Table("Figures by experiment", head, rows, right=(1, 2, 3, 4), bad=bad)


def _section(result: Result) -> Section:
    """Picture, table and choices of an experiment."""
    head, cells = columns(result, difference=True)
    rows = [(name, unit(of), *rest) for name, of, *rest in cells]
    right = [k for k, name in enumerate(head) if name in NUMBERS]
    bad = [k for k, row in enumerate(result.rows) if verdict_of(row) == MISSED]
    found = Section(result.experiment, f"Experiment {result.experiment}")
    if result.shortened:
        found.parts.append(Text([f"Shortened by --quick: {result.shortened}."]))
    with tempfile.TemporaryDirectory(prefix="cable_sim_plot_") as folder:
        drawn = result.plot(Path(folder))
        if drawn.suffix == ".png":
            found.parts.append(Picture(drawn.read_bytes(), f"Picture of the experiment {result.experiment}"))
    found.parts.append(Table("Measured beside ours", head, rows, right=right, bad=bad))
    if result.choices:
        names, *lines = choices(result)
        title = f"{result.chosen[0].upper()}{result.chosen[1:]}"
        found.parts.append(Table(title, names, lines, right=range(1, len(names))))
    return found
