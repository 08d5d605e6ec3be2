"""A haul of 100 m, recorded and replayed: the same numbers to the last bit, from the drum to the towbody.

Markers in recordings of runs and replays, and the picture of them.

A run whose vehicle moves by a table, a bag, a function or a simple motion; recorded, replayed, gone on with.
"""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros import CableSimError, replay, run
from cable_sim_ros.cli import commands
from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.bags.bag import BagError, BagReader, BagWriter, read_bag
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.plots.foxglove_view import draw_bag, series
from cable_sim_ros.runs import offline

pytestmark = pytest.mark.trust

SCENE = "rov_tether"
SECONDS = 8.0

MARKERS, TF = "/tow_sim/cable/markers", "/tow_sim/tf"

PLAN = "0 hold, 1 rate -3.5, 30 hold"  # 101 m


@pytest.fixture(scope="module")
def circled(tmp_path_factory):
    """A recorded run on a circle of 5 m in 30 s."""
    out = tmp_path_factory.mktemp("circle")
    return run(SCENE, vehicle="circle 5 30", duration=SECONDS, step="fixed", out=out / "run"), out / "run" / "tow"


@cache
def start() -> list[float]:
    return list(load_scene(SCENE).vehicle.position or ())


def circle(t: float) -> list[float]:
    x, y, z = start()
    w = 2.0 * math.pi / 30.0
    return [x + 5.0 * math.sin(w * t), y + 5.0 * (1.0 - math.cos(w * t)), z, 0.0, 0.0, 0.0]


def test_a_function_of_time_is_the_same_motion(circled):
    other = run(SCENE, vehicle=circle, duration=SECONDS, step="fixed")
    np.testing.assert_allclose(other.frames["vehicle_position"], circled[0].frames["vehicle_position"], atol=1e-9)
    np.testing.assert_allclose(other.frames["tension"], circled[0].frames["tension"], atol=1e-3)
    assert circled[0].verdict.state == "ok"


def test_a_table_at_1_hz_is_the_same_motion(circled, tmp_path):
    table = tmp_path / "vehicle.csv"
    rows = [f"{t},{','.join(f'{x:.6f}' for x in circle(t)[:3])}" for t in range(11)]
    table.write_text("\n".join(["time_s,x_m,y_m,z_m", *rows]))
    other = run(SCENE, vehicle=table, duration=SECONDS, step="fixed").frames
    np.testing.assert_allclose(other["vehicle_position"], circled[0].frames["vehicle_position"], atol=0.02)
    np.testing.assert_allclose(other["tension"], circled[0].frames["tension"], atol=1.0)


def test_a_replay_gives_the_same_bits_and_the_bag_is_a_source(circled):
    one, bag = circled
    again = replay(bag)
    for name in ("tension", "vehicle_force", "vehicle_position"):
        np.testing.assert_array_equal(again.frames[name], one.frames[name])
    other = run(SCENE, vehicle=bag, duration=SECONDS, step="fixed")
    np.testing.assert_allclose(other.frames["tension"], one.frames["tension"], atol=1e-6)


def test_the_force_is_recorded_as_a_wrench_in_axes_of_the_vehicle(circled):
    one, bag = circled
    topic, kind = "/tow_sim/vehicle/wrench", "geometry_msgs/msg/WrenchStamped"
    with BagReader(bag) as reader:
        found = [STORE.deserialize_cdr(message.data, kind) for message in reader.read([topic])]
    assert len(found) == len(one.frames) and found[0].header.frame_id == "vehicle_link"
    for part in ("force", "torque"):  # it heads east, level: its axes are those of the world
        got = np.array([[getattr(getattr(m.wrench, part), axis) for axis in "xyz"] for m in found])
        np.testing.assert_allclose(
            got, one.frames["vehicle_" + {"force": "force", "torque": "moment"}[part]], atol=1e-9
        )


def test_a_saved_run_goes_on_with_the_motion_of_its_vehicle(circled, tmp_path):
    run(SCENE, vehicle="circle 5 30", duration=4.0, step="fixed", save=tmp_path / "half.npz")
    rest = run(None, vehicle="circle 5 30", duration=SECONDS - 4.0, resumed=tmp_path / "half.npz")
    np.testing.assert_array_equal(rest.frames["tension"], circled[0].frames["tension"][400:])


