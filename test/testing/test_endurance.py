"""What is left of nodes that were stopped and killed, and of shared memory: nothing."""

import os
import subprocess
import sys
import threading

import pytest

from cable_sim_ros import testing
from cable_sim_ros.ros import watchdog
from cable_sim_ros.ros.child import MARK
from cable_sim_ros.testing import tow_sim


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs the speed")
def test_nothing_is_left_of_nodes_that_were_stopped_and_killed():
    """No process, no thread, no file in shared memory, no descriptor."""
    pytest.importorskip("rclpy")
    descriptors = []
    for mode in ("realtime", "lockstep"):
        sim = testing.tow("full_scale", mode=mode)
        try:
            # not the ports: their names come again, and may by now be another program's
            segments = {name for name in tow_sim.mapped(sim.node.pid) if "port" not in name}
            sim.feed(heave=(1.0, 8.0), duration=5.0)
            sim.advance(0.2)
            if mode == "lockstep":
                sim.node.kill()
        finally:
            sim.close()
        assert not watchdog.marked(MARK) and not tow_sim.remove(segments)
        descriptors.append(len(os.listdir("/proc/self/fd")))  # the first has loaded everything
    assert descriptors[1] <= descriptors[0]
    assert not any(thread.name.startswith("cable_sim") for thread in threading.enumerate())


def test_only_files_that_nobody_has_mapped_are_removed():
    names = {f"fastdds_test{os.getpid()}{k}" for k in "ab"}
    used, unused = sorted(names)
    for name in names:
        (tow_sim.SHARED / name).write_bytes(bytes(4096))
    (tow_sim.SHARED / f"{unused}_el").touch()
    code = f"import mmap; f = open('/dev/shm/{used}', 'r+b'); m = mmap.mmap(f.fileno(), 0); "
    code += "print('.', flush=True); input()"
    holder = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        holder.stdout.readline()
        assert tow_sim.mapped(holder.pid) == {used}
        assert tow_sim.remove(names) == {unused}
        assert not (tow_sim.SHARED / f"{unused}_el").exists()
    finally:
        holder.kill()
        holder.communicate()
    assert tow_sim.remove(names) == {used} and tow_sim.mapped(holder.pid) == set()
