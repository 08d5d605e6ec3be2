"""Errors that a user is told, and the codes that commands leave with. Imports nothing of ours.

An error of these is expected: its text is the whole message, the command line prints it in one line. Any other error is
a fault of the program and keeps its traceback.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

# where several apply: 2, 1, 3, 4, 0
CODE_OK, CODE_FAILED, CODE_INPUT, CODE_DAMAGED, CODE_DOUBTFUL = 0, 1, 2, 3, 4
NEEDS_ROS = (
    "needs ROS 2, and rclpy cannot be imported ({error}); nothing was started. Source your ROS installation, or: "
    "pip install 'cable_sim_ros[ros]'. `cable-sim run` and `replay` work without it"
)


class CableSimError(Exception):
    """What is wrong with what was given, or why a run came to no end; every error of the package is one.

    exit_code: of a command that ends with it; cause: name in sim/flag_rules.CHECKS, where that is a run that failed;
    lines: the text has several, each of which is clean (terminal.py).
    """

    exit_code, lines = CODE_INPUT, False
    cause = "HALTED"


class RunError(CableSimError, RuntimeError):
    """What was given was right, but no run came of it."""

    exit_code = CODE_FAILED


class TowError(RunError):
    """A node or a process beside it did not do what was asked for; the text has its last lines."""

    lines = True


NO_PLACE = OSError, ValueError  # of a path: ValueError where a NUL is in it
Errors = type[Exception] | tuple[type[Exception], ...]


@contextmanager
def told_as(
    told: Callable[[str], Exception], before: str, after: str | None = None, of: Errors = OSError
) -> Iterator[None]:
    """Raise `told` in place of errors of the system or a library: BEFORE (why)AFTER, BEFORE alone where that is all.

    A CableSimError stays what it is."""
    try:
        yield
    except CableSimError:
        raise
    except of as error:
        why = "" if after is None else f" ({getattr(error, 'strerror', None) or error}){after}"
        raise told(f"{before}{why}") from None
