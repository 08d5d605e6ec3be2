"""Damaged bags of SQLite and of ROS 1: rosbags reads them, and whatever it raises is one line for the user."""

import sqlite3

import numpy as np
import pytest
from hostile_files import flipped
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from test_motion import bag_of_any_kind

from cable_sim_ros.io.bags.bag import BagError, Damage, read_bag
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.sources.recorded_tow import read_motion

pytestmark = pytest.mark.check


@pytest.mark.parametrize("kind", ["SQLITE3", "ros1"])
def test_a_flipped_bit_gives_messages_or_one_line(kind, tmp_path):
    path = tmp_path / "old.bag" if kind == "ros1" else tmp_path / "bag"
    bag_of_any_kind(kind, path)
    file = path if kind == "ros1" else next(path.glob("*.db3"))
    whole, rng = file.read_bytes(), np.random.default_rng(3)
    unread = 0
    for bit in rng.integers(0, 8 * len(whole), 30):
        file.write_bytes(flipped(whole, int(bit)))
        damage = Damage()
        try:
            count = len(list(read_bag(path, damage)))
            assert count == 5 or damage or kind == "SQLITE3"  # SQLite has no checksums
            assert "\n" not in str(damage)
        except BagError as error:
            unread += 1
            assert "cannot be read (" in str(error) and "\n" not in str(error) and len(str(error)) < 600
    assert 0 < unread < 30
    for cut in np.linspace(0, len(whole) - 1, 8).astype(int):
        file.write_bytes(whole[:cut])
        damage = Damage()
        try:
            assert len(list(read_bag(path, damage))) == 5 or damage
        except BagError as error:
            assert "cannot be read (" in str(error) and "\n" not in str(error)


def test_a_giant_row_is_refused_before_it_is_read(tmp_path):
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=STORE)
        writer.write(connection, 1, b"\0\1\0\0")
    file = next((tmp_path / "bag").glob("*.db3"))
    with sqlite3.connect(file) as database:
        database.execute("UPDATE messages SET data = zeroblob(70000000)")
    database.close()
    with pytest.raises(BagError, match="1 messages are above the limit of 64 MB, up to 70 MB"):
        list(read_motion(tmp_path / "bag"))
