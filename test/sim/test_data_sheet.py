"""Numbers that contradict each other are refused or said, each with both numbers and the way out.

Lengths of cable that the checks of a scene count from are those of the route that the static start lays out.
"""

from math import cos, hypot, radians, sin

import numpy as np
import pytest
from underway import cautioned, scene_with

from cable_sim_ros.io.scenes.load import SceneError, load_scene
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.problem import apart
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of
from cable_sim_ros.sim.statics.route import first_angle
from cable_sim_ros.sim.tables.current import current_of, turned_current

pytestmark = pytest.mark.trust


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact", "side_scan", "lowered_ctd", "flume"])
def test_lengths_of_the_checks_are_those_of_the_route(name):
    """The cable turns from the drum, onto the sheave and off it at the lengths that the checks count from."""
    scene = load_scene(name)
    layout = layout_of(scene)
    angle, route = first_angle(scene, layout.water_speed), layout.route
    unmeshed = route.wound - route.on_drum  # a winch that feeds has its first node where the cable leaves the drum
    wound, tangent, leaves = (s - unmeshed for s in (route.wound, layout.tangent, layout.leaves))
    eps = 1e-6 * scene.sheave.radius
    x, z, *_ = route.place(wound - (0.0 if route.feeds else eps), angle)
    assert hypot(x, z) == pytest.approx(route.drum, rel=1e-9), "on the drum up to there"
    for s in (wound, tangent, leaves)[1 if route.feeds else 0 :]:
        before, after = route.place(s - eps, angle)[2:], route.place(s + eps, angle)[2:]
        assert before[0] * after[0] + before[1] * after[1] == pytest.approx(1.0, abs=1e-9), "a smooth route"
    free = route.place(leaves + eps, angle)
    assert free[2:] == pytest.approx((sin(angle), -cos(angle)), abs=1e-9), "straight from there on"
    curved = route.place(leaves - 0.5 * (leaves - tangent), angle)
    assert hypot(curved[0] - route.away, curved[1] - route.rise) == pytest.approx(route.sheave, rel=1e-9)


def test_the_fine_zone_of_the_thesis_is_the_known_one():
    scene = load_scene("full_scale_westin")
    inboard, outboard = layout_of(scene).fine_zone
    wrapped = layout_of(scene).route.on_sheave(first_angle(scene, scene.ship.tow_speed))
    assert wrapped == pytest.approx(0.25 * radians(14.0), abs=0.002)  # nearly level: the critical angle
    assert outboard + wrapped == pytest.approx(0.86, abs=0.005)  # trap T6
    assert inboard == pytest.approx(2.5 - 0.86, abs=0.005)


@pytest.mark.parametrize(
    "name, values, text",
    [
        ("full_scale_contact", {"winch.wrap": 100.0}, "more than 0.6 m, twice winch.drum_radius"),
        ("full_scale", {"ship.tow_speed": -2.0}, "ship.tow_speed = -2 m/s sends the ship astern at 2 m/s"),
        ("side_scan", {"winch.position": [-8, 0, 20], "sheave.position": [-12, 0, 0.5]}, "it falls 78.6 deg below the"),
        ("full_scale", {"seabed.depth": 0.4, "sheave.position": [-36.8, 0, 0.26]}, "0.4 m is less than 0.49 m, c"),
        ("full_scale", {"seabed.depth": 50.0, "towbody.net_weight": -20.0}, "weighs 3.026 N/m in water, the towbody -"),
    ],
)
def test_what_cannot_be_is_refused(name, values, text):
    with pytest.raises(SceneError) as error:
        scene_with(name, **values)
    (problem,) = error.value.problems
    assert text in problem and problem.key in values and problem.remedy


@pytest.mark.parametrize(
    "name, values, text",
    [
        ("full_scale", {"cable.diameter": 0.005}, "make a cable of 1.981e+04 kg/m^3, outside 300 to 9000 kg/m^3"),
        ("full_scale", {"cable.sections.bare.mass_per_length": 0.01}, "= 0.01 kg/m make a cable of 127.3 kg/m^3"),
        ("lowered_ctd", {"ship.tow_speed": -0.1}, "leads forward under the ship, about 1 deg from the vertical"),
        ("full_scale", {"ship.tow_speed": 0.0, "water.current": [2.0, 0.0]}, "0.0] m/s overtakes the ship by 2 m/s"),
        ("side_scan", {"towbody.net_weight": 36.4}, "towbody.net_weight = 36.4 N is 7.4 % of the dry weight 490.5 N"),
        ("side_scan", {"towbody.lift_area": 0.05}, "it lifts the body, with 108.8 N at 2.06 m/s"),
        ("side_scan", {"towbody.length": 1.4, "towbody.diameter": 0.06}, "0.0133 m^3, 3.35 times the 0.00396 m^3 of"),
        ("side_scan", {"cable.diameter": 0.012}, "is that of side_scan, whose cable is 0.01 m thick, this one 0.012 m"),
        ("full_scale", {"winch.wrap": 100.0}, "winch.wrap = 100 rad has no effect: winch.scope = 450 m says how much"),
    ],
)
def test_what_hardly_can_be_is_said(name, values, text):
    assert text in " ".join(cautioned(scene_with, name, **values))


