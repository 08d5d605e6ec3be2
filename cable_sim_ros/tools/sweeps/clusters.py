"""Where the workers of a sweep are: processes of this machine, or a Dask cluster.

The workers of a Dask client as a `concurrent.futures.Executor` that never leaves a future open.

Dask's own (`Client.get_executor`) does where a worker dies after it ended a case and before its row was fetched: the
row is waited for without end. Here that case counts as lost with its worker, and the engine runs it again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar
from warnings import warn

from ...errors import CableSimError, told_as
from .engine import Make, processes, workers_of
from .store import EXTRA
from .threads import ONE_THREAD

P = ParamSpec("P")
T = TypeVar("T")
FETCH, LOOK, WITHOUT = 10.0, 1.0, 60.0  # s: for a row, between looks at the cluster, that a local one may lack a worker

SETTINGS = {  # of Dask
    "distributed.scheduler.allowed-failures": 0,  # the engine runs alone what was lost with a worker
    "distributed.worker.memory.terminate": False,  # the engine gives no worker more than a case; see MEMORY
    "distributed.worker.memory.pause": False,  # a paused worker would keep its case without end
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.target": False,
}
TRUST = (
    "no certificate is asked for there: whoever reaches this scheduler runs code on its workers, and its answers are "
    "run here. Trust everyone on that network, or give tls:// and the certificates of distributed.comm.tls in Dask's "
    "configuration"
)


class ClusterError(CableSimError, ValueError):
    """A cluster that cannot be reached, is not installed, or is not fit for a sweep."""


def checked_there(code: str, call: Callable[[], T]) -> T:
    """On a worker: the result of the call, if the program there is the one that handed it out."""
    from .cases import code_of

    if code_of() != code:
        raise ClusterError(
            "a worker of the cluster has another version of cable_sim_ros than this program: its rows would be those "
            "of another physics; the rows before are kept. Install the same on all workers"
        )
    return call()


class DaskExecutor(Executor):
    """client: of distributed, stays open; own: workers of a cluster of this process, 0: of others; useless: one of our
    own that lost a worker, and is made anew: Dask's, after that, may keep a case without end.

    A future ends with BrokenExecutor where its worker died, its row was lost with the worker or a local cluster lacks
    workers for WITHOUT s; with ClusterError where the scheduler is gone.
    """

    def __init__(self, client: Any, own: int = 0) -> None:
        from .cases import code_of

        self._client, self._own = client, own
        self.useless = False
        self._open: dict[Future, Any] = {}
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._code = code_of()
        self._watcher = threading.Thread(target=self._watch, name="cluster", daemon=True)
        self._watcher.start()

    def submit(self, function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Future of function(*args, **kwargs) on a worker; all are pickled."""
        given: Future[T] = Future()
        try:
            made = self._client.submit(checked_there, self._code, partial(function, *args, **kwargs), pure=False)
        except Exception as error:  # a client that is closed or has lost its scheduler raises many kinds
            given.set_exception(self._gone(error))
            return given
        with self._lock:
            self._open[given] = made
        made.add_done_callback(partial(self._hand_over, given))
        return given

    def _hand_over(self, given: Future, made: Any) -> None:
        """In a thread of Dask's, when a case has ended one way or another."""
        from distributed import KilledWorker

        try:
            self._end(given, result=made.result(timeout=FETCH))
        except (KilledWorker, TimeoutError) as error:
            self.useless = bool(self._own)
            self._end(given, error=BrokenExecutor(f"{type(error).__name__}: {error}"))
        except CancelledError as error:
            self._end(given, error=self._gone(error))
        except Exception as error:
            self._end(given, error=error)

    def _end(self, given: Future, result: Any = None, error: BaseException | None = None) -> None:
        with self._lock:
            if self._open.pop(given, None) is None or not given.set_running_or_notify_cancel():
                return
        if error is None:
            given.set_result(result)
        else:
            given.set_exception(error)

    def _gone(self, error: BaseException) -> Exception:
        """What ends a case whose scheduler does not answer: of a cluster of our own it is run on another."""
        if self._own:
            self.useless = True
            return BrokenExecutor(str(error))
        return ClusterError(
            f"the scheduler of the cluster is gone ({error}); the rows before are kept. Start the same sweep again: it "
            "goes on"
        )

    def _watch(self) -> None:
        empty = 0.0
        while not self._ended.wait(LOOK):
            gone = self._client.status not in ("running", "connecting")
            there = True
            if self._own and not gone:
                with suppress(Exception):  # a look that fails says nothing
                    there = len(self._client.nthreads()) >= self._own
            empty = 0.0 if there else empty + LOOK
            if gone or empty >= WITHOUT:
                for given in list(self._open):
                    self._end(
                        given, error=self._gone(RuntimeError(f"client {self._client.status}, workers are missing"))
                    )

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Cancel what has not ended, whether cancel_futures says so or not."""
        self._ended.set()
        with self._lock:
            left = dict(self._open)
            self._open.clear()
        for given in left:
            given.cancel()
        with suppress(Exception):  # a scheduler that is gone has nothing to cancel
            self._client.cancel(list(left.values()), force=True)
        if wait and threading.current_thread() is not self._watcher:
            self._watcher.join()


class ClusterWarning(UserWarning):
    """Whom a cluster trusts."""


@contextmanager
def executors(cluster: str | None, workers: int | None) -> Iterator[tuple[Make, int]]:
    """Maker of executors, and the number of workers. cluster: None (own processes), local, slurm or an address."""
    if cluster is None:
        count = workers_of(workers)
        yield lambda: processes(count), count
        return
    missing = f"--cluster {cluster}: dask.distributed is not installed; nothing was simulated. {EXTRA}"
    with told_as(ClusterError, missing, of=ImportError):
        import dask
        from distributed import Client
    if cluster == "local":
        count = workers_of(workers)
        with dask.config.set(SETTINGS):
            local = _Local(count, _of_this_run(cluster))
            try:
                yield local.executor, count
            finally:
                local.close()
        return
    held = None
    if cluster == "slurm":
        try:
            from dask_jobqueue import SLURMCluster
        except ImportError:
            raise ClusterError(
                "--cluster slurm: dask-jobqueue is not installed; nothing was simulated. pip install dask-jobqueue, "
                "and describe the queue in its jobqueue.yaml"
            ) from None
        from .local_cluster import PagelessScheduler

        held = SLURMCluster(
            cores=1,
            processes=1,
            job_script_prologue=[f"export {name}=1" for name in ONE_THREAD],
            security=_of_this_run(cluster),
            scheduler_cls=PagelessScheduler,
        )
        held.scale(workers or 1)
    elif not cluster.startswith(("tls://", "wss://")):
        warn(f"--cluster {cluster}: {TRUST}", ClusterWarning, stacklevel=3)
    try:
        try:
            client = Client(held if held is not None else cluster, timeout=20)
        except (OSError, ValueError, TimeoutError) as error:
            raise ClusterError(
                f"--cluster {cluster}: no scheduler answers ({error}); nothing was simulated. Give local, slurm or "
                "tcp://HOST:PORT of a scheduler that runs"
            ) from None
        with client:
            threads = client.nthreads()
            if wide := [name for name, count in threads.items() if count != 1]:
                raise ClusterError(
                    f"--cluster {cluster}: worker {wide[0]} has {threads[wide[0]]} threads, and a worker simulates "
                    "one case at a time; nothing was simulated. Start workers with --nthreads 1"
                )
            yield lambda: DaskExecutor(client), workers or max(1, len(threads))
    finally:
        if held is not None:
            held.close()


def _of_this_run(cluster: str) -> Any:
    """A certificate made now, its key in memory: who does not show it is not heard."""
    from distributed.security import Security

    try:
        return Security.temporary()
    except ImportError:
        raise ClusterError(
            f"--cluster {cluster}: the package cryptography is not installed, and without a certificate every user of "
            f"the machine could run code in the workers; nothing was simulated. {EXTRA}"
        ) from None


class _Local:
    """A cluster of this machine: separate processes, all of them started anew where one died."""

    def __init__(self, count: int, security: Any) -> None:
        self.count, self.security = count, security
        self._open: tuple[Any, Any] | None = None
        self._last: DaskExecutor | None = None

    def executor(self) -> DaskExecutor:
        """On the cluster, which starts with the first."""
        from distributed import Client

        from .local_cluster import local_cluster

        if self._last is not None and self._last.useless:
            self.close()
        if self._open is None:
            held = local_cluster(self.count, self.security)
            try:
                self._open = Client(held, timeout=60), held
            except BaseException:
                held.close()
                raise
        self._last = DaskExecutor(self._open[0], own=self.count)
        return self._last

    def close(self) -> None:
        """End the processes."""
        for one in self._open or ():
            with suppress(Exception):  # what is gone need not be closed
                one.close()
        self._open = self._last = None
