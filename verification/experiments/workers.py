"""Runs of experiments over processes: the same results, bit for bit, for any number of workers.

A run is a public function of plain values that decide all of it, the seed among them; results come in the order in
which runs were asked for. Workers are those of the sweeps: started afresh, one thread each. Seconds of CPU that a run
measures of itself are of the machine and differ.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from cable_sim_ros.errors import RunError

Over = Callable[[Callable[..., Any], Sequence[tuple]], Iterator[Any]]


def here(run: Callable[..., Any], arguments: Sequence[tuple]) -> Iterator[Any]:
    """Results of ``run`` with each of the arguments, one after the other in this process."""
    return (run(*each) for each in arguments)


@contextmanager
def workers(count: int) -> Iterator[Over]:
    """What hands runs to that many processes, as many at a time; of one worker it is this process itself."""
    if count == 1:
        yield here
        return
    from cable_sim_ros.tools.sweeps.engine import processes

    executor = processes(count)
    try:
        yield lambda run, arguments: _handed(executor, run, arguments)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _handed(executor: Executor, run: Callable[..., Any], arguments: Sequence[tuple]) -> Iterator[Any]:
    """All are handed out at once, before the first result is asked for."""
    futures = [executor.submit(run, *each) for each in arguments]
    return (_result(future) for future in futures)


def _result(future: Future) -> Any:
    """Raises RunError where the process ended, and what the run raised."""
    try:
        return future.result()
    except BrokenExecutor as error:
        raise RunError(
            "a process that ran an experiment ended (killed, or out of memory); no result was written. Free memory, "
            "or give --workers 1, which starts none"
        ) from error


@lru_cache(maxsize=1)
def warm() -> None:
    """Load the kernels of this process, once: what comes after is timed without it."""
    from cable_sim_ros.io.scenes.load import load_scene
    from cable_sim_ros.sim.rig.rig import warm_up
    from cable_sim_ros.sim.simulator import Simulator

    Simulator(load_scene("flume")).warm_up()
    warm_up()
