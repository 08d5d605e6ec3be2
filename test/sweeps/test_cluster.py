"""A local Dask cluster of separate processes: a worker killed, nothing lost or doubled, the bits of one process."""

import json
import os
import signal
import socket
import ssl
import sys
import warnings
from concurrent.futures import BrokenExecutor, CancelledError, Future
from functools import partial
from types import SimpleNamespace

import pytest

from cable_sim_ros.tools.sweeps import engine
from cable_sim_ros.tools.sweeps.cases import cases_of, code_of
from cable_sim_ros.tools.sweeps.sweep_file import checked
from cable_sim_ros.tools.sweeps.worker import simulate

distributed = pytest.importorskip("distributed")
pytest.importorskip("cryptography")
psutil = pytest.importorskip("psutil")  # Dask needs it

from cable_sim_ros.tools.sweeps.clusters import ClusterError, ClusterWarning, DaskExecutor, checked_there, executors  # noqa: E402 (after the look for Dask)  # noqa: E402

PLAN = {"sweep": "short", "scene": "flume", "duration": 0.5, "grid": {"winch.scope": [0.8, 0.85, 0.9, 0.95, 1.0, 1.05]}}


def with_pid(case):
    return simulate(case) | {"pid": os.getpid()}


def plain(rows):
    left_out = ("cpu_s", "pid")
    return [json.dumps({k: v for k, v in row.items() if k not in left_out}, sort_keys=True) for row in rows]


def test_a_cluster_of_this_machine_refuses_strangers():
    before = listening()
    with executors("local", 1) as (make, _):
        assert make().submit(divmod, 7, 3).result() == (2, 1)
        refuses_strangers(listening() - before, 3)  # scheduler, nanny, worker


@pytest.mark.nightly
def test_a_worker_killed_in_the_middle_loses_and_doubles_nothing(monkeypatch):
    monkeypatch.setattr(engine, "simulate", with_pid)
    cases = list(cases_of(checked(PLAN, "here")))
    rows, killed = [], None
    before = listening()
    with executors("local", 2) as (make, count):
        make()
        refuses_strangers(listening() - before, 5)  # scheduler, two nannies, two workers
        for case, row in engine.rows_of(cases, make, count):
            rows.append((case.number, row))
            if killed is None:
                killed = row["pid"]
                os.kill(killed, signal.SIGKILL)
    assert sorted(index for index, _ in rows) == list(range(len(cases)))
    pids = {row["pid"] for _, row in rows}
    assert os.getpid() not in pids and len(pids - {killed}) >= 1
    rows.sort(key=lambda one: one[0])
    assert plain(row for _, row in rows) == plain(simulate(case) for case in cases)


def listening():
    """Places that this process and those it started listen to."""
    here = psutil.Process()
    places = [one for process in (here, *here.children(recursive=True)) for one in process.net_connections("tcp")]
    return {tuple(one.laddr) for one in places if one.status == psutil.CONN_LISTEN}


def refuses_strangers(places, count):
    """Each place of the cluster wants its certificate: a stranger who speaks TLS hears nothing but that."""
    assert len(places) == count
    stranger = ssl.create_default_context()
    stranger.check_hostname, stranger.verify_mode = False, ssl.CERT_NONE
    for place in places:
        assert place[0] == "127.0.0.1"
        with socket.create_connection(place) as plain_one, pytest.raises(ssl.SSLError, match="(?i)cert"):
            stranger.wrap_socket(plain_one).recv(1)


@pytest.mark.parametrize("address, trusted", [("tcp://h:1", False), ("h:1", False), ("tls://h:1", True)])
def test_an_address_says_whom_it_trusts(monkeypatch, address, trusted):
    monkeypatch.setattr("distributed.Client", lambda *_, **__: (_ for _ in ()).throw(OSError("nobody")))
    with warnings.catch_warnings(record=True) as said, pytest.raises(ClusterError, match="no scheduler answers"):
        warnings.simplefilter("always")
        executors(address, 1).__enter__()
    assert [one.category for one in said] == ([] if trusted else [ClusterWarning])
    assert all("whoever reaches this scheduler runs code on its workers" in str(one.message) for one in said)


def test_slurm_has_a_certificate_and_no_page_and_none_is_no_cluster(monkeypatch):
    asked = {}

    def cluster(**options):
        asked.update(options)
        raise OSError("no queue")

    monkeypatch.setitem(sys.modules, "dask_jobqueue", SimpleNamespace(SLURMCluster=cluster))
    with pytest.raises(OSError, match="no queue"):
        executors("slurm", 1).__enter__()
    assert asked["security"].require_encryption and asked["security"].tls_scheduler_key.startswith("-----BEGIN")
    assert asked["scheduler_cls"].start_http_server is not distributed.Scheduler.start_http_server
    monkeypatch.setitem(sys.modules, "cryptography", None)
    for name in ("local", "slurm"):
        with pytest.raises(ClusterError, match="cryptography is not installed, and without a certificate every user"):
            executors(name, 1).__enter__()


class Client:
    """In place of Dask's: its futures end as they are told to."""

    status = "running"

    def nthreads(self):
        return {"one": 1}

    def __init__(self, result):
        self.result = result

    def submit(self, function, /, *args, pure):
        done = SimpleNamespace(result=self.result)
        done.add_done_callback = lambda call: call(done)
        return done

    def cancel(self, futures, force):
        pass


def raising(error):
    def result(timeout):
        raise error

    return result


@pytest.mark.parametrize("own, error", [(1, BrokenExecutor), (0, ClusterError)])
def test_a_scheduler_that_is_gone_ends_every_case(own, error):
    executor = DaskExecutor(Client(raising(CancelledError("scheduler-connection-lost"))), own)
    assert isinstance(executor.submit(len, "a").exception(timeout=600), error)
    assert executor.useless is bool(own)
    executor.shutdown()


def test_a_row_that_cannot_be_fetched_is_lost_with_its_worker():
    executor = DaskExecutor(Client(raising(TimeoutError())))
    assert isinstance(executor.submit(len, "a").exception(timeout=600), BrokenExecutor)
    executor.shutdown()


def test_rows_are_of_this_program_alone():
    assert checked_there(code_of(), partial(len, "abc")) == 3
    with pytest.raises(ClusterError, match="another version of cable_sim_ros"):
        checked_there("0", partial(len, "abc"))


def test_a_lost_cluster_ends_the_sweep_and_is_no_row():
    class Gone(DaskExecutor):
        def __init__(self):
            pass

        def submit(self, function, /, *args):
            future = Future()
            future.set_exception(ClusterError("gone"))
            return future

        def shutdown(self, wait=True, *, cancel_futures=False):
            pass

    with pytest.raises(ClusterError, match="gone"):
        list(engine.rows_of(list(cases_of(checked(PLAN, "here"))), Gone, 1))
