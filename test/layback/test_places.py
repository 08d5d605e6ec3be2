"""The static place and its interval, and the command on a recording and on a log."""

import csv
import json
import re
from math import hypot, sqrt

import numpy as np
import pytest
from click.testing import CliRunner
from test_tow_log import GOOD, POSITIONS, N, written

from cable_sim_ros.cli import commands
from cable_sim_ros.io.geodesy import on_plane
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.parameter import declared
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.tools.ensemble.plan import Ranges, assumed, with_drag
from cable_sim_ros.tools.layback.laid import WAYS, NoShape, Samples, Tow, band_of, of_track, static_place

NONE = Ranges(drag=0.0, speed=0.0, current=0.0, current_turn_deg=0.0)
TOW = Tow(200.0, 2.06, 0.0, 0.0)


@pytest.mark.parametrize("values, drag", [({}, 1.0), ({}, 1.2), ({"water.current": [0.0, 0.5]}, 1.0)])
def test_the_static_place_is_that_of_the_solved_tow(values, drag):
    """By integration, without mesh and bending: within 0.05 m of 187 m and 54 m, of which the elements make 2 cm."""
    scene = override(load_scene("side_scan"), values)
    sim = Simulator(with_drag(scene, drag))
    sim.start()
    away = sim.frame.body_position - sim.frame.sheave_position
    place = static_place(scene, TOW, drag)
    assert (place.east, place.north) == pytest.approx(away[:2], abs=0.05)
    assert place.depth == pytest.approx(-sim.frame.body_position[2], abs=0.05)


def test_the_interval_holds_95_of_100_steady_tows():
    """Drag, speed and current drawn from the ranges: of 200 draws 190 +- 9 (three deviations) are inside."""
    ranges, chance, scene = Ranges(), np.random.default_rng(5), load_scene("side_scan")
    middle, band = band_of(scene, TOW, ranges)
    inside = np.zeros(3)
    for draw in chance.standard_normal((200, 4)) / 1.96:
        drag, speed, ahead, port = draw * (ranges.drag, ranges.speed, ranges.current, ranges.current)
        place = static_place(scene, TOW._replace(east=TOW.east + speed + ahead, north=port), 1.0 + drag)
        gaps = place.east - middle.east, place.north - middle.north, place.depth - middle.depth  # astern is along
        inside += np.abs(gaps) <= (band.along, band.across, band.depth)
    assert ((181 <= inside) & (inside <= 199)).all(), inside


def test_the_interval_is_that_of_its_parts():
    scene = override(load_scene("side_scan"), {"water.current": [0.0, 0.3]})
    _, none = band_of(scene, TOW, NONE)
    assert none == (0.0, 0.0, 0.0, 0.0)
    parts = {"drag": 0.2, "speed": 0.1, "current_turn_deg": 15.0, "payout": 1.0}
    alone = [band_of(scene, TOW, NONE.model_copy(update={name: value}))[1] for name, value in parts.items()]
    place, whole = band_of(scene, TOW, NONE.model_copy(update=parts))
    for k in range(4):
        assert whole[k] == pytest.approx(sqrt(sum(part[k] ** 2 for part in alone)), rel=1e-9)
    ends = [static_place(scene, TOW, drag).layback for drag in (0.8, 1.2)]
    assert alone[0].layback == pytest.approx(0.5 * abs(ends[0] - ends[1]))
    assert alone[3].layback == pytest.approx(0.93, abs=0.1)  # a metre of cable is nearly a metre of layback
    assert hypot(place.east, place.north) == place.layback


def test_a_tow_without_a_shape_says_so():
    with pytest.raises(NoShape, match="has no static shape"):
        static_place(override(load_scene("side_scan"), {"towbody.net_weight": -5000.0}), TOW)


def test_ranges_that_nobody_chose_are_said_with_their_size():
    lines = assumed(Ranges(), {"drag"})
    assert len(lines) == len(list(declared(Ranges))) - 1 and all(line.startswith("assumed: ") for line in lines)
    assert any("0.1 m/s (95 %); --range speed=" in line for line in lines) and not any("drag" in line for line in lines)


