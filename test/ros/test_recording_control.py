"""Recordings of a node without its topics: names under one root, one at a time, and refusals with a reason."""

import os
import re
import threading
import time

import pytest

from cable_sim_ros.io.bags.bag import read_bag, read_metadata
from cable_sim_ros.io.scenes.load import scene_from_text
from cable_sim_ros.ros.parameters import ParameterError, settle
from cable_sim_ros.ros.services.control import RecordingControl
from cable_sim_ros.sim.live_parameters import changed

pytestmark = pytest.mark.check

TOGGLES = 12  # a thousand are stress row S1
IMU, TOPIC = "sensor_msgs/msg/Imu", "/tow_sim/imu/data"


@pytest.fixture
def make(tmp_path):
    """RecordingControl with recording.* parameters, its root in tmp_path."""
    made = []

    def make(**recording):
        given = {"recording.root": str(tmp_path / "root")} | {f"recording.{k}": v for k, v in recording.items()}
        made.append(RecordingControl(settle(given), "/tow_sim"))
        return made[-1]

    yield make
    for control in made:
        control.stop()


def test_toggles_are_bounded(make, tmp_path):
    control = make(path="a")
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    for _ in range(TOGGLES):
        assert control.start() == ""
        assert control.start() == f"already recording to {control.path}"  # one at a time
        control.recorder.put(TOPIC, IMU, 1, b"\0\1\0\0")
        assert control.stop().written == 1 and control.stop() is None
    assert len(os.listdir("/proc/self/fd")) <= files + 2 and threading.active_count() == threads
    names = {path.name for path in (tmp_path / "root").iterdir()}
    assert names == {"a"} | {f"a_{k}" for k in range(2, TOGGLES + 1)}


def test_default_names_do_not_grow(make, monkeypatch, tmp_path):
    base = "tow_20261122_060000"
    monkeypatch.setattr(time, "strftime", lambda form: base)
    control = make()
    for _ in range(4):
        assert control.start() == ""
        control.stop()
    assert {p.name for p in (tmp_path / "root").iterdir()} == {base, f"{base}_2", f"{base}_3", f"{base}_4"}


@pytest.mark.parametrize("name", ["x" * 5000, ".", "..", "/tmp/elsewhere", "a/b", "a\n", "a\0b", "x" * 65])
def test_a_name_that_is_none_is_refused_at_the_start_and_while_running(make, name, tmp_path):
    rule = r"parameter 'recording.path' = .* is not a name for a recording: 1 to 64 of A-Z a-z 0-9 _ - are allowed"
    with pytest.raises(ParameterError, match=rule):
        settle({"recording.path": name})
    control = make()
    control.wanted = name
    text = control.start()
    assert text.startswith("no recording: parameter 'recording.path'") and "recording.root" in text and len(text) < 400
    assert control.recorder is None and not (tmp_path / "root").exists()
    control.wanted = "good"
    assert control.start() == ""


def test_links_and_old_bags_are_not_written_to(make, tmp_path):
    (tmp_path / "outside").mkdir()
    (tmp_path / "root").mkdir()
    (tmp_path / "root" / "link").symlink_to(tmp_path / "outside")
    (tmp_path / "root" / "old").mkdir()
    for name in ("link", "old"):
        assert f"{name}' exists already: it is not overwritten" in make(path=name).start()
    assert not list((tmp_path / "outside").iterdir()) and not list((tmp_path / "root" / "old").iterdir())


def test_a_root_that_cannot_be_used_is_refused_with_its_reason(make, tmp_path):
    (tmp_path / "file").write_text("x")
    for root, why in (
        (str(tmp_path / "file" / "x"), "Not a directory|is not a folder"),
        ("/proc/nowhere", "cannot be (written to|made)|0 bytes of the disk are free"),
        ("n" * 5000, r"File name too long.*|\.\.\. \(5000 characters\)"),
        ("a\0b", "null"),
    ):
        assert re.search(why, make(root=root).start()), root
    with pytest.raises(ParameterError, match=r"parameter 'recording.root' = .*file': '.*' is not a folder; nothing"):
        settle({"recording.enabled": True, "recording.root": str(tmp_path / "file")})
    with pytest.raises(ParameterError, match=r"of the disk are free, .* are to be left \(recording.least_free\)"):
        settle({"recording.enabled": True, "recording.root": str(tmp_path), "recording.least_free": 1e6 - 1.0})


def test_a_full_disk_ends_the_recording_in_good_order(make, monkeypatch):
    control = make(least_free=0.001)
    assert control.start() == ""
    for k in range(10):
        control.recorder.put(TOPIC, IMU, k, b"\0\1\0\0")
    control.recorder.least_free = 10**18  # as if another had filled the disk
    until = time.monotonic() + 600.0
    while not control.stats().ended and time.monotonic() < until:
        time.sleep(0.01)
    stats = control.stats()
    assert "of the disk are free" in stats.ended and "the bag is whole, the simulation goes on" in stats.ended
    control.recorder.put(TOPIC, IMU, 11, b"\0\1\0\0")
    assert (control.stats().written, control.stats().dropped) == (10, 1)
    first = control.path
    assert control.start() == "" and control.path != first  # what has ended is not in the way
    assert len(list(read_bag(first))) == 10 and read_metadata(first)["message_count"] == 10


def test_a_recording_has_live_parameters_as_they_are(make):
    control = make(path="a")
    scene = changed(control.settings.scene, "winch.command_timeout", 0.9)
    control.settings = control.settings._replace(scene=scene)
    assert control.start() == ""
    control.stop()
    kept = scene_from_text(read_metadata(control.path)["custom_data"]["scene_yaml"], "a")
    assert kept.winch.command_timeout == 0.9
