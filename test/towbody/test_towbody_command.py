"""`cable-sim towbody` against closed forms of the theory page; what is refused and reported."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.wing import Wing
from cable_sim_ros.sim.checks.attitude_checks import critical_speed
from cable_sim_ros.tools.towbody.command import towbody
from cable_sim_ros.tools.towbody.figures import Alone, at_speed, least_scale, stability_map

pytestmark = pytest.mark.check

BUOYANCY = 250.0 * 9.81 - 445.0
LOW = (233.9 + 0.25 * BUOYANCY) / (250.0 * 9.81)


def body(centre, gravity_centre, **fin):
    """The body of the theory page with fins of aspect ratio 2 and lift alone."""
    chord = np.sqrt(0.5 * fin.pop("area"))
    return Towbody(
        model="rigid",
        mass=250.0,
        net_weight=445.0,
        inertia=(2.81, 188.9, 188.9),
        centre_of_buoyancy=centre,
        centre_of_gravity=gravity_centre,
        added_mass=(10.9, 217.6, 217.6),
        added_inertia=(0.0, 163.2, 163.2),
        crossflow_coefficient=0.0,
        length=3.0,
        diameter=0.3,
        wings={"tail": Wing(span=2.0 * chord, chord=chord, drag_coefficient=0.0, **fin)},
    )


@pytest.fixture(scope="module")
def scene():
    return load_scene("depressor")


def test_pitch_is_lost_at_the_critical_speed(scene):
    """1.573 m/s by formula, and where the moment changes its sign; +0.0826 1/s at 1.05 of it."""
    fins = body((0.0, 0.0, -0.25), (0.0, 0.0, -LOW), area=0.06, place=(-1.4, 0.0, -0.25))
    assert critical_speed(scene, fins) == pytest.approx(1.573, abs=2e-3)
    below, above = (Alone(scene, fins, share * 1.573) for share in (0.95, 1.05))
    assert below.stiffness()[1, 1] > 0.0 > above.stiffness()[1, 1]
    assert np.min(abs(above.modes() - 0.0826)) < 1e-3


def test_the_least_fins_are_those_of_the_formula(scene):
    """0.0968 m^2 with the tow point 0.2 m ahead of the centre and the fins 1.6 m behind."""
    fins = body((-0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), area=0.1, place=(-1.6, 0.0, 0.0), dihedral=90.0)
    assert 0.1 * least_scale(scene, fins, 2.2) == pytest.approx(0.0968, abs=2e-4)


def test_the_map_has_the_boundaries_of_the_theory(scene):
    """In yaw 0.0968 m^2 with the tow point 0.2 m ahead; in pitch that which holds at 1.573 m/s, 0.06 m^2."""
    upright = body((-0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), area=0.1, place=(-1.6, 0.0, 0.0), dihedral=90.0)
    found = stability_map(scene, upright, 2.2, points=3)
    yaw = found["yaw"]
    assert found["pitch"] is None, "no level tail"
    assert yaw["own_tow_point_m"] == 0.2 and yaw["tow_point_m"] == pytest.approx([0.0, 0.45, 0.9])
    reach = 1.4 + np.array(yaw["tow_point_m"])  # of the fins behind the tow point
    np.testing.assert_allclose(yaw["formula_m2"], 0.0968 * 1.6 / reach, rtol=2e-3)
    np.testing.assert_allclose(yaw["found_m2"], yaw["formula_m2"], rtol=1e-3)
    growth = np.array(yaw["growth_per_s"])
    assert (growth[0] > 0.0).all() and (growth[2] < 0.0).all(), "areas of 0, 0.1 and 0.2 m^2"

    level = body((0.0, 0.0, -0.25), (0.0, 0.0, -LOW), area=0.06, place=(-1.4, 0.0, -0.25))
    pitch = stability_map(scene, level, 1.573, points=3)["pitch"]
    at_own = pitch["tow_point_m"].index(0.25)
    assert pitch["found_m2"][at_own] == pytest.approx(0.06, rel=5e-3)
    assert pitch["formula_m2"][at_own] == pytest.approx(0.06, rel=5e-3)


def test_an_unstable_speed_is_a_row(scene):
    """Without fins it is reported with its axis, not raised."""
    bare = override(scene, {"towbody.wings": {}})
    row = at_speed(bare, "towbody", bare.towbody, 3.0)
    assert row["unstable"] in ("unstable in pitch", "unstable in yaw")
    assert row["body"] == "towbody"


def test_the_command_gives_its_figures(monkeypatch, tmp_path):
    monkeypatch.setattr("cable_sim_ros.tools.towbody.figures.POINTS", 3)
    page = tmp_path / "page.png"
    answer = CliRunner().invoke(towbody, ["depressor", "--speeds", "2:2:1", "--map", "--json", "--out", str(page)])
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.stdout)
    row = found["speeds"][0]
    assert found["body"] == "towbody"
    assert row["lift_n"] < -400.0 < 0.0 < row["drag_n"]
    assert min(row["stiffness_nm"].values()) > 0.0
    assert found["map"]["yaw"]["found_m2"] == pytest.approx(found["map"]["yaw"]["formula_m2"], rel=0.01)
    assert page.stat().st_size > 20_000


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["side_scan"], ("Give towbody.model: rigid",)),
        (["depressor", "--body", "pod"], ("no body 'pod'", "nothing was computed", "Give --body towbody")),
        (["depressor", "--speeds", "1:2"], ("'1:2' is not FROM:TO:STEP", "nothing was computed")),
        (["depressor", "--speeds", "0:2:0.1"], ("0 < FROM <= TO <= 15 m/s", "nothing was computed")),
        (["depressor", "--speeds", "1:2:1e-9"], ("at most 100 steps", "nothing was computed")),
        (["depressor", "--speeds", "1:nan:1"], ("is not 0 < FROM", "nothing was computed")),
    ],
)
def test_a_mistake_is_one_clear_line(arguments, parts):
    answer = CliRunner().invoke(towbody, arguments)
    said = " ".join((answer.output + str(answer.exception or "")).split())
    assert answer.exit_code != 0
    for part in parts:
        assert part in said
