"""`cable-sim sweep`: many runs of a scene, on all cores or a cluster, into one table."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.report_option import report_option, said, typed
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK, RunError
from ...files import read_text, write_text
from ...terminal import plain_console, say

if TYPE_CHECKING:
    from .sweep import Swept
    from .sweep_file import SweepPlan


WORKERS = click.option(
    "--workers", type=click.IntRange(1, 4096), help="Processes. Default: one a core that memory holds."
)
OF_A_FILE = (  # what every command on a sweep FILE takes
    click.argument("file", type=click.Path(path_type=Path)),
    click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        help="Folder for rows and tables. Default: runs/sweep_<name>. Rows that it has are not computed again; the "
        "tables of another sweep there are replaced.",
    ),
    WORKERS,
    click.option(
        "--cluster",
        metavar="local|slurm|ADDRESS",
        help="Dask in place of own processes: a local cluster, slurm (dask-jobqueue), or the address of a scheduler.",
    ),
    report_option,
    click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else."),
)


SHOWN = 20  # texts of a kind


class Stopped(RunError):
    """A command that was ended by Ctrl-C."""


def of_a_file(function: Callable) -> Callable:
    """A command on a sweep FILE: its argument and options."""
    for one in reversed(OF_A_FILE):
        function = one(function)
    return function


@click.command()
@of_a_file
@click.option("--dry-run", is_flag=True, help="Say how many cases there are and how many are new; simulate nothing.")
def sweep(file, out, workers, cluster, dry_run, report, as_json) -> None:
    """Simulate every case of the sweep FILE, and keep one row of figures each.

    A sweep that was stopped goes on; one that was extended computes what is new. A run that fails is a row with its
    reason.
    """
    from .clusters import executors
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
        say(json.dumps(told) if as_json else f"{len(keys)} cases, {new} of them new")
        return
    with stoppable(folder), executors(cluster, workers) as (make, count), bar(as_json) as progress:
        swept = run_sweep(plan, folder, workers=count, make=make, progress=progress)
    replaced = replaced_by(plan, folder / "sweep.json")
    paths = write(swept, folder)
    figures = summary(swept) | {"replaced": replaced, "files": [str(path) for path in paths]}
    write_text(folder / "sweep.json", json.dumps(figures, indent=1) + "\n")
    if report is not None:
        from .reported import write_report

        said(write_report(swept, report, typed(), notes=replacing(figures, folder)))
    if as_json:
        say(json.dumps(figures, indent=1), lines=True)
    else:
        _tell(figures, replacing(figures, folder))
    sys.exit(figures["exit_code"])


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
def stoppable(folder: Path | None) -> Iterator[None]:
    """Say at Ctrl-C what is kept; folder: of the rows, None: they are nowhere."""
    try:
        yield
    except KeyboardInterrupt:
        from ..report.parts import counted
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
    for note in notes:
        say(f"warning: {note}", err=True)
    for path in figures["files"]:
        say(f"table:     {path}")


def tell_rows(figures: dict[str, Any]) -> None:
    """Say why rows failed or are doubtful, and of what they warn; figures: of `summary`."""
    for words, name in (("failed {} x", "errors"), ("doubtful {} x", "reasons"), ("warning in {} runs", "warnings")):
        for text, count in figures[name].items():
            say(f"{words.format(count)}: {text}", err=True)


@contextmanager
def bar(quiet: bool) -> Iterator[Any]:
    """Progress of the cases, with the time left, on a terminal; called with done and total."""
    if quiet or not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn("cases"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=plain_console(err=True)) as bar:
        task = bar.add_task("cases")
        yield lambda done, total: bar.update(task, completed=done, total=total)


def place_of(plan: SweepPlan) -> Path:
    """Folder of a sweep for which none is given."""
    safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in plan.sweep)[:64] or "sweep"
    return Path("runs") / f"sweep_{safe}"
