"""A node under test: what it is fed and asked, what goes wrong, and that nothing is left of it."""

import os
import sys
import time

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = [pytest.mark.ros, pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")]

from cable_sim_ros.testing import TowError, tow, watchdog  # noqa: E402
from cable_sim_ros.testing.process import MARK  # noqa: E402

NODE = "import sys, time; print('so far so good', flush=True); "


def poll(condition, within):
    deadline = time.monotonic() + within
    while not condition():
        assert time.monotonic() < deadline, "not within the time"
        time.sleep(0.01)


def python(code):
    return (sys.executable, "-c", code)


@pytest.mark.parametrize(
    "options, text",
    [
        ({"mode": "fast"}, "mode = 'fast' is not known: nothing was started; give 'realtime' or 'lockstep'"),
        ({"command": python(NODE + "sys.exit(3)")}, "the node ended with code 3\n  so far so good"),
        (
            {"command": python(NODE + "time.sleep(60)"), "ready_within": 1.0},
            r"not ready for motion, within 1 s \(state starting\)\n  so far so good",
        ),
        ({"command": ("/no/such",)}, "the node could not be started: .*No such file"),
        ({"parameters": {"winch.scope": -1.0}, "command": python(NODE + "time.sleep(60)")}, "winch.scope"),
        ({"scene": "no_such", "command": python(NODE + "time.sleep(60)")}, "no_such"),
    ],
)
def test_a_node_that_does_not_start_is_said_with_its_last_lines(options, text, tmp_path):
    with pytest.raises(TowError, match=text):
        tow(options.pop("scene", "full_scale"), folder=tmp_path, **options)
    assert not watchdog.marked(MARK)


def test_a_node_in_real_time_from_start_to_end(tmp_path):
    with tow("full_scale", parameters={"setpoint.algorithm": "hold"}, folder=tmp_path, record=True) as sim:
        assert sim.environment["ROS_DOMAIN_ID"] == str(sim.domain) and sim.state == "waiting"
        with pytest.raises(TowError, match=r"step\(\) is for mode='lockstep'"):
            sim.step()
        with pytest.raises(TowError, match=r"give rate=\.\.\. in m/s or payout=\.\.\. in m: nothing was commanded"):
            sim.command()
        begin = sim.feed(heave=(1.0, 8.0), duration=60.0)
        frames = sim.advance(1.0)
        assert len(frames) >= 100 and sim.missing == 0 and frames.time[0] * 1e-9 > begin
        assert (np.diff(frames.time) == 10_000_000).all()
        with pytest.raises(ValueError, match="read-only"):
            frames.tension[0] = 0.0

        sim.command(rate=0.2)
        sim.wait_until(lambda frames: frames.payout_rate[-1] > 0.15, within=2.0)
        with pytest.raises(TowError, match=r"not within 0.2 s of simulation; at .* s: tension \d+ N, pay-out"):
            sim.wait_until(lambda frames: frames.payout[-1] < 0.0, within=0.2)
        sim.set("setpoint.algorithm", "simplified_sheave")
        with pytest.raises(TowError, match=r"winch.max_rate = 1.0 was refused"):
            sim.set("winch.max_rate", 1.0)
        assert "static equilibrium" in sim.call("reset")
        with pytest.raises(TowError, match="pause: "):
            sim.call("pause", True)
        from sensor_msgs.msg import Imu

        other = sim._link.ears.node.create_publisher(Imu, "imu/data", 10)
        with pytest.raises(TowError, match=rf"2 publishers of imu/data in domain {sim.domain}: "):
            sim.advance(5.0)
        sim._link.ears.node.destroy_publisher(other)

        gives_up = python("print('I give up'); raise SystemExit(7)")
        assert sim.run(gives_up, name="a pilot", within=0.0, may_end=True).wait(10.0) == 7
        sim.run(gives_up, name="the pilot", within=0.0)
        with pytest.raises(TowError, match="the pilot ended with code 7\n  I give up"):
            sim.advance(20.0)
        stray = "import subprocess, sys, time; "
        stray += "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'], start_new_session=True); "
        sim.processes.clear()
        sim.run(python(stray + "time.sleep(60)"), name="one that leaves another", within=0.0)
        poll(lambda: len(watchdog.marked(sim._mark)) == 3, 10.0)
    assert len(sim.leftovers) == 1
    assert sim.node.code == 0 and sim.figures["state"] == "stopped" and sim.figures["last"] == "running"
    assert not watchdog.marked(sim._mark)
    assert (sim.recording / "metadata.yaml").is_file()
    sim.close()
