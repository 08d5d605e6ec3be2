"""Kernels compiled by as many processes as there are cores, where they are not on disk yet.

What is called by symbol can be compiled in any order and place (`by_symbol.py`). The calling process and workers of
its own take one kernel after the other, the largest first; each keeps what it compiled on disk, where the calling
process finds it. Nothing depends on a worker: what one leaves undone, because it died or could not start, the calling
process compiles itself, to the same code.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import importlib
import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from base64 import b64decode, b64encode
from collections.abc import Callable
from typing import Any

import numba

from .by_symbol import Task as Link
from .by_symbol import fingerprint, planned, publish
from .kernel_cache import files
from .kernel_form import Form, Kernel
from .kernel_key import content_of

MODULE = __name__
MAX_WORKERS = 3  # beside the calling process, 320 MB each: the longest kernel takes a sixth of the whole
SMALL = 4000  # bytes of bytecode; less compiles sooner than a worker starts
HANGS, TIMES = 30.0, 3.0  # s, and times what the calling process took: a worker is given up after both
Task = tuple[Any, tuple]  # form, types
_prepared: set[tuple] = set()
_begun: list[_Pool] = []


def ahead(needed: Callable[[], tuple]) -> None:
    """Workers begin with what prepare(*needed()) takes when this process compiles for the first time, beside it."""

    def begin() -> None:
        pool = _Pool()
        _begun.append(pool)
        atexit.register(pool.stop)
        pool.take(missing(tasks_of(*needed())))

    Kernel.before_first = None if numba.config.DISABLE_JIT else begin


def prepare(linker: Callable[..., None], parts: tuple, entry: Any = None, arguments: tuple = ()) -> None:
    """Compile or load what ``linker(*parts)`` publishes, and publish it; the entry with its arguments is compiled too.

    Raises what `by_symbol.link` raises.
    """
    if numba.config.DISABLE_JIT:
        return
    key, links = (entry, fingerprint(arguments)), planned(linker, *parts)
    if not links and key in _prepared:
        return
    compile_all(missing(_tasks(links, entry, arguments)))
    for link in links:
        publish(link)
    _prepared.add(key)


def tasks_of(linker: Callable[..., None], parts: tuple, entry: Any, arguments: tuple) -> list[Task]:
    """What prepare() would compile now."""
    return _tasks(planned(linker, *parts), entry, arguments)


def _tasks(links: list[Link], entry: Any, arguments: tuple) -> list[Task]:
    tasks = [(link.form, link.types) for link in links]
    if entry is not None:
        tasks.append((entry, tuple(numba.typeof(a) for a in arguments)))
    return tasks


def missing(tasks: list[Task]) -> list[Task]:
    """Those of the tasks that could be on disk and are not, nor in memory."""
    own = ((form, types) for form, types in tasks if isinstance(form, Form))
    return [(form, types) for form, types in own if types not in form.overloads and form._cache.lacks(types)]


def workers_for(tasks: list[Task]) -> int:
    """Worker processes worth starting beside this one."""
    sizes = [content_of(form)[1] for form, _ in tasks]
    if sum(sizes) - max(sizes, default=0) < SMALL or not _interpreter() or not files.writable():
        return 0
    return max(0, min(cores() - 1, len(tasks) - 1, MAX_WORKERS))


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _interpreter() -> str:
    """The program that runs a Python module, nothing where this one is frozen or embedded."""
    program = sys.executable or ""
    known = os.path.basename(program).lower().startswith(("python", "pypy"))
    return program if known and not getattr(sys, "frozen", False) else ""


class _Pool:
    """Kernels that wait, the largest first, and the workers that take them."""

    def __init__(self) -> None:
        self.waiting: queue.PriorityQueue[tuple[int, int, Task]] = queue.PriorityQueue()
        self.threads: list[threading.Thread] = []
        self._workers: list[subprocess.Popen] = []
        self._taken: set[tuple[int, tuple]] = set()

    def take(self, tasks: list[Task]) -> None:
        """Let these wait too, and start the workers worth it."""
        new = [(form, types) for form, types in tasks if (id(form), types) not in self._taken]
        for form, types in new:
            self._taken.add((id(form), types))
            self.waiting.put((-content_of(form)[1], len(self._taken), (form, types)))
        for _ in range(workers_for(new) - sum(thread.is_alive() for thread in self.threads)):
            thread = threading.Thread(target=self._serve, name="compile", daemon=True)
            try:
                thread.start()
            except RuntimeError:  # as many as this process may have
                break
            self.threads.append(thread)

    def keep_only(self, tasks: list[Task]) -> None:
        """Let none but these wait."""
        wanted = {(id(form), types) for form, types in tasks}
        with self.waiting.mutex:
            waiting = (one for one in self.waiting.queue if (id(one[2][0]), one[2][1]) in wanted)
            self.waiting.queue = sorted(waiting)  # a heap, as the queue wants it

    def finish(self) -> None:
        """Take what waits beside the workers, then wait for them."""
        begun = time.monotonic()
        try:
            while True:
                form, types = self.waiting.get_nowait()[2]
                form.keep(types)
        except queue.Empty:
            limit = time.monotonic() + HANGS + TIMES * (time.monotonic() - begun)
            for thread in self.threads:
                thread.join(max(0.0, limit - time.monotonic()))
        finally:
            self.stop()

    def stop(self) -> None:
        """Leave what waits, after an error or at the end of the process, and kill workers that hang or go on."""
        with contextlib.suppress(queue.Empty):
            while True:
                self.waiting.get_nowait()
        for worker in self._workers:
            worker.kill()
        for thread in self.threads:
            thread.join()

    def _serve(self) -> None:
        """Give what waits to a worker of its own, one after the other, until it dies or nothing is left."""
        command = [_interpreter(), "-P", "-W", "ignore", "-m", MODULE]
        pipe = subprocess.PIPE
        try:
            places = os.pathsep.join(p or os.getcwd() for p in sys.path if isinstance(p, str))
            environment = {**os.environ, "PYTHONPATH": places}
            worker = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, env=environment)
        except OSError:
            return
        self._workers.append(worker)
        assert worker.stdin is not None and worker.stdout is not None
        with contextlib.suppress(OSError), worker:
            while worker.stdout.readline():  # ready for one
                try:
                    form, types = self.waiting.get_nowait()[2]
                except queue.Empty:  # said: a process forked meanwhile holds the pipe open too
                    worker.stdin.write(b"\n")
                    return
                worker.stdin.write(b64encode(pickle.dumps((_name(form), types))) + b"\n")
                worker.stdin.flush()


def compile_all(tasks: list[Task]) -> None:
    """Compile these kernels, with workers where that is worth it; afterwards all are in memory or on disk."""
    pool = _begun.pop() if _begun else _Pool()
    pool.keep_only(tasks)
    pool.take(tasks)
    if pool.threads:  # else each is compiled where it is linked or called
        pool.finish()
    atexit.unregister(pool.stop)


def _name(form: Form) -> tuple[str, str, str]:
    return form.py_func.__module__, form.py_func.__qualname__, form.kind


def _named(module: str, name: str, kind: str) -> Any:
    kernel = getattr(importlib.import_module(module), name)
    return getattr(kernel, kind, kernel)


def work() -> None:
    """What a worker does: a line for each kernel that it is ready to compile, until its input ends."""
    gc.set_threshold(700, 10, 100)  # GARBAGE of limits.py: searches of all objects took a tenth
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    out, sys.stdout = sys.stdout, sys.stderr
    while True:
        out.write("ready\n")
        out.flush()
        line = sys.stdin.buffer.readline()
        if not line.strip():
            return
        name, types = pickle.loads(b64decode(line))
        _named(*name).keep(types)


def _end_with(caller: int) -> None:
    while os.getppid() == caller:
        time.sleep(1.0)
    os._exit(1)


if __name__ == "__main__":
    work()
