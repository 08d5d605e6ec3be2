"""Where the workers of a sweep are: processes of this machine, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import CableSimError
from .engine import Make, processes, workers_of
from .store import EXTRA
from .worker import ONE_THREAD


class ClusterError(CableSimError, ValueError):
    """A cluster that cannot be reached or is not installed."""


@contextmanager
def executors(cluster: str | None, workers: int | None) -> Iterator[tuple[Make, int]]:
    """Maker of executors, and the number of workers. cluster: None (own processes), local, slurm or an address."""
    if cluster is None:
        count = workers_of(workers)
        yield lambda: processes(count), count
        return
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ClusterError(
            f"--cluster {cluster}: dask.distributed is not installed; nothing was simulated. {EXTRA}"
        ) from None
    count = workers_of(workers)
    if cluster == "local":
        held = LocalCluster(n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None)
    elif cluster == "slurm":
        try:
            from dask_jobqueue import SLURMCluster
        except ImportError:
            raise ClusterError(
                "--cluster slurm: dask-jobqueue is not installed; nothing was simulated. pip install dask-jobqueue, "
                "and describe the queue in its jobqueue.yaml"
            ) from None
        count = workers or 1
        held = SLURMCluster(cores=1, processes=1, job_script_prologue=[f"export {name}=1" for name in ONE_THREAD])
        held.scale(count)
    else:
        held = None
    try:
        try:
            client = Client(held if held is not None else cluster, timeout=20)
        except (OSError, ValueError, TimeoutError) as error:
            raise ClusterError(
                f"--cluster {cluster}: no scheduler answers ({error}); nothing was simulated. Give local, slurm or "
                "tcp://HOST:PORT of a scheduler that runs"
            ) from None
        with client:
            if held is None:
                count = workers or max(1, len(client.scheduler_info()["workers"]))
            yield lambda: client.get_executor(pure=False, retries=2), count
    finally:
        if held is not None:
            held.close()
