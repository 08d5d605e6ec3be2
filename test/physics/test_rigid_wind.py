"""Wind on a rigid body that hangs in the air, against closed forms."""

import numpy as np
import pytest

from cable_sim_ros.physics.attitude import roll_pitch_yaw
from cable_sim_ros.physics.state import NOW
from verification.shipped import scene_with, started

WIND = 15.0  # m/s, to the north, across the ship
HANGING = {
    "ship.tow_speed": 0.0,
    "solver.tolerance": 1e-8,
    "winch.scope": 4.0,
    "air.drag_coefficient": 0.0,  # of the cable
    "air.wind": [0.0, WIND],
    "towbody.centre_of_gravity": [0.0, 0.0, -0.13],
    "towbody.centre_of_buoyancy": [0.0, 0.0, -0.12],
}


def test_a_hull_in_the_wind_heels_and_draws_its_cable_aside_and_keeps_its_energy_when_it_turns():
    """F = rho_a/2 C_c l d W^2: tan of the cable F/mg; tan of the heel F z_C/(m g z_G), from the tow point."""
    sim = started(scene_with("side_scan_fish", HANGING | {"towbody.wings": {}}))
    body = sim.scene.towbody
    force = 0.5 * sim.scene.air.density * body.crossflow_coefficient * body.length * body.diameter * WIND**2
    weight, (above, end) = body.mass * sim.scene.gravity, sim.shape[-2:, 1:3]
    assert sim.frame.body_position[2] > 1.0
    assert (end[0] - above[0]) / (above[1] - end[1]) == pytest.approx(force / weight, rel=3e-3)
    roll, pitch, yaw = roll_pitch_yaw(sim.state.attitude[NOW, 0].quaternion)
    assert np.tan(roll) == pytest.approx(force * 0.12 / (weight * 0.13), rel=1e-5)
    assert abs(pitch) < 1e-6 and abs(yaw) < 1e-3
    sim.state.memory[NOW].wind[1] = -WIND
    swung = sim.run(150)
    way = np.ptp(swung.body_position[:, 1])
    assert way > 0.1
    assert np.abs(swung.energy_residual).max() < 1e-3 * force * way


def test_a_fin_turns_its_body_into_the_wind():
    sim = started(scene_with("side_scan_fish", HANGING))
    roll, _, yaw = roll_pitch_yaw(sim.state.attitude[NOW, 0].quaternion)
    assert np.degrees(yaw) == pytest.approx(-90.0, abs=0.01), "it blows to the north: the nose goes south of east"
    assert abs(roll) < 1e-3
