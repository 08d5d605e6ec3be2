"""Definitions, hashes and the name of the distribution follow the ROS in use."""

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
import yaml

from cable_sim_ros.io.bags import typestore

pytestmark = pytest.mark.trust

USED = ("sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState", "sensor_msgs/msg/PointCloud2")
USED += ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/WrenchStamped", "diagnostic_msgs/msg/DiagnosticArray")
WRITE = """
import sys
from cable_sim_ros.io.bags.bag_writer import BagWriter
with BagWriter(sys.argv[1]) as bag:
    bag.declare("/imu/data", "sensor_msgs/msg/Imu")
"""


def none(name):
    raise metadata.PackageNotFoundError(name)


@pytest.mark.parametrize(
    ("environ", "version", "name"),
    [
        ({"ROS_DISTRO": "kilted"}, lambda _: "7.1.6", "kilted"),
        ({}, lambda _: "7.1.6", "jazzy"),
        ({"ROS_DISTRO": ""}, lambda _: "9.1.2", "kilted"),
        ({}, lambda _: "10.0.10", "lyrical"),
        ({}, lambda _: "11.0.2", "rolling"),
        ({}, none, "jazzy"),
    ],
    ids=["sourced", "wheels 7", "wheels 9", "wheels 10", "later", "no ROS"],
)
def test_distribution_in_use(environ, version, name):
    assert typestore.distribution(environ, version) == name


@pytest.mark.parametrize("name", ["jazzy", "kilted", "lyrical", "rolling"])
def test_what_is_written_is_the_same_in_every_distribution(name):
    """So a bag recorded with one is played with the other. No hash has constants: Lyrical adds some to PointField."""
    store = typestore.store_of(name)
    assert [store.hash_rihs01(kind) for kind in USED] == [typestore.type_hash(kind) for kind in USED]


@pytest.mark.parametrize("name", ["jazzy", "kilted"])
def test_bag_says_the_distribution_it_was_made_with(tmp_path, name):
    environment = os.environ | {"ROS_DISTRO": name}
    subprocess.run([sys.executable, "-c", WRITE, str(tmp_path / "bag")], env=environment, check=True, timeout=600)
    info = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert info["ros_distro"] == name


def test_text_and_hash_are_those_of_the_messages_installed():
    """The definition files and hashes that the distribution in use ships, where its wheels are here."""
    pytest.importorskip("rclpy")
    fractions = [Path(prefix) / "share" for prefix in (sys.prefix, *os.environ.get("AMENT_PREFIX_PATH", "").split(":"))]
    for kind in ("sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState", "nav_msgs/msg/Odometry"):
        package, _, name = kind.split("/")
        found = [fraction / package / "msg" / f"{name}.json" for fraction in fractions]
        (path,) = [path for path in found if path.is_file()][:1]
        hashes = {entry["type_name"]: entry["hash_string"] for entry in json.loads(path.read_text())["type_hashes"]}
        assert hashes[kind] == typestore.type_hash(kind)
