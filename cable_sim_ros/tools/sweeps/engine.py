"""Runs the cases of a sweep on any `concurrent.futures.Executor`: processes of this machine, or a Dask cluster.

No more cases are handed out than the workers can have in hand. What is lost with a worker that dies is run again, one
case at a time; a case that ends its worker twice is a row with that reason. Rows come in any order and are kept by key:
the same rows for any number of workers.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from itertools import islice
from typing import Any

from ...errors import CableSimError
from ...processes import Spawn, Workers
from ...sim.flag_rules import FAILED
from .cases import Case
from .threads import begun
from .worker import AGAIN, simulate

AHEAD = 2  # cases a worker has in hand, the one that it runs counted
TRIES = 2
FAULT = "fault of the program: "
MEMORY = 700e6  # bytes of a worker: interpreter, kernels, a run; measured
Make = Callable[[], Executor]


def workers_of(asked: int | None) -> int:
    """Workers on this machine: as asked, else one a core, and never more than its free memory holds."""
    cores = len(os.sched_getaffinity(0))
    room = max(1, int(free_memory() // MEMORY))
    return max(1, min(cores if asked is None else asked, room))


def free_memory() -> float:
    """Bytes that a new process can have, of the machine and of its control group."""
    free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    try:
        with open("/proc/meminfo") as file:
            free = next(1024 * int(line.split()[1]) for line in file if line.startswith("MemAvailable"))
        with open("/sys/fs/cgroup/memory.max") as most, open("/sys/fs/cgroup/memory.current") as used:
            limit = most.read().strip()
            free = free if limit == "max" else min(free, int(limit) - int(used.read()))
    except (OSError, StopIteration, ValueError):
        pass
    return float(free)


def processes(workers: int) -> Executor:
    """Workers as processes of this machine, started afresh: they share nothing with the caller."""
    return Workers(workers, mp_context=Spawn(), initializer=begun)


def rows_of(cases: Iterable[Case], make: Make, workers: int) -> Iterator[tuple[Case, dict[str, Any]]]:
    """Each case with its row, as they come. make: an Executor, anew where the one before broke."""
    waiting = iter(cases)
    executor = make()
    hand: dict[Future, Case] = {}
    try:
        while True:
            lost = []
            for case in islice(waiting, AHEAD * workers - len(hand)):
                try:
                    hand[executor.submit(simulate, case)] = case
                except BrokenExecutor:  # a worker died since the last row came
                    lost.append(case)
                    break
            if not hand and not lost:
                return
            for future in wait(hand, return_when=FIRST_COMPLETED).done:
                case = hand.pop(future)
                try:
                    yield case, _row(future, case)
                except BrokenExecutor:
                    lost.append(case)
            if lost:
                executor.shutdown(cancel_futures=True)
                lost += hand.values()
                hand.clear()
                executor = make()
                for case in lost:
                    row, executor = _alone(case, executor, make)
                    yield case, row
    finally:
        executor.shutdown(cancel_futures=True)


def _alone(case: Case, executor: Executor, make: Make) -> tuple[dict[str, Any], Executor]:
    """The row of a case that was lost with a worker, run while no other is; and an executor that works."""
    for _ in range(TRIES):
        try:
            return _row(executor.submit(simulate, case), case), executor
        except BrokenExecutor:
            executor.shutdown()
            executor = make()
    return failed(case, "the worker that ran it ended (killed, or out of memory), each time"), executor


def _row(future: Future, case: Case) -> dict[str, Any]:
    try:
        return future.result()
    except (BrokenExecutor, CableSimError):  # of the executor: a mistake of a case is in its row
        raise
    except Exception as error:  # a fault of the program, or of a cluster, in one case: the others go on
        return failed(case, f"{FAULT}{type(error).__name__}: {error}")


def failed(case: Case, why: str) -> dict[str, Any]:
    """Row of a case that gave none itself."""
    nothing = {"reasons": "", "warnings": "", "cpu_s": 0.0, "simulated_s": 0.0, "flags": {}}
    return {"key": case.key, "verdict": FAILED, "error": why, AGAIN: True} | nothing
