"""Lengths of cable that the checks of a scene count from are those of the route that the static start lays out."""

from math import cos, hypot, radians, sin

import pytest

from cable_sim_ros.io.load import load_scene
from cable_sim_ros.sim import checks
from cable_sim_ros.sim.statics import Route, first_angle


@pytest.mark.parametrize("name", ["full_scale", "side_scan", "lowered_ctd", "flume"])
def test_lengths_of_the_checks_are_those_of_the_route(name):
    """The cable turns from the drum, onto the sheave and off it at the lengths that the checks count from."""
    scene = load_scene(name)
    place, angle, route = checks.layout(scene), first_angle(scene, checks.water_speed(scene)), Route(scene)
    eps = 1e-6 * scene.sheave.radius
    x, z, *_ = route.place(place.wound - eps, angle)
    assert hypot(x, z) == pytest.approx(route.drum, rel=1e-9), "on the drum up to there"
    for s in place[:3]:
        before, after = route.place(s - eps, angle)[2:], route.place(s + eps, angle)[2:]
        assert before[0] * after[0] + before[1] * after[1] == pytest.approx(1.0, abs=1e-9), "a smooth route"
    free = route.place(place.leaves + eps, angle)
    assert free[2:] == pytest.approx((sin(angle), -cos(angle)), abs=1e-9), "straight from there on"
    curved = route.place(place.leaves - 0.5 * (place.leaves - place.tangent), angle)
    assert hypot(curved[0] - route.away, curved[1] - route.rise) == pytest.approx(route.sheave, rel=1e-9)


def test_the_fine_zone_of_the_thesis_is_the_known_one():
    scene = load_scene("full_scale_westin")
    inboard, outboard = checks.fine_zone(scene)
    wrapped = Route(scene).on_sheave(first_angle(scene, scene.ship.tow_speed))
    assert wrapped == pytest.approx(0.25 * radians(14.0), abs=0.002)  # nearly level: the critical angle
    assert outboard + wrapped == pytest.approx(0.86, abs=0.005)  # trap T6
    assert inboard == pytest.approx(2.5 - 0.86, abs=0.005)
