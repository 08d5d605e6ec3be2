"""The rules of a node: its ticks one by one give what a run gives, in /diagnostics, the final figures and the bag."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.ros.parts import OK, WARN
from cable_sim_ros.ros.publisher import PIECE, rule_keeper
from cable_sim_ros.ros.report.diagnostics import rule_status
from cable_sim_ros.ros.services.control import RecordingControl
from cable_sim_ros.sim.rules.watch import watched

pytestmark = pytest.mark.check

RULES = {"rules.set": "unols_3hz", "rules.working_load": 3000.0, "rules.groove_margin": 0.0, "rules.bend_life": 100.0}


@pytest.fixture(scope="module")
def scene():
    return override(load_scene("full_scale"), RULES)


def ticks(count=90, broken_at=70):
    frames = np.zeros(count, TICK_OUTPUT).view(np.recarray)
    frames.tick, frames.time = np.arange(1, count + 1), 10_000_000 * np.arange(1, count + 1)
    frames.tension, frames.groove_margin = 2000.0, 0.01
    frames.payout = 100.0 + np.sin(np.arange(count) / 5.0)
    frames.groove_margin[broken_at:] = -0.002
    return frames


def test_ticks_one_by_one_give_what_the_run_gives(scene):
    keeper, frames = rule_keeper(scene), ticks()
    for index, frame in enumerate(frames):
        keeper.add(frame.copy())
        if index == 33:
            keeper.report()  # asked in between
    assert keeper.report() == watched(scene, frames)["rules"]
    assert keeper.report()["broken"] == ["climb_out"]


def test_a_broken_rule_is_known_without_asking_for_the_report(scene):
    keeper = rule_keeper(scene)
    for frame in ticks(70 + PIECE):
        keeper.add(frame.copy())
    assert keeper.broken == ("climb_out",)


def test_no_rules_cost_nothing():
    assert rule_keeper(load_scene("full_scale")) is None


def test_the_task_warns_from_the_first_break_on(scene):
    keeper, frames = rule_keeper(scene), ticks(100)
    assert rule_status(keeper).level == OK and "kept" in rule_status(keeper).message
    frames.groove_margin[80:] = 0.01  # kept again
    for frame in frames:
        keeper.add(frame.copy())
    status = rule_status(keeper)
    assert (status.name, status.level) == ("rules", WARN)
    assert status.message == (
        "climb_out -0.002 m at 0.71 s, at least 0 m is allowed; broken first at 0.71 s, for 0.1 s in all"
    )
    assert status.values["climb_out: first_ns"] == "710000000" and status.values["climb_out: times"] == "1"
    assert status.values["working_load: at most"] == "3000" and "working_load: first_s" not in status.values
    assert status.values["not watched: wire_ratio"] == "rules.wire_diameter is not given"


def test_the_bag_keeps_them(scene, tmp_path):
    settings = settle({"scene": "full_scale", "recording.root": str(tmp_path), "recording.path": "a"})
    control = RecordingControl(settings, "/tow_sim")
    assert control.start() == ""
    keeper = rule_keeper(scene)
    for frame in ticks():
        keeper.add(frame.copy())
    publisher = SimpleNamespace(end_recording=lambda: None, rules=keeper)
    control.recorder.put("/chatter", "std_msgs/msg/Empty", 1, b"\x00\x01\x00\x00\x00")
    control.finish(SimpleNamespace(journal=None), publisher)
    with BagReader(control.path) as bag:
        kept = json.loads(bag.custom_data["rules"])
    assert kept == json.loads(json.dumps(keeper.report())) and kept["broken"] == ["climb_out"]
