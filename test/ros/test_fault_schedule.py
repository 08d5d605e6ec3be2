"""When a node sets the parameters of a scenario of faults; no rclpy."""

from __future__ import annotations

import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.ros.blocks import NodeBlock
from cable_sim_ros.ros.fault_schedule import FaultSchedule, schedule_of

FILE = """
scenario: a
faults:
  b: {at: 1, until: 2, target: encoder, kind: bias, size: 7.0}
  c: {at: 2, target: command, kind: late, size: 0.5}
"""


@pytest.fixture
def path(tmp_path):
    (tmp_path / "a.yaml").write_text(FILE, "utf-8")
    return str(tmp_path / "a.yaml")


@pytest.fixture(scope="module")
def scene():
    return override(load_scene("full_scale"), {"instruments.encoder.on": True})


def test_each_comes_once_in_its_order_and_again_after_a_reset(path, scene):
    schedule = FaultSchedule(NodeBlock(faults_file=path), scene)
    assert schedule.due(0.5) == []
    assert [(row.key, row.value) for row in schedule.due(1.2)] == [
        ("faults.encoder.size", 7.0),
        ("faults.encoder.kind", "bias"),
    ]
    assert schedule.due(1.9) == []
    assert [row.key for row in schedule.due(9.0)] == [
        "faults.encoder.kind",
        "faults.command.size",
        "faults.command.kind",
    ]
    assert schedule.due(9.1) == [] and schedule.due(0.0) == []
    assert [row.value for row in schedule.due(1.0)] == [7.0, "bias"]


def test_one_that_is_shorter_than_the_pace_of_asking_acts_all_the_same(path, scene):
    with open(path, "w", encoding="utf-8") as file:
        file.write("scenario: a\nfaults:\n  b: {at: 1, until: 1.02, target: encoder, kind: bias, size: 7.0}\n")
    schedule = FaultSchedule(NodeBlock(faults_file=path), scene)
    assert [row.value for row in schedule.due(1.05)] == [7.0, "bias"] and schedule.due(1.05) == []
    assert [row.value for row in schedule.due(1.06)] == ["none"] and schedule.due(1.1) == []
    with open(path, "w", encoding="utf-8") as file:
        file.write("scenario: a\nfaults:\n  b: {at: 1.001, until: 1.004, target: encoder, kind: bias, size: 7.0}\n")
    assert (
        "before the next tick output, that at 1.01 s: it would never act; nothing was started"
        in schedule_of(path, scene, False)[1]
    )


def test_a_fault_that_its_scene_cannot_have_is_refused_at_the_start(path):
    rows, problem = schedule_of(path, load_scene("full_scale"), False)
    assert rows == [] and problem == (
        "parameter 'faults_file': scenario a, b: faults.encoder.kind = bias, but instruments.encoder.on is false: "
        "there is nothing to be wrong; nothing was started. Give instruments.encoder.on: true, or kind: none"
    )
