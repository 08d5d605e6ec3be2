"""Throughput of a sweep beside single runs: ``cable-sim bench --sweep``.

The same cases one after another in this process, and on 1, 2, ... workers; all in turn, ratios within a round. While
all workers have work they are counted from the first row of each to the last case that is handed out; what starting
and ending them costs stands beside it, as the whole time of these cases.
"""

from __future__ import annotations

import statistics
import time
from functools import partial
from typing import NamedTuple

from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.tools.sweeps.cases import Case, cases_of
from cable_sim_ros.tools.sweeps.engine import processes, rows_of, workers_of
from cable_sim_ros.tools.sweeps.sweep import compiled
from cable_sim_ros.tools.sweeps.sweep_file import checked
from cable_sim_ros.tools.sweeps.worker import simulate

from .turns import in_turn

CASES, SECONDS, TURNS = 24, 30.0, 3
SEA = {"water.waves.kind": "jonswap", "water.waves.height": 2.0, "water.waves.period": 7.0}


class Timed(NamedTuple):
    """Simulated seconds per wall second, while all workers have work and with start and end; CPU s per simulated s."""

    busy: float
    whole: float
    cpu: float


class Throughput(NamedTuple):
    """One number of workers, 0: single runs in one process. share: of the throughput of a single run that a worker
    has while all have work, median of the rounds, with the least and the most of them; whole: with start and end."""

    workers: int
    cases: int
    simulated_per_wall_s: float
    cpu_s_per_simulated_s: float
    share: float
    least: float
    most: float
    whole: float


def cases(count: int = CASES) -> list[Case]:
    """side_scan under the waves of a sea state that also moves the ship, a seed each."""
    plan = {
        "sweep": "throughput",
        "scene": "side_scan",
        "settings": SEA,
        "duration": SECONDS,
        "motions": [{"rao": "simple"}],
        "seeds": count,
    }
    return list(cases_of(checked(plan, "throughput")))


def throughput(turns: int = TURNS, progress: Progress = silent) -> list[Throughput]:
    """Single runs, and sweeps of 1 to as many workers as there are cores and memory for."""
    compiled()
    most = workers_of(None)
    todo = cases(max(CASES, 4 * most))
    numbers = range(most + 1)
    jobs = [partial(_timed, todo, number) for number in numbers]
    names = ["single runs", *(f"{number} workers" for number in numbers[1:])]
    times, _ = in_turn(jobs, turns, progress, names)
    found = []
    for number, mine in zip(numbers, times, strict=True):
        share = [one.busy / single.busy / max(number, 1) for one, single in zip(mine, times[0], strict=True)]
        whole = [one.whole / single.whole / max(number, 1) for one, single in zip(mine, times[0], strict=True)]
        found.append(
            Throughput(
                number,
                len(todo),
                statistics.median(one.busy for one in mine),
                statistics.median(one.cpu for one in mine),
                statistics.median(share),
                min(share),
                max(share),
                statistics.median(whole),
            )
        )
    return found


def _timed(todo: list[Case], workers: int) -> tuple[Timed, None]:
    begun, rows, at = time.perf_counter(), [], []
    here = ((case, simulate(case)) for case in todo)
    arriving = rows_of(todo, partial(processes, workers), workers) if workers else here
    for _, row in arriving:
        rows.append(row)
        at.append(time.perf_counter())
    if failed := [row["error"] for row in rows if row["error"]]:
        raise RuntimeError(f"a case of the benchmark failed: {failed[0]}")
    simulated = sum(row["simulated_s"] for row in rows)
    each, last = simulated / len(rows), len(rows) - workers - 1
    first = max(workers - 1, 0)  # the row from which on every worker runs
    busy = each * (last - first) / (at[last] - at[first])
    return Timed(busy, simulated / (time.perf_counter() - begun), sum(row["cpu_s"] for row in rows) / simulated), None


def study(repeats: int | None, progress: Progress) -> tuple[list[dict], str]:
    """Rows as data, and the table of docs/sweeps.md."""
    rows = throughput(repeats or TURNS, progress)
    whole = f"with start and end, {rows[0].cases} cases"
    head = ("runs", "simulated s per wall s", "CPU s per simulated s", "of a single run, a worker", whole)
    lines = [
        (
            f"{r.workers} workers" if r.workers > 1 else "1 worker" if r.workers else "one after another",
            f"{r.simulated_per_wall_s:.1f}",
            f"{r.cpu_s_per_simulated_s:.4f}",
            f"{100.0 * r.share:.1f} % ({100.0 * r.least:.1f} to {100.0 * r.most:.1f})",
            f"{100.0 * r.whole:.0f} %",
        )
        for r in rows
    ]
    return [r._asdict() for r in rows], markdown_table([head, *lines])
