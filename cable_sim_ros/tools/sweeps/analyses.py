"""`cable-sim envelope` and `cable-sim sensitivity`: what the rows of a sweep say together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ...cli.answer import Answer, answers
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK
from ...sim.flag_rules import OK
from ...terminal import say
from .command import engine, of_a_file, place_of, replaced_by, replacing, reported, summary, tell_notes, tell_rows

if TYPE_CHECKING:
    from .sweep import Swept


@click.command()
@of_a_file
@answers
def envelope(file, out, workers, cluster, report) -> Answer:
    """Operating envelope of the sweep FILE: extremes of every cell over its seeds, and the rules it breaks."""
    from ..report.parts import Table
    from . import envelope as cells_of
    from .sweep import sweep
    from .sweep_file import load_sweep

    plan = load_sweep(file)
    cells_of.refuse_others(plan, str(file))
    folder = out or place_of(plan)
    with engine(folder, cluster, workers) as how:
        swept = sweep(plan, folder, **how)
    cells = cells_of.envelope(swept)
    figures = {
        "sweep": plan.sweep,
        "runs": len(swept.rows),
        "computed": swept.computed,
        "workers": swept.workers,
        "wall_s": swept.wall,
        "cpu_s": sum(row["cpu_s"] for row in swept.rows),
        "simulated_s": sum(row["simulated_s"] for row in swept.rows),
        **_rows(summary(swept)),
        "notes": cells_of.notes_of(cells),
        "doubts": cells_of.doubts_of(cells),
        "replaced": replaced_by(plan, folder / "envelope.json"),
        "cells": [cells_of.as_dict(cell) for cell in cells],
    }
    replaced = replacing(figures, folder)
    picture = cells_of.draw(plan.sweep, cells, folder / "envelope.png")
    found, notes = Table(cells_of.CAPTION, *cells_of.rows_of(cells)), [*figures["notes"], *replaced]
    reported(report, swept, kind="envelope", tables=[found], notes=notes, doubts=figures["doubts"])

    def tell() -> None:
        cells_of.tell(swept, cells)
        tell_notes(replaced)
        for text in figures["doubts"]:
            say(f"doubtful: {text}", err=True)
        tell_rows(figures)

    return Answer(figures, tell, folder / "envelope.json", [("picture", picture)], code=_code(swept, figures))


@click.command()
@of_a_file
@answers
def sensitivity(file, out, workers, cluster, report) -> Answer:
    """Sobol indices of the ranges of the sweep FILE for each of its figures, with 95 % intervals."""
    from ..report.parts import Table
    from . import sensitivity as indices
    from .sweep_file import load_sweep

    plan = load_sweep(file)
    folder = out or place_of(plan)
    with engine(folder, cluster, workers) as how:
        found = indices.sensitivity(plan, folder, **how)
    assert plan.samples is not None
    figures = {
        "sweep": plan.sweep,
        "runs": len(found.swept.rows),
        "computed": found.swept.computed,
        "cpu_s": sum(row["cpu_s"] for row in found.swept.rows),
        **_rows(summary(found.swept)),
        "doubts": found.doubts,
        "replaced": replaced_by(plan, folder / "sensitivity.json"),
        "ranges": {key: [one.low, one.high] for key, one in plan.samples.ranges.items()},
        "indices": [index._asdict() for index in found.indices],
        "constant": found.constant,
        "spread": {name: {"mean": mean, "std": std} for name, (mean, std) in found.spread.items()},
    }
    notes = replacing(figures, folder)
    shown = Table(indices.CAPTION, indices.HEAD, indices.rows_of(found))
    reported(report, found.swept, kind="sensitivity", tables=[shown], notes=notes, doubts=found.doubts)

    def tell() -> None:
        indices.tell(found)
        tell_notes(notes)
        tell_rows(figures)

    return Answer(figures, tell, folder / "sensitivity.json", code=_code(found.swept, figures))


def _rows(told: dict[str, Any]) -> dict[str, Any]:
    """What the JSON of an analysis has of the summary of its rows."""
    return {name: told[name] for name in ("verdicts", "errors", "reasons", "warnings")}


def _code(swept: Swept, figures: dict[str, Any]) -> int:
    """Exit code: a run that failed is a part of the answer; doubts: of what was made of the rows."""
    doubtful = figures["doubts"] or sum(figures["verdicts"].values()) > figures["verdicts"].get(OK, 0)
    return CODE_FAILED if swept.faults else CODE_DOUBTFUL if doubtful else CODE_OK
