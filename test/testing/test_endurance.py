"""The short form of a hundred starts and stops, and what it would find."""

import os
import subprocess
import sys

import pytest

from cable_sim_ros.testing import shared_memory


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs the speed")
def test_nothing_is_left_of_nodes_that_were_stopped_and_killed():
    pytest.importorskip("rclpy")
    from cable_sim_ros.testing.endurance import endure, failed

    metrics = endure(2, kill_every=2)
    assert failed(metrics) == [] and metrics["starts"] == 2
    bad = dict.fromkeys(metrics, 1)
    assert failed(bad) == ["leftover_processes", "shared_memory_left", "threads_left", "hung", "descriptors_gained"]


def test_only_files_that_nobody_has_mapped_are_removed():
    names = {f"fastdds_test{os.getpid()}{k}" for k in "ab"}
    used, unused = sorted(names)
    for name in names:
        (shared_memory.SHARED / name).write_bytes(bytes(4096))
    (shared_memory.SHARED / f"{unused}_el").touch()
    code = f"import mmap; f = open('/dev/shm/{used}', 'r+b'); m = mmap.mmap(f.fileno(), 0); "
    code += "print('.', flush=True); input()"
    holder = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        holder.stdout.readline()
        assert shared_memory.mapped(holder.pid) == {used}
        assert shared_memory.remove(names) == {unused}
        assert not (shared_memory.SHARED / f"{unused}_el").exists()
    finally:
        holder.kill()
        holder.communicate()
    assert shared_memory.remove(names) == {used} and shared_memory.mapped(holder.pid) == set()
