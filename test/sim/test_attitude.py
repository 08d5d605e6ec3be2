"""A tow whose body has an attitude: checks of its keys, static start, the level body as its limit, save and restore."""

from __future__ import annotations

import numpy as np
import pytest
from underway import cautioned, goes_on, refused, sail

from cable_sim_ros import Simulator
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import load_scene, override, scene_from_dict
from cable_sim_ros.physics.tick_output import BODY_COLUMNS, Flag
from cable_sim_ros.runs.offline import run
from cable_sim_ros.sim.checks.added_mass_checks import semidefinite
from cable_sim_ros.sim.checks.attitude_checks import critical_speed
from cable_sim_ros.sim.static_equilibrium import Departure, no_equilibrium
from cable_sim_ros.sim.static_gradients import StaticGradients
from cable_sim_ros.sim.statics.route import StartError
from verification.shipped import started

pytestmark = pytest.mark.trust
COLUMNS = {name: k for k, (name, _) in enumerate(BODY_COLUMNS)}

# the body of full_scale with six degrees of freedom: its lift from a wing, held in its way by tail and fin
FISH = {
    "model": "rigid",
    "lift_area": 0.0,
    "length": 3.0,
    "diameter": 0.3,
    "inertia": [2.81, 188.9, 188.9],
    "centre_of_gravity": [-0.1, 0.0, -0.3],
    "centre_of_buoyancy": [-0.1, 0.0, -0.25],
    "added_inertia": [0.0, 163.2, 163.2],
    "drag_area": [0.0641, 0.0, 0.0],
    "wings": {
        "depressor": {"place": [0.0, 0.0, -0.25], "span": 1.414, "chord": 0.3536, "incidence": -8.8},
        "tail": {"place": [-1.5, 0.0, -0.25], "span": 0.6, "chord": 0.3},
        "fin": {"place": [-1.5, 0.0, -0.1], "span": 0.6, "chord": 0.3, "dihedral": 90.0},
    },
}


def scene_of(changes: dict | None = None, name: str = "full_scale"):
    """The scene with that body and further changes."""
    body = {f"towbody.{key}": value for key, value in FISH.items()}
    return override(override(load_scene(name), {"setpoint.algorithm": "hold"} | body), changes or {})


def heaving(sim: Simulator, seconds: float) -> np.recarray:
    """Tick outputs from a start on, under a metre of heave and 8 deg of roll in 8 s."""
    sim.start()
    w, roll = 2.0 * np.pi / 8.0, np.radians(4.0)
    for k in range(1, round(seconds / 0.02) + 10):
        s, c = np.sin(w * 0.02 * k), np.cos(w * 0.02 * k)
        sail(sim, 0.02 * k, 0.5 * (1.0 - c), 0.5 * w * s, (roll * s, 0.0, 0.0), (roll * w * c, 0.0, 0.0))
    return sim.run(round(seconds / sim.scene.solver.tick))


@pytest.fixture(scope="module")
def fish():
    return Simulator(scene_of())


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"inertia": [10.0, 188.9, 300.0]}, ("towbody.inertia", "that of no body", "at most the sum")),
        ({"inertia": [2.81, 188.9, 188.9], "products_of_inertia": [0.0, 60.0, 0.0]}, ("towbody.inertia", "no body")),
        ({"inertia": None}, ("towbody.inertia", "is missing", "three numbers")),
        ({"centre_of_gravity": [0, 0, 0], "centre_of_buoyancy": [0, 0, 0]}, ("tow point", "would hold an attitude")),
        ({"lift_area": -0.5}, ("towbody.lift_area", "wings")),
        ({"wings.depressor.flap": 20.0}, ("towbody.wings.depressor.flap", "without a flap", "flap_share")),
        ({"wings.depressor.flap": 40.0, "wings.depressor.flap_share": 0.25}, ("depressor.flap", "more than 29.56 deg")),
        ({"wings.depressor.span": 0.0}, ("towbody.wings.depressor.span", "outside (0, 100] m")),
        ({"wings.depressor.chrod": 1.0}, ("towbody.wings.depressor.chrod", "chord")),
        ({"wings": {"tail": 3.0}}, ("towbody.wings.tail = 3.0", "tail: {place:")),
        ({"model": "level"}, ("towbody.inertia", "level", "towbody.model: rigid")),
    ],
)
def test_what_no_body_has_is_refused_with_the_remedy(changes, parts):
    said = refused(scene_of, {f"towbody.{key}": value for key, value in changes.items()})
    assert all(part in said for part in parts), said


