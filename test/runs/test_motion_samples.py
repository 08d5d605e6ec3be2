"""The motion of a bag as samples: pushed into a Simulator they are the run, and what is no motion is refused."""

import numpy as np
import pytest
from short_bag import put_short_bag

from cable_sim_ros import ShipMotion, Simulator, motion_of_bag, run
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.physics.tick_output import Source

pytestmark = pytest.mark.trust
S = 1_000_000_000


@pytest.fixture
def bag(monkeypatch):
    """Three seconds of the shipped motion, to change."""
    return put_short_bag(monkeypatch, 3)


def pushed(samples, start, count):
    """Tick outputs of a Simulator that is given the samples."""
    sim = Simulator("side_scan")
    sim.start(*start)
    for sample in samples:
        sim.push(sample)
    return sim.run(count)


def test_pushed_into_a_simulator_they_are_the_run(bag):
    theirs = run("side_scan", "nbp1406", duration=1.0).frames
    samples = motion_of_bag("nbp1406", "side_scan")
    assert all(isinstance(sample, ShipMotion) and sample.source is Source.ODOMETRY for sample in samples)
    assert [sample.jump for sample in samples] == [False] * len(samples)
    first, yaw = samples[0], np.array([sample.attitude[2] for sample in samples])
    heading = float(np.arctan2(np.sin(yaw).mean(), np.cos(yaw).mean()))
    ours = pushed(samples, (first.time_ns, first.position[:2], heading), 100)
    assert np.array_equal(ours.time, theirs.time)
    for name, atol in (("ship_position", 1e-9), ("ship_velocity", 1e-3), ("tension", 2.0), ("payout", 1e-6)):
        assert np.allclose(ours[name], theirs[name], rtol=0.0, atol=atol), name


def test_without_odometry_the_heave_filter_gives_them(bag):
    samples = motion_of_bag("nbp1406", "side_scan", imu_only=True)
    assert {sample.source for sample in samples} == {Source.IMU}
    assert samples[-1].time_ns - samples[0].time_ns > 2 * S


def test_a_table_gives_them_too(tmp_path):
    t = np.arange(0.0, 2.0, 0.05)
    rows = np.column_stack([t, 0.3 * np.sin(t), 2.0 * np.cos(t)])
    path = tmp_path / "mine.csv"
    np.savetxt(path, rows, delimiter=",", header="time_s,heave_m,roll_deg", comments="", fmt="%.17g")
    samples = motion_of_bag(path, "side_scan")
    now = np.array([sample.time_ns for sample in samples]) * 1e-9
    now -= now[0]
    assert np.allclose([sample.position[2] for sample in samples], 0.3 * np.sin(now), atol=1e-4)
    assert np.allclose([sample.attitude[0] for sample in samples], np.radians(2.0) * np.cos(now), atol=1e-4)
    assert np.allclose([sample.rate[0] for sample in samples], -np.radians(2.0) * np.sin(now), atol=1e-3)
    assert np.allclose([sample.velocity[0] for sample in samples], 2.06)


def test_a_jump_of_the_stamps_has_no_one_order(bag):
    half = len(bag) // 2
    bag[half:] = [event.moved(40 * S) for event in bag[half:]]
    with pytest.raises(MotionError, match=r"nbp1406: the stamps jump from \d+ ns to \d+ ns: no list of samples was"):
        motion_of_bag("nbp1406", "side_scan")


def test_odd_first_stamps_are_left_out(bag):
    clean = motion_of_bag("nbp1406", "side_scan")
    bag[0] = bag[0].moved(-3600 * S)
    samples = motion_of_bag("nbp1406", "side_scan")
    assert samples and samples[0].time_ns - clean[0].time_ns < S


def test_a_gap_is_a_jump_of_the_motion(bag):
    begin = bag[0].time
    bag[:] = [event for event in bag if not 0.5 * S < event.time - begin < 2.3 * S]
    samples = motion_of_bag("nbp1406", "side_scan")
    assert sum(sample.jump for sample in samples) == 1


def test_motion_of_which_nothing_can_be_used_has_no_samples(bag):
    bag[:] = [event._replace(data=event.data[:40]) for event in bag]
    with pytest.raises(MotionError, match=r"no message of the ship's motion can be used \(size \d+\): there are no"):
        motion_of_bag("nbp1406", "side_scan")