@pytest.mark.parametrize(
    "given, text",
    [
        ("spiral 5 30", "is neither 'still', 'circle RADIUS PERIOD'"),
        ("circle 5", r"'circle 5' is none of .*Give a size in \[0, 1e4\] m"),
        ("", "'' is none of"),
        (lambda t: (0.0, 0.0), "expected six finite numbers"),
        (lambda t: (1.0 / 0.0,) * 6, "ZeroDivisionError"),
        (lambda t: (100.0 * t, 0.0, -30.0, 0.0, 0.0, 0.0), "the speed is"),
    ],
)
def test_what_moves_no_vehicle_is_refused(given, text):
    with pytest.raises(CableSimError, match=text):
        run(SCENE, vehicle=given, duration=1.0)


def test_steps_are_chosen_with_a_vehicle_too(circled):
    chosen = run(SCENE, vehicle="circle 5 30", duration=SECONDS, step="chosen", every=0.1)
    fixed = circled[0].frames["tension"][9::10]
    np.testing.assert_allclose(chosen.frames["tension"][20:], fixed[20:], atol=2.0)


def data_of(bag):
    data = {}
    for message in read_bag(bag):
        data.setdefault(message.topic, []).append(message.data)
    return data


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A second of a tow, recorded with markers."""
    run = offline.run("full_scale", heave=(0.5, 8.0), duration=1.0, out=tmp_path_factory.mktemp("run"), markers=10.0)
    return run.bag


def test_markers_are_beside_the_rest_and_a_replay_makes_the_same(bag, tmp_path):
    bare = offline.run("full_scale", heave=(0.5, 8.0), duration=1.0, out=tmp_path / "a").bag
    plain, marked = data_of(bare), data_of(bag)
    again = data_of(offline.replay(bare, out=tmp_path / "b", markers=10.0).bag)
    markers = marked.pop(MARKERS)
    assert len(markers) == 10 and MARKERS not in plain and again[MARKERS] == markers
    assert marked == plain and len(plain[TF]) > 0


def test_the_picture_is_drawn_from_the_messages(bag, tmp_path):
    picture = draw_bag(bag, tmp_path / "view.png")
    assert picture.stat().st_size > 30_000
    (tmp_path / "again").mkdir()
    assert draw_bag(bag, tmp_path / "again" / "view.png").read_bytes() == picture.read_bytes()


def test_a_bag_without_markers_is_refused(tmp_path):
    with BagWriter(tmp_path / "tow"):
        pass
    with pytest.raises(BagError, match=r"has no cable/markers: nothing was drawn; make them with cable-sim replay BAG"):
        draw_bag(tmp_path / "tow", tmp_path / "view.png")
    assert not (tmp_path / "view.png").exists()


def test_a_path_that_the_bag_lacks_is_named():
    with pytest.raises(BagError, match=r"the path '/other/x.y' of the layout is not in the bag: nothing was drawn"):
        series({}, "/other/x.y")


@pytest.mark.parametrize("command", [["run", "full_scale"], ["replay", "nbp1406"]])
def test_markers_without_a_place_to_write_them_are_refused(command):
    result = CliRunner().invoke(main, [*command, "--markers", "10"])
    assert result.exit_code == 2
    assert "--markers writes into the bag of --out; nothing was simulated; give --out DIR" in result.output


def test_a_haul_is_replayed_bit_for_bit(tmp_path):
    scene = override(load_scene("full_scale"), {"solver.tick": 0.05, "setpoint.algorithm": "simplified_sheave"})
    first = offline.run(scene, heave=(1.0, 8.0), duration=32.0, winch=PLAN, out=tmp_path)
    assert first.frames.scope[0] - first.frames.scope[-1] == pytest.approx(101.5, abs=2.5)
    assert np.abs(first.frames.payout + first.frames.cable_on_drum - 600.0).max() < 1e-9
    again = offline.replay(first.bag)
    assert again.metrics["largest_difference"] == {"field": "", "difference": 0.0, "ticks": len(first.frames)}
    assert read_tow(first.bag).about["scene_yaml"]


def test_the_haul_of_the_command_line_is_replayed_bit_for_bit(tmp_path):
    """With chosen steps, as a user gets them; 15 m of it."""
    line = ["run", "full_scale", "--heave", "1,8", "--winch", "0 rate -3, 5 hold", "--duration", "7", "--json"]
    line += ["--set", "contact.working_tension=9000"]
    for words in ([*line, "--out", str(tmp_path)], ["replay", str(tmp_path / "tow"), "--json"]):
        result = CliRunner().invoke(commands.main, words, catch_exceptions=False)
        assert result.exit_code == 0, result.stderr
        metrics = json.loads(result.stdout)
    assert metrics["largest_difference"]["difference"] == 0.0
    assert metrics["scope_max_m"] - metrics["scope_min_m"] == pytest.approx(15.0, abs=2.0)
