"""What is drawn of a recorded run: shape, waves, charts, verdict, and what is refused in one line."""

import socket
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros import load_scene, override
from cable_sim_ros.cli import commands
from cable_sim_ros.errors import CODE_FAILED, CODE_INPUT
from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.io.bags.bag_writer import BagWriter
from cable_sim_ros.io.messages import shapes
from cable_sim_ros.io.messages.markers import cable_points, colour_scale
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import SceneWarning
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.plots.sea_surface import SeaSurface
from cable_sim_ros.runs import offline
from cable_sim_ros.tools.view.beside_node import Memory
from cable_sim_ros.tools.view.cameras import CAMERAS, camera, followed
from cable_sim_ros.tools.view.moment import (
    AMBER,
    RED,
    BagRun,
    alarms,
    alarms_html,
    parts_of,
    scale,
    smooth_shape,
    strips_of,
    verdict_html,
)
from cable_sim_ros.tools.view.page import Pace, Page, addresses


def call(*arguments):
    return CliRunner().invoke(commands.main, [str(a) for a in arguments])


def copied(bag: Path, to: Path, leave: str = "", **custom) -> Path:
    """The bag without a topic, its custom data changed."""
    with BagReader(bag) as reader:
        messages = [m for m in reader if not leave or not m.topic.endswith(leave)]
        about = {k: v for k, v in {**reader.custom_data, **custom}.items() if v is not None}
    with BagWriter(to, custom_data=about) as writer:
        for m in messages:
            writer.add(m.topic, m.msgtype, m.time, m.data)
    return to


