"""`cable-sim sweep`: many runs of a scene, on all cores or a cluster, into one table."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import (
    Answer,
    answers,
    asks_json,
    folder_option,
    progress_bar,
    report_option,
    said,
    together,
    typed,
    workers_option,
)
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK, RunError
from ...files import read_text
from ...terminal import say

if TYPE_CHECKING:
    from .sweep import Swept
    from .sweep_file import SweepPlan

of_a_file = together(  # what every command on a sweep FILE takes
    click.argument("file", type=click.Path(path_type=Path)),
    folder_option(
        "Folder for rows and tables. Default: runs/sweep_<name>. Rows that it has are not computed again; the tables "
        "of another sweep there are replaced."
    ),
    workers_option,
    click.option(
        "--cluster",
        metavar="local|slurm|ADDRESS",
        help="Dask in place of own processes: a local cluster, slurm (dask-jobqueue), or the address of a scheduler.",
    ),
    report_option,
)
SHOWN = 20  # texts of a kind


class Stopped(RunError):
    """A command that was ended by Ctrl-C."""


@click.command()
@of_a_file
@click.option("--dry-run", is_flag=True, help="Say how many cases there are and how many are new; simulate nothing.")
@answers
def sweep(file, out, workers, cluster, dry_run, report) -> Answer | None:
    """Simulate every case of the sweep FILE, and keep one row of figures each.

    A sweep that was stopped goes on; one that was extended computes what is new. A run that fails is a row with its
    reason.
    """
    from .dataset import write
    from .store import Store
    from .sweep import cases_of
    from .sweep import sweep as run_sweep
    from .sweep_file import load_sweep
    from .worker import AGAIN

    plan = load_sweep(file)
    folder = out or place_of(plan)
    if dry_run:
        keys, there = [case.key for case in cases_of(plan)], Store(folder, look=True).rows
        new = sum(there.get(key, {AGAIN: True}).get(AGAIN, False) for key in keys)
        told = {"sweep": plan.sweep, "cases": len(keys), "new": new}
        say(json.dumps(told) if asks_json() else f"{len(keys)} cases, {new} of them new")
        return None
    with engine(folder, cluster, workers) as how:
        swept = run_sweep(plan, folder, **how)
    replaced = replaced_by(plan, folder / "sweep.json")
    paths = write(swept, folder)
    figures = summary(swept) | {"replaced": replaced, "files": [str(path) for path in paths]}
    notes = replacing(figures, folder)
    reported(report, swept, notes=notes)
    files = [("table", path) for path in paths]
    return Answer(figures, lambda: _tell(figures, notes), folder / "sweep.json", files, code=figures["exit_code"])


def reported(path: Path | None, swept: Swept, **found: Any) -> None:
    """Write the report of a sweep, where one was asked for; found: as of `write_report`."""
    if path is not None:
        from .dataset import write_report

        said(write_report(swept, path, typed(), **found))


def summary(swept: Swept) -> dict[str, Any]:
    """What is said of a sweep: cases by verdict, reasons of failures with their number, cost."""
    states = Counter(row["verdict"] for row in swept.rows)
    errors = Counter(row["error"] for row in swept.rows if row["error"])
    reasons = Counter(row["reasons"] for row in swept.rows if row["reasons"])
    warnings = Counter(row["warnings"] for row in swept.rows if row["warnings"])
    simulated = sum(row["simulated_s"] for row in swept.rows)
    code = CODE_FAILED if states["failed"] else CODE_DOUBTFUL if states["doubtful"] else CODE_OK
    return {
        "sweep": swept.plan.sweep,
        "cases": len(swept.rows),
        "computed": swept.computed,
        "verdicts": dict(states),
        "errors": _commonest(errors),
        "reasons": _commonest(reasons),
        "warnings": _commonest(warnings),
        "faults": len(swept.faults),
        "damaged_parts": swept.damaged,
        "simulated_s": simulated,
        "cpu_s": sum(row["cpu_s"] for row in swept.rows),
        "wall_s": swept.wall,
        "workers": swept.workers,
        "exit_code": code,
    }


def _commonest(texts: Counter[str]) -> dict[str, int]:
    """The SHOWN commonest texts with their numbers, and a line for the others."""
    shown = dict(texts.most_common(SHOWN))
    others = {text: count for text, count in texts.items() if text not in shown}
    return shown | ({f"{len(others)} other texts, see the rows": sum(others.values())} if others else {})


def replaced_by(plan: SweepPlan, path: Path) -> str | None:
    """Name of another sweep, whose figures are in a file that those of this one will replace."""
    try:
        before = json.loads(read_text(path))["sweep"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return str(before) if before != plan.sweep else None


def replacing(figures: dict[str, Any], folder: Path) -> list[str]:
    """What is said where the tables of another sweep were replaced; figures: with `replaced`."""
    before = figures["replaced"]
    if before is None:
        return []
    return [
        f"{folder} had the tables of another sweep, '{before}': those of '{figures['sweep']}' replace them. The rows "
        f"of both are kept: its own file or command makes its tables again, with another --out beside these"
    ]


@contextmanager
def engine(folder: Path, cluster: str | None, workers: int | None) -> Iterator[dict[str, Any]]:
    """Keywords of `sweep` that say where and on how many processes; with a bar, and what Ctrl-C leaves."""
    from .clusters import executors

    with stoppable(folder), executors(cluster, workers) as (make, count), progress_bar(unit="cases") as progress:
        yield {"workers": count, "make": make, "progress": partial(progress, "cases")}


@contextmanager
def stoppable(folder: Path | None) -> Iterator[None]:
    """Say at Ctrl-C what is kept; folder: of the rows, None: they are nowhere."""
    try:
        yield
    except KeyboardInterrupt:
        from ..report.subject import counted
        from .store import Store

        if folder is None:
            raise Stopped("stopped by Ctrl-C: nothing is kept without --out DIR") from None
        count = len(Store(folder, look=True).rows)
        raise Stopped(
            f"stopped by Ctrl-C: {counted(count, 'row')} kept in {folder / 'rows'}; those in hand are lost. The same "
            "command goes on with the others"
        ) from None


def _tell(figures: dict[str, Any], notes: list[str]) -> None:
    states = ", ".join(f"{count} {state}" for state, count in sorted(figures["verdicts"].items()))
    say(f"{figures['sweep']}: {figures['cases']} cases ({states}), {figures['computed']} computed now")
    if figures["computed"]:
        say(
            f"{figures['simulated_s']:.0f} s simulated in {figures['cpu_s']:.0f} s of CPU; {figures['wall_s']:.1f} s "
            f"of wall time on {figures['workers']} workers"
        )
    tell_rows(figures)
    for name in figures["damaged_parts"]:
        say(f"warning: rows/{name} cannot be read: set aside, its cases were computed again", err=True)
    tell_notes(notes)


def tell_rows(figures: dict[str, Any]) -> None:
    """Say why rows failed or are doubtful, and of what they warn; figures: of `summary`."""
    for words, name in (("failed {} x", "errors"), ("doubtful {} x", "reasons"), ("warning in {} runs", "warnings")):
        for text, count in figures[name].items():
            say(f"{words.format(count)}: {text}", err=True)


def tell_notes(notes: Sequence[str]) -> None:
    """Warn of the tables of another sweep that were replaced; notes: of `replacing`."""
    for note in notes:
        say(f"warning: {note}", err=True)


def place_of(plan: SweepPlan) -> Path:
    """Folder of a sweep for which none is given."""
    safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in plan.sweep)[:64] or "sweep"
    return Path("runs") / f"sweep_{safe}"
