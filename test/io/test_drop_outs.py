"""Motion that stops for 0.1 to 10 s, comes twice or out of order: through the ingest and the ship's kernels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_motion import T0, S
from true_ship import imu_messages, odometry_messages, sail, stamps

from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.physics.heave_filter import Heave
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.ship import NO_EPOCH, SHIP_TIMES, evaluate, follow, ship_ring
from cable_sim_ros.physics.ship import Ship as Parameters
from cable_sim_ros.physics.state import MEMORY, records
from cable_sim_ros.sim.loop import look

pytestmark = pytest.mark.check

TICK = S // 100
LATE = 3 * S // 100  # ns, the delay with which the motion is used
HEADING, TOWED = 0.7, 2.2  # rad, m/s: the tow frame's


class Ship:
    """Ticks every 10 ms behind an ingest; rows: time [s], coordinates, rates, accelerations in the tow frame."""

    def __init__(self):
        self.it = MotionIngest(make_inputs(), Parameters(tow_speed=TOWED), Heave())
        self.memory, self.times = records(1, MEMORY)[0], records(1, SHIP_TIMES)[0]
        self.times.stale_decay, self.times.start_blend, self.times.source_blend = 3.0, 1.0, 2.0
        self.memory.ship.epoch = NO_EPOCH
        self.memory.frame.velocity[:] = TOWED * np.cos(HEADING), TOWED * np.sin(HEADING)
        time = self.memory.time
        time.now = time.start = self.memory.ship.blend_at = T0
        self.rows = []

    def until(self, time_ns):
        time, motion = self.memory.time, self.memory.ship.motion
        while time.now + TICK <= time_ns - LATE:
            look(self.it.inputs)
            follow(time.now, time.now + TICK, ship_ring(self.it.inputs), self.memory.ship, self.memory, self.times)
            evaluate(time.now + TICK, ship_ring(self.it.inputs), self.memory.ship, self.memory, self.times.stale_decay)
            time.now += TICK
            self.rows.append([(time.now - T0) / S, *motion.coord, *motion.rate, *motion.accel])


def sailed(m, sent, imu_too=()):
    """Rows [n, 19] of a ship that gets the odometry of m where `sent`, its IMU where `imu_too`."""
    ship, odometry, imu = Ship(), odometry_messages(m), imu_messages(m)
    for k, stamp in enumerate(stamps(m)):
        if sent[k]:
            ship.it.odometry(odometry[k], stamp)
        if len(imu_too) and imu_too[k]:
            ship.it.imu(imu[k], stamp)
        ship.until(stamp)
    return np.array(ship.rows), ship.it


@pytest.mark.parametrize("gap, speed", [(0.1, 4.0), (0.6, 2.2), (10.0, 4.0)])
def test_a_drop_out_neither_shakes_the_ship_nor_carries_it_off(gap, speed):
    """Both topics silent. Before, the ship's whole speed died out: 10 s at 4 m/s in a scene of 2.2 m/s put it 17 m
    beside its place and shook it by 22 m/s^2."""
    m = sail(22.0 + gap + 8.0, speed=speed, heading=HEADING)
    rows, _ = sailed(m, (m.t < 22.0) | (m.t >= 22.0 + gap))
    t, after = rows[:, 0], rows[:, 0] > 22.0
    place = np.stack([np.interp(t, m.t, m.position[:, i]) for i in range(2)], axis=1)
    place -= t[:, None] * TOWED * np.array([np.cos(HEADING), np.sin(HEADING)])
    off = np.hypot(*(rows[:, 1:3] - place).T)
    usual = np.abs(rows[(t > 10.0) & ~after, 13:16]).max()
    assert np.abs(rows[after, 13:15]).max() < 2.5 and np.abs(rows[after, 13:16]).max() < 5.0 * usual
    assert off[after].max() < 1.5 and off[-1] < 0.01
    assert np.isfinite(rows).all()


def test_the_imu_bridges_a_drop_out_of_the_odometry():
    m = sail(41.0, heading=HEADING)
    rows, it = sailed(m, (m.t < 30.0) | (m.t >= 35.0), np.ones(len(m.t), bool))
    assert it.counts["source_change"] == 2
    assert np.abs(rows[rows[:, 0] > 30.0, 13:16]).max() < 2.5
    height = np.interp(rows[:, 0], m.t, m.position[:, 2])
    assert np.abs(rows[:, 3] - height)[rows[:, 0] > 30.0].max() < 0.4


@given(st.integers(0, 10_000))
@settings(max_examples=5)
def test_duplicates_swaps_losses_and_odd_stamps_leave_the_motion_as_it_was(seed):
    """One message in ten twice, later than its neighbour, lost, or with a stamp of 1970 or an hour ahead, each."""
    random, m = np.random.default_rng(seed), sail(12.0)
    it = MotionIngest(make_inputs(), Parameters(tow_speed=TOWED), Heave())
    found = list(zip(stamps(m), odometry_messages(m)))
    k = 50
    while k < len(found) - 1:
        what = random.integers(40)
        if what < 4:
            found.insert(k, found[k])
        elif what < 8:
            found[k], found[k + 1] = found[k + 1], found[k]
        elif what < 12:
            del found[k]
        elif what < 14:
            data = found[k][1]
            found[k] = found[k][0], data[:4] + np.array([random.choice([7, 1]), 0], "<u4").tobytes() + data[12:]
        k += 1
    for arrival, data in found:
        it.odometry(data, arrival)
    head = int(it.inputs.motion_head[0])
    rows, times = it.inputs.motion[:head], (it.inputs.motion_time[:head] - T0) / S
    assert head > 400 and np.all(np.diff(times) > 0.0) and np.isfinite(rows).all() and it.epoch == 1
    for i in range(3):
        assert np.abs(rows[:, i] - np.interp(times, m.t, m.position[:, i])).max() < 2e-3
    assert set(c for c, n in it.counts.items() if n) <= {"stamp_not_advancing", "stamp_backwards"}
