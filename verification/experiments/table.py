"""Experiments as data and on the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from math import ceil, isfinite, log10
from typing import Any

from cable_sim_ros.terminal import markdown_table, print_table

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
            r = max(kept, key=lambda row: abs(row.ours - row.measured) / row.allowed)
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