def call(*words):
    return CliRunner().invoke(commands.main, ["layback", *(str(word) for word in words)])


def table_of(folder):
    text = (folder / "layback.csv").read_text("utf-8")
    assert "nan" not in text.lower()
    return list(csv.DictReader(text.splitlines()))


@pytest.fixture(scope="module")
def by_log(tmp_path_factory):
    """A steady log along the static tow, with positions."""
    folder = tmp_path_factory.mktemp("layback")
    steady = {**POSITIONS, "speed_mps": None}
    path = written(folder / "log.csv", **steady)
    done = call(path, "--scene", "side_scan", "--json", "--out", folder / "out", "--antenna", "2,0")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout), folder / "out", path


def test_a_steady_log_gives_the_static_tow_behind_its_ship(by_log):
    """2 m/s east: the fish lies behind the sheave, 16 m behind base_link, 18 m behind the antenna."""
    report, out, _ = by_log
    place = static_place(load_scene("side_scan"), Tow(200.0, 2.0, 0.0, 0.0))
    assert report["layback_m"]["mean"] == pytest.approx(place.layback, abs=0.3)
    assert report["depth_m"]["mean"] == pytest.approx(place.depth, abs=0.3)
    rows = table_of(out)
    assert rows[0]["time_utc"] == "2026-03-01T12:00:00.000Z" and len(rows) >= N - 3
    for k in (5, -1):
        fish = on_plane((60.0, 5.0), np.array([float(rows[k]["latitude"])]), np.array([float(rows[k]["longitude"])]))[0]
        second = k if k > 0 else len(rows) + k
        assert fish == pytest.approx([2.0 * second - 18.0 - place.layback, 0.0], abs=0.6)
        assert float(rows[k]["layback_antenna_m"]) == pytest.approx(float(rows[k]["layback_m"]) + 18.0, abs=0.02)
    assert {row["way"] for row in report["ways"]} == set(WAYS)
    straight = next(row for row in report["ways"] if row["way"] == "pythagoras")
    assert straight["layback_difference_mean_m"] == pytest.approx(sqrt(200**2 - 60**2) - place.layback, abs=0.4)
    assert any("block of the sheave swivels" in note for note in report["notes"])
    assert any("pay-out counts from the sheave" in line for line in report["assumed"])
    assert report["depth_difference_m"]["share_within_interval"] == 1.0
    assert (out / "layback.png").stat().st_size > 10_000


def test_a_cable_shorter_than_deep_has_no_pythagoras_and_the_rest_goes_on(by_log, tmp_path):
    _, _, path = by_log
    done = call(path, "--scene", "side_scan", "--counter-offset", -145, "--json", "--out", tmp_path)
    report = json.loads(done.stdout)
    straight = next(row for row in report["ways"] if row["way"] == "pythagoras")
    assert straight["no_solution"] == report["samples"] and straight["apart_mean_m"] is None
    assert any("Pythagoras has no solution" in note and "--counter-offset" in note for note in report["notes"])
    rows = table_of(tmp_path)
    assert rows[3]["layback_pythagoras_m"] == "" and float(rows[3]["layback_m"]) > 40.0
    # and the depth that was measured is not that of such a tow
    assert done.exit_code == 4 and [r["flag"] for r in report["verdict"]["reasons"]] == ["LAYBACK_DEPTH"]


def test_of_a_recording(tmp_path):
    """The towbody of the run is the simulated one; an origin gives its latitude."""
    line = ["run", "side_scan", "--motion", "none", "--duration", "20", "--out", str(tmp_path / "run")]
    assert CliRunner().invoke(commands.main, line).exit_code == 0
    done = call(
        tmp_path / "run" / "tow", "--json", "--origin", "60,5", "--out", tmp_path / "lay", "--range", "drag=0.1"
    )
    assert done.exit_code == 0, done.output
    report, rows = json.loads(done.stdout), table_of(tmp_path / "lay")
    place = static_place(load_scene("side_scan"), TOW)
    assert report["layback_m"]["mean"] == pytest.approx(place.layback, abs=0.05)
    static = next(row for row in report["ways"] if row["way"] == "static")
    assert static["apart_largest_m"] < 0.1
    fish = on_plane((60.0, 5.0), np.array([float(rows[0]["latitude"])]), np.array([float(rows[0]["longitude"])]))[0]
    assert fish == pytest.approx([-16.0 - place.layback, 0.0], abs=2.2)
    assert list(rows[0])[0] == "time_s" and not any("drag of cable" in line for line in report["assumed"])


