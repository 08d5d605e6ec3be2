"""What drawing tools take from a node: markers and transforms, with and without their message packages."""

from __future__ import annotations

import os
import signal

import pytest
from conftest import LONG, ROOT, poll, recorded
from sensor_msgs.msg import PointCloud2

MARKERS, TF = "/tow_sim/cable/markers", "/tow_sim/tf"


def stamp_of(array: bytes) -> bytes:
    """That of the first marker, behind encapsulation and count."""
    return array[8:16]


def test_live_markers_are_those_recorded(world):
    package = pytest.importorskip("visualization_msgs.msg")
    ears = world.ears()
    live = ears.listen(package.MarkerArray, "cable/markers", raw=True)
    world.ship(ears).sail()
    node = world.node(
        recording__enabled=True, recording__markers=True, recording__root=str(world.folder), recording__path="tow"
    ).until("running")
    poll(lambda: len(live) > 20, "20 messages")
    assert node.stop(((signal.SIGTERM, LONG),)) == 0, "every other node of these tests ends by SIGINT"
    assert "Traceback" not in node.text and "jitter p99" in node.text and node.state()["state"] == "stopped"
    assert node.text.rstrip().splitlines()[-1].startswith("verdict: ")
    data = recorded(world.folder / "tow")
    by_stamp = {stamp_of(written): written for written in data[MARKERS]}
    for received in live:
        written = by_stamp[stamp_of(received)]
        assert received[: len(written)] == written, "live bytes and recorded bytes differ"
        assert len(received) - len(written) < 4  # the wire pads to four bytes
    ticks = len(data["/tow_sim/towbody/pose"])
    assert len(data[MARKERS]) == pytest.approx(ticks / 10, abs=1) and len(data[TF]) == pytest.approx(ticks / 5, abs=1)


def test_without_their_package_the_node_says_so_once_and_goes_on(world):
    """A package that cannot be imported stands in front of the installed one."""
    hidden = world.folder / "hidden"
    for name in ("visualization_msgs", "tf2_msgs"):
        (hidden / name).mkdir(parents=True)
        (hidden / name / "__init__.py").write_text(f"raise ImportError('{name} is hidden')\n")
    ears = world.ears()
    shapes = ears.listen(PointCloud2, "cable/shape")
    world.ship(ears).sail()
    node = world.node(
        environment={"PYTHONPATH": os.pathsep.join([str(hidden), str(ROOT), os.environ.get("PYTHONPATH", "")])},
        recording__enabled=True,
        recording__root=str(world.folder),
        recording__path="tow",
    ).until("running")
    poll(lambda: len(shapes) > 5, "shapes")
    names = dict(ears.node.get_topic_names_and_types())
    assert "/tow_sim/cable/shape" in names and not {MARKERS, TF} & set(names)
    assert node.stop() == 0 and "Traceback" not in node.text
    for topic, package in ((MARKERS, "visualization_msgs"), (TF, "tf2_msgs")):
        assert node.text.count(f"{topic} is not published: the package {package} is not installed") == 1
    data = recorded(world.folder / "tow")
    assert data[TF] and MARKERS not in data  # recorded all the same; markers where recording.markers says so
