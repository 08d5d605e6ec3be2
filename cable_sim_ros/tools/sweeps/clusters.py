"""Where the workers of a sweep are: processes of this machine, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any
from warnings import warn

from .dask_executor import ClusterError, DaskExecutor
from .engine import Make, processes, workers_of
from .store import EXTRA
from .threads import ONE_THREAD

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


class ClusterWarning(UserWarning):
    """Whom a cluster trusts."""


@contextmanager
def executors(cluster: str | None, workers: int | None) -> Iterator[tuple[Make, int]]:
    """Maker of executors, and the number of workers. cluster: None (own processes), local, slurm or an address."""
    if cluster is None:
        count = workers_of(workers)
        yield lambda: processes(count), count
        return
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise ClusterError(
            f"--cluster {cluster}: dask.distributed is not installed; nothing was simulated. {EXTRA}"
        ) from None
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
