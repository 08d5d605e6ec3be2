"""A sweep from its file to its rows: kernels compiled once, cases handed out, rows kept as they come."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ...terminal import say
from .cases import Case, cases_of
from .engine import FAULT, Make, processes, rows_of, workers_of
from .store import Store
from .sweep_file import SweepPlan
from .worker import AGAIN

Progress = Callable[[int, int], None]  # cases done, cases in all


class Swept(NamedTuple):
    """A sweep that ran: cases and rows side by side in the order of the cases; computed: how many now, the others were
    there; wall: s; damaged: parts of the store that could not be read."""

    plan: SweepPlan
    cases: list[Case]
    rows: list[dict[str, Any]]
    computed: int
    wall: float
    workers: int
    damaged: list[str]

    @property
    def faults(self) -> list[str]:
        """Errors of rows that are faults of the program."""
        return [row["error"] for row in self.rows if row["error"].startswith(FAULT)]

    def tell(self) -> None:
        """Say how much was computed."""
        say(
            f"{len(self.rows)} runs, {self.computed} computed now in {self.wall:.1f} s of wall time on {self.workers} "
            f"workers"
        )


def sweep(
    plan: SweepPlan,
    out: str | os.PathLike,
    *,
    workers: int | None = None,
    make: Make | None = None,
    drawn: Sequence[dict[str, float]] | None = None,
    progress: Progress = lambda done, total: None,
) -> Swept:
    """Run the cases of a plan that the folder ``out`` does not have yet, or that failed by the machine.

    workers: processes, default one a core; make: another Executor, with ``workers`` of them in hand at a time;
    drawn: samples in place of those that the plan draws.
    Raises StoreError. What was computed stays when it is interrupted.
    """
    begun, cases = time.monotonic(), list(cases_of(plan, drawn))
    rows, new, number, damaged = computed(cases, out, workers=workers, make=make, progress=progress)
    return Swept(plan, cases, rows, new, time.monotonic() - begun, number, damaged)


def computed(
    cases: Sequence[Case],
    out: str | os.PathLike,
    *,
    workers: int | None = None,
    make: Make | None = None,
    progress: Progress = lambda done, total: None,
) -> tuple[list[dict[str, Any]], int, int, list[str]]:
    """Rows of cases, kept in a folder; how many were computed now, by how many workers; damaged parts of the store."""
    store = Store(out)
    todo = {case.key: case for case in cases if store.rows.get(case.key, {AGAIN: True}).get(AGAIN)}
    number = workers_of(workers) if make is None else max(1, workers or 1)
    total = len(cases)
    done = total - len(todo)
    progress(done, total)
    if todo:
        compiled()
    try:
        for _, row in rows_of(todo.values(), make or (lambda: processes(number)), number):
            store.add(row)
            done += 1
            progress(done, total)
    finally:
        store.flush()
    return [store.rows[case.key] for case in cases], len(todo), number, store.damaged


def compiled() -> None:
    """Compile the kernels once, before workers would each do it."""
    from ...io.scenes.load import load_scene
    from ...sim.rig.rig import warm_up
    from ...sim.simulator import Simulator

    Simulator(load_scene("flume")).warm_up()
    warm_up()
