"""The four ways of the trade against closed forms, and places on the earth against known lengths of WGS 84."""

from math import cosh, hypot, pi, radians, sin, tanh

import numpy as np
import pytest

from cable_sim_ros.io.geodesy import on_earth, on_plane
from cable_sim_ros.io.sources.csv_table import MotionError
from cable_sim_ros.tools.layback.report import along_track
from cable_sim_ros.tools.layback.ways import (
    Table,
    along_the_track,
    astern,
    cable_factor,
    catenary,
    catenary_of_depth,
    follow_the_dog,
    looked_up,
    pythagoras,
    read_table,
)


def test_pythagoras_is_the_other_leg_and_nothing_where_the_cable_is_too_short():
    found = pythagoras(np.array([50.0, 50.0, 39.0, -50.0]), np.array([24.0, 44.0, 34.0, 24.0]), 6.0)
    assert found[0] == pytest.approx(40.0) and found[1] == 0.0
    assert np.isnan(found[2:]).all()


def test_the_factor_shortens_the_cable():
    assert cable_factor(np.array([200.0, 0.0]), 0.8).tolist() == [160.0, 0.0]
    assert np.isnan(cable_factor(np.array([-1.0]))).all()
    for factor in (0.0, 1.1):
        with pytest.raises(ValueError, match="outside"):
            cable_factor(np.array([1.0]), factor)


def summed(cable, weight, body, pull, pieces=200_000):
    """The chain link by link: layback and drop."""
    v = body + weight * cable * (np.arange(pieces) + 0.5) / pieces
    t = np.hypot(pull, v)
    return float(np.sum(pull / t)) * cable / pieces, float(np.sum(v / t)) * cable / pieces


def test_the_chain_is_the_sum_of_its_links():
    over, drop = catenary(np.array([200.0]), 3.0, 357.0, np.array([400.0]))
    assert (over[0], drop[0]) == pytest.approx(summed(200.0, 3.0, 357.0, 400.0), rel=1e-8)
    over, drop = catenary(np.array([200.0]), 0.0, 300.0, np.array([400.0]))  # weightless: straight
    assert (over[0], drop[0]) == pytest.approx((160.0, 120.0))
    over, drop = catenary(np.array([200.0]), 3.0, 357.0, np.array([0.0]))  # no way on: it hangs
    assert (over[0], drop[0]) == pytest.approx((0.0, 200.0))
    assert np.isnan(catenary(np.array([-1.0]), 3.0, 357.0, np.array([1.0]))[0]).all()


def test_the_chain_through_a_depth_has_that_depth_and_that_length():
    for a, x in ((300.0, 187.0), (50.0, 100.0)):
        length, sag = a * np.sinh(x / a), a * (cosh(x / a) - 1.0)
        assert catenary_of_depth(length, sag - 6.0, 6.0) == pytest.approx(x, rel=1e-9)
    assert catenary_of_depth(200.0, -6.0, 6.0) == 200.0  # level
    assert np.isnan(catenary_of_depth(np.array([50.0, 60.0]), 54.0, 6.0)).all()


def test_a_dog_on_a_leash_draws_the_tractrix():
    """Drawn from abeam along x: the fish at height L sech u, behind by L tanh u of L u (u = x / L)."""
    leash, t = 100.0, np.linspace(0.0, 300.0, 60_001)
    fish = follow_the_dog(np.column_stack([t, 0.0 * t]), np.full(len(t), leash), np.array([0.0, 1.0]))
    u = t[-1] / leash
    assert fish[-1] == pytest.approx([t[-1] - leash * tanh(u), leash / cosh(u)], abs=0.02)


def test_a_dog_on_a_circle_follows_on_a_smaller_one():
    leash, radius, turn = 60.0, 100.0, np.linspace(0.0, 6.0 * pi, 40_000)
    ship = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    fish = follow_the_dog(ship, np.full(len(turn), leash), np.array([0.0, -1.0]))
    assert hypot(*fish[-1]) == pytest.approx(80.0, rel=1e-3)  # sqrt(R^2 - L^2)


def test_a_dog_without_a_leash_is_nowhere_and_goes_on():
    ship = np.column_stack([np.arange(5.0), np.zeros(5)])
    fish = follow_the_dog(ship, np.array([2.0, 2.0, np.nan, 2.0, 2.0]), np.array([-1.0, 0.0]))
    assert np.isnan(fish[2]).all() and fish[4].tolist() == [2.0, 0.0]
    assert np.isnan(follow_the_dog(ship, np.full(5, np.nan), np.array([-1.0, 0.0]))).all()


