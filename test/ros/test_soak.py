"""The soak table: the rows that the command offers; the rows themselves are `make soak`."""

import math

import numpy as np
import pytest

from cable_sim_ros.io.messages.messages import decode_imu, decode_odometry
from cable_sim_ros.physics.heave_filter import Convention
from verification.soak import SOAK
from verification.soak.pace import missed_fraction
from verification.soak.rig import percentile
from verification.soak.sender import Ship


def test_the_command_offers_the_rows_that_there_are():
    pytest.importorskip("rclpy")
    rows = [SOAK.load(id) for id in SOAK.named]
    assert len(rows) == 18 == len({row.run for row in rows})


def test_missed_share_and_percentiles():
    assert missed_fraction({"overruns": 1.0, "skipped": 9.0, "ticks": 991.0}) == 0.01
    assert np.isnan(percentile([], 50)) and percentile([1.0, 3.0], 50) == 2.0


def test_a_made_up_ship_sends_what_the_node_reads():
    ship = Ship(1.0, 8.0)
    imu = decode_imu(ship.message("imu", 5_000_000_123, 2.0), Convention.ENU)
    odometry = decode_odometry(ship.message("odometry", 5_000_000_123, 2.0), Convention.ENU)
    assert imu.stamp == odometry.stamp == 5_000_000_123
    assert imu.force[2] == pytest.approx(9.81 - (2 * math.pi / 8.0) ** 2)
    assert odometry.position == pytest.approx((4.0, 0.0, 1.0)) and odometry.velocity == pytest.approx((2.0, 0.0, 0.0))
