"""Processes that we start: output in a file, ended by their ids within a bounded time, also when we are killed.

Needs no rclpy.
"""

from __future__ import annotations

import atexit
import os
import signal
import subprocess
import sys
import time
import uuid
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..errors import TowError
from . import watchdog

STEPS = ((signal.SIGINT, 5.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))  # s to wait after each
POLL = 0.01  # s
TAIL = 30  # lines shown in errors
MARK = uuid.uuid4().hex  # in the environment of every child; that of a tow begins with it
_guard: subprocess.Popen | None = None
opened: weakref.WeakSet[Any] = weakref.WeakSet()  # tows


@atexit.register
def _end_all() -> None:
    """What nobody closed: a listener's thread must not run when the middleware is taken down."""
    for one in list(opened):
        with suppress(TowError):
            one._end()


def guard() -> None:
    """Start the watchdog of this process, once; it ends our children when this one is killed."""
    global _guard
    if _guard is None or _guard.poll() is not None:
        clean = {name: value for name, value in os.environ.items() if name != watchdog.VARIABLE}
        _guard = subprocess.Popen(
            [sys.executable, "-I", "-S", watchdog.__file__, MARK],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=clean,
            start_new_session=True,  # Ctrl-C in the terminal is not for it
        )
        atexit.register(_release, _guard)


def _release(process: subprocess.Popen) -> None:
    if process.stdin is not None:
        process.stdin.close()
    try:
        process.wait(watchdog.PATIENCE + 6.0)
    except subprocess.TimeoutExpired:
        process.kill()


def failure(figures: Mapping[str, Any]) -> str:
    """ "" or that a node failed or halted and why, by what it wrote of itself in ``statistics_file``."""
    state = figures.get("last", figures.get("state"))  # last: of one that has ended
    return f"is {state}: {figures.get('problem', '')}" if state in ("failed", "halted") else ""


class Process:
    """A child in a process group of its own, so that what it starts ends with it.

    log: file of its output; inherit: descriptors that it takes over; folder: where it runs, by default where we do.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        log: Path,
        environment: Mapping[str, str],
        inherit: Sequence[int] = (),
        folder: Path | None = None,
    ) -> None:
        guard()
        if not environment.get(watchdog.VARIABLE, "").startswith(MARK):
            environment = {**environment, watchdog.VARIABLE: MARK}
        self.name, self.log = name, log
        self.watched = True  # is its end by itself, with another code than 0, a failure?
        try:
            with open(log, "wb") as stream:
                self._process = subprocess.Popen(
                    list(command),
                    env=dict(environment),
                    stdin=subprocess.DEVNULL,
                    stdout=stream,
                    stderr=subprocess.STDOUT,
                    cwd=folder,
                    pass_fds=tuple(inherit),
                    process_group=0,  # not a session: the kernel would share the cores out by session, not by nice
                )
        except (OSError, TypeError, ValueError) as error:  # the latter two: of an environment that is no text
            raise TowError(f"{name} could not be started: {error}; the command was {' '.join(command)}") from error
        self.pid = self._process.pid

    @property
    def code(self) -> int | None:
        """Exit code, negative: the signal that ended it; None while it runs."""
        if self._process.returncode is None:
            ended = os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            if ended is None:
                return None
            self._signal(signal.SIGKILL)  # the rest of its group, whose id is ours until we have waited for it
            self._process.wait()
        return self._process.returncode

    @property
    def text(self) -> str:
        """Its output so far."""
        return self.log.read_text("utf-8", errors="replace")

    def tail(self, lines: int = TAIL) -> str:
        """Its last lines, indented."""
        return "\n".join("  " + line for line in self.text.splitlines()[-lines:]) or "  (no output)"

    def wait(self, within: float) -> int:
        """Its exit code; TowError when it has not ended within so many seconds."""
        deadline = time.monotonic() + within
        while self.code is None:
            if time.monotonic() > deadline:
                raise TowError(f"{self.name} (process {self.pid}) has not ended within {within:g} s\n{self.tail()}")
            time.sleep(POLL)
        return self._process.returncode

    def kill(self) -> int:
        """End it at once, as a crash would; its exit code."""
        return self.stop(((signal.SIGKILL, 5.0),))

    def stop(self, steps: Sequence[tuple[signal.Signals, float]] = STEPS) -> int:
        """End it: a signal, so many seconds, the next one; its exit code. TowError when it outlives the last."""
        self.watched = False
        try:
            for number, patience in steps:
                if self.code is None:
                    self._signal(number)
                deadline = time.monotonic() + patience
                while self.code is None and time.monotonic() < deadline:
                    time.sleep(POLL)
                if self.code is not None:
                    return self.code
        except BaseException:  # Ctrl-C while we wait
            self._signal(signal.SIGKILL)
            raise
        raise TowError(
            f"{self.name} (process {self.pid}) outlived {', '.join(s.name for s, _ in steps)}\n{self.tail()}"
        )

    def _signal(self, number: signal.Signals) -> None:
        try:
            os.killpg(self.pid, number)
        except ProcessLookupError:
            pass
