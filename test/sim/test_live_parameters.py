"""Live parameters: they act from the next tick on, a start keeps them, their bounds hold.

Functions and products that no processor computes otherwise: as numpy's but for the last bit.
"""

import numpy as np
import pytest
from pydantic import ValidationError

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.live_parameters import changed, set_live, ways
from cable_sim_ros.sim.tables.elementary import exp, log, power, principal, product, tanh
from verification.shipped import started

pytestmark = pytest.mark.trust

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("ours, numpys", [(exp, np.exp), (tanh, np.tanh)], ids=["exp", "tanh"])
def test_functions_of_one_array(ours, numpys):
    x = RNG.normal(size=(40, 3)) * 5.0
    np.testing.assert_allclose(ours(x), numpys(x), rtol=4e-16)
    assert ours(x).shape == x.shape and ours(-np.inf).shape == ()


def test_logarithm_and_power_of_arrays_and_numbers():
    x = RNG.random(50) + 0.1
    np.testing.assert_allclose(log(x), np.log(x), rtol=4e-16, atol=1e-17)
    for exponent in (-5.0, 0.25, RNG.normal(size=50)):
        np.testing.assert_allclose(power(x, exponent), x**exponent, rtol=4e-16)
    with pytest.raises(ValueError):
        log(0.0)


def test_products():
    a, b = RNG.normal(size=(7, 3)), RNG.normal(size=(3, 4))
    np.testing.assert_allclose(product(a, b), a @ b, rtol=1e-13)
    np.testing.assert_allclose(product(a[0], b), a[0] @ b, rtol=1e-13)
    np.testing.assert_allclose(product(a, b[:, 0]), a @ b[:, 0], rtol=1e-13)


@pytest.mark.parametrize("small", [1.0, 1e-4, 0.0])
def test_principal_axes(small):
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([3.0, small, 1.0]) @ turn.T
    values, axes = principal(0.5 * (matrix + matrix.T))
    np.testing.assert_allclose(values, sorted([3.0, small, 1.0]), rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(matrix @ axes, axes * values, atol=1e-14)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)


@pytest.fixture
def sim():
    return started(override(load_scene("full_scale"), {"setpoint.algorithm": "hold"}))


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
