"""Processes of our own. Ctrl-C reaches all processes of a terminal: ours leave it to the one that started them, which
ends them. Imports nothing of ours."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import context, resource_tracker
from typing import Any

INTERRUPT = {signal.SIGINT}


@contextmanager
def deaf() -> Iterator[None]:
    """What is started in it does not hear SIGINT, from its first instruction on; the caller hears it at the end, as a
    start that is cut in two leaves a process without its task."""
    resource_tracker.ensure_running()  # its start would let the signal through
    came: list[int] = []
    raises = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    waits = raises and threading.current_thread() is threading.main_thread()
    if waits:  # a signal that another thread took would be raised here
        signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPT)  # is inherited, as a handler is not
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if waits:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if came:
            signal.raise_signal(signal.SIGINT)


class _Deaf:
    """How such a process is started, and what it does first."""

    def start(self) -> None:
        with deaf():
            super().start()  # type: ignore[misc]

    def run(self) -> None:
        signal.signal(signal.SIGINT, lambda *_: None)  # no SIG_IGN: a node that is started here is to hear it
        signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPT)
        super().run()  # type: ignore[misc]


class Spawned(_Deaf, context.SpawnProcess):
    """Started afresh."""


class Served(_Deaf, context.ForkServerProcess):
    """Forked off a process that has imported already."""


class Forked(_Deaf, context.ForkProcess):
    """A copy of this process."""


class Spawn(context.SpawnContext):
    """Of `Spawned`."""

    Process = Spawned


class ForkServer(context.ForkServerContext):
    """Of `Served`."""

    Process = Served


class Workers(ProcessPoolExecutor):
    """A pool whose shutdown ends what it has in hand as well, where its futures are cancelled."""

    def submit(self, *args: Any, **options: Any) -> Future:
        """As of Executor; it is heard of a process that was started before a signal is."""
        with deaf():
            return super().submit(*args, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """As of Executor; cancel_futures: nobody waits for what is being run either."""
        if cancel_futures:  # before they are cancelled: a pool that breaks with cancelled futures hangs
            for process in list((self._processes or {}).values()):
                process.terminate()
        super().shutdown(wait, cancel_futures=cancel_futures)


class Alive:
    """True until SIGINT or SIGTERM."""

    def __init__(self) -> None:
        self.asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._end)

    def _end(self, *_: Any) -> None:
        self.asked = True

    def __call__(self) -> bool:
        return not self.asked
