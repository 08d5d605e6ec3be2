"""Processes of a test end, whatever they do and however the test does."""

import os
import signal
import subprocess
import sys
import time

import pytest

from cable_sim_ros.errors import TowError
from cable_sim_ros.ros import watchdog
from cable_sim_ros.ros.child import Process

STUBBORN = (
    "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('deaf', flush=True); time.sleep(6000)"
)
PARENT = (
    "import subprocess, sys, time; print(subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(6000)']).pid,\
 flush=True); time.sleep(6000)"
)


def poll(condition, within=600.0):
    deadline = time.monotonic() + within
    while not (value := condition()):
        assert time.monotonic() < deadline, "not within the time"
        time.sleep(0.01)
    return value


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as stream:
            return stream.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def started(tmp_path, code, **environment):
    return Process("child", [sys.executable, "-c", code], tmp_path / "child.log", os.environ | environment)


def test_sigint_ends_it_and_what_it_has_started(tmp_path):
    parent = started(tmp_path, PARENT)
    child = int(poll(lambda: parent.text.strip()))
    assert parent.code is None and alive(child)
    assert parent.stop() != 0 and not alive(parent.pid)
    poll(lambda: not alive(child))
    assert parent.stop() == parent.code, "a second time is no error"


def test_one_that_is_deaf_is_killed(tmp_path):
    deaf = started(tmp_path, STUBBORN)
    poll(lambda: "deaf" in deaf.text)
    code = deaf.stop(((signal.SIGINT, 0.2), (signal.SIGKILL, 600.0)))
    assert code == -signal.SIGKILL and "deaf" in deaf.tail()


def test_one_that_outlives_everything_is_named(tmp_path):
    deaf = started(tmp_path, STUBBORN)
    poll(lambda: "deaf" in deaf.text)
    with pytest.raises(TowError, match=rf"child \(process {deaf.pid}\) outlived SIGINT\n  deaf"):
        deaf.stop(((signal.SIGINT, 0.1),))
    with pytest.raises(TowError, match=r"has not ended within 0.1 s\n  deaf"):
        deaf.wait(0.1)
    assert deaf.kill() == -signal.SIGKILL


def test_what_is_no_program_is_said(tmp_path):
    with pytest.raises(TowError, match="child could not be started: .*No such file.*the command was /no/such -x"):
        Process("child", ["/no/such", "-x"], tmp_path / "log", os.environ)


def test_the_watchdog_ends_all_when_the_session_is_killed(tmp_path):
    """SIGKILL to the session; its child, and a grandchild that left group and session, end all the same."""
    script = f"""
import os, sys, time
from pathlib import Path
from cable_sim_ros.ros import child, watchdog
code = "import subprocess, sys; "
code += "subprocess.run([sys.executable, '-c', 'import time; time.sleep(6000)'], start_new_session=True)"
folder = Path({str(tmp_path)!r})
child.Process("child", [sys.executable, "-c", code], folder / "log", os.environ)
print(child.MARK, flush=True)
time.sleep(6000)
"""
    session = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    try:
        mark = session.stdout.readline().strip()
        poll(lambda: len(watchdog.marked(mark)) == 2)
    finally:
        session.kill()
        session.communicate()
    poll(lambda: not watchdog.marked(mark))
