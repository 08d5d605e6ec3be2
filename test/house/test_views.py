"""Layouts of RViz, Foxglove and PlotJuggler: every topic, type and field that they name is one of the node's."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.channels import HEALTH, JOINTS, TRANSFORMS, Context, channels_of
from cable_sim_ros.io.messages.markers import markers_channel
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS, SHAPE_COLUMNS

pytestmark = pytest.mark.check

CONFIG = Path(__file__).resolve().parents[2] / "config"
SCENE = load_scene("full_scale")
ROWS = {Context().topic(row): row for row in (*channels_of(SCENE), markers_channel(SCENE, 10.0))}
FRAMES = {"odom", "base_link", "sheave_link", "towbody_link"}
NAMESPACES = {"cable", "contact", "drum", "sheave", "ship", "text", "towbody", "water"}
CLOUDS = {"/tow_sim/cable/shape": SHAPE_COLUMNS, "/tow_sim/sheave/contact": CONTACT_COLUMNS}
RVIZ_TYPES = {
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "PointCloud2": "sensor_msgs/msg/PointCloud2",
    "Wrench": "geometry_msgs/msg/WrenchStamped",
    "Odometry": "nav_msgs/msg/Odometry",
}


def field_type(msgtype: str, path: list[str]):
    """Type of a field of a message, by the definitions."""
    for name in path:
        fields = dict(STORE.fielddefs[msgtype][1])
        assert name in fields, f"{msgtype} has no {name}"
        kind, what = fields[name]
        msgtype = what if kind.name == "NAME" else (kind.name, what)
    return msgtype


@pytest.fixture(scope="module")
def rviz():
    return yaml.safe_load((CONFIG / "rviz" / "tow.rviz").read_text("utf-8"))["Visualization Manager"]


def test_rviz_displays_take_topics_of_their_type(rviz):
    shown = {}
    for display in rviz["Displays"]:
        plugin, kind = display["Class"].split("/")
        assert plugin == "rviz_default_plugins"
        if kind == "TF":
            continue
        topic = display["Topic"]
        row = ROWS[topic["Value"]]
        assert row.msgtype == RVIZ_TYPES[kind]
        assert topic["Reliability Policy"] == {"reliable": "Reliable", "sensor": "Best Effort"}[row.qos]
        shown[kind] = display
    assert set(shown) == set(RVIZ_TYPES)
    assert set(shown["MarkerArray"]["Namespaces"]) == NAMESPACES
    assert shown["PointCloud2"]["Channel Name"] in dict(SHAPE_COLUMNS)


def test_rviz_looks_at_frames_there_are(rviz):
    assert rviz["Global Options"]["Fixed Frame"] == "odom"
    views = [rviz["Views"]["Current"], *rviz["Views"]["Saved"]]
    assert {view["Target Frame"] for view in views} <= FRAMES and len(views) == 3
    assert TRANSFORMS.topic == "tf"


@pytest.fixture(scope="module")
def foxglove():
    return json.loads((CONFIG / "foxglove" / "tow.json").read_text("utf-8"))


def leaves(layout):
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])


def test_foxglove_has_a_panel_for_every_place(foxglove):
    assert sorted(leaves(foxglove["layout"])) == sorted(foxglove["configById"])
    assert set(foxglove) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}


def test_foxglove_draws_topics_fields_and_frames_there_are(foxglove):
    views = [panel for name, panel in foxglove["configById"].items() if name.startswith("3D!")]
    assert len(views) == 2
    for panel in views:
        assert panel["followTf"] in FRAMES and {f"frame:{name}" for name in FRAMES} == set(panel["transforms"])
        assert "/tow_sim/cable/markers" in panel["topics"]
        for topic, shown in panel["topics"].items():
            assert topic in ROWS
            assert set(shown.get("namespaces", {})) <= NAMESPACES
            if "colorField" in shown:
                assert shown["colorField"] in dict(CLOUDS[topic])


def test_foxglove_plots_what_its_labels_say(foxglove):
    """An index into sim/health must be that of the quantity: a new field of the tick output shifts it."""
    named = {
        "sheave": "tension",
        "drum": "tension_drum",
        "towbody": "tension_body",
        "set-point": "payout_setpoint",
        "sheave height": "sheave_position.z",
    }
    paths = [p for name, panel in foxglove["configById"].items() if name.startswith("Plot!") for p in panel["paths"]]
    assert len(paths) == 7
    for path in paths:
        topic, field, _, index = re.fullmatch(r"(/tow_sim/[a-z/]+)\.([a-z_.]+)(\[(\d+)\])?", path["value"]).groups()
        kind = field_type(ROWS[topic].msgtype, field.split("."))
        if topic.endswith("sim/health"):
            assert HEALTH[int(index)] == named[path["label"]], path["label"]
        elif index is not None:
            assert (JOINTS[int(index)], field) == ("payout", "position")
        else:
            assert kind == ("BASE", ("float64", 0)), path["value"]


def test_plotjuggler_curves_are_there():
    """JointStates appear by joint: topic/joint/position, /velocity, /effort."""
    root = ElementTree.parse(CONFIG / "plotjuggler" / "tow.xml").getroot()
    curves = [curve.get("name") for curve in root.iter("curve")]
    assert len(curves) > 15
    for name in curves:
        topic = next(topic for topic in sorted(ROWS, reverse=True) if name.startswith(f"{topic}/"))
        rest = name[len(topic) + 1 :].split("/")
        if ROWS[topic].msgtype == "sensor_msgs/msg/JointState":
            joint, array = rest
            assert joint in (HEALTH if topic.endswith("health") else JOINTS), name
            assert array in (("position",) if topic.endswith("health") else ("position", "velocity", "effort"))
        else:
            assert field_type(ROWS[topic].msgtype, rest) == ("BASE", ("float64", 0)), name
    used = {next(t for t in sorted(ROWS, reverse=True) if name.startswith(f"{t}/")) for name in curves}
    for plugin in root.find("Plugins"):
        chosen = plugin.find("selected_topics")
        if chosen is not None:
            assert set(chosen.get("value").split(";")) == used
