"""The stepping loop in its own thread: the compiled entry in its LIVE mode (sim/loop.py), which never needs the
interpreter lock, with its control words, its stats rows and the eventfd that wakes the publisher.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from ..sim.loop import (
    CONTROL_WORDS,
    COUNT,
    EVENTFD,
    HALT,
    HALTED,
    HEADS,
    LIVE,
    MAPPING,
    MAX_CATCHUP,
    ONE,
    OVERRUNS,
    PERIOD,
    REACHED,
    RESYNCS,
    SKIPPED,
    SLEW,
    STATS_COLUMNS,
    STOP,
    TARGET,
    UNTIL,
    drive,
)

__all__ = ["HALT", "REACHED", "RESYNCS", "SKIPPED", "Loop", "TickStats", "quiet", "take_priority"]

NEVER = 2**62  # ticks
SWITCH = 5e-4  # s; a thread that waits for the lock gets it after this
NO_MORE = 1_000_000_000  # collections
HEADS_ROWS = 4096  # ticks of which it is known what they saw, also where the publisher was overtaken


class TickStats(NamedTuple):
    """What the loop says of one tick, ns."""

    time: int
    deadline: int
    wake: int
    done: int
    flags: int
    lag: int


class Loop:
    """The loop thread with its rings. `output` must have the rows of a ring, see sim.build.make_output.

    `meet` does, in the thread of the ticks, what has to be done before the next of them; it returns the ticks to the
    next time that it has something to do.
    """

    def __init__(self, model, state, inputs, output, *, period_ns: int, priority: int = 0, max_catchup: int = 3):
        self.parts = (model, state, inputs, output)
        self.output = output
        self.period_ns = int(period_ns)
        self.priority = int(priority)
        self.max_catchup = int(max_catchup)
        self.slew_ns = self.period_ns // 50  # 2 %: a lag of 0.1 s is worked off in 5 s
        self.rows = len(output.frame)
        self.control = np.zeros(CONTROL_WORDS, np.int64)
        self.stats = np.zeros((self.rows, STATS_COLUMNS), np.int64)
        self.heads = np.zeros((HEADS_ROWS, HEADS), np.int64)
        self.eventfd = os.eventfd(0, os.EFD_CLOEXEC)
        self.control[[PERIOD, SLEW, MAX_CATCHUP, EVENTFD, ONE]] = (
            self.period_ns,
            self.slew_ns,
            self.max_catchup,
            self.eventfd,
            1,
        )
        self.scheduler = "not running"
        self.warning = ""  # why no real-time scheduling, with the remedy
        self.failure: BaseException | None = None
        self.meet: Callable[[], int] = lambda: NEVER
        self._thread: threading.Thread | None = None

    def warm_up(self) -> None:
        """Compile the loop (or load it from the cache) without a tick."""
        self.control[STOP] = 1
        self._run()
        self.control[STOP] = 0

    def start(self, time_ns: int, target_ns: int) -> None:
        """Start ticking from a state at time_ns; tick k is due at time + k period + target on CLOCK_MONOTONIC.

        The counters are kept, so that a reset does not hide what went before.
        """
        if self.running:
            raise RuntimeError("the loop is running already; stop it first")
        self.control[[STOP, HALTED]] = 0
        self.control[[TARGET, MAPPING]] = target_ns
        self.control[REACHED] = time_ns
        self._launch()

    def _launch(self) -> None:
        thread = threading.Thread(target=self._enter, name="tick", daemon=True)
        thread.start()
        self._thread = thread  # only now: a signal during the configure may stop it at any moment

    def run_to(self, count: int) -> None:
        """Come back when so many ticks are done, or it halted."""
        while self.count < count and not self.halted:
            time.sleep(0.01)

    @contextmanager
    def paused(self):
        """Hold the loop between two ticks; the grid stays, a tick that is missed meanwhile is run at once."""
        was_running = self.running
        if not self.stop():
            raise RuntimeError("the loop does not stop; a tick is running for more than 2 s")
        try:
            yield
        finally:
            self.control[STOP] = 0
            if was_running and not self.halted:
                self._launch()

    def clear(self) -> None:
        """Forget what was counted; the loop must be stopped."""
        self.control[:PERIOD] = 0  # the settings stay
        self.stats[:], self.heads[:] = 0, 0
        os.eventfd_write(self.eventfd, 1)
        os.eventfd_read(self.eventfd)  # empties it

    def stop(self, timeout: float = 2.0) -> bool:
        """Ask the loop to end and wait for it; False when it did not end in time."""
        self.control[STOP] = 1
        if self._thread is not None:
            self._thread.join(timeout)
        return not self.running

    def close(self) -> None:
        """Stop, wake the reader a last time and give the descriptor back (the reader must have ended)."""
        if self.stop():
            os.close(self.eventfd)

    def wake_reader(self) -> None:
        os.eventfd_write(self.eventfd, 1)

    @property
    def running(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    @property
    def halted(self) -> bool:
        return bool(self.control[HALTED])

    @property
    def count(self) -> int:
        return int(self.control[COUNT])

    def row(self, index: int) -> TickStats:
        return TickStats(*(int(value) for value in self.stats[index % self.rows]))

    @property
    def overruns(self) -> int:
        """Ticks that were done after the next deadline."""
        return int(self.control[OVERRUNS])

    def _enter(self) -> None:
        self.scheduler, self.warning = take_priority(self.priority)
        try:
            self._run()
        except BaseException as error:  # a thread's exception would vanish: diagnostics show it
            self.failure = error
            self.control[HALTED] = 1
            self.wake_reader()

    def _run(self, count: int = 0) -> None:
        """So many ticks at once; 0: in real time, until it is stopped."""
        end, left = self.count + count, self.meet()
        while True:
            self.control[UNTIL] = self.count + left
            part = min(left, end - self.count) if count else 0
            drive(*self.parts, LIVE, part, self.control, self.stats, self.heads)
            if self.control[STOP] or self.halted or self.count == end:
                return
            left = self.meet()


class StepLoop(Loop):
    """The same rings and words without a thread: a tick is done by `step`, in the thread that calls it."""

    def _launch(self) -> None:
        self.scheduler = "lockstep"

    def step(self, count: int = 1) -> None:
        """Do so many ticks now, fewer where one cannot be solved; none for 0."""
        if count > 0:  # to the compiled loop 0 means real time, without an end
            self._run(count)

    def run_to(self, count: int) -> None:
        self.step(count - self.count)


def take_priority(priority: int) -> tuple[str, str]:
    """Give the calling thread SCHED_FIFO, else a lower nice value; returns (scheduler class, warning or "")."""
    _timer_slack()
    if priority <= 0:
        return "other", ""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))  # pid 0: this thread only
        return f"fifo {priority}", ""
    except (OSError, AttributeError):
        pass
    remedy = (
        "no permission for real-time scheduling: under load ticks may come some milliseconds late; allow it with "
        "'rtprio 80' for this user in /etc/security/limits.conf, or set realtime.priority:=0"
    )
    return ("other, nice -10" if raise_priority() else "other"), remedy


def raise_priority() -> bool:
    """Nice value -10 for the calling thread; False where it is not allowed (the loop reports it)."""
    try:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), -10)
    except OSError:
        return False
    return True


def _timer_slack() -> None:
    """Ask for exact timers: a normal thread is otherwise woken up to 50 us late on purpose."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(29, 1, 0, 0, 0)  # PR_SET_TIMERSLACK, 1 ns


def quiet() -> None:
    """Freeze what is loaded, and collect only young garbage from now on.

    A full collection walks every object with the lock held: 0.1 s with all this loaded, a second with five million
    objects, while inputs and outputs wait. The node makes no cycles that grow old (row R7 of `cable-sim soak`), so what
    a full collection would find does not come up.
    """
    gc.collect()
    gc.freeze()
    young, middle, _ = gc.get_threshold()
    gc.set_threshold(young, middle, NO_MORE)
    sys.setswitchinterval(SWITCH)
