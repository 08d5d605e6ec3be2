"""All runs of the benchmark: each cell of each entrant beside its twin, on several processes; the result as data."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from ...files import open_file, read_text
from ...processes import ForkServer, Workers
from ...runs.stepping import Progress, silent
from ...version import __version__
from . import definition
from .definition import BAND, DIGITS, SLACK, TWIN, Cell, condition, place
from .entrants import CALLABLE, LAW, PROGRAM, Entrant, source_of
from .figures import NAMES, Rules, Twin, figures, twin_of
from .score import score_of
from .simulate import Done, Span, run_cell

FULL = Span(definition.DURATION, definition.START_UP)
SHORT = Span(definition.QUICK_DURATION, definition.QUICK_START_UP)
Row = dict[str, Any]
COST = {LAW: 4.0, CALLABLE: 16.0, PROGRAM: 90.0}  # s of a core of docs/figures.md, for a run of 120 s
ROOT = Path(__file__).resolve().parents[3]


def rules_of(cell: Cell, span: Span) -> Rules:
    """What the figures of a cell are taken with, at its scale."""
    pace, fault = place(cell.scene).scale ** 0.5, condition(cell.condition).fault
    return Rules(
        pace * span.start_up,
        (BAND[0] / pace, BAND[1] / pace),
        SLACK,
        None if fault is None else (pace * fault[0], pace * fault[1]),
    )


def twin_cell(cell: Cell) -> Cell:
    """Where the held winch beside a cell is run."""
    return cell._replace(condition=condition(cell.condition).twin)


@cache
def _twin(cell: Cell, span: Span) -> tuple[Twin | None, Row, Done]:
    """Of the held winch in its cell: what is taken from it, its figures, and its run without the tick outputs."""
    done = run_cell(Entrant(TWIN, LAW, TWIN), cell, span)
    if done.frames is None:
        return None, {}, done
    rules = rules_of(cell, span)
    found = twin_of(done.frames, rules.start_up)
    return found, figures(done.frames, rules, found, False), done._replace(frames=None)


def row_of(entrant: Entrant, cell: Cell, span: Span) -> Row:
    """An entrant in a cell: state, reason, figures and those of its twin (None where there are none)."""
    own = entrant.kind == LAW and entrant.what == TWIN and twin_cell(cell) == cell
    twin, held, beside = _twin(twin_cell(cell), span)
    if own or twin is None:
        done, found = beside, held or None
        if not own:
            done = Done(None, beside.state, f"the held winch: {beside.reason}")
    else:
        done = run_cell(entrant, cell, span)
        rules, motor = rules_of(cell, span), condition(cell.condition).drive
        found = None if done.frames is None else figures(done.frames, rules, twin, motor)
    return {
        "entrant": entrant.name,
        "rank": entrant.rank,
        "scene": cell.scene,
        "motion": cell.motion,
        "class": cell.condition,
        "seed": definition.seed(cell.motion),
        "state": done.state,
        "reason": done.reason,
        "figures": None if found is None else rounded(found),
        "twin": rounded(held) if found is not None else None,
    }


def rounded(found: Row) -> Row:
    """Figures as they stand in files."""
    return {name: None if found[name] is None else float(f"{found[name]:.{DIGITS}g}") for name in NAMES}


def run(
    entrants: Sequence[Entrant],
    cells: Sequence[Cell],
    span: Span = FULL,
    processes: int = 1,
    progress: Progress = silent,
    journal: Journal | None = None,
) -> dict[str, Any]:
    """Every entrant in every cell of one track; the result as JSON has it. A program of rclpy runs on one process.

    journal: what is in it is not run again, and what is run is added to it.
    """
    version = definition.version_of(cells[0])
    tasks = [(entrant, cell, span) for cell in cells for entrant in entrants]
    begun = commit()
    known = {} if journal is None else journal.rows
    left = [task for task in tasks if _key(task) not in known]
    found = dict(known)
    for k, (task, row) in enumerate(zip(left, _rows(left, processes), strict=True)):
        found[_key(task)] = row
        if journal is not None:
            journal.add(_key(task), row)
        progress(f"{row['scene']}/{row['motion']}/{row['class']}", k + 1, len(left))
    rows = [found[_key(task)] for task in tasks]
    whole = span == FULL and set(cells) == set(definition.cells(version=version))
    return {
        "benchmark": version,
        "definition": definition.digest(version),
        "product": __version__,
        "commit": begun,
        "complete": whole,
        "seconds": span.duration,
        "score": score_of(rows),
        "rows": rows,
    }


Task = tuple[Entrant, Cell, Span]


def _key(task: Task) -> str:
    """Of a run and all it hangs on: entrant and its files, cell, span, definition and version of the product."""
    entrant, cell, span = task
    version = definition.version_of(cell)
    said = (*entrant[:2], source_of(entrant), *cell, *span, definition.digest(version), __version__, commit())
    return hashlib.sha256(json.dumps(said).encode()).hexdigest()[:16]


def length_of(
    entrants: Sequence[Entrant], cells: Sequence[Cell], span: Span, processes: int, journal: Journal | None
) -> str:
    """How long a run will take, in a line."""
    tasks = [(entrant, cell, span) for cell in cells for entrant in entrants]
    left = [task for task in tasks if journal is None or _key(task) not in journal.rows]
    seconds = sum(COST[entrant.kind] + COST[LAW] / len(entrants) for entrant, *_ in left) * span.duration / 120.0
    there = f", {len(tasks) - len(left)} more are there" if len(left) < len(tasks) else ""
    runs = f"{len(left)} runs of {span.duration:g} s{there}"
    return f"{definition.version_of(cells[0])}: {runs}; about {max(1, round(seconds / processes / 60.0))} min"


class Journal:
    """Rows of runs in a file, a line each, that a run which is stopped goes on from; a line that was cut off is run
    again."""

    def __init__(self, path: Path) -> None:
        self.path, self.rows = path, dict[str, Row]()
        for line in read_text(path).splitlines() if path.exists() else []:
            with suppress(ValueError, TypeError):
                key, row = json.loads(line)
                self.rows[key] = row

    def add(self, key: str, row: Row) -> None:
        """Keep a row."""
        with open_file(self.path, "a", encoding="utf-8") as file:
            file.write(f"\n{json.dumps((key, row))}")


def _rows(tasks: list[Task], processes: int) -> Iterator[Row]:
    if processes == 1 or len(tasks) < 2 or any(entrant.kind == PROGRAM for entrant, *_ in tasks):
        yield from (row_of(*task) for task in tasks)
        return
    context = ForkServer()
    context.set_forkserver_preload([__name__])
    pool = Workers(processes, mp_context=context)
    try:
        for row in [pool.submit(row_of, *task) for task in tasks]:
            yield row.result()
    finally:
        pool.shutdown(cancel_futures=True)


@cache
def commit() -> str:
    """Commit of the tree that this version runs from, with -dirty where it was edited since; "" outside a clone."""
    command = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=7", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip() if (ROOT / ".git").exists() else ""
