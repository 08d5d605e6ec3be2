"""A tow that would begin in the seabed, on it, or with its body half in the air: one clear line."""

from __future__ import annotations

import pytest

from cable_sim_ros import Simulator, load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs.offline import run
from cable_sim_ros.sim.static_equilibrium import StartError

HELD = {"setpoint.algorithm": "hold"}


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
