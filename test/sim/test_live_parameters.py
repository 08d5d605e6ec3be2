"""Live parameters: they act from the next tick on, a start keeps them, their bounds hold."""

import numpy as np
import pytest
from pydantic import ValidationError

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.live_parameters import changed, set_live, ways
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.trust


@pytest.fixture
def sim():
    sim = Simulator(override(load_scene("full_scale"), {"setpoint.algorithm": "hold"}))
    sim.start()
    return sim


def stale_ticks(sim):
    """Ticks of a second after a rate command in which it is held to be too old."""
    sim.push(WinchCommand(rate=0.1))
    return int(np.sum(sim.run(100).status & Flag.COMMAND_STALE != 0))


def test_a_command_timeout_acts_from_the_next_tick_on(sim):
    before = stale_ticks(sim)
    set_live(sim, "winch.command_timeout", 5.0)
    assert before == pytest.approx(50, abs=2) and stale_ticks(sim) == 0
    assert not sim.model.settings.flags.writeable, "kernels take it for locked"
    sim.start()
    assert sim.scene.winch.command_timeout == 5.0 and stale_ticks(sim) == 0


def test_a_washout_and_a_flow_time_reach_the_model_and_outlast_a_start(sim):
    set_live(sim, "setpoint.washout_period", 77.0)
    set_live(sim, "towbody.flow_time_constant", 3.0)
    sim.start()
    assert sim.state.now.setpoint.washout == 77.0 and sim.model.line.bodies[0]["flow_time"] == 3.0
    sim.run(1)


def test_an_algorithm_is_kept_by_the_scene(sim):
    set_live(sim, "setpoint.algorithm", "simplified_sheave")
    assert sim.scene.setpoint.algorithm == "simplified_sheave"
    sim.start()
    assert sim.state.now.setpoint.algorithm == 1


def test_bodies_on_the_line_have_ways_of_their_own():
    scene = load_scene("full_scale")
    pod = {"at": "bare", "mass": 50.0, "net_weight": 300.0}
    scene = type(scene).model_validate(scene.model_dump() | {"bodies": {"pod": pod}})
    assert "bodies.pod.flow_time_constant" in ways(scene)
    assert changed(scene, "bodies.pod.flow_time_constant", 2.0).bodies["pod"].flow_time_constant == 2.0


def test_a_key_that_is_fixed_says_why_and_one_that_is_not_there_what_is_near(sim):
    with pytest.raises(KeyError, match=r"winch.max_rate = .* is fixed, .* start anew .*winch.command_timeout"):
        set_live(sim, "winch.max_rate", 1.0)
    with pytest.raises(KeyError, match=r"drive.mod: is no key of full_scale; .* Live keys are drive.mode"):
        set_live(sim, "drive.mod", "follow")


@pytest.mark.parametrize(
    "name, value, error", [("water.density", 1000.0, KeyError), ("winch.command_timeout", -1.0, ValidationError)]
)
def test_what_cannot_be_set(sim, name, value, error):
    with pytest.raises(error):
        set_live(sim, name, value)
    assert sim.scene.water.density == 1026.0 and sim.scene.winch.command_timeout == 0.5
