"""Numbers that contradict each other are refused or said, each with both numbers and the way out."""

import warnings

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, load_scene, override
from cable_sim_ros.sim.problem import apart
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of
from cable_sim_ros.sim.tables.current import current_of, turned_current

pytestmark = pytest.mark.trust


def quietly(name, values=None):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return override(load_scene(name), values or {})


@pytest.mark.parametrize(
    "name, values, text",
    [
        (
            "full_scale",
            {"towbody.net_weight": 4450.0},
            "towbody.net_weight = 4450 N is more than the dry weight 2452.5 N of towbody.mass = 250 kg: nothing "
            "is heavier "
            "in water than in air; nothing was started. Check the units of both; a depressor's down-force is its "
            "lift_area",
        ),
        (
            "full_scale_contact",
            {"winch.wrap": 100.0},
            "winch.wrap = 100 rad winds 30.48 m of cable on the drum, and with it cable.sections.span, whose "
            "elements of "
            "1.8 m are longer than 0.6 m, twice winch.drum_radius, and cannot follow the drum; nothing was "
            "started. Wind "
            "less than 5.2 m on it by a smaller wrap, or make the section at the drum end longer; the unit is "
            "rad, not deg "
            "or turns",
        ),
        (
            "full_scale",
            {"ship.tow_speed": -2.0},
            "ship.tow_speed = -2 m/s sends the ship astern through the water at 2 m/s: the cable leads forward "
            "under the "
            "ship, about 77 deg from the vertical, more than 45 deg; there is no hull in the model for it to lie "
            "against; "
            "nothing was started. Speed ahead is positive; check the sign, or go slower",
        ),
        (
            "side_scan",
            {"winch.position": [-8.0, 0.0, 20.0], "sheave.position": [-12.0, 0.0, 0.5]},
            "sheave.position lets the cable pass over the sheave: from the drum it falls 78.6 deg below the horizontal",
        ),
        (
            "full_scale",
            {"sheave.position": [-20.8, 0.0, 3.7]},
            "sheave.position has x = -20.8 m, not aft of winch.position with x = -28.8 m: a winch aft of its "
            "sheave is not "
            "modelled, for angles of wrap and departure and the set-point laws count from a cable that leaves "
            "aft, and over "
            "the bow it would come back under the ship; nothing was started. Give the sheave the smaller x; for a bow "
            "sheave describe the ship turned about",
        ),
        (
            "full_scale",
            {"cable.sections.bare.drag_law": "pode", "cable.sections.bare.tangential_coefficient": 0.01},
            "cable.sections.bare.tangential_coefficient = 0.01 has no meaning beside drag_coefficient = none",
        ),
    ],
)
def test_what_cannot_be_is_refused(name, values, text):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(SceneError) as error:
            override(load_scene(name), values)
    assert text in str(error.value)


@pytest.mark.parametrize(
    "name, values, text",
    [
        (
            "full_scale",
            {"cable.diameter": 0.005},
            "cable.diameter = 0.005 m and cable.mass_per_length = 0.389 kg/m make a cable of 1.981e+04 kg/m^3, "
            "outside 300 "
            "to 9000 kg/m^3 (fibre rope 500 to 1500, steel rope 4000 to 6500, solid steel 7850): its weight and "
            "drag in "
            "water are those of no cable. Check both: is the diameter a radius, or mm?",
        ),
        (
            "full_scale",
            {"cable.sections.bare.mass_per_length": 0.01},
            "cable.diameter = 0.01 m and cable.sections.bare.mass_per_length = 0.01 kg/m make a cable of 127.3 kg/m^3",
        ),
        (
            "lowered_ctd",
            {"ship.tow_speed": -0.1},
            "ship.tow_speed = -0.1 m/s is the ship going astern: the cable leads forward under the ship, about 1 "
            "deg from the vertical, and nothing keeps it off the hull. Speed ahead is positive; check the sign",
        ),
        (
            "full_scale",
            {"ship.tow_speed": 0.0, "water.current": [2.0, 0.0]},
            "water.current = [2.0, 0.0] m/s overtakes the ship by 2 m/s: the cable leads forward under it, "
            "about 77 deg from the vertical, and nothing keeps it off the hull. Check its direction",
        ),
        (
            "side_scan",
            {"towbody.net_weight": 36.4},
            "towbody.net_weight = 36.4 N is 7.4 % of the dry weight 490.5 N of towbody.mass = 50 kg: a body that "
            "nearly floats, 1.08 times as dense as water; 36.4 kg would be 357.1 N. Give it in N",
        ),
        (
            "side_scan",
            {"towbody.lift_area": 0.05},
            "towbody.lift_area = 0.05 m^2 lifts the body, with 108.8 N at 2.06 m/s through the water, against "
            "towbody.net_weight = 357 N. A wing that presses down, a depressor's, has a negative one",
        ),
        (
            "side_scan",
            {"towbody.length": 1.4, "towbody.diameter": 0.06},
            "towbody.net_weight = 357 N and towbody.mass = 50 kg displace 0.0133 m^3, 3.35 times the 0.00396 m^3 of a "
            "cylinder of towbody.length = 1.4 m and towbody.diameter = 0.06 m; expected 0.05 to 1.27: weight in the",
        ),
        (
            "side_scan",
            {"cable.diameter": 0.012},
            "cable.sections.armoured.drag_amplification = 1.8 is that of side_scan, whose cable is 0.01 m thick, this "
            "one 0.012 m: a drag factor is of one cable and how it strums",
        ),
        ("full_scale", {"winch.wrap": 100.0}, "winch.wrap = 100 rad has no effect: winch.scope = 450 m says how much"),
    ],
)
def test_what_hardly_can_be_is_said(name, values, text):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = load_scene(name)
    with pytest.warns(SceneWarning) as caught:
        override(scene, values)
    assert any(text in str(item.message) for item in caught), [str(item.message) for item in caught]


