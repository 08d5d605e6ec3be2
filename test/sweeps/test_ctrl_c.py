"""Ctrl-C, which all processes of a terminal hear, while ours start and while they run: one hears it and ends them."""

import subprocess
import sys

import pytest

CODE = """
import multiprocessing, os, signal, sys
from concurrent.futures import wait

STARTS, KIND, WHEN = "__mp_main__" in __name__, *sys.argv[1:]


def interrupt():
    "As a terminal does it."
    os.killpg(0, signal.SIGINT)


def for_ever():
    if WHEN == "runs":
        interrupt()
    while True:
        signal.pause()


if STARTS and WHEN == "starts":
    assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []), "it was heard before"
    interrupt()
if __name__ == "__main__":
    from cable_sim_ros.processes import Forked, ForkServer, Spawn, Workers
    server = ForkServer()
    server.set_forkserver_preload(["preloaded"] * (WHEN == "preloads"))
    try:
        if KIND == "forked":
            one = Forked(target=for_ever, daemon=True)
            one.start()
            while one.is_alive():
                one.join(0.2)  # a signal just before a wait without end would be heard after it
        pool = Workers(1, mp_context=server if KIND == "served" else Spawn())
        try:
            future = pool.submit(for_ever)
            while not future.done():
                wait([future], 0.2)
        finally:
            pool.shutdown(cancel_futures=True)
    except KeyboardInterrupt:
        print("heard", [one.name for one in multiprocessing.active_children() if not one.daemon])
"""
PRELOADED = "import os, signal\nos.killpg(0, signal.SIGINT)\n"


@pytest.mark.parametrize(
    "kind, when",
    [
        ("spawned", "starts"),
        ("spawned", "runs"),
        ("served", "preloads"),
        ("served", "starts"),
        ("served", "runs"),
        ("forked", "runs"),
    ],
)
def test_ctrl_c_is_heard_by_the_caller_alone(tmp_path, kind, when):
    (tmp_path / "stopped.py").write_text(CODE, "utf-8")
    (tmp_path / "preloaded.py").write_text(PRELOADED, "utf-8")
    command = [sys.executable, "stopped.py", kind, when]
    started = {"cwd": tmp_path, "text": True, "start_new_session": True, "timeout": 300}
    done = subprocess.run(command, capture_output=True, **started)
    assert (done.returncode, done.stdout, done.stderr) == (0, "heard []\n", "")
