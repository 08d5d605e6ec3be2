"""Nodes between the simulation and a controller: two runs are the same bits, and the scene can be the same drive.

To copy: a chain of processes that the tow waits for (docs/lockstep.md). winch_relay.py is a drive and instruments of
one's own; `drive` of the scene is that drive in a few lines.
"""

import functools
import sys
from pathlib import Path

import numpy as np
import pytest
from test_heave_compensator import CONTROLLER, HOLD, PART, RAMP, counted, same_bits, stalled, waves, whole

from cable_sim_ros.testing import tow

RELAY = Path(__file__).with_name("winch_relay.py")
RATE = 100  # Hz, a command for every tick
LINKS = {  # what of the relay stands between: topics of the controller -> those of the relay
    "drive": {"winch/command": "drive/command"},
    "all": {"winch/command": "drive/command", "odom": "mru/odom", "winch/state": "encoder/state"},
}
DRIVE = {  # the drive of winch_relay.py as lines of the scene
    "drive.model": "rate_loop",
    "drive.bandwidth": 6.0,
    "drive.damping": 0.7,
    "drive.dead_time": 0.08,
    "drive.length_gain": 0.0,  # the relay has no loop of the length
    "winch.max_rate": 1.5,
    "winch.max_acceleration": 2.0,
}
SCENES = {"drive": DRIVE}  # kind of LINKS -> the same in the scene
SECONDS = 7.0
WAIT = 8.0  # s of wall time for a command; a start that lost one costs it twice, and is made again


def chain(folder, *given):
    """As `started`, of a start in which every input was there at its time."""
    return whole(lambda number: started(folder / str(number), *given))


def started(folder, kind, scene=None, seconds=SECONDS, meanwhile=lambda sim: None):
    """Tick outputs with the relay, or with a scene in its place; the stamp of the motion's begin, s; what was unmet."""
    parameters = {"setpoint.algorithm": "hold", "lockstep.command_period": 1.0 / RATE, "lockstep.wait": WAIT}
    said = ["-p", "use_sim_time:=true", "-p", f"ramp:={RAMP}"]
    publishes = "winch/command"
    with tow("full_scale", mode="lockstep", parameters=parameters | (scene or {}), folder=folder) as sim:
        if scene is None:
            links = LINKS[kind]
            ends = ["winch/command", *(topic for topic in links.values() if topic != "drive/command")]
            sim.run([sys.executable, RELAY, "--ros-args", *said[:2]], name="relay", publishes=ends)
            said += [part for link in links.items() for part in ("-r", ":=".join(link))]
            publishes = "drive/command"
        meanwhile(sim)
        sim.run([sys.executable, CONTROLLER, RATE, "--ros-args", *said], publishes=publishes)
        begin = sim.feed(waves())
        frames = sim.wait_until(lambda frames: frames.time[-1] * 1e-9 > begin + seconds, within=20.0)
        return frames, begin, sim.unmet


@pytest.fixture(scope="module")
def relayed(tmp_path_factory):
    """Function: kind of LINKS -> what `chain` gives with the relay, simulated when it is first asked for."""
    pytest.importorskip("rclpy")
    return functools.cache(lambda kind: chain(tmp_path_factory.mktemp(kind), kind))


@pytest.mark.nightly
@pytest.mark.parametrize("kind", SCENES)
def test_the_scene_can_be_what_the_relay_is(tmp_path, relayed, kind):
    """They differ by 4 ms, as the relay takes a command at once and the scene over a tick, and by 1 % of the travel,
    by which the ideal servo behind the relay swells."""
    (one, begin), (other, again) = relayed(kind), chain(tmp_path, kind, SCENES[kind])
    assert begin == again
    relay, scene = counted(one, begin), counted(other, again)
    print(f"{kind}: {relay.tension.std():.1f} N behind the relay, {scene.tension.std():.1f} N by the scene")
    assert 0.4 * HOLD < relay.tension.std() < 0.8 * HOLD, "such a drive leaves the half of it"
    assert abs(relay.tension.std() - scene.tension.std()) < 0.02 * HOLD
    assert abs(relay.payout - scene.payout).max() < 0.02 * np.ptp(relay.payout)


def test_two_runs_of_the_chain_are_the_same_bits(tmp_path):
    """Also where the node stands still while the controller starts."""
    runs = [chain(tmp_path / str(k), "all", None, PART, held) for k, held in enumerate((lambda sim: None, stalled))]
    same_bits(*runs)


def test_a_link_that_nobody_hears_is_said_and_a_name_of_a_topic_is_asked_for(tow_sim):
    from cable_sim_ros.testing import TowError

    sim = tow_sim("full_scale", mode="lockstep", parameters={"setpoint.algorithm": "hold"})
    for wrong in ("", [], [3], "/"):
        with pytest.raises(TowError, match=r"publishes = .* names no topic: nothing was started; give 'winch/command'"):
            sim.run([sys.executable, RELAY], publishes=wrong)
    sim.run([sys.executable, RELAY], name="relay", publishes=["winch/command", "mru/odom"])
    sim.feed(heave=(0.5, 8.0), duration=2.0)
    with pytest.raises(TowError, match="nobody subscribes to /tow_sim/mru/odom, which relay publishes: nothing was"):
        sim.step()
