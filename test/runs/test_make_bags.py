"""Bags from the recorded data: same bytes twice, the shipped ones, signs, and values that agree with each other."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader
from scipy.interpolate import CubicSpline

from cable_sim_ros.io.bags.bag import BagError, read_bag, read_metadata
from cable_sim_ros.io.messages.messages import decode_imu, decode_odometry
from cable_sim_ros.runs.make_bags import (
    GRAVITY,
    IMU_TOPIC,
    ODOMETRY_TOPIC,
    QUANTUM,
    RATE,
    RECORDS,
    Displacement,
    derive,
    displacement,
    interpolate,
    make_bags,
    metrics,
    read_csv,
)
from cable_sim_ros.sim.tables.attitude import quaternion, rotation

BAGS = Path(__file__).parents[2] / "bags"
SOURCE = BAGS / "source"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("bags")
    rows = make_bags(out)
    assert len(rows) == 12 and all(row in (BAGS / "README.md").read_text("utf-8") for row in rows)
    return out


def digest(folder):
    return {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(folder.iterdir())}


def doubles(message):
    """The 37 or 85 doubles at the end of an Imu or Odometry, and what stands before them."""
    size = 8 * (37 if message.topic == IMU_TOPIC else 85)
    return np.frombuffer(message.data[-size:], "<f8"), message.data[:-size]


def test_the_same_bytes_twice(made, tmp_path):
    make_bags(tmp_path, SOURCE, only=("lmg1903",))
    assert digest(tmp_path / "lmg1903") == digest(made / "lmg1903")
    assert not (tmp_path / "nbp1406").exists()


@pytest.mark.parametrize("name", RECORDS)
def test_shipped_bags_are_what_the_script_makes(made, name):
    """To one unit of rounding: another libm may round another way."""
    count = 0
    for ours, shipped in zip(read_bag(made / name), read_bag(BAGS / name), strict=True):
        assert (ours.topic, ours.msgtype, ours.time) == (shipped.topic, shipped.msgtype, shipped.time)
        (a, head), (b, head_shipped) = doubles(ours), doubles(shipped)
        assert head == head_shipped and np.abs(a - b).max() <= 1.01 * QUANTUM
        count += 1
    assert count == 2 * (int(RECORDS[name].duration) * RATE + 1)
    assert read_metadata(made / name)["custom_data"] == read_metadata(BAGS / name)["custom_data"]


@pytest.mark.parametrize("name", RECORDS)
def test_shipped_bags_are_rosbag2_with_their_provenance(name):
    with AnyReader([BAGS / name]) as reader:
        assert {(c.topic, c.msgtype) for c in reader.connections} == {
            (IMU_TOPIC, "sensor_msgs/msg/Imu"),
            (ODOMETRY_TOPIC, "nav_msgs/msg/Odometry"),
        }
        connection, time, raw = next(reader.messages())
        message = reader.deserialize(raw, connection.msgtype)
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == time
    start = {"nbp1406": "2014-08-01T00:00:30.160", "lmg1903": "2019-03-26T10:06:25.170"}[name]
    assert np.datetime64(time, "ns") == np.datetime64(start)
    about = read_metadata(BAGS / name)["custom_data"]
    assert "interpolated from 1 Hz" in about["processing"] and about["licence"] == "MIT"
    assert sum(f.stat().st_size for f in (BAGS / name).iterdir()) < 5_000_000


def test_readme_has_the_figures():
    text = (BAGS / "README.md").read_text()
    for name, record in RECORDS.items():
        moved = displacement(record, SOURCE)
        for row in metrics(name, moved):
            assert row in text
        assert f"{np.degrees(moved.heading):.1f} deg" in text
    assert "interpolated from 1 Hz" in text and "MIT" in text


def test_derivation_reproduces_the_derived_file():
    """The steps that make LMG1903's horizontal motion, on NBP1406's record, give the file that came with it."""
    start, raw = read_csv(SOURCE / "nbp1406_seapath330_1hz.csv")
    origin, file = read_csv(SOURCE / "nbp1406_6dof_derived_1hz.csv")
    attitude = np.column_stack([raw["heave_down_m"], raw["roll_rad"], raw["pitch_rad"]])
    ours = derive(raw["t_s"], raw["east_m"], raw["north_m"], raw["heading_rad"], attitude)[30:-30]
    assert origin - start == 30_160_000_000
    theirs = np.column_stack([v for k, v in file.items() if k != "t_s"])
    assert np.abs(ours - theirs).max(0) == pytest.approx(0, abs=1.1e-3)
    assert np.abs(ours - theirs)[:, 5].max() < 2e-6


def body(signal, column):
    """Motion from one recorded signal in one column, heading north-east."""
    motion = np.zeros((41, 6))
    motion[:, column] = signal(np.arange(41.0))
    return interpolate(Displacement(10**18, np.arange(41.0), motion, np.pi / 4), speed=0.0)


def test_signs_of_the_source_are_turned_once():
    """surge fwd, sway to starboard, heave down, roll + port up, pitch + bow up, yaw clockwise -> ENU, x fwd, y left."""

    def up(t):
        return 0.1 * np.sin(0.3 * t) ** 2

    k = 5 * RATE
    half = np.sqrt(0.5)
    value = 0.1 * np.sin(1.5) ** 2
    assert body(up, 0).position[k] == pytest.approx([value * half, value * half, 0])  # forward: north-east
    assert body(up, 1).position[k] == pytest.approx([value * half, -value * half, 0])  # starboard: south-east
    assert body(up, 2).position[k] == pytest.approx([0, 0, -value])
    port, bow = [0, 1, 0], [1, 0, 0]
    assert (rotation(body(up, 3).angles)[k] @ port)[2] == pytest.approx(np.sin(value))  # port side goes up
    assert (rotation(body(up, 4).angles)[k] @ bow)[2] == pytest.approx(np.sin(value))  # bow goes up
    turned = rotation(body(up, 5).angles)[k] @ bow
    assert np.arctan2(turned[0], turned[1]) == pytest.approx(np.pi / 4 + value)  # heading grows


def test_at_rest_the_imu_feels_g_upwards_and_the_track_goes_on():
    moved = Displacement(0, np.arange(11.0), np.zeros((11, 6)), np.radians(90.0))
    motion = interpolate(moved, speed=2.2)
    assert motion.specific_force == pytest.approx(np.tile([0, 0, GRAVITY], (501, 1)))
    assert motion.velocity == pytest.approx(np.tile([2.2, 0, 0], (501, 1))) and not motion.rate.any()
    assert motion.position[-1] == pytest.approx([22, 0, 0])  # due east


def test_a_sinusoid_has_its_specific_force():
    """Heave a sin(w t), rolled by a constant angle: f = R^T (g - a w^2 sin(w t)) upwards."""
    t, w = np.arange(0, 60, 0.1), 2 * np.pi / 10
    motion = np.zeros((len(t), 6))
    motion[:, 2], motion[:, 3] = -np.sin(w * t), 0.2
    got = interpolate(Displacement(0, t, motion, 0.0))
    inner = slice(5 * RATE, -5 * RATE)
    lift = GRAVITY - w * w * np.sin(w * got.time * 1e-9)
    assert got.specific_force[inner] == pytest.approx(
        np.column_stack([0 * lift, lift * np.sin(0.2), lift * np.cos(0.2)])[inner], abs=1e-3
    )


@given(st.lists(st.tuples(*[st.floats(-0.5, 0.5)] * 6), min_size=8, max_size=8))
@settings(max_examples=8)
def test_force_twist_and_pose_agree(points):
    """Numerical derivatives of the poses are the twist and the specific force, for any record."""
    motion = interpolate(Displacement(0, np.arange(8.0), np.array(points), 1.0), rate=400)
    t, turned = motion.time * 1e-9, rotation(motion.angles)
    velocity = CubicSpline(t, motion.position)(t, 1)
    assert np.einsum("nij,nj->ni", turned, motion.velocity)[5:-5] == pytest.approx(velocity[5:-5], abs=1e-3)
    acceleration = np.gradient(np.einsum("nij,nj->ni", turned, motion.velocity), t, axis=0)
    felt = np.einsum("nij,nj->ni", turned, motion.specific_force) - [0, 0, GRAVITY]
    assert felt[5:-5] == pytest.approx(acceleration[5:-5], abs=5e-2)
    spin = np.einsum("nji,njk->nik", turned, np.gradient(turned, t, axis=0))  # R^T R' is skew
    assert motion.rate[5:-5] == pytest.approx(
        np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])[5:-5], abs=2e-3
    )
    x, y, z, w = motion.quaternion.T
    assert 1 - 2 * (y * y + z * z) == pytest.approx(turned[:, 0, 0]) and 2 * (x * y + z * w) == pytest.approx(
        turned[:, 1, 0]
    )
    assert quaternion(motion.angles) == pytest.approx(motion.quaternion)


def test_imu_and_odometry_of_a_message_pair_agree(made):
    messages = list(read_bag(made / "nbp1406"))[4000:4002]
    imu, odometry = decode_imu(messages[0].data), decode_odometry(messages[1].data)
    assert imu.stamp == odometry.stamp and imu.angles == odometry.angles and imu.rate == odometry.rate
    assert odometry.twist


def test_bad_calls_name_the_remedy(made, tmp_path):
    for out, data, only, text in (
        (made, SOURCE, "lmg1903", "exists already: nothing was written; give --force to replace it"),
        (tmp_path, tmp_path, "lmg1903", "'lmg1903' was not made; give the folder of the source files with --data"),
        (tmp_path, SOURCE, "nbp", "there is no record 'nbp': nothing was written; choose from nbp1406, lmg1903"),
    ):
        with pytest.raises(BagError, match=text):
            make_bags(out, data, only=(only,))
    for speed in (float("nan"), 1e3):
        with pytest.raises(BagError, match=r"is outside \[-15, 15\] m/s: nothing was written; give the mean speed"):
            make_bags(tmp_path / "new", SOURCE, speed=speed)
    assert not (tmp_path / "new").exists()
    broken = tmp_path / "lmg1903_seapath_1hz.csv"
    broken.write_text("t_s,roll_rad\n0,0\n")
    with pytest.raises(ValueError, match="has no comment 't_s: ... after <UTC>Z': the bag would have no time"):
        read_csv(broken)


def test_force_replaces(made, tmp_path):
    (tmp_path / "lmg1903").mkdir()
    (tmp_path / "lmg1903" / "junk").write_text("x")
    make_bags(tmp_path, SOURCE, only=("lmg1903",), force=True, speed=3.0)
    assert not (tmp_path / "lmg1903" / "junk").exists()
    first = next(m for m in read_bag(tmp_path / "lmg1903") if m.topic == ODOMETRY_TOPIC)
    reference = next(m for m in read_bag(made / "lmg1903") if m.topic == ODOMETRY_TOPIC)
    assert decode_odometry(first.data).velocity[0] - decode_odometry(reference.data).velocity[0] == pytest.approx(
        0.8, abs=1e-3
    )