def test_shipped_scenes_contradict_nothing():
    for name in ("full_scale", "side_scan", "lowered_ctd", "flume"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            load_scene(name)


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
    """Not "0.12 m, longer than 0.12 m"."""
    assert " ".join(apart(value, bound)) == text


def test_elements_a_little_too_long_for_the_sheave():
    scene = quietly("full_scale_contact")
    with pytest.warns(SceneWarning) as caught:
        override(scene, {"cable.sections.sheave.elements": 48, "sheave.radius": 0.24999})
    text = next(str(item.message) for item in caught if "lies on the sheave" in str(item.message))
    assert "with elements of 0.1 m, longer than 0.099996 m, 0.4 of sheave.radius" in text


def test_a_current_abeam_stays_abeam_or_says_so():
    scene = quietly("full_scale", {"water.current": [0.0, 0.5], "water.current_gradient": [0.001, 0.0]})
    turned = quietly("full_scale", {**flat(scene), "water.current_frame": "heading"})
    assert current_of(scene.water, 2.0).tolist() == [0.0, 0.5, 0.001, 0.0]
    assert current_of(turned.water, 0.5 * np.pi) == pytest.approx([-0.5, 0.0, 0.0, 0.001])
    assert turned_current(turned, 2.0) == "" and turned_current(scene, 0.05) == ""
    assert turned_current(quietly("full_scale"), 2.0) == ""  # no current
    assert turned_current(scene, np.radians(120.0)) == (
        "the heading of the motion is 120 deg, ship.heading_deg is 0 deg: that of the motion is used, and the "
        "current stays "
        "as it is in the world: it sets 30 deg to starboard of the bow, where the scene alone has it 90 deg to "
        "port of the "
        "bow. Set ship.heading_deg to 120 deg if that is meant, or water.current_frame: heading to keep the "
        "current as it "
        "was along the ship"
    )
    assert "it sets astern, where the scene alone has it 90 deg to port" in turned_current(scene, np.radians(270.0))


def test_waves_ahead_stay_ahead_or_say_so():
    """towards_deg 180 is a head sea of heading 0, not of that of the bag."""
    sea = {"water.waves.kind": "airy", "water.waves.height": 1.0, "water.waves.towards_deg": 180.0}
    scene = quietly("full_scale", sea)
    assert turned_current(scene, 0.05) == "" and turned_current(quietly("full_scale"), 2.0) == ""
    assert turned_current(quietly("full_scale", sea | {"water.waves.frame": "heading"}), 2.0) == ""
    assert turned_current(scene, np.radians(-128.2)) == (
        "the heading of the motion is -128.2 deg, ship.heading_deg is 0 deg: that of the motion is used, and the waves "
        "stay as they are in the world: they travel 52 deg to starboard of the bow, where the scene alone has them "
        "astern. Set ship.heading_deg to -128.2 deg if that is meant, or water.waves.frame: heading to keep the waves "
        "as they were along the ship"
    )
    table = {"depth": [0.0, 50.0], "speed": [0.5, 0.2], "towards_deg": [90.0, 90.0]}
    text = turned_current(quietly("full_scale", sea | {"water.current_table": table}), np.radians(90.0))
    assert "it sets ahead, where the scene alone has it 90 deg to port of the bow; the waves stay as they" in text
    assert text.endswith(
        "they travel 90 deg to port of the bow, where the scene alone has them astern. Set ship.heading_deg to 90 deg "
        "if that is meant, or water.current_frame: heading and water.waves.frame: heading to keep the current as it "
        "was and the waves as they were along the ship"
    )


def flat(scene):
    return {"water.current": list(scene.water.current), "water.current_gradient": list(scene.water.current_gradient)}
