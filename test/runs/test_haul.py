"""A haul of 200 m, recorded and replayed: the same numbers to the last bit, from the drum to the towbody.

Markers in recordings of runs and replays, and the picture of them.
"""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.bags.bag import BagError, BagWriter, read_bag
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.plots.foxglove_view import draw_bag, series
from cable_sim_ros.runs import offline

pytestmark = pytest.mark.trust

MARKERS, TF = "/tow_sim/cable/markers", "/tow_sim/tf"

PLAN = "0 hold, 1 rate -3.5, 59 hold"  # 203 m


def data_of(bag):
    data = {}
    for message in read_bag(bag):
        data.setdefault(message.topic, []).append(message.data)
    return data


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Two seconds of a tow, recorded with markers."""
    run = offline.run("full_scale", heave=(0.5, 8.0), duration=2.0, out=tmp_path_factory.mktemp("run"), markers=10.0)
    return run.bag


def test_a_run_without_them_is_the_same_but_for_them(bag, tmp_path):
    plain = data_of(offline.run("full_scale", heave=(0.5, 8.0), duration=2.0, out=tmp_path).bag)
    marked = data_of(bag)
    assert len(marked.pop(MARKERS)) == 20 and MARKERS not in plain
    assert marked == plain and len(plain[TF]) > 0


def test_a_replay_makes_the_markers_of_a_recording_that_has_none(bag, tmp_path):
    plain = offline.run("full_scale", heave=(0.5, 8.0), duration=2.0, out=tmp_path / "a").bag
    again = offline.replay(plain, out=tmp_path / "b", markers=10.0)
    assert data_of(again.bag)[MARKERS] == data_of(bag)[MARKERS]


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


@pytest.mark.parametrize("law", ["hold", "simplified_sheave"])
def test_a_haul_is_replayed_bit_for_bit(tmp_path, law):
    scene = override(load_scene("full_scale"), {"solver.tick": 0.05, "setpoint.algorithm": law})
    first = offline.run(scene, heave=(1.0, 8.0), duration=62.0, winch=PLAN, out=tmp_path)
    assert first.frames.scope[0] - first.frames.scope[-1] == pytest.approx(203.0, abs=2.5)
    assert np.abs(first.frames.payout + first.frames.cable_on_drum - 600.0).max() < 1e-9
    again = offline.replay(first.bag)
    assert again.metrics["largest_difference"] == {"field": "", "difference": 0.0, "ticks": len(first.frames)}
    assert read_tow(first.bag).about["scene_yaml"]


def test_the_haul_of_the_command_line_is_replayed_bit_for_bit(tmp_path):
    """With chosen steps, as a user gets them; 60 m of it."""
    line = ["run", "full_scale", "--heave", "1,8", "--winch", "0 rate -3, 20 hold", "--duration", "25", "--json"]
    line += ["--set", "contact.working_tension=9000"]
    for words in ([*line, "--out", str(tmp_path)], ["replay", str(tmp_path / "tow"), "--json"]):
        result = CliRunner().invoke(commands.main, words, catch_exceptions=False)
        assert result.exit_code == 0, result.stderr
        metrics = json.loads(result.stdout)
    assert metrics["largest_difference"]["difference"] == 0.0
    assert metrics["scope_max_m"] - metrics["scope_min_m"] == pytest.approx(60.0, abs=2.0)
