"""Functions in processes of their own, which may die or hang."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing import Pipe
from typing import Any

from cable_sim_ros.processes import Forked, ForkServer


class DiedError(Exception):
    """A process ended without an answer."""


def start_apart(function: Callable, *args, copy: bool = False) -> tuple[Any, Any]:
    """A process that runs function(pipe, *args), and the end of the pipe to receive from; copy: of this process, else
    of one that has imported the function's module and nothing else."""
    here, there = Pipe(duplex=False)
    if copy:
        child: Any = Forked(target=function, args=(there, *args), daemon=True)
    else:
        context = ForkServer()
        context.set_forkserver_preload([__name__, function.__module__])
        child = context.Process(target=function, args=(there, *args), daemon=True)
    child.start()
    there.close()
    return child, here


def apart(function: Callable, *args, timeout: float = 120.0, copy: bool = False) -> Any:
    """Result of a function in a process of its own. Raises TimeoutError where there is none in time, and DiedError."""
    child, pipe = start_apart(_answer, function, *args, copy=copy)
    try:
        if not pipe.poll(timeout):
            raise TimeoutError(f"not done after {timeout:g} s")
        return pipe.recv()
    except EOFError:
        raise DiedError("the process died") from None
    finally:
        child.kill()
        child.join()
        pipe.close()


def _answer(pipe, function: Callable, *args) -> None:
    pipe.send(function(*args))