def test_a_fish_that_meets_the_ground_is_borne_and_lifted_again():
    """Paid out onto a seabed 4 m below it and hauled in: it lands, lies or slides, and flies as before."""
    scene = scene_of({"seabed.depth": 113.0})
    done = run(scene, heave=(0.3, 8.0), duration=60.0, winch="1 rate 1.0, 30 rate -1.0", step="fixed", every=0.04)
    frames, aground = done.frames, done.frames.status & Flag.SEABED > 0
    assert not aground[0] and aground.any() and not aground[-1]
    assert -113.2 < frames.body_position[:, 2].min() and frames.body_position[-1, 2] > -112.0
    assert done.metrics["landing_speed_m_s"] is not None and np.abs(done.metrics["landing_speed_m_s"]) < 1.0
    assert abs(frames.energy_residual[-1]) < 1e-3 * abs(frames.work_supplied[-1])


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"towbody.centre_of_gravity": [-0.1, 0.0, 0.3]}, ("hangs", "upside down", "sign of z")),
        ({"towbody.length": None}, ("towbody.length", "ten times as long", "Give both")),
        ({"towbody.wings.fin.span": 0.05}, ("upright", "Munk's moment", "fins")),
    ],
)
def test_what_would_surprise_is_said(changes, parts):
    said = " ".join(cautioned(scene_of, changes))
    assert all(part in said for part in parts), said


def test_semidefinite_knows_matrices_by_their_eigenvalues():
    rng = np.random.default_rng(3)
    for _ in range(200):
        m = rng.normal(size=(3, 3))
        m = m + m.T
        least = np.linalg.eigvalsh(m)[0]
        assert semidefinite(m) == (least >= 0.0) and semidefinite(m - least * np.eye(3) * (1.0 + 1e-12))


def test_a_trim_that_a_small_turn_leaves_is_no_start():
    """Without its tail the body would pitch over above 1.1 m/s."""
    scene = scene_of({"towbody.wings": {"fin": FISH["wings"]["fin"]}})
    assert critical_speed(scene, scene.towbody) == pytest.approx(
        np.sqrt(250 * 9.81 * 0.3 - (250 * 9.81 - 445) * 0.25) / np.sqrt(206.7), rel=1e-3
    )
    with pytest.raises(StartError, match=r"pitch.*grows.*tow below 1\.\d+ m/s.*level fins"):
        Simulator(scene).start()


def test_the_level_body_is_the_limit_of_a_stiff_one(tmp_path):
    """Drag along alone, at the tow point, and more inertia than a heave can turn."""
    same = {"towbody.drag_area": [0.0641, 0.0, 0.0], "towbody.lift_area": 0.0}
    stiff = {
        "towbody.wings": {"fin": {"place": [-0.5, 0, 0], "span": 0.05, "chord": 0.05, "dihedral": 90.0}},
        "towbody.crossflow_coefficient": 0.0,
        "towbody.inertia": [1e8, 1e8, 1e8],
        "towbody.centre_of_gravity": [0.0, 0.0, -0.05],
        "towbody.centre_of_buoyancy": [0.0, 0.0, 0.0],
        "towbody.added_mass": [10.9, 10.9, 10.9],
        "towbody.added_inertia": [0.0, 0.0, 0.0],
    }
    level = override(
        load_scene("full_scale"), {"setpoint.algorithm": "hold"} | same | {"towbody.added_mass": [10.9, 10.9, 10.9]}
    )
    rigid = Simulator(scene_of(stiff))
    one, other = heaving(Simulator(level), 18.0), heaving(rigid, 18.0)
    rigid.save(tmp_path / "stiff.npz")
    assert Simulator.load(tmp_path / "stiff.npz").tick().tension == rigid.tick().tension, "however stiff"
    assert np.abs(one.tension / other.tension - 1.0).max() < 1e-3
    assert np.abs(one.body_position - other.body_position).max() < 0.01