def test_along_the_track_is_where_the_sheave_was():
    """Round a corner: 30 m behind is 20 m back on the first leg; before the beginning straight on; NaN stays."""
    ship = np.vstack([np.column_stack([np.arange(100.0), np.zeros(100)]), [[99.0, 10.0], [99.0, 20.0]]])
    layback = np.full(102, 30.0)
    layback[50] = np.nan
    fish = along_the_track(ship, layback, np.array([-1.0, 0.0]))
    assert fish[[0, 100, 101]] == pytest.approx(np.array([[-30.0, 0.0], [79.0, 0.0], [89.0, 0.0]]))
    assert np.isnan(fish[50]).all() and np.isfinite(fish[51]).all()
    behind, aside = along_track(ship, fish, np.zeros(102))
    assert behind[60:] == pytest.approx(np.full(42, 30.0)) and aside[60:] == pytest.approx(np.zeros(42), abs=1e-9)


def test_a_table_is_linear_between_its_rows_and_ends_at_them():
    laybacks = np.array([[60.0, 80.0], [120.0, 140.0], [180.0, np.nan]])  # the longest cable does not tow so fast
    table = Table(np.array([100.0, 200.0, 300.0]), np.array([1.0, 2.0]), laybacks)
    assert looked_up(table, np.array([150.0, 100.0]), np.array([1.0, 1.5])) == pytest.approx([90.0, 70.0])
    assert np.isnan(looked_up(table, np.array([99.0, 290.0, 150.0]), np.array([1.5, 1.9, 2.1]))).all()
    assert np.isnan(looked_up(None, np.ones(3), np.ones(3))).all()


HEAD = "winch.scope,ship.tow_speed,layback_max_m,reasons"


@pytest.mark.parametrize(
    "lines, text",
    [
        ((HEAD.replace("layback_max_m", "depth"), "1,2,3,"), "no column 'layback_max_m'"),
        (("towbody.mass," + HEAD, "1,100,2,3,"), "a column 'towbody.mass'"),
        ((HEAD, "100,1,90,", "200,1,,failed"), "has 1 cables out and 1 speeds"),
        ((HEAD, "100,1,many,"), "layback_max_m = many is no finite number"),
        ((HEAD, "100,1"), "2 cells under 3 columns"),
        ((), "is empty"),
    ],
)
def test_what_is_no_table_of_laybacks_is_refused_in_one_line(tmp_path, lines, text):
    (tmp_path / "table.csv").write_text("\n".join(lines), "utf-8")
    with pytest.raises(MotionError, match=text) as caught:
        read_table(tmp_path / "table.csv")
    assert "\n" not in str(caught.value) and "nothing was simulated" in str(caught.value)


def test_astern_is_against_the_course():
    found = astern(np.zeros((2, 2)), np.array([10.0, 10.0]), np.array([0.0, 0.5 * pi]))
    assert found == pytest.approx(np.array([[-10.0, 0.0], [0.0, -10.0]]))


def test_lengths_of_the_earth():
    """A minute of longitude on the equator is a pi/10800; a degree of latitude there 110 574.3 m (WGS 84)."""
    east = on_plane((0.0, 0.0), np.array([0.0]), np.array([1.0 / 60.0]))
    assert east[0] == pytest.approx([6_378_137.0 * sin(radians(1.0 / 60.0)), 0.0], abs=1e-6)
    north = sum(float(on_plane((k / 10.0, 7.0), np.array([(k + 1) / 10.0]), np.array([7.0]))[0, 1]) for k in range(10))
    assert north == pytest.approx(110_574.3, abs=0.5)


def test_places_go_to_the_earth_and_back():
    away = np.array([[0.0, 0.0], [12_000.0, -3000.0], [-50_000.0, 50_000.0]])
    for origin in ((0.0, 0.0), (60.0, 179.9), (-75.0, -30.0)):
        latitude, longitude = on_earth(origin, away)
        assert on_plane(origin, latitude, longitude) == pytest.approx(away, abs=1e-6)
        assert np.abs(longitude).max() <= 180.0


def test_a_place_along_a_track():
    ship = np.column_stack([np.arange(0.0, 100.0), np.zeros(100)])
    behind, aside = along_track(ship, ship - [40.0, 3.0], np.zeros(100))
    assert behind == pytest.approx(np.full(100, 40.0)) and aside == pytest.approx(np.full(100, 3.0))  # to starboard
    around = np.vstack([ship, np.column_stack([np.full(50, 99.0), np.arange(1.0, 51.0)])])
    places = np.full(around.shape, np.nan)
    places[-1] = (79.0, -2.0)
    behind, aside = along_track(around, places, np.zeros(len(around)))
    assert (behind[-1], aside[-1]) == pytest.approx((70.0, 2.0)) and np.isnan(behind[:-1]).all()
