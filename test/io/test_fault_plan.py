"""A scenario of faults as a file: what it changes when, and each thing that cannot be."""

import pytest

from cable_sim_ros.io.scenes.fault_plan import FaultError, load_faults, timed
from cable_sim_ros.runs.offline import scenario_of

pytestmark = pytest.mark.check

GOOD = """
scenario: motion lost
faults:
  late: {at: 60, until: 70, target: command, kind: late, size: 0.5}
  frozen: {at: 20, until: 60, target: mru_heave, kind: frozen, function: compensation, expected: holds}
  again: {at: 60, target: mru_heave, kind: drift, size: 0.01}
"""


def write(folder, text):
    path = folder / "faults.yaml"
    path.write_text(text, "utf-8")
    return path


def test_a_scenario_is_live_keys_at_times(tmp_path):
    rows = [(row.time, row.key, row.value) for row in timed(load_faults(write(tmp_path, GOOD)))]
    assert rows == [
        (20.0, "faults.mru_heave.size", 0.0),
        (20.0, "faults.mru_heave.kind", "frozen"),
        (60.0, "faults.mru_heave.kind", "none"),  # mended first where another follows at once
        (60.0, "faults.command.size", 0.5),
        (60.0, "faults.command.kind", "late"),
        (60.0, "faults.mru_heave.size", 0.01),
        (60.0, "faults.mru_heave.kind", "drift"),
        (70.0, "faults.command.kind", "none"),
    ]


@pytest.mark.parametrize(
    "old, new, text",
    [
        ("target: command", "target: rudder", r"'rudder' is nothing that can fail.*Give one of mru"),
        ("kind: late", "kind: broken", r"faults.yaml:4: faults.late.kind = 'broken' is none"),
        ("kind: late", "kind: none", r"= none is no fault"),
        ("until: 70", "until: 50", r"until = 50 s is not after at = 60 s"),
        ("at: 60, target: mru", "at: 59, target: mru", r"= 59 s is before faults.frozen is mended, 60 s"),
        ("at: 20, ", "", r"faults.frozen.at"),
        ("at: 20", "at: -1", r"faults.frozen.at = -1"),
        ("size: 0.5", "size: .nan", r"faults.late.size"),
        ("scenario: motion lost", "ship: {}", r"this is a scene of a tow, not a scenario of faults"),
        ("size: 0.5", "sise: 0.5", r"faults.late.sise"),
    ],
)
def test_a_scenario_that_cannot_be_is_refused_with_its_line(tmp_path, old, new, text):
    with pytest.raises(FaultError, match=text):
        load_faults(write(tmp_path, GOOD.replace(old, new)))


def test_a_scenario_may_be_data():
    data = {"scenario": "a", "faults": {"b": {"at": 1.0, "target": "usbl", "kind": "lost"}}}
    assert scenario_of(data).faults["b"].target == "usbl" and scenario_of(None) is None
    with pytest.raises(FaultError, match="faults.b.target = 'x' is nothing that can fail"):
        scenario_of({"scenario": "a", "faults": {"b": {"at": 1.0, "target": "x", "kind": "lost"}}})


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(FaultError, match="cannot be read"):
        load_faults(tmp_path / "none.yaml")
    with pytest.raises(FaultError, match="faults has no failure mode"):
        load_faults(write(tmp_path, "scenario: nothing\nfaults: {}\n"))
    with pytest.raises(FaultError, match="expected keys and values such as `scenario: heave lost`"):
        load_faults(write(tmp_path, "- 1\n"))
