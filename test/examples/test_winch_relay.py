"""Nodes between the simulation and a controller: two runs are the same bits.

To copy: a chain of processes that the tow waits for (docs/lockstep.md). winch_relay.py is a drive and instruments of
one's own; that a scene can be the same is test/sim/test_relay_and_scene.py.
"""

import signal
import sys
import time
from pathlib import Path

import pytest
from test_heave_compensator import CONTROLLER, PART, RAMP, same_bits, stalled, waves, whole

from cable_sim_ros.testing import TowError, tow

RELAY = Path(__file__).with_name("winch_relay.py")
RATE = 100  # Hz, a command for every tick
LINKS = {"winch/command": "drive/command", "odom": "mru/odom", "winch/state": "encoder/state"}  # its topics there
WAIT = 8.0  # s of wall time for a command; a start that lost one costs it twice, and is made again


def started(folder, meanwhile, after=lambda sim, controller: None):
    """Tick outputs with the relay between; the stamp of the motion's begin, s; what was unmet; then after(...)."""
    parameters = {"setpoint.algorithm": "hold", "lockstep.command_period": 1.0 / RATE, "lockstep.wait": WAIT}
    said = ["-p", "use_sim_time:=true", "-p", f"ramp:={RAMP}"]
    with tow("full_scale", mode="lockstep", parameters=parameters, folder=folder) as sim:
        ends = ["winch/command", "mru/odom", "encoder/state"]
        sim.run([sys.executable, RELAY, "--ros-args", *said[:2]], name="relay", publishes=ends, within=600.0)
        said += [part for link in LINKS.items() for part in ("-r", ":=".join(link))]
        meanwhile(sim)
        command = [sys.executable, CONTROLLER, RATE, "--ros-args", *said]
        controller = sim.run(command, publishes="drive/command", within=600.0)
        begin = sim.feed(waves())
        frames, unmet = sim.wait_until(lambda frames: frames.time[-1] * 1e-9 > begin + PART, within=20.0), sim.unmet
        after(sim, controller)
        return frames, begin, unmet


def unheard(sim, controller):
    """Of a link that nobody hears any more it is said; and a name of a topic is asked for."""
    for wrong in ("", [], [3], "/"):
        with pytest.raises(TowError, match=r"publishes = .* names no topic: nothing was started; give 'winch/command'"):
            sim.run([sys.executable, RELAY], publishes=wrong)
    controller.stop(((signal.SIGINT, 600.0),))  # by which it says farewell
    until = time.monotonic() + 600.0
    while sim._link.client.node.count_subscribers("/tow_sim/mru/odom"):
        assert time.monotonic() < until
        time.sleep(0.02)
    sim.feed(heave=(0.5, 8.0), duration=2.0)
    with pytest.raises(TowError, match="nobody subscribes to /tow_sim/mru/odom, which relay publishes: nothing was"):
        sim.step()


def test_two_runs_of_the_chain_are_the_same_bits(tmp_path):
    """Also where the node stands still while the controller starts; one without its controller is refused."""
    pytest.importorskip("rclpy")
    one = whole(lambda number: started(tmp_path / "one" / str(number), lambda sim: None))
    other = whole(lambda number: started(tmp_path / "other" / str(number), stalled, unheard))
    same_bits(one, other)