@pytest.mark.parametrize("name", ["full_scale", "side_scan", "lowered_ctd", "flume"])
def test_shipped_scenes_contradict_nothing(name):
    assert not cautioned(load_scene, name)


def test_a_rig_says_which_coefficient_is_missing():
    cable = cable_of(
        [{"length": 1.0, "elements": 1, "drag_law": "pode", "tangential_coefficient": 0.02}],
        mass_per_length=0.1,
        axial_stiffness=1e5,
    )
    with pytest.raises(RigError, match="tangential_coefficient = 0.02 has no meaning .* nothing was built. Give drag_"):
        Rig(cable, held={0: "r"}, tension=10.0)


@pytest.mark.parametrize("value, bound, text", [(0.12003, 0.12, "0.12003 0.12"), (0.5, 0.1, "0.5 0.1")])
def test_a_bound_is_told_apart_from_what_is_beyond_it(value, bound, text):
    """Not "0.12 m, more than 0.12 m"."""
    assert " ".join(apart(value, "<=", bound)) == text


def test_elements_a_little_too_long_for_the_sheave():
    long = {"cable.sections.sheave.elements": 48, "sheave.radius": 0.24999}
    said = " ".join(cautioned(scene_with, "full_scale_contact", **long))
    assert "lies on the sheave with elements of 0.1 m, more than 0.099996 m, 0.4 of sheave.radius" in said


def test_a_current_abeam_stays_abeam_or_says_so():
    current = {"water.current": [0.0, 0.5], "water.current_gradient": [0.001, 0.0]}
    scene, turned = scene_with(**current), scene_with(**current, water__current_frame="heading")
    assert current_of(scene.water, 2.0).tolist() == [0.0, 0.5, 0.001, 0.0]
    assert current_of(turned.water, 0.5 * np.pi) == pytest.approx([-0.5, 0.0, 0.0, 0.001])
    assert turned_current(turned, 2.0) == "" and turned_current(scene, 0.05) == ""
    assert turned_current(load_scene("full_scale"), 2.0) == ""  # no current
    assert turned_current(scene, np.radians(120.0)) == (
        "the heading of the motion is 120 deg, ship.heading_deg is 0 deg: that of the motion is used, and the current "
        "stays as it is in the world: it sets 30 deg to starboard of the bow, where the scene alone has it 90 deg to "
        "port of the bow. Set ship.heading_deg to 120 deg if that is meant, or water.current_frame: heading to keep "
        "the current as it was along the ship"
    )
    assert "it sets astern, where the scene alone has it 90 deg to port" in turned_current(scene, np.radians(270.0))


def test_waves_ahead_stay_ahead_or_say_so():
    """towards_deg 180 is a head sea of heading 0, not of that of the bag."""
    sea = {"water.waves.kind": "airy", "water.waves.height": 1.0, "water.waves.towards_deg": 180.0}
    scene = scene_with(**sea)
    assert turned_current(scene, 0.05) == ""
    assert turned_current(scene_with(**sea, water__waves__frame="heading"), 2.0) == ""
    assert turned_current(scene, np.radians(-128.2)) == (
        "the heading of the motion is -128.2 deg, ship.heading_deg is 0 deg: that of the motion is used, and the waves "
        "stay as they are in the world: they travel 52 deg to starboard of the bow, where the scene alone has them "
        "astern. Set ship.heading_deg to -128.2 deg if that is meant, or water.waves.frame: heading to keep the waves "
        "as they were along the ship"
    )
    table = {"depth": [0.0, 50.0], "speed": [0.5, 0.2], "towards_deg": [90.0, 90.0]}
    text = turned_current(scene_with(**sea, water__current_table=table), np.radians(90.0))
    assert "it sets ahead, where the scene alone has it 90 deg to port of the bow; the waves stay as they" in text
    assert text.endswith(
        "they travel 90 deg to port of the bow, where the scene alone has them astern. Set ship.heading_deg to 90 deg "
        "if that is meant, or water.current_frame: heading and water.waves.frame: heading to keep the current as it "
        "was and the waves as they were along the ship"
    )
