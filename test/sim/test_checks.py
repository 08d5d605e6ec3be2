"""Lengths of cable that the checks of a scene count from are those of the route that the static start lays out."""

from math import cos, hypot, radians, sin

import pytest

from cable_sim_ros.io.scenes.load import SceneError, load_scene, override
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.statics.route import first_angle

pytestmark = pytest.mark.trust


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact", "side_scan", "lowered_ctd", "flume"])
def test_lengths_of_the_checks_are_those_of_the_route(name):
    """The cable turns from the drum, onto the sheave and off it at the lengths that the checks count from."""
    scene = load_scene(name)
    layout = layout_of(scene)
    angle, route = first_angle(scene, layout.water_speed), layout.route
    unmeshed = route.wound - route.on_drum  # a winch that feeds has its first node where the cable leaves the drum
    wound, tangent, leaves = (s - unmeshed for s in (layout.wound, layout.tangent, layout.leaves))
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
    ("changes", "text"),
    [
        (
            {"seabed.depth": 0.4, "sheave.position": [-36.8, 0.0, 0.26]},
            r"seabed.depth = 0.4 m lies above the sheave, whose lowest point is at 0.01 m: the cable would leave it "
            r"through the ground; nothing was started. Make it more than 0.49 m",
        ),
        (
            {"seabed.depth": 50.0, "towbody.net_weight": -20.0},
            r"seabed.depth is given, but what floats does not lie on it: the cable weighs 3.026 N/m in water, the "
            r"towbody -20 N; both must be above 0, they set its stiffness; nothing was started. Leave the seabed out",
        ),
    ],
)
def test_a_seabed_that_makes_no_sense_stops_the_load(changes, text):
    with pytest.raises(SceneError, match=text):
        override(load_scene("full_scale"), changes)