def test_a_pitching_body_is_restored_and_chosen_steps_follow_it(fish, tmp_path):
    frames = heaving(fish, 12.0)
    pitch = 2.0 * np.arcsin(frames.body_quaternion[:, 1])
    assert np.ptp(pitch) > np.radians(0.5) and not (frames.status & Flag.STALLED).any()
    assert np.abs(np.linalg.norm(frames.body_quaternion, axis=1) - 1.0).max() < 1e-12
    goes_on(fish, 30, tmp_path)
    chosen = Simulator(scene_of({"solver.tension_error": 0.005}))
    found = heaving(chosen, 12.0)
    assert np.abs(found.body_position - frames.body_position).max() < 0.01
    assert np.abs(2.0 * np.arcsin(found.body_quaternion[:, 1]) - pitch).max() < np.radians(0.1)


def test_a_body_without_added_mass_of_its_own_weighs_that_of_its_spheroid_for_ringing_and_steps(fish):
    body, row = fish.scene.towbody, fish.model.line.bodies[0]
    water = (body.mass * 9.81 - body.net_weight) / 9.81
    given = Simulator(scene_of({"towbody.added_mass": [0.0, 0.0, 0.0]})).model.line.bodies[0]
    np.testing.assert_allclose(row["added"], body.added_mass)
    np.testing.assert_allclose(given["added"], np.array([0.0207, 0.9602, 0.9602]) * water, rtol=2e-3)


def test_gradients_are_refused_beside_an_attitude(fish):
    assert "attitude" in StaticGradients(fish.scene)("towbody.net_weight").refused


def test_a_start_without_rest_points_to_the_trim(fish):
    said = str(no_equilibrium(fish, Departure(0.0, 0.0, 0.1), 3, 4, 5.0))
    assert "no trim that it keeps" in said and "model: level" in said


def test_a_flap_is_moved_while_the_tow_runs(fish):
    """A tail flap of 8 deg down lifts the tail: the nose goes down, the wing presses harder and the body dives."""
    flapped = {"towbody.wings.tail.flap_share": 0.25, "towbody.wings.depressor.flap_share": 0.25}
    sim = Simulator(scene_of(flapped | {"solver.tick": 0.1}))
    sim.start()
    before = sim.frame.copy()
    sim.set("towbody.wings.tail.flap", 8.0)
    frames = sim.run(2000)
    pitch = np.degrees(2.0 * np.arcsin(frames.body_quaternion[:, 1] - before.body_quaternion[1]))
    assert pitch[-1] > 0.3 and frames.body_position[-1, 2] < before.body_position[2] - 0.3
    begun = started(scene_of(flapped | {"towbody.wings.tail.flap": 8.0}))
    turned = begun.frame.body_quaternion[1] - before.body_quaternion[1]
    assert np.radians(pitch[-1]) / 2.0 == pytest.approx(turned, rel=0.1)
    with pytest.raises(ValueError, match=r"towbody\.wings\.depressor\.flap .*stall_angle.*nothing was changed"):
        sim.set("towbody.wings.depressor.flap", -50.0)


def test_a_depressor_on_the_line_pitches_in_metrics_and_topic(tmp_path):
    """A two-part tow: the depressor at the end of the main cable, a fish of next to no weight behind it."""
    data = override(load_scene("full_scale"), {"solver.tick": 0.05}).model_dump(mode="json")
    data["cable"]["sections"]["umbilical"] = {"length": 40.0, "diameter": 0.02, "mass_per_length": 0.33}
    weight = {"mass": 250.0, "net_weight": 445.0, "added_mass": [10.9, 217.6, 217.6]}
    data["bodies"] = {"depressor": FISH | weight | {"at": "faired"}}
    data["towbody"] = {"mass": 60.0, "net_weight": 10.0, "drag_area": [0.02, 0.2, 0.2]}
    data["setpoint"] = {"algorithm": "hold"}
    result = run(scene_from_dict(data, "two_part.yaml"), heave=(1.0, 6.0), duration=8.0, out=tmp_path)
    found, recorded = result.metrics["bodies"]["depressor"], load_run(tmp_path / "tow")
    pitch = np.degrees([rows[0, COLUMNS["pitch"]] for _, rows in recorded.bodies])
    assert found["pitch_std_deg"] > 0.1 and found["roll_std_deg"] < 1e-6
    assert -found["pitch_mean_deg"] == pytest.approx(pitch[len(pitch) // 2 :].mean(), abs=0.02)
    assert result.metrics["body_pitch_std_deg"] is None, "the fish is level"


def test_a_stalled_wing_is_flagged_and_doubtful():
    sim = started(scene_of({"towbody.wings.depressor.incidence": -16.0, "towbody.wings.depressor.stall_angle": 15.0}))
    assert sim.tick().status & Flag.STALLED
