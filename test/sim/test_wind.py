"""Wind on the cable and on level bodies above the water, against closed forms.

A tow that would begin in the seabed, on it, or with its body half in the air: one clear line.
"""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros import Simulator, load_scene, override
from cable_sim_ros.physics.sea import WIND
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs.offline import run
from cable_sim_ros.sim.static_equilibrium import StartError
from verification.shipped import started

HELD = {"setpoint.algorithm": "hold"}

STILL = {"ship.tow_speed": 0.0, "setpoint.algorithm": "hold", "water.current": [0.0, 0.0], "solver.tolerance": 1e-8}


def test_a_fish_in_the_seabed_is_refused_with_how_deep_it_would_be():
    scene = override(load_scene("side_scan_fish"), {"seabed.depth": 30.0})
    with pytest.raises(StartError, match=r"would begin \S+ m deep, \S+ m in the seabed.* = 30 m.*less cable") as error:
        Simulator(scene).start()
    assert "\n" not in str(error.value)


def test_a_fish_half_in_the_air_begins_flagged_with_how_far():
    """Its tow point over the water, its hull in it."""
    scene = override(load_scene("side_scan_fish"), {"winch.scope": 6.4, "ship.tow_speed": 0.0})
    done = run(scene, heave=(0.001, 8.0), duration=1.0)
    height = float(done.frames.body_position[0, 2])
    assert 0.05 < height < 0.2 and done.frames.status[0] & Flag.SURFACE_CROSSED
    assert f"in the water surface, the towbody {height:.3g} m over its mean" in " ".join(done.verdict.notes)


def test_a_body_that_begins_on_the_seabed_is_said_with_the_cable_that_lies_there():
    done = run(override(load_scene("full_scale"), HELD | {"seabed.depth": 60.0}), heave=(0.001, 8.0), duration=1.0)
    lies = float(done.frames.seabed_length[0])
    assert lies > 1.0 and done.verdict.state == "ok"
    assert f"began on the seabed, with {lies:.3g} m of cable on it" in done.verdict.notes[-1]


def lowered(changes: dict) -> Simulator:
    return started(override(load_scene("lowered_ctd"), STILL | changes))


def test_a_hanging_cable_stands_off_by_the_load_over_the_tension():
    sim = lowered({"air.wind": [0.0, 15.0], "winch.scope": 60.0})
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
    east = lowered({"air.wind": [0.0, 15.0], "winch.scope": 60.0}).frame.body_position
    other = lowered({"air.wind": [0.0, -15.0], "winch.scope": 60.0}).frame.body_position
    assert east[1] == pytest.approx(-other[1], rel=1e-6) and east[1] > 0.0
    turned = {"air.wind": [0.0, 15.0], "air.frame": "heading", "ship.heading_deg": 90.0, "winch.scope": 60.0}
    to_port = lowered(turned).frame.body_position
    still = lowered({"ship.heading_deg": 90.0, "winch.scope": 60.0}).frame.body_position
    assert to_port[0] - still[0] == pytest.approx(-east[1], rel=1e-3), "to port of a ship that heads north is west"


def test_a_body_in_the_air_draws_its_cable_aside_even_where_the_cable_has_no_drag():
    """tan = rho A w^2 / 2 m g, A = 0.2 m^2."""
    in_air = {"air.wind": [0.0, 15.0], "air.drag_coefficient": 0.0, "winch.scope": 5.0}
    sim = lowered(in_air | {"towbody.drag_area": [0.2, 0.2, 0.2]})
    force, (above, end) = 0.5 * sim.scene.air.density * 0.2 * 15.0**2, sim.shape[-2:, 1:3]
    assert sim.state.work.around[-1, WIND : WIND + 3] == pytest.approx([0.0, force, 0.0], abs=1e-9)
    weight = sim.scene.towbody.mass * sim.scene.gravity
    assert (end[0] - above[0]) / (above[1] - end[1]) == pytest.approx(force / weight, rel=1e-3)
    assert sim.run(50).body_position[-1, 1] == pytest.approx(end[0], abs=1e-4)
