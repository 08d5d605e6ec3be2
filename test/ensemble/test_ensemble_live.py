"""Beside a real node: the band comes over topics, the node runs the same bits with and without it, and its end is said.

Lockstep, so that the two runs of the node get the same messages at the same times.
"""

import itertools
import os
import signal
import sys
import time

import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")

COMMAND = [sys.executable, "-m", "cable_sim_ros.cli", "ensemble", "--copies", "5"]  # its scene is the node's
TICK = {"solver.tick": 0.05, "lockstep.wait": 600.0}  # s; what is computed costs a fifth
WITHIN = 600.0  # s of wall time that only something that hangs takes


def sailed(sim, others=lambda sim: None):
    """5 s in pieces of 0.5 s; the tick outputs. others: called before."""
    sim.feed(heave=(0.5, 6.0), duration=60.0)
    others(sim)
    for _ in range(10):
        sim.step(10)
    return sim.frames.copy()


def poll(condition, what):
    deadline = time.monotonic() + WITHIN
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


def test_a_band_beside_a_node_that_does_not_feel_it(tow_sim):
    """Whether the copies hear the first tick is the middleware's: what they make of all of them is held on a bag."""
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from sensor_msgs.msg import JointState

    with tow_sim("side_scan", mode="lockstep", parameters=TICK) as sim:
        alone = sailed(sim)
        assert "ensemble" not in sim.diagnostics, "off by default"
    with tow_sim("side_scan", mode="lockstep", parameters=TICK) as sim:
        bands = sim.listen(JointState, "ensemble/band")
        places = sim.listen(PoseWithCovarianceStamped, "ensemble/towbody")
        ensemble = []

        def others(sim):
            ensemble.append(sim.run(COMMAND, within=0))
            there = sim._link.client.node.get_subscriptions_info_by_topic
            ready = lambda: "cable_sim_ensemble" in [end.node_name for end in there("/tow_sim/sim/health")]  # noqa: E731
            poll(ready, "the ensemble is there")

        together = sailed(sim, others)
        assert together.tobytes() == alone.tobytes(), "the node is the same to the bit"
        ticks = itertools.count()

        def come():
            """Copies on a busy machine are behind: ever fewer ticks, or the motion that is fed ends before WITHIN."""
            time.sleep(0.0 if next(ticks) < 200 else 1.0)
            sim.step(1)
            return len(bands) >= 3 and places

        poll(come, "bands come")
        band = dict(zip(bands[-1].name, bands[-1].position, strict=True))
        assert band["copies"] == 5 and band["body_depth.low"] < band["body_depth.high"]
        stamp = bands[-1].header.stamp.sec * 10**9 + bands[-1].header.stamp.nanosec
        assert stamp in sim.frames["time"]
        sim.node.kill()
        poll(lambda: "says nothing" in sim.diagnostics.get("ensemble", (0, "", {}))[1], "the silence is said")
        assert sim.diagnostics["ensemble"][0] == 2 and ensemble[0].code is None
        assert ensemble[0].stop(((signal.SIGINT, WITHIN),)) == 0
