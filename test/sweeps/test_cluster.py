"""A local Dask cluster of separate processes: a worker killed, nothing lost or doubled, the bits of one process."""

import json
import os
import signal
from concurrent.futures import BrokenExecutor, CancelledError, Future
from functools import partial
from types import SimpleNamespace

import pytest

from cable_sim_ros.sweeps import engine
from cable_sim_ros.sweeps.cases import cases_of, code_of
from cable_sim_ros.sweeps.sweep_file import checked
from cable_sim_ros.sweeps.worker import simulate

distributed = pytest.importorskip("distributed")

from cable_sim_ros.sweeps.clusters import executors  # noqa: E402 (after the look for Dask)
from cable_sim_ros.sweeps.dask_executor import ClusterError, DaskExecutor, checked_there  # noqa: E402

PLAN = {"sweep": "short", "scene": "flume", "duration": 0.5, "grid": {"winch.scope": [0.8, 0.85, 0.9, 0.95, 1.0, 1.05]}}


def with_pid(case):
    return simulate(case) | {"pid": os.getpid()}


def plain(rows):
    left_out = ("cpu_s", "pid")
    return [json.dumps({k: v for k, v in row.items() if k not in left_out}, sort_keys=True) for row in rows]


def test_a_worker_killed_in_the_middle_loses_and_doubles_nothing(monkeypatch):
    monkeypatch.setattr(engine, "simulate", with_pid)
    cases = list(cases_of(checked(PLAN, "here")))
    rows, killed = [], None
    with executors("local", 2) as (make, count):
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
    assert isinstance(executor.submit(len, "a").exception(timeout=5), error)
    assert executor.useless is bool(own)
    executor.shutdown()


def test_a_row_that_cannot_be_fetched_is_lost_with_its_worker():
    executor = DaskExecutor(Client(raising(TimeoutError())))
    assert isinstance(executor.submit(len, "a").exception(timeout=5), BrokenExecutor)
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
