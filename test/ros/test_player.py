"""What the player takes from a bag: the motion of the ship, by kind, from the part asked for."""

import struct

import pytest

from cable_sim_ros.io.bags.bag import BagError, BagWriter, read_bag
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.ros.play.player import PlayError, load

SECOND = 10**9


def test_items_have_kinds_and_times_from_the_start(bag):
    items = load(bag)
    assert [item.kind for item in items[:4]] == ["imu", "odometry", "imu", "odometry"] and len(items) == 1200
    assert [item.arrival for item in items[:4]] == [0, 0, SECOND // 50, SECOND // 50]
    part = load(bag, start=1.0, duration=2.0, imu_only=True)
    assert {item.kind for item in part} == {"imu"} and len(part) == 101 and part[0].arrival == 0
    assert part[0].stamp == items[0].stamp + SECOND
    assert part[0].moved(5 * SECOND).data[4:12] == struct.pack("<iI", *divmod(part[0].stamp + 5 * SECOND, SECOND))


def test_of_a_recorded_run_only_the_ship_is_played(bag, tmp_path):
    """The towbody's odometry and winch commands stand in such a bag too."""
    with BagWriter(tmp_path / "run") as writer:
        for message in list(read_bag(bag))[:200]:
            topic = message.topic.replace("/ship", "/tow_sim")
            writer.add(topic, message.msgtype, message.time, message.data)
            if message.msgtype == "nav_msgs/msg/Odometry":
                writer.add("/tow_sim/towbody/odom", message.msgtype, message.time, message.data)
                writer.add("/tow_sim/winch/command", "sensor_msgs/msg/JointState", message.time, message.data[:40])
    items = load(tmp_path / "run")
    assert len(items) == 200 and {item.kind for item in items} == {"imu", "odometry"}


def test_bags_that_cannot_be_played(bag, tmp_path):
    with pytest.raises(
        PlayError, match=r"has no sensor_msgs/Imu or nav_msgs/Odometry in the part asked for \(from 99 s"
    ):
        load(bag, start=99.0)
    with BagWriter(tmp_path / "short") as writer:
        writer.add("/imu/data", "sensor_msgs/msg/Imu", 5, b"\0\1\0\0")
    with pytest.raises(
        PlayError, match="a message of imu is not little-endian CDR; nothing was played; convert the bag"
    ):
        load(tmp_path / "short")
    with BagWriter(tmp_path / "none") as writer:
        writer.add("/x", "sensor_msgs/msg/JointState", 5, b"\0\1\0\0")
    with pytest.raises(BagError, match="has neither sensor_msgs/msg/Imu nor nav_msgs/msg/Odometry"):
        load(tmp_path / "none")


@pytest.mark.parametrize("name", ["start", "duration"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0])
def test_seconds_that_are_none_are_refused(name, value):
    with pytest.raises(PlayError, match=f"--{name} .* s is outside .0, 1e.07. s; nothing was played; give seconds"):
        load(find_bag("nbp1406"), **{name: value})
