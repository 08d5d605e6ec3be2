"""Dask clusters that nobody else gets into: one certificate for one run, and no page of the scheduler."""

from __future__ import annotations

from logging import CRITICAL
from typing import Any

from distributed import Nanny, Scheduler, SpecCluster, Worker
from distributed.security import Security

from .threads import ONE_THREAD

HOST = "127.0.0.1"  # every user of the machine reaches it, so it asks for the certificate as well


class PagelessScheduler(Scheduler):
    """A scheduler that listens to its workers and clients alone."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """None: its pages ask nobody who he is."""


class PagelessWorker(Worker):
    """A worker likewise."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """None, as of the scheduler."""


def local_cluster(count: int, security: Security) -> SpecCluster:
    """Scheduler in this process and count workers, each a process of one thread; security: both ends of a connection
    show its certificate, whose key the workers get through the pipe that they are started by."""
    common = {"host": HOST, "protocol": "tls://", "security": security}
    worker = {
        "cls": Nanny,
        "options": common
        | {
            "nthreads": 1,
            "memory_limit": 0,
            "silence_logs": CRITICAL,
            "env": dict.fromkeys(ONE_THREAD, "1"),
            "worker_class": PagelessWorker,
        },
    }
    return SpecCluster(
        workers=dict.fromkeys(range(count), worker),
        worker=worker,
        scheduler={"cls": PagelessScheduler, "options": common | {"port": 0, "dashboard": False}},
        security=security,
        silence_logs=CRITICAL,
    )
