"""`cable-sim envelope` and `cable-sim sensitivity`: what the rows of a sweep say together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import Answer, answers
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK
from ...sim.flag_rules import OK
from ...terminal import say
from .command import engine, of_a_file, place_of, replaced_by, replacing, reported, summary, tell_notes, tell_rows

if TYPE_CHECKING:
    from ..report.subject import Table
    from .sweep import Swept


@click.command()
@of_a_file
@answers
def envelope(file, out, workers, cluster, report) -> Answer:
    """Operating envelope of the sweep FILE: extremes of every cell over its seeds, and the rules it breaks."""
    from ..report.subject import Table
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
        **_of_rows(swept, "workers", "wall_s", "cpu_s", "simulated_s"),
        "notes": cells_of.notes_of(cells),
        "doubts": cells_of.doubts_of(cells),
        "replaced": replaced_by(plan, folder / "envelope.json"),
        "cells": [cells_of.as_dict(cell) for cell in cells],
    }
    files = [("picture", cells_of.draw(plan.sweep, cells, folder / "envelope.png"))]
    found = Table(cells_of.CAPTION, *cells_of.rows_of(cells))
    answer = _answer("envelope", swept, figures, folder, report, found, lambda: cells_of.tell(swept, cells))
    return answer._replace(files=files)


@click.command()
@of_a_file
@answers
def sensitivity(file, out, workers, cluster, report) -> Answer:
    """Sobol indices of the ranges of the sweep FILE for each of its figures, with 95 % intervals."""
    from ..report.subject import Table
    from . import sensitivity as indices
    from .sweep_file import load_sweep

    plan = load_sweep(file)
    folder = out or place_of(plan)
    with engine(folder, cluster, workers) as how:
        found = indices.sensitivity(plan, folder, **how)
    assert plan.samples is not None
    figures = {
        **_of_rows(found.swept, "cpu_s"),
        "doubts": found.doubts,
        "replaced": replaced_by(plan, folder / "sensitivity.json"),
        "ranges": {key: [one.low, one.high] for key, one in plan.samples.ranges.items()},
        "indices": [index._asdict() for index in found.indices],
        "constant": found.constant,
        "spread": {name: {"mean": mean, "std": std} for name, (mean, std) in found.spread.items()},
    }
    shown = Table(indices.CAPTION, indices.HEAD, indices.rows_of(found))
    return _answer("sensitivity", found.swept, figures, folder, report, shown, lambda: indices.tell(found))


def _answer(
    kind: str,
    swept: Swept,
    figures: dict[str, Any],
    folder: Path,
    report: Path | None,
    shown: Table,
    tell: Callable[[], None],
) -> Answer:
    """The answer of an analysis, with its report; shown: its table there, tell: prints it. A run that failed is a part
    of the answer, a fault of the program is not; doubts are of what was made of the rows."""
    replaced = replacing(figures, folder)
    notes = [*figures.get("notes", ()), *replaced]
    reported(report, swept, kind=kind, tables=[shown], notes=notes, doubts=figures["doubts"])

    def told() -> None:
        tell()
        tell_notes(replaced)
        for text in figures["doubts"]:
            say(f"doubtful: {text}", err=True)
        tell_rows(figures)

    doubtful = figures["doubts"] or sum(figures["verdicts"].values()) > figures["verdicts"].get(OK, 0)
    code = CODE_FAILED if swept.faults else CODE_DOUBTFUL if doubtful else CODE_OK
    return Answer(figures, told, folder / f"{kind}.json", code=code)


def _of_rows(swept: Swept, *costs: str) -> dict[str, Any]:
    """What the JSON of an analysis has of the summary of its rows, with these costs."""
    told = summary(swept)
    names = ("computed", *costs, "verdicts", "errors", "reasons", "warnings")
    return {"sweep": told["sweep"], "runs": told["cases"], **{name: told[name] for name in names}}
