"""The stepping loop: one compiled function in its own thread that never needs the interpreter lock.

Tick k takes the simulation to the time t_k on the clock of the motion data; it is due at t_k + mapping on
CLOCK_MONOTONIC, where mapping = clock offset + input delay. The loop slews its mapping towards the wanted one, so that
simulation time never jumps:

* late by less than a period: the tick runs at once, the grid stays;
* behind by 1 to max_catchup periods: the missed ticks run back to back (counted as overruns);
* further behind: the mapping is moved by the whole periods lost (a resync, the deadlines are counted as skipped), and
  the lag is worked off slowly by the slew.

The libc symbols are external functions of the compiled code, not foreign-function pointers: those would keep the loop
out of the on-disk cache.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numba import njit, types

from ..physics.system import tick  # first: it decides where compiled code is cached

_INT64 = types.CPointer(types.int64)
_sleep = types.ExternalFunction("clock_nanosleep", types.int32(types.int32, types.int32, _INT64, _INT64))
_clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, _INT64))
_write = types.ExternalFunction("write", types.int64(types.int32, _INT64, types.uint64))

CLOCK_MONOTONIC = 1
TIMER_ABSTIME = 1
SECOND = 1_000_000_000
HALT = 1 | 1024          # Flag.NEWTON_FAILED | Flag.NOT_FINITE
SLEEP_CHUNK = 50_000_000  # ns, so that a stop is seen soon
SLEEP_LEAST = 200_000     # ns given to others by a tick that found its deadline already past

# columns of a stats row, ns
TIME, DEADLINE, WAKE, DONE, FLAGS, LAG = range(6)
STATS_COLUMNS = 6
# control words: the first two are written by Python, the others by the loop
STOP, TARGET, COUNT, MAPPING, OVERRUNS, SKIPPED, RESYNCS, HALTED, REACHED = range(9)
CONTROL_WORDS = 9


@njit(nogil=True, cache=True)
def monotonic(buffer):
    """CLOCK_MONOTONIC in ns; buffer: int64 [2] scratch."""
    _clock(CLOCK_MONOTONIC, buffer.ctypes)
    return buffer[0] * SECOND + buffer[1]


@njit(nogil=True, cache=True)
def sleep_until(deadline, control, buffer):
    """Sleep to an absolute deadline in chunks; returns the time of waking."""
    now = monotonic(buffer)
    while now < deadline and control[STOP] == 0:
        until = min(deadline, now + SLEEP_CHUNK)
        buffer[0] = until // SECOND
        buffer[1] = until % SECOND
        _sleep(CLOCK_MONOTONIC, TIMER_ABSTIME, buffer.ctypes, buffer.ctypes)
        now = monotonic(buffer)
    return now


@njit(nogil=True, cache=True)
def run(model, state, inputs, output, control, stats, buffer, one, eventfd, time, period, slew, max_catchup):
    """Tick until control[STOP] or a halt; `time` is the simulation time of the state, ns."""
    rows = stats.shape[0]
    due = time + period
    while control[STOP] == 0 and control[HALTED] == 0:
        mapping = control[MAPPING]
        mapping += max(-slew, min(slew, control[TARGET] - mapping))
        deadline = due + mapping
        called = monotonic(buffer)
        wake = sleep_until(deadline, control, buffer)
        if control[STOP] != 0:
            break
        behind = (wake - deadline) // period
        if behind > max_catchup:
            mapping += behind * period
            deadline += behind * period
            control[RESYNCS] += 1
            control[SKIPPED] += behind
        if called >= deadline:     # no sleep above: leave the core a moment, a FIFO thread starves it otherwise
            sleep_until(wake + SLEEP_LEAST, control, buffer)
        control[MAPPING] = mapping
        slot = control[COUNT] % rows
        flags = tick(model, state, inputs, output, slot)
        done = monotonic(buffer)
        if done - deadline > period:
            control[OVERRUNS] += 1
        stats[slot, TIME] = due
        stats[slot, DEADLINE] = deadline
        stats[slot, WAKE] = wake
        stats[slot, DONE] = done
        stats[slot, FLAGS] = flags
        stats[slot, LAG] = mapping - control[TARGET]
        if flags & HALT:
            control[HALTED] = 1
        control[REACHED] = due
        control[COUNT] += 1
        _write(eventfd, one.ctypes, 8)
        due += period


class Row(NamedTuple):
    """What the loop says of one tick, ns."""

    time: int
    deadline: int
    wake: int
    done: int
    flags: int
    lag: int


class Loop:
    """The loop thread with its rings. `output` must have the rows of a ring, see physics.system.make_output."""

    def __init__(self, model, state, inputs, output, *, period_ns: int, priority: int = 0, max_catchup: int = 3):
        self.parts = (model, state, inputs, output)
        self.output = output
        self.period_ns = int(period_ns)
        self.priority = int(priority)
        self.max_catchup = int(max_catchup)
        self.slew_ns = self.period_ns // 50          # 2 %: a lag of 0.1 s is worked off in 5 s
        self.rows = len(output.frame)
        self.control = np.zeros(CONTROL_WORDS, np.int64)
        self.stats = np.zeros((self.rows, STATS_COLUMNS), np.int64)
        self.eventfd = os.eventfd(0, os.EFD_CLOEXEC)
        self.scheduler = "not running"
        self.warning = ""                            # why no real-time scheduling, with the remedy
        self.failure: BaseException | None = None
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
        self._thread = threading.Thread(target=self._enter, name="tick", daemon=True)
        self._thread.start()

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
        self.control[:] = 0
        self.stats[:] = 0
        os.eventfd_write(self.eventfd, 1)
        os.eventfd_read(self.eventfd)      # empties it

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

    def row(self, index: int) -> Row:
        return Row(*(int(value) for value in self.stats[index % self.rows]))

    @property
    def overruns(self) -> int:
        """Ticks that were done after the next deadline."""
        return int(self.control[OVERRUNS])

    def _enter(self) -> None:
        self.scheduler, self.warning = take_priority(self.priority)
        try:
            self._run()
        except BaseException as error:   # a thread's exception would vanish: diagnostics show it
            self.failure = error
            self.control[HALTED] = 1
            self.wake_reader()

    def _run(self) -> None:
        model, state, inputs, output = self.parts
        run(model, state, inputs, output, self.control, self.stats, np.zeros(2, np.int64), np.ones(1, np.int64),
            self.eventfd, int(self.control[REACHED]), self.period_ns, self.slew_ns, self.max_catchup)


def take_priority(priority: int) -> tuple[str, str]:
    """Give the calling thread SCHED_FIFO, else a lower nice value; returns (scheduler class, warning or "")."""
    _timer_slack()
    if priority <= 0:
        return "other", ""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))   # pid 0: this thread only
        return f"fifo {priority}", ""
    except (OSError, AttributeError):
        pass
    remedy = ("no permission for real-time scheduling: under load ticks may come some milliseconds late; allow it with "
              "'rtprio 80' for this user in /etc/security/limits.conf, or set realtime.priority:=0")
    try:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), -10)
        return "other, nice -10", remedy
    except OSError:
        return "other", remedy


def _timer_slack() -> None:
    """Ask for exact timers: a normal thread is otherwise woken up to 50 us late on purpose."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(29, 1, 0, 0, 0)   # PR_SET_TIMERSLACK, 1 ns
