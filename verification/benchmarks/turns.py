"""Runs that take turns: the one driver of everything here that compares run times.

A shared machine drifts by more than most changes bring, so that times are compared only within one run in which all
jobs alternate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from cable_sim_ros.runs.message_run import Progress, silent

Cost = TypeVar("Cost")
Result = TypeVar("Result")


def in_turn(
    jobs: Sequence[Callable[[], tuple[Cost, Result]]],
    rounds: int,
    progress: Progress = silent,
    names: Sequence[str] = (),
) -> tuple[list[list[Cost]], list[Result]]:
    """Costs of each job in each round, and its last result.

    Every job runs once to warm up, which counts nothing, and then once a round; every other round goes backwards, so
    that no job always follows the same one. names: of the jobs, for the progress.
    """
    costs: list[list[Cost]] = [[] for _ in jobs]
    last: list = [None] * len(jobs)
    for turn in range(rounds + 1):
        order = range(len(jobs)) if turn % 2 == 0 else reversed(range(len(jobs)))
        for done, k in enumerate(order):
            progress(names[k] if names else "", turn * len(jobs) + done, (rounds + 1) * len(jobs))
            cost, last[k] = jobs[k]()
            if turn:
                costs[k].append(cost)
    return costs, last
