"""Wind on the cable and on level bodies above the water, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros import Simulator, load_scene, override
from cable_sim_ros.physics.sea import WIND

STILL = {"ship.tow_speed": 0.0, "setpoint.algorithm": "hold", "water.current": [0.0, 0.0], "solver.tolerance": 1e-8}


def started(name: str, changes: dict) -> Simulator:
    sim = Simulator(override(load_scene(name), STILL | changes))
    sim.start()
    return sim


def test_a_hanging_cable_stands_off_by_the_load_over_the_tension():
    sim = started("lowered_ctd", {"air.wind": [0.0, 15.0], "winch.scope": 60.0})
    scene, shape = sim.scene, sim.shape
    load = 0.5 * scene.air.density * scene.air.drag_coefficient * scene.cable.diameter * 15.0**2  # N/m
    outboard = shape[np.abs(shape[:, 0] - shape[-1, 0]) < 0.1]  # the part that hangs
    top, tension = outboard[0], float(sim.frame.tension)
    off = shape[-1, 1] - top[1]
    groove = np.sqrt(2.0 * scene.sheave.radius * scene.sheave.groove_depth)  # m, below the axis, that the rim holds it
    least, most = (load * h**2 / (2.0 * tension) for h in (top[2] - groove - 0.1, top[2]))
    assert least < off < most, "w h^2 / 2 T; below, it hangs straight"
    wet = shape[shape[:, 2] < -5.0]
    assert np.ptp(wet[:, 1]) < 3e-3 * off
    total = sim.state.work.around[:, WIND + 1].sum()
    assert total == pytest.approx(load * (shape[-1, 4] + shape[-1, 2] - shape[0, 4]), rel=0.2), "with what is aboard"
    assert np.abs(sim.run(200).energy_residual[-1]) < 0.1


def test_wind_is_counted_as_it_blows_and_along_the_heading_where_the_scene_says_so():
    east = started("lowered_ctd", {"air.wind": [0.0, 15.0], "winch.scope": 60.0}).frame.body_position
    other = started("lowered_ctd", {"air.wind": [0.0, -15.0], "winch.scope": 60.0}).frame.body_position
    assert east[1] == pytest.approx(-other[1], rel=1e-6) and east[1] > 0.0
    turned = {"air.wind": [0.0, 15.0], "air.frame": "heading", "ship.heading_deg": 90.0, "winch.scope": 60.0}
    to_port = started("lowered_ctd", turned).frame.body_position
    still = started("lowered_ctd", {"ship.heading_deg": 90.0, "winch.scope": 60.0}).frame.body_position
    assert to_port[0] - still[0] == pytest.approx(-east[1], rel=1e-3), "to port of a ship that heads north is west"


def test_a_body_in_the_air_draws_its_cable_aside_even_where_the_cable_has_no_drag():
    """tan = rho A w^2 / 2 m g, A = 0.2 m^2."""
    in_air = {"air.wind": [0.0, 15.0], "air.drag_coefficient": 0.0, "winch.scope": 5.0}
    sim = started("lowered_ctd", in_air | {"towbody.drag_area": [0.2, 0.2, 0.2]})
    force, (above, end) = 0.5 * sim.scene.air.density * 0.2 * 15.0**2, sim.shape[-2:, 1:3]
    assert sim.state.work.around[-1, WIND : WIND + 3] == pytest.approx([0.0, force, 0.0], abs=1e-9)
    weight = sim.scene.towbody.mass * sim.scene.gravity
    assert (end[0] - above[0]) / (above[1] - end[1]) == pytest.approx(force / weight, rel=1e-3)
    assert sim.run(50).body_position[-1, 1] == pytest.approx(end[0], abs=1e-4)
