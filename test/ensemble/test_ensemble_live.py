"""Beside a real node: the band comes over topics, the node runs the same bits with and without it, and its end is said.

Lockstep, so that the two runs of the node get the same messages at the same times.
"""

import os
import signal
import sys
import time

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = [pytest.mark.ros, pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")]

COMMAND = [sys.executable, "-m", "cable_sim_ros.cli", "ensemble", "--copies", "5"]  # its scene is the node's
TICK = {"solver.tick": 0.05}  # s; what is computed costs a fifth
FIRST = 5  # ticks of which the copies must hear one to follow the whole tow
SOON = 5.0  # s in which they say that they did
STARTS = 4  # of a start whose first ticks nobody heard yet another is made
WITHIN = 180.0  # s of wall time, on a machine that is busy


def sailed(sim, others=lambda sim: 0):
    """7 s in pieces of 0.5 s; the tick outputs. others: called before, may step by ticks and answers how many."""
    sim.feed(heave=(0.5, 6.0), duration=120.0)
    left = 140 - others(sim)
    while left:
        sim.step(min(left, 10))
        left -= min(left, 10)
    return sim.frames.copy()


def poll(condition, what):
    deadline = time.monotonic() + WITHIN
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


def test_a_band_beside_a_node_that_does_not_feel_it(tow_sim):
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from sensor_msgs.msg import JointState

    with tow_sim("side_scan", mode="lockstep", parameters=TICK) as sim:
        alone = sailed(sim)
        assert "ensemble" not in sim.diagnostics, "off by default"
    for _ in range(STARTS):
        with tow_sim("side_scan", mode="lockstep", parameters=TICK) as sim:
            bands = sim.listen(JointState, "ensemble/band")
            places = sim.listen(PoseWithCovarianceStamped, "ensemble/towbody")
            ensemble = []

            def others(sim, ensemble=ensemble):
                ensemble.append(sim.run(COMMAND, within=0))
                node = sim._link.client.node
                there = lambda: node.get_subscriptions_info_by_topic("/tow_sim/sim/health")  # noqa: E731
                poll(lambda: "cable_sim_ensemble" in [end.node_name for end in there()], "the ensemble is there")
                for done in range(1, FIRST + 1):  # the node may learn of it later than this client: one tick at a time
                    sim.step(1)
                    deadline = time.monotonic() + SOON
                    while time.monotonic() < deadline:
                        if "follow /tow_sim" in ensemble[-1].text:
                            return done
                        time.sleep(0.05)
                return FIRST

            together = sailed(sim, others)
            assert together.tobytes() == alone.tobytes(), "the node is the same to the bit"
            poll(lambda sim=sim, bands=bands, places=places: sim.step(1) or (len(bands) >= 3 and places), "bands come")
            together = sim.frames.copy()
            band = dict(zip(bands[-1].name, bands[-1].position, strict=True))
            assert band["copies"] == 5 and band["body_depth.low"] < band["body_depth.high"]
            if band["settling"] > 0.0:  # our client knew it before the node did: its copies begin at rest, and say so
                continue
            stamp = bands[-1].header.stamp.sec * 10**9 + bands[-1].header.stamp.nanosec
            frame = together[np.searchsorted(together["time"], stamp)]
            assert frame["time"] == stamp and band["body_depth.copy_0"] == pytest.approx(
                -frame["body_position"][2], abs=0.05
            )
            sim.node.kill()
            silent = lambda sim=sim: "says nothing" in sim.diagnostics.get("ensemble", (0, "", {}))[1]  # noqa: E731
            poll(silent, "the silence is said")
            assert sim.diagnostics["ensemble"][0] == 2 and ensemble[0].code is None
            assert ensemble[0].stop(((signal.SIGINT, 10.0),)) == 0
            return
    pytest.fail(f"in none of {STARTS} starts the copies heard the first ticks")