@pytest.mark.parametrize(
    "words, text",
    [
        (("{log}",), "a log does not say what is towed"),
        (("{log}", "--scene", "side_scan", "--range", "wind=1"), "there is no range 'wind'"),
        (("{log}", "--scene", "side_scan", "--range", "drag=2"), r"'2' is no number in \[0, 0.8\] 1"),
        (("{log}", "--scene", "side_scan", "--origin", "95,0"), r"95 is outside \[-89, 89\] deg"),
        (("{log}", "--scene", "side_scan", "--antenna", "here"), "'here' is not X,Y"),
        (("{log}", "--scene", "side_scan", "--began", "noon"), "'noon' is no time"),
        (("{log}", "--scene", "no_such"), "no such scene file"),
        (("no_such.csv", "--scene", "side_scan"), "no such file"),
    ],
)
def test_options_that_cannot_be_used(tmp_path, words, text):
    log = written(tmp_path / "log.csv", **GOOD)
    done = call(*(word.format(log=log) for word in words))
    assert done.exit_code == 2
    assert re.search(text, " ".join(done.output.split())), done.output


def way_of(turned):
    """Samples of 400 s at 2 m/s that turn by ``turned`` [rad] over 100 s, the fish 180 m behind on the way, and the
    steady tow of each moment."""
    t = np.arange(0.0, 400.0)
    course = 0.4 + turned * np.clip((t - 200.0) / 100.0, 0.0, 1.0)
    heads = np.column_stack([np.cos(course), np.sin(course)])
    sheave = np.cumsum(2.0 * heads, axis=0)
    fish = np.column_stack([np.interp(t - 90.0, t, sheave[:, k]) for k in (0, 1)])
    fish[t < 90.0] = sheave[t < 90.0] - 180.0 * heads[t < 90.0]
    rest = [np.zeros(len(t))] * 3
    return Samples(
        t, sheave, sheave, 2.0 * heads, course, rest[0], rest[0] + 200.0, rest[1], fish, rest[2], course
    ), -180 * heads


def test_the_interval_of_a_straight_way_is_the_steady_one_and_a_turn_makes_it_that_of_its_way():
    band = np.tile([2.0, 2.0, 9.0, 1.0], (400, 1))
    assert of_track(*way_of(0.0), band, 0.1) == pytest.approx(band, abs=1e-5)
    one, steady = way_of(-0.5 * np.pi)
    found = of_track(one, steady, band, 0.0)
    assert found[:195] == pytest.approx(band[:195], abs=1e-5) and found[395] == pytest.approx(band[395], abs=0.1)

    # a current of 0.1 m/s that nobody knew: the way through the water less that of the sheave since the same length
    def end(current, k=300):
        water = one.velocity[:k][::-1] - current
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*water.T))])
        back = np.vstack([[0.0, 0.0], -np.cumsum(water, axis=0)])
        return np.array([np.interp(180.0, length, back[:, j]) for j in (0, 1)])

    k, still = 300, end((0.0, 0.0))
    axes = np.array([still, [-still[1], still[0]]]) / np.hypot(*still)
    worst = sum((axes @ (end(current) - still)) ** 2 for current in ((0.1, 0.0), (0.0, 0.1)))
    assert np.hypot(2.0, np.sqrt(worst[0])) == pytest.approx(found[k, 1], rel=0.05)
    assert np.sqrt(worst[1]) == pytest.approx(found[k, 2], rel=0.05)
    assert found[k, 1] > 3.0 and found[k, 2] > 10.0
    assert (of_track(one, steady, band, 0.1)[250:350, 2] > found[250:350, 2]).all()
