"""A block that swivels: in a turn the cable stays in its groove; friction holds it back; saved, replayed, off."""

import numpy as np
import pytest

from cable_sim_ros import Simulator, load_scene, override, replay, run
from cable_sim_ros.physics.swivel import leads, rolled, swung_to
from cable_sim_ros.sim.flag_rules import DOUBTFUL, OK
from verification.shipped import started

TURN = "5 starboard 90 over 40"
SWIVELS = {"winch.scope": 40.0, "sheave.swivel": True}


def turned(seconds=60.0, **values):
    """A turn of 90 deg on one cable length."""
    return run(override(load_scene("side_scan"), {"winch.scope": 40.0, **values}), ship=TURN, duration=seconds)


@pytest.fixture(scope="module")
def free(tmp_path_factory):
    out = tmp_path_factory.mktemp("swivel") / "run"
    return run(override(load_scene("side_scan"), SWIVELS), ship=TURN, duration=60.0, out=out)


def cable_of(sim_scene, frames):
    """Angle [rad] at which the departing cable leads about the line of the inboard one."""
    rules = Simulator(sim_scene).model.settings[0].swivel
    return np.array([leads(rules, tuple(f["tension_vector"] / f["tension"]))[0] for f in frames])


def test_in_a_turn_the_cable_stays_in_the_groove_of_a_block_that_swivels_and_leaves_another(free):
    fixed = turned(35.0)
    assert free.verdict.state == OK and free.frames["groove_margin"].min() > 0.029
    assert fixed.verdict.state == DOUBTFUL and any(one.flag == "DETACHED" for one in fixed.verdict.reasons)
    assert not fixed.frames["swivel_angle"].any()
    cable, angle = cable_of(free.scene, free.frames), free.frames["swivel_angle"]
    assert np.degrees(np.ptp(angle)) > 30.0 and np.degrees(np.abs(cable - angle).max()) < 1.0
    phases = free.metrics["phases"]
    assert [one["phase"] for one in phases] == ["straight at 2.06 m/s", "starboard 90 deg", "straight at 2.06 m/s"]
    assert phases[1]["lead_max_deg"] < 2.0 and phases[1]["lead_min_deg"] < -15.0
    assert free.metrics["body_position_m"] is None and free.metrics["turned_deg"] > 60.0


def test_friction_of_the_swivel_holds_the_block_behind_the_cable():
    held = turned(**SWIVELS, **{"sheave.swivel_friction": 0.01})
    off = np.abs(cable_of(held.scene, held.frames) - held.frames["swivel_angle"])
    ends = held.frames[-1]
    assert 3.0 < np.degrees(off.max()) < 40.0  # behind, and not stuck
    assert np.ptp(held.frames["swivel_angle"]) > 0.2 and ends["groove_margin"] > 0.0


def test_a_block_goes_on_from_a_save_and_in_a_replay(free, tmp_path):
    again = replay(free.bag)
    assert again.metrics["largest_difference"]["difference"] == 0.0
    scene = override(load_scene("side_scan"), SWIVELS)
    run(scene, ship=TURN, duration=30.0, save=tmp_path / "half.npz")
    rest = run(None, ship=TURN, duration=30.0, resumed=tmp_path / "half.npz")
    assert rest.frames.tobytes() == free.frames[-len(rest.frames) :].tobytes()
    assert rest.metrics["phases"][-1] == free.metrics["phases"][-1]


def test_a_block_starts_in_the_plane_of_its_cables():
    sim = started(override(load_scene("side_scan"), {"sheave.swivel": True, "water.current": [0.0, 0.8]}))
    sw, f = sim.model.settings[0].swivel, sim.frame
    assert np.degrees(f.swivel_angle) > 20.0 and f.groove_margin > 0.029
    assert leads(sw, tuple(f.tension_vector / f.tension))[0] == pytest.approx(f.swivel_angle, abs=2e-3)


def test_a_block_turns_rigidly_about_the_inboard_cable():
    sim = Simulator(override(load_scene("side_scan"), SWIVELS))
    sw, centre = sim.model.settings[0].swivel, np.array(sim.scene.sheave.position)
    swung = sim.state.now.swung
    for angle in (-1.2, 0.0, 0.7):
        swung.angle, swung.rate = angle, 0.3
        place, velocity = swung_to(sw, swung, tuple(centre))
        swung.angle = angle + 0.3e-6
        moved, _ = swung_to(sw, swung, tuple(centre))
        assert (np.array(moved) - place) / 1e-6 == pytest.approx(np.array(velocity), abs=1e-6)
        assert np.linalg.norm(place - sw.point) == pytest.approx(np.linalg.norm(centre - sw.point))
        assert rolled(sw, angle, tuple(sw.along)) == pytest.approx(tuple(sw.along))
        assert np.sign(place[1]) == np.sign(angle)  # to port
