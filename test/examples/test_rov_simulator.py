"""rov_simulator.py beside the node in lockstep: pose in, wrench out."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = [
    pytest.mark.rest,
    pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="minutes without compilation"),
]
SCRIPT = Path(__file__).with_name("rov_simulator.py")
EAST, NORTH, DOWN = -50.0, 0.0, 32.0  # where the scene has it, the ship heading east


def test_an_rov_simulator_of_another_convention_beside_the_node():
    from geometry_msgs.msg import WrenchStamped

    from cable_sim_ros.testing import tow

    with tow("rov_tether", mode="lockstep", parameters={"solver.tick": 0.02}, may_be_doubtful=True) as sim:
        wrenches = sim.listen(WrenchStamped, "vehicle/wrench")
        command = [
            sys.executable,
            SCRIPT,
            NORTH,
            EAST,
            DOWN,
            "--ros-args",
            "-r",
            "__ns:=/tow_sim",
            "-p",
            "use_sim_time:=true",
        ]
        sim.run(command, name="ROV", publishes="vehicle/odom", within=600.0)
        sim.feed(heave=(0.5, 8.0), duration=40.0)
        frames = sim.advance(20.0)
        assert sim.missing == 0
        late = frames[600:]
        # 200 N/m hold it against the pull of the tether, some newtons
        miss = late.vehicle_position - (EAST, NORTH, -DOWN)
        force = late.vehicle_force
        assert 5.0 < np.linalg.norm(force.mean(axis=0)) < 30.0
        np.testing.assert_allclose(miss.mean(axis=0), force.mean(axis=0) / 200.0, atol=0.02)
        assert np.linalg.norm(np.diff(late.vehicle_position, axis=0), axis=1).max() < 0.02  # no jump between poses
        assert not (late.vehicle_off > 0.0).any() and (late.vehicle_age < 0.2).all()
        at = {m.header.stamp.sec * 10**9 + m.header.stamp.nanosec: m for m in wrenches}
        both = [(at[t], k) for k, t in enumerate(frames.time.tolist()) if t in at]
        assert len(both) > 500
        for message, k in [pair for pair in both if pair[1] >= 600][::50]:  # it has heard its pose long ago
            assert message.header.frame_id == "vehicle_link"
            # the ROV heads north: forward is north, port is west
            x, y, z = frames.vehicle_force[k]
            f = message.wrench.force
            np.testing.assert_allclose((f.x, f.y, f.z), (y, -x, z), atol=0.2)