def test_moments_are_those_that_were_recorded(run):
    assert len(run) == len(run.run.shapes) > 50
    for k in (0, len(run) // 2, len(run) - 1):
        moment = run.moment(k)
        stamp, shape = run.run.shapes[k]
        assert moment.frame["time"] == stamp and moment.shape is shape
        assert np.linalg.norm(shape[-1, :3] - moment.frame["body_position"]) < 1e-3  # one tick: cable and body meet
    assert run.index(-1.0) == 0 and run.index(1e9) == len(run) - 1
    assert run.moment(run.index(3.0)).seconds == pytest.approx(3.0, abs=0.11)


def test_the_line_between_nodes_is_that_of_a_circle_within_a_thousandth():
    angle = np.linspace(0.0, 1.5, 11)
    table = np.column_stack((np.cos(angle), np.sin(angle), 0 * angle, 0 * angle, angle))
    points, _ = cable_points(smooth_shape(table), parts_of(table))
    assert len(points) == 10 * 8 + 1
    assert np.abs(np.linalg.norm(points, axis=1) - 1.0).max() < 1e-3
    assert np.abs(np.linalg.norm(0.5 * (table[1:, :3] + table[:-1, :3]), axis=1) - 1.0).max() > 2.5e-3  # chords


def test_the_surface_is_that_of_the_simulation_at_every_tick(run):
    sea = SeaSurface(run.scene)
    sea.settle(run.run.frames)
    assert sea.agrees
    ours = [float(sea(*f["sheave_position"][:2], sea.at(f))) for f in run.run.frames]
    assert np.std(ours) > 0.1
    assert np.abs(np.array(ours) - run.run.frames["surface_elevation"]).max() < 1e-6


def test_waves_of_another_sea_are_not_drawn(run):
    waves = {"kind": "jonswap", "height": 1.5, "period": 6.0, "seed": 99}
    other = override(load_scene("side_scan"), {"water.waves": waves})
    sea = SeaSurface(other)
    sea.settle(run.run.frames)
    assert len(sea.table) and not sea.agrees


def test_a_scale_has_a_span():
    assert scale(np.array([5.0, 5.0]), 2.0) == pytest.approx((3.8, 6.2))
    assert scale(np.array([np.nan]), 2.0) == (0.0, 2.0)


def test_charts_have_the_numbers_of_the_tick_outputs(run):
    f = run.run.frames
    strips = strips_of(run.scene, colour_scale(run.scene, None))
    assert strips[0].title.endswith("[kN]")
    assert strips_of(run.scene, colour_scale(run.scene, 3.0))[0].title.endswith("[N]")
    tension, depth, payout, height = (strip.of(f) for strip in strips)
    assert np.array_equal(tension, f["tension"] / 1000) and np.array_equal(depth, -f["body_position"][:, 2])
    assert np.array_equal(payout, f["payout"]) and np.array_equal(height, f["sheave_position"][:, 2])


def test_a_rigid_towbody_has_a_chart_of_its_pitch():
    scene = load_scene("side_scan_fish")
    strip = strips_of(scene, colour_scale(scene, None))[-1]
    up = np.radians(-5.0)  # half of 10 deg about y, which points to port: negative is nose up
    frame = {"body_quaternion": np.array([0.0, np.sin(up), 0.0, np.cos(up)])}
    assert "pitch" in strip.title and strip.of(frame) == pytest.approx(10.0)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_camera_looks_at_what_it_follows(run, name):
    moment = run.moment(10)
    view = camera(name, run.scene, moment, (1.4, 0.11), 35.0)
    target = {
        "sheave": moment.frame["sheave_position"],
        "fish": moment.frame["body_position"],
        "drum": moment.frame["ship_position"] + np.array(run.scene.winch.position),
    }.get(name)
    if target is not None:
        assert np.linalg.norm(followed(name, run.scene, moment) - target) < 1.0
        assert np.linalg.norm(view.at) < 0.2 * np.linalg.norm(view.eye)
    assert view.near < 0.02 * np.linalg.norm(view.eye - view.at) and view.far > 5 * np.linalg.norm(view.eye - view.at)


def test_the_sheave_is_drawn_at_its_size(run):
    wheel = run.scene.sheave
    core = shapes.sheave_core(run.scene, 0.01).corners
    assert np.hypot(core[:, 0], core[:, 2]).max() == pytest.approx(wheel.radius)
    flange = shapes.sheave_flanges(run.scene, 0.01).corners
    assert np.hypot(flange[:, 0], flange[:, 2]).max() == pytest.approx(wheel.radius + wheel.groove_depth)


def test_flags_are_said_in_words():
    found = alarms(int(Flag.SLACK | Flag.NEWTON_FAILED | Flag.MOTION_BLENDING))
    assert [name for name, _, _ in found] == ["NEWTON_FAILED", "SLACK", "MOTION_BLENDING"]
    assert found[0][2] == RED and found[1][2] == AMBER
    assert "less than no tension" in alarms_html(int(Flag.SLACK)) and "none" in alarms_html(0)


def test_a_doubtful_run_is_not_shown_as_ok(tmp_path):
    scene = override(load_scene("side_scan"), {"ship.tow_speed": 1.0})
    with pytest.warns(SceneWarning, match="mean speed of the motion"):
        made = offline.run(scene, find_bag("nbp1406"), duration=42.0, out=tmp_path)
    assert "MEAN_TRACK" in {reason.flag for reason in made.verdict.reasons}
    verdict = BagRun(made.bag).verdict
    assert verdict.state == "doubtful" and {r.flag for r in verdict.reasons} >= {r.flag for r in made.verdict.reasons}
    html = verdict_html(verdict, "verdict:")
    assert "doubtful" in html and "mean speed of the motion" in html


def test_memory_of_a_node_begins_anew_where_its_clock_goes_back(run):
    frames = np.zeros(300, TICK_OUTPUT)
    frames["time"] = np.arange(300) * 10_000_000 + 5_000_000_000
    frames["status"] = int(Flag.SLACK)
    memory = Memory(run.scene)
    memory.add(frames[:200])
    memory.add(frames[200:])
    assert memory.seconds[-1] == pytest.approx(2.99) and not memory.again and memory.counts == {int(Flag.SLACK): 300}
    assert "SLACK" in memory.verdict_html()
    frames["status"] = 0
    memory.add(frames[:50])
    assert memory.again and memory.counts == {0: 50} and "ok" in memory.verdict_html()


def test_pace_skips_what_it_missed():
    now = [0.0]
    pace = Pace(10.0, lambda: now[0])
    assert pace.due() and not pace.due()
    now[0] = 5.0
    assert pace.due()
    assert sum(pace.due() for _ in range(100)) <= 1


def test_another_host_is_warned_of():
    assert "warning" not in addresses("127.0.0.1", 1) and "warning" not in addresses("::1", 1)
    assert "no password" in addresses("0.0.0.0", 8080)["warning"]


def refused(result, code, *texts):
    assert result.exit_code == code, result.output
    said = result.stderr.strip().splitlines()
    for text in texts:
        assert text in said[-1], said
    assert not any("Traceback" in line for line in said)


def test_a_bag_without_shapes_is_refused(bag, tmp_path):
    pytest.importorskip("viser")
    bare = copied(bag, tmp_path / "bare", leave="cable/shape")
    for command in (("view", bare, "--port", "0"), ("film", bare, "--out", tmp_path / "a.gif")):
        refused(call(*command), CODE_INPUT, "has no cable/shape", "nothing was drawn", "cable-sim replay")


def test_a_bag_without_a_scene_is_refused_and_taken_with_one(bag, tmp_path):
    bare = copied(bag, tmp_path / "bare", scene_yaml=None)
    refused(call("film", bare, "--out", tmp_path / "a.gif"), CODE_INPUT, "keeps no scene", "--scene")
    assert len(BagRun(bare, "side_scan")) > 50


def test_a_bag_of_something_else_is_refused(tmp_path):
    pytest.importorskip("viser")
    refused(call("view", "nbp1406", "--port", "0"), CODE_INPUT, "no topic 'sim/health'")
    refused(call("view", "no_such_bag"), CODE_INPUT, "no such bag")


def test_options_that_do_not_go_together_are_refused(bag):
    refused(call("view", "--save", "a.html"), CODE_INPUT, "give BAG")
    refused(call("view", bag, "--seconds", "3"), CODE_INPUT, "give --save")
    refused(call("view", bag, "--open"), CODE_INPUT, "are of a node")
    refused(call("view", bag, "--rate", "nan"), CODE_INPUT, "not a finite number")


def test_a_start_after_the_end_is_refused(bag):
    pytest.importorskip("viser")
    refused(call("view", bag, "--start", "900", "--port", "0"), CODE_INPUT, "--start 900 s", "give less")


@pytest.mark.parametrize("aspect, moved, looks", [(1.8, 0.0, 0), (1.2, 0.0, 1), (1.2, 1.0, 0), (1.81, 0.0, 0)], ids=str)
def test_a_camera_is_placed_anew_in_another_shape_where_nobody_moved_it(aspect, moved, looks):
    eye = np.array([0.0, -300.0, 40.0])
    page, found = object.__new__(Page), []
    window = SimpleNamespace(camera=SimpleNamespace(aspect=aspect, position=eye + (moved, 0.0, 0.0)))
    page.camera, page.look = "whole", lambda *asked: found.append(asked)
    page.looked = SimpleNamespace(get=lambda client, other: (1.8, eye))
    page._shaped(window)
    assert found == [("whole", window)] * looks


def test_a_port_that_is_taken_is_refused(bag):
    pytest.importorskip("viser")
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        one.listen()
        port = one.getsockname()[1]
        refused(call("view", bag, "--port", port), CODE_FAILED, f"--port {port}", "cannot be served", "another --port")


def test_a_missing_extra_is_named(bag, tmp_path, monkeypatch):
    for module, command in (
        ("viser", ("view", bag)),
        ("imageio_ffmpeg", ("film", bag, "--out", tmp_path / "a.mp4")),
        ("matplotlib", ("film", bag, "--out", tmp_path / "a.gif")),
    ):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, module, None)
            refused(call(*command), CODE_INPUT, "nothing was drawn", "pip install 'cable_sim_ros[view]'")


def test_a_damaged_bag_is_shown_as_far_as_it_goes(bag, tmp_path):
    whole = copied(bag, tmp_path / "cut")
    file = next(whole.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    with pytest.warns(UserWarning, match="damaged"):
        verdict = BagRun(whole).verdict
    assert verdict.state == "doubtful" and "DAMAGE" in {reason.flag for reason in verdict.reasons}
