"""`cable-sim envelope` and `cable-sim sensitivity`: what the rows of a sweep say together."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import click

from ...cli.report_option import said, typed
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK
from ...files import write_text
from ...sim.flag_rules import OK
from ...terminal import say
from .command import bar, of_a_file, place_of, replaced_by, replacing, stoppable, summary, tell_rows

if TYPE_CHECKING:
    from .sweep import Swept

ROWS = ("verdicts", "errors", "reasons", "warnings")  # of `summary`


@click.command()
@of_a_file
def envelope(file, out, workers, cluster, report, as_json) -> None:
    """Operating envelope of the sweep FILE: extremes of every cell over its seeds, and the rules it breaks."""
    from . import envelope as cells_of
    from .clusters import executors
    from .sweep import sweep
    from .sweep_file import load_sweep

    plan = load_sweep(file)
    cells_of.refuse_others(plan, str(file))
    folder = out or place_of(plan)
    with stoppable(folder), executors(cluster, workers) as (make, count), bar(as_json) as progress:
        swept = sweep(plan, folder, workers=count, make=make, progress=progress)
    cells = cells_of.envelope(swept)
    figures = {
        "sweep": plan.sweep,
        "runs": len(swept.rows),
        "computed": swept.computed,
        "workers": swept.workers,
        "wall_s": swept.wall,
        "cpu_s": sum(row["cpu_s"] for row in swept.rows),
        "simulated_s": sum(row["simulated_s"] for row in swept.rows),
        **{name: summary(swept)[name] for name in ROWS},
        "notes": cells_of.notes_of(cells),
        "doubts": cells_of.doubts_of(cells),
        "replaced": replaced_by(plan, folder / "envelope.json"),
        "cells": [cells_of.as_dict(cell) for cell in cells],
    }
    write_text(folder / "envelope.json", json.dumps(figures, indent=1) + "\n")
    picture = cells_of.draw(plan.sweep, cells, folder / "envelope.png")
    if report is not None:
        from ..report.parts import Table
        from .reported import write_report

        found = Table(cells_of.CAPTION, *cells_of.rows_of(cells))
        said(
            write_report(
                swept,
                report,
                typed(),
                kind="envelope",
                tables=[found],
                notes=[*figures["notes"], *replacing(figures, folder)],
                doubts=figures["doubts"],
            )
        )
    if as_json:
        say(json.dumps(figures, indent=1), lines=True)
    else:
        cells_of.tell(swept, cells)
        for note in replacing(figures, folder):
            say(f"warning: {note}", err=True)
        say(f"figures:   {folder / 'envelope.json'}")
        say(f"picture:   {picture}")
        for text in figures["doubts"]:
            say(f"doubtful: {text}", err=True)
    _leave(swept, as_json, bool(figures["doubts"]))


@click.command()
@of_a_file
def sensitivity(file, out, workers, cluster, report, as_json) -> None:
    """Sobol indices of the ranges of the sweep FILE for each of its figures, with 95 % intervals."""
    from . import sensitivity as indices
    from .clusters import executors
    from .sweep_file import load_sweep

    plan = load_sweep(file)
    folder = out or place_of(plan)
    with stoppable(folder), executors(cluster, workers) as (make, count), bar(as_json) as progress:
        found = indices.sensitivity(plan, folder, workers=count, make=make, progress=progress)
    assert plan.samples is not None
    figures = {
        "sweep": plan.sweep,
        "runs": len(found.swept.rows),
        "computed": found.swept.computed,
        "cpu_s": sum(row["cpu_s"] for row in found.swept.rows),
        **{name: summary(found.swept)[name] for name in ROWS},
        "doubts": found.doubts,
        "replaced": replaced_by(plan, folder / "sensitivity.json"),
        "ranges": {key: [one.low, one.high] for key, one in plan.samples.ranges.items()},
        "indices": [index._asdict() for index in found.indices],
        "constant": found.constant,
        "spread": {name: {"mean": mean, "std": std} for name, (mean, std) in found.spread.items()},
    }
    write_text(folder / "sensitivity.json", json.dumps(figures, indent=1) + "\n")
    if report is not None:
        from ..report.parts import Table
        from .reported import write_report

        shown = Table(indices.CAPTION, indices.HEAD, indices.rows_of(found))
        notes = replacing(figures, folder)
        said(
            write_report(
                found.swept, report, typed(), kind="sensitivity", tables=[shown], notes=notes, doubts=found.doubts
            )
        )
    if as_json:
        say(json.dumps(figures, indent=1), lines=True)
    else:
        indices.tell(found)
        for note in replacing(figures, folder):
            say(f"warning: {note}", err=True)
        say(f"figures:   {folder / 'sensitivity.json'}")
    _leave(found.swept, as_json, bool(found.doubts))


def _leave(swept: Swept, as_json: bool, doubts: bool = False) -> None:
    """Say what is wrong with rows, and leave with the code of it: a run that failed is a part of the answer. doubts: of
    what was made of the rows."""
    told = summary(swept)
    if not as_json:
        tell_rows(told)
    doubtful = doubts or sum(told["verdicts"].values()) > told["verdicts"].get(OK, 0)
    sys.exit(CODE_FAILED if swept.faults else CODE_DOUBTFUL if doubtful else CODE_OK)
