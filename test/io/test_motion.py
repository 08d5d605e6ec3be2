"""Motion messages into Inputs: round trips, signs, every cause of refusal, changes of source, and bags of any kind."""

import struct
from math import cos, nan, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from cable_sim_ros.io.bags.bag import BagError, BagWriter
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.cdr import header
from cable_sim_ros.io.messages.fault_hypotheses import DOUBTS
from cable_sim_ros.io.messages.message_classes import (
    UNKNOWN36,
    Imu,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from cable_sim_ros.io.messages.messages import CAUSES, decode_imu, decode_odometry, find_topics
from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.physics.heave_filter import Convention, Heave, MotionInput
from cable_sim_ros.physics.inputs import EPOCH, MOTION_ROWS, SOURCE, make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.tick_output import Source

pytestmark = pytest.mark.trust

BAGS = Path(__file__).parents[2] / "bags"
G = 9.81
S = 10**9
T0 = 1_700_000_000 * S
STEP = S // 50
ZERO = (0, 0, 0)


def turn(roll, pitch, yaw):
    """Rz Ry Rx, not by the code under test."""
    return Rotation.from_euler("ZYX", [yaw, pitch, roll])


def quaternion(roll, pitch, yaw):
    """x y z w of Rz Ry Rx."""
    return turn(roll, pitch, yaw).as_quat().tolist()


def serialized(message, little_endian):
    return bytes(STORE.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))


def imu(stamp, angles=ZERO, force=(0, 0, G), rate=ZERO, q=None, absent=False, frame="imu_link", little_endian=True):
    turned, turning, pushed = Quaternion(*map(float, q or quaternion(*angles))), vector(rate), vector(force)
    known = np.append(-1.0 if absent else 0.0, np.zeros(8))
    message = Imu(header(stamp, frame), turned, known, turning, np.zeros(9), pushed, np.zeros(9))
    return serialized(message, little_endian)


def odometry(
    stamp,
    position=ZERO,
    angles=ZERO,
    velocity=ZERO,
    rate=ZERO,
    q=None,
    frame="odom",
    child="base_link",
    little_endian=True,
):
    pose = Pose(Point(*map(float, position)), Quaternion(*map(float, q or quaternion(*angles))))
    twist = TwistWithCovariance(Twist(vector(velocity), vector(rate)), UNKNOWN36)
    message = Odometry(header(stamp, frame), child, PoseWithCovariance(pose, UNKNOWN36), twist)
    return serialized(message, little_endian)


def vector(numbers):
    return Vector3(*map(float, numbers))


def ingest(convention="enu", **kw):
    return MotionIngest(make_inputs(), Ship(**kw), Heave(), MotionInput(convention=Convention(convention)))


def newest(it, back=1):
    head = int(it.inputs.motion_head[0])
    assert head >= back
    row = it.inputs.motion[(head - back) % MOTION_ROWS]
    return int(it.inputs.motion_time[(head - back) % MOTION_ROWS]), row


def samples(it):
    """Rows pushed since the last 1024, oldest first."""
    head = int(it.inputs.motion_head[0])
    index = np.arange(max(0, head - MOTION_ROWS), head) % MOTION_ROWS
    return it.inputs.motion_time[index], it.inputs.motion[index]


# decoding

small = st.tuples(*[st.floats(-3, 3)] * 3)
attitude = st.tuples(st.floats(-3, 3), st.floats(-1.3, 1.3), st.floats(-3, 3))


@given(attitude, small, small, small, st.text("abc_/", max_size=9), st.text("abc_/", max_size=9), st.booleans())
@settings(max_examples=60)
def test_numbers_come_back_whatever_the_names_and_byte_order(angles, position, velocity, rate, frame, child, order):
    got = decode_odometry(
        odometry(T0 + 5, position, angles, velocity, rate, frame=frame, child=child, little_endian=order)
    )
    assert got.stamp == T0 + 5 and got.position == position and got.velocity == velocity and got.rate == rate
    assert np.allclose(got.angles, angles, atol=1e-9)
    got = decode_imu(imu(T0 + 7, angles, velocity, rate, frame=frame, little_endian=order))
    assert got.stamp == T0 + 7 and got.force == velocity and got.rate == rate
    assert np.allclose(got.angles, angles, atol=1e-9)


@given(st.integers(0, 84), st.floats(), st.integers(0, 36), st.floats())
@settings(max_examples=150)
def test_no_number_gets_a_sample_that_is_not_finite_through(i, a, k, b):
    """One double of a good message replaced by anything: NaN, infinity, 1e300, a denormal."""
    it = ingest()
    good = odometry(T0 + STEP), imu(T0 + STEP)
    it.odometry(odometry(T0), T0)
    it.odometry(good[0][:-680] + struct.pack("<d", a).join([good[0][-680:][: 8 * i], good[0][-680:][8 * i + 8 :]]), T0)
    it.imu(imu(T0), T0)
    it.imu(good[1][:-296] + struct.pack("<d", b).join([good[1][-296:][: 8 * k], good[1][-296:][8 * k + 8 :]]), T0)
    it.imu(imu(T0 + 2 * STEP), T0 + S)
    assert np.isfinite(samples(it)[1]).all()


def test_known_roll_port_side_up():
    """Roll 0.1 with the port side up is positive in both conventions; pitch and yaw turn round."""
    for convention, angles, force in (
        ("enu", (0.1, 0.0, 0.0), (0, G * sin(0.1), G * cos(0.1))),
        ("ned", (0.1, 0.0, pi / 2), (0, -G * sin(0.1), -G * cos(0.1))),
    ):  # heading east
        got = decode_imu(imu(T0, angles, force), Convention(convention))
        assert np.allclose(got.angles, (0.1, 0, 0), atol=1e-12)
        assert np.allclose(got.force, (0, G * sin(0.1), G * cos(0.1)))  # +g along the port-up vertical


@given(attitude, small, small)
@settings(max_examples=40)
def test_ned_is_the_same_motion_in_other_axes(angles, vector, position):
    """Rotate a body vector into the world in NED, then change axes: must be what the converted message gives."""
    north, east, down = turn(*angles).apply(vector)
    got = decode_odometry(odometry(T0, position, angles, vector, vector), Convention.NED)
    for found in (got.angles, decode_imu(imu(T0, angles, vector), Convention.NED).angles):
        assert np.allclose(turn(*found).apply([got.velocity, got.rate]), (east, north, -down), atol=1e-9)
    assert got.position == (position[1], position[0], -position[2])


def test_a_quaternion_within_a_hundredth_is_renormalised():
    q = quaternion(0.2, -0.1, 1.0)
    got = decode_imu(imu(T0, q=[1.009 * x for x in q]))
    assert np.allclose(got.angles, (0.2, -0.1, 1.0), atol=1e-12)


# refusals


def prepared():
    """An ingest that has taken both topics at T0 + 10 s."""
    it = ingest()
    it.odometry(odometry(T0 + 10 * S), T0 + 10 * S)
    it.imu(imu(T0 + 10 * S), T0 + 10 * S)
    return it


LATER = T0 + 10 * S + STEP
BAD = [
    ("size", "imu", b""),
    ("size", "imu", imu(LATER)[:-1]),
    ("size", "imu", imu(LATER) + b"\0"),
    ("size", "odometry", imu(LATER)),
    ("size", "odometry", odometry(LATER)[:30]),
    ("size", "imu", odometry(LATER)),
    ("encoding", "imu", b"\0\7" + imu(LATER)[2:]),
    ("not_finite", "imu", imu(LATER, force=(nan, 0, G))),
    ("not_finite", "imu", imu(LATER, rate=(0, np.inf, 0))),
    ("not_finite", "imu", imu(LATER, q=(nan, 0, 0, 1))),
    ("not_finite", "odometry", odometry(LATER, (0, -np.inf, 0))),
    ("not_finite", "odometry", odometry(LATER, velocity=(0, 0, nan))),
    ("not_finite", "odometry", odometry(LATER, q=(0, 0, nan, 1))),
    ("quaternion", "imu", imu(LATER, q=(0, 0, 0, 0))),
    ("quaternion", "odometry", odometry(LATER, q=(0, 0, 0, 0))),
    ("quaternion", "imu", imu(LATER, q=(0, 0, 0, 1.02))),
    ("quaternion", "odometry", odometry(LATER, q=(0, 0, 0, 0.98))),
    ("no_orientation", "imu", imu(LATER, absent=True)),
    ("no_orientation", "imu", imu(LATER, absent=True, q=(0, 0, 0, 0))),
    ("out_of_range", "imu", imu(LATER, force=(0, 0, 50.1))),
    ("out_of_range", "imu", imu(LATER, rate=(-5.1, 0, 0))),
    ("out_of_range", "odometry", odometry(LATER, rate=(0, 5.1, 0))),
    ("out_of_range", "odometry", odometry(LATER, velocity=(51, 0, 0))),
    ("out_of_range", "odometry", odometry(LATER, (2e7, 0, 0))),
    ("out_of_range", "imu", imu(LATER, (0, radians(85), 0))),
    ("out_of_range", "imu", struct.pack("<4sI", imu(LATER)[:4], 1) + struct.pack("<I", S) + imu(LATER)[12:]),
    ("height", "odometry", odometry(LATER, (0, 0, 35.0))),
    ("no_stamp", "imu", imu(0)),
    ("no_stamp", "odometry", odometry(0)),
    ("stamp_not_advancing", "imu", imu(T0 + 10 * S)),
    ("stamp_not_advancing", "odometry", odometry(T0 + 10 * S)),
    ("stamp_not_advancing", "odometry", odometry(T0 + 9 * S)),
    ("stamp_backwards", "imu", imu(T0 + 9 * S - 1)),
    ("stamp_backwards", "odometry", odometry(T0)),
]


@pytest.mark.parametrize("cause, topic, data", BAD)
def test_bad_input_is_refused_and_counted_by_cause(cause, topic, data):
    it = prepared()
    before, counted = int(it.inputs.motion_head[0]), dict(it.counts)
    assert getattr(it, topic)(data, LATER) is None
    assert it.inputs.motion_head[0] == before
    assert {k: v - counted[k] for k, v in it.counts.items() if v != counted[k]} == {cause: 1}
    report = it.report(LATER)
    assert report["refused"] == 1 and report["last_refusal"] == f"{topic}: {CAUSES[cause]}"
    assert it.odometry(odometry(LATER, velocity=(1, 0, 0)), LATER) == LATER  # and the next good one is taken
    assert it.imu(imu(LATER), LATER) == LATER


def test_every_cause_has_a_test():
    events = {cause for cause, text in CAUSES.items() if not text}
    elsewhere = {"joint_name", "array_length", "interface", "effort_only", "before_motion", "stamp_off_clock", *DOUBTS}
    elsewhere |= {"step_past", "step_future", "step_twice", "held_full"}  # test_lockstep, test_gate
    elsewhere |= {"no_vehicle", "too_fast", "flap_name", "flap_array"}  # test_vehicle_session, test_flaps
    assert {cause for cause, _, _ in BAD} | {"behind"} == set(CAUSES) - events - elsewhere
    assert events == {"imu_gap", "gap", "source_change", "position_jump", "heave_diverged"}


def test_stamps_behind_the_other_source_are_counted_and_not_pushed():
    it = ingest()
    it.odometry(odometry(T0 + S, velocity=(1, 0, 0)), T0)
    it.imu(imu(T0), T0)
    assert it.imu(imu(T0 + STEP), T0 + S) == T0 + STEP  # odometry is silent, but its newest stamp is ahead
    assert it.counts["behind"] == 1 and it.inputs.motion_head[0] == 1
    it.imu(imu(T0 + S + STEP), T0 + 2 * S)
    assert newest(it)[0] == T0 + S + STEP


def test_without_stamps_the_arrival_counts():
    it = ingest()
    for k in range(3):
        it.odometry(odometry(0, velocity=(1, 0, 0)), T0 + k * STEP)
    assert it.counts["no_stamp"] == 1 and list(samples(it)[0]) == [T0 + STEP, T0 + 2 * STEP]


# samples


def drive(it, t, twist=True):
    """Odometry of a ship that heaves, rolls, pitches and goes ahead while it turns; exact twist."""
    stamp = T0 + round(t * S)
    a = np.array([0.1 * sin(0.6 * t), 0.05 * sin(0.5 * t + 1), 3.0 + 0.05 * t])
    da = np.array([0.06 * cos(0.6 * t), 0.025 * cos(0.5 * t + 1), 0.05])
    p, v = np.array([2.0 * t, 0.3 * t, sin(0.6 * t)]), np.array([2.0, 0.3, 0.6 * cos(0.6 * t)])
    (sr, sp, _), (cr, cp, _) = np.sin(a), np.cos(a)
    body = (da[0] - da[2] * sp, da[1] * cr + da[2] * cp * sr, da[2] * cp * cr - da[1] * sr)
    sent = {"velocity": turn(*a).apply(v, inverse=True), "rate": body} if twist else {}
    it.odometry(odometry(stamp, p, a, **sent), stamp)
    return p, a, v, da


def test_odometry_twist_becomes_velocity_and_angle_rates_and_yaw_is_unwrapped():
    it = ingest()
    for k in range(500):  # the yaw passes pi
        p, a, v, da = drive(it, 0.02 * k)
        assert np.allclose(newest(it)[1], [*p, *a, *v, *da, 1.0, Source.ODOMETRY], atol=1e-9)
    assert it.report(T0 + round(9.98 * S))["odometry_rate_hz"] == pytest.approx(50.0)


def test_a_twist_of_zeros_is_replaced_by_central_differences_one_sample_later():
    it = ingest()
    known = [drive(it, 0.02 * k, twist=False) for k in range(100)]
    times, rows = samples(it)
    assert len(rows) == 99 and times[-1] == T0 + 98 * STEP
    for k in range(1, 99):
        p, a, v, da = known[k]
        assert np.allclose(rows[k, :12], [*p, *a, *v, *da], atol=2e-4)
    assert abs(rows[1:, 2:3] - [[k[0][2]] for k in known[1:99]]).max() < 1e-12
    drive(it, 2.0)  # a twist comes: the waiting sample and the new one
    assert list(samples(it)[0][-2:]) == [T0 + 99 * STEP, T0 + 100 * STEP]
    assert len(np.unique(samples(it)[1][:, EPOCH])) == 1


def test_a_ship_at_rest_with_zero_twist_stays_at_rest():
    it = ingest()
    for k in range(5):
        it.odometry(odometry(T0 + k * STEP, (1, 2, 0.5), (0.1, 0, 1)), T0 + k * STEP)
    assert np.allclose(newest(it)[1][:12], [1, 2, 0.5, 0.1, 0, 1, *[0] * 6], atol=1e-12)


def feed(it, start, stop, *, imu_on=True, odometry_on=True, speed=2.0, position=(0.0, 0.0), z=0.0):
    """Level ship going east at constant speed, both topics at 50 Hz from start to stop in s."""
    for k in range(round(start * 50), round(stop * 50)):
        stamp = T0 + k * STEP
        if imu_on:
            it.imu(imu(stamp), stamp)
        if odometry_on:
            it.odometry(odometry(stamp, (position[0] + speed * k / 50, position[1], z), velocity=(speed, 0, 0)), stamp)


def test_odometry_is_preferred_and_the_start_waits_for_it():
    it = ingest()
    feed(it, 0, 0.4, odometry_on=False)
    assert it.inputs.motion_head[0] == 0
    feed(it, 0.4, 1.0)
    assert set(samples(it)[1][:, SOURCE]) == {Source.ODOMETRY} and it.epoch == 1 and it.counts["source_change"] == 0
    assert it.first_pose == (T0 + 20 * STEP, pytest.approx(0.8), 0.0, 0.0)


def test_odometry_lost_and_found_goes_over_without_a_jump_and_with_new_epochs():
    it = ingest(tow_speed=5.0)
    feed(it, 0, 20)
    feed(it, 20, 30, odometry_on=False)
    times, rows = samples(it)
    assert rows[-1, SOURCE] == Source.IMU and it.epoch == 2 and it.report(T0 + 30 * S)["source"] == "imu"
    first = np.flatnonzero(rows[:, SOURCE] == Source.IMU)[0]
    assert (times[first] - times[first - 1]) * 1e-9 == pytest.approx(0.52)  # odometry_timeout, and not sooner
    assert np.allclose(rows[-1, :3], [2 * 29.98, 0, 0], atol=0.05)  # goes on as fast as it went, not at 5 m/s
    assert it.filter.age == pytest.approx(29.98)  # warm
    feed(it, 30, 30.98)
    assert newest(it)[1][SOURCE] == Source.IMU  # not yet trusted
    feed(it, 30.98, 32)
    assert newest(it)[1][SOURCE] == Source.ODOMETRY and it.epoch == 3 and it.counts["source_change"] == 2
    assert it.counts["position_jump"] == 0 and np.isfinite(samples(it)[1]).all()


def test_odometry_slower_than_the_timeout_does_not_flap():
    it = ingest()
    for k in range(1000):
        stamp = T0 + k * STEP
        it.imu(imu(stamp), stamp)
        if k % 50 == 0:
            it.odometry(odometry(stamp, velocity=(1, 0, 0)), stamp)
    assert it.counts["source_change"] == 1


def test_a_jump_of_position_shifts_the_origin_and_not_the_ship():
    it = ingest()
    feed(it, 0, 5, imu_on=False)
    feed(it, 5, 6, imu_on=False, position=(1000.0, -500.0))
    _, rows = samples(it)
    assert np.abs(np.diff(rows[:, 0])).max() < 0.05 and np.abs(np.diff(rows[:, 1])).max() < 0.01
    assert it.counts["position_jump"] == 1 and rows[-1, EPOCH] == 2
    report = it.report(T0 + 6 * S)
    assert (report["origin_x_m"], report["origin_y_m"]) == (pytest.approx(-1000, abs=0.1), pytest.approx(500, abs=0.1))
    feed(it, 6, 7, imu_on=False, position=(1003.0, -500.0))  # a small one is blended by the simulator
    assert it.counts["position_jump"] == 1


def test_a_jump_without_twist_does_not_count_as_speed():
    it = ingest()
    for k in range(600):
        stamp = T0 + k * STEP
        it.imu(imu(stamp), stamp)
        if k < 300:
            x = 2.0 * k / 50 + (0.0 if k < 290 else 2000.0)
            it.odometry(odometry(stamp, (x, 0, 0)), stamp)
    _, rows = samples(it)
    assert it.counts["position_jump"] == 1
    assert rows[-1, SOURCE] == Source.IMU and rows[-1, 6] == pytest.approx(2.0)


def test_odometry_that_comes_back_elsewhere_does_not_move_the_ship():
    it = ingest()
    feed(it, 0, 5)
    feed(it, 5, 10, odometry_on=False)
    feed(it, 10, 15, position=(300.0, 40.0))
    times, rows = samples(it)
    assert rows[-1, SOURCE] == Source.ODOMETRY and it.counts["position_jump"] == 1
    assert np.abs(np.diff(rows[:, 0])).max() < 2.0
    speed = np.diff(rows[-200:, 0]) / (np.diff(times[-200:]) * 1e-9)
    assert np.allclose(speed, 2.0, atol=1e-3) and np.allclose(rows[-200:, 6], 2.0)


def test_gaps_begin_new_epochs():
    it = ingest(max_gap=1.5)
    feed(it, 0, 2, imu_on=False)
    feed(it, 3.4, 4, imu_on=False)
    assert it.epoch == 1 and it.counts["gap"] == 0
    feed(it, 6, 7, imu_on=False)
    assert it.epoch == 2 and it.counts["gap"] == 1
    only = ingest()
    feed(only, 0, 3, odometry_on=False)
    feed(only, 4.2, 5, odometry_on=False)  # longer than heave.max_gap: the filter starts anew
    assert only.counts["imu_gap"] == 1 and only.epoch == 2 and only.filter.age == pytest.approx(0.78)


def test_a_heave_that_runs_away_restarts_the_filter():
    it = ingest()
    for k in range(3000):
        stamp = T0 + k * STEP
        it.imu(imu(stamp, force=(0, 0, G if k < 1500 else 3 * G)), stamp)
    assert it.counts["heave_diverged"] >= 1 and np.abs(samples(it)[1][:, :3]).max() <= 20.0
    assert it.epoch == 1 + it.counts["heave_diverged"]


def test_imu_alone_follows_the_tow_speed_along_its_heading():
    it = ingest(tow_speed=2.0, reference_height=1.5)
    for k in range(600):
        stamp = T0 + k * STEP
        it.imu(imu(stamp, angles=(0, 0, 2.0)), stamp)
    times, rows = samples(it)
    ahead = 2.0 * (times[-1] - times[0]) * 1e-9
    assert np.allclose(
        rows[-1, :12], [ahead * cos(2), ahead * sin(2), 1.5, 0, 0, 2, 2 * cos(2), 2 * sin(2), *[0] * 4], atol=1e-9
    )


def test_a_clock_set_back_shows_and_reset_takes_it_up():
    it = prepared()
    for k in range(12):
        assert it.odometry(odometry(T0 + k * STEP, velocity=(1, 0, 0)), LATER + k * STEP) is None
        assert it.time_jump == (k >= 9)
    before = it.epoch
    it.reset()
    assert it.inputs.motion_head[0] == 0 and not it.time_jump
    it.odometry(odometry(T0, velocity=(1, 0, 0)), LATER)
    assert it.inputs.motion_head[0] == 1 and it.epoch == before + 1 and it.counts["stamp_backwards"] == 12


@pytest.mark.parametrize(
    "force, hint", [((0, 0, G), ""), ((0, 0, -G), "set motion.convention"), ((0, 0, 0), "gravity removed")]
)
def test_the_report_tells_of_gravity_the_wrong_way(force, hint):
    it = ingest()
    for k in range(400):
        it.imu(imu(T0 + k * STEP, force=force), T0 + k * STEP)
    text = it.report(T0 + 8 * S)["hint"]
    assert hint in text and bool(text) == bool(hint)


def test_the_report_tells_of_a_twist_in_the_wrong_axes():
    it = ingest()
    for k in range(100):
        stamp = T0 + k * STEP
        it.odometry(odometry(stamp, (0, 2.0 * k / 50, 0), (0, 0, pi / 2), velocity=(0, 2, 0)), stamp)
    assert "child_frame_id" in it.report(T0 + 2 * S)["hint"]


def test_report_has_plain_values():
    for it in (ingest(), prepared()):
        for value in it.report(LATER).values():
            assert type(value) in (str, int, float, bool)
    assert prepared().report(T0 + 12 * S)["imu_age_s"] == pytest.approx(2.0)


# both bags through bytes


LONG = [pytest.param(name, np.inf, marks=pytest.mark.nightly) for name in ("nbp1406", "lmg1903")]


@pytest.mark.parametrize("name, seconds", [("nbp1406", 220.0), *LONG])
def test_imu_only_from_bytes_within_five_percent_of_the_odometry(name, seconds):
    """Required: RMS heave error <= max(5 cm, 5 % Hs) after 180 s with 1 mg of bias and 100 ug/sqrt(Hz) of noise."""
    random = np.random.default_rng(7)
    it = MotionIngest(make_inputs(), Ship(tow_speed=2.2), Heave())
    height, error, along, start = [], [], [], None
    truth = {}
    for time, kind, data in read_motion(BAGS / name):
        if kind == "odometry":
            truth[time] = decode_odometry(data).position
            height.append(truth[time][2])
            _, row = newest(it) if it.inputs.motion_head[0] else (0, None)
            if row is not None and time - start >= 180 * S:
                assert newest(it)[0] == time
                error.append(row[2] - truth[time][2])
                along.append(np.hypot(row[6], row[7]))
            continue
        start = time if start is None else start
        if time - start > seconds * S:
            break
        doubles = np.frombuffer(data[-296:], "<f8").copy()
        doubles[13:16] += radians(0.005) * 5 * random.standard_normal(3)
        doubles[25:28] += 1e-3 * G + 100e-6 * G * 5 * random.standard_normal(3)
        it.imu(data[:-296] + doubles.tobytes(), time)
    significant, rms = 4 * np.std(height), np.sqrt(np.mean(np.square(error)))
    assert rms <= max(0.05, 0.05 * significant)
    assert it.report(time)["heave_valid"] and it.report(time)["source"] == "imu" and it.epoch == 1
    assert np.mean(along) == pytest.approx(2.2, abs=0.15)


# bags


def test_topics_are_found_by_type_and_name():
    i, o, j = "sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState"
    assert find_topics(
        {
            "/ship/imu/data": i,
            "/ship/imu/data_raw": i,
            "/x/odom": o,
            "/tow_sim/towbody/odom": o,
            "/tow_sim/winch/state": j,
            "/tow_sim/winch/command": j,
        }
    ) == {"imu": "/ship/imu/data", "odometry": "/x/odom", "command": "/tow_sim/winch/command"}
    assert find_topics({"/mru": i, "/tow_sim/towbody/odom": o, "/joints": j}) == {"imu": "/mru"}
    assert find_topics({"/a": i, "/b": i}, {"imu": "/b"}) == {"imu": "/b"}
    with pytest.raises(BagError, match="imu could be any of /a, /b: nothing was read; say which topic it is"):
        find_topics({"/a": i, "/b": i})
    with pytest.raises(BagError, match="topic '/c' is not in the bag, imu needs sensor_msgs/msg/Imu"):
        find_topics({"/a": i}, {"imu": "/c"})


def bag_of_any_kind(kind, path):
    """Three IMU and two odometry messages, two of them at the same time, odometry first."""
    plan = [("odom", T0), ("imu", T0), ("imu", T0 + STEP), ("odom", T0 + 2 * STEP), ("imu", T0 + 2 * STEP)]
    topics = {"imu": ("/imu/data", "sensor_msgs/msg/Imu"), "odom": ("/odom", "nav_msgs/msg/Odometry")}
    if kind == "ros1":
        store, writer = get_typestore(Stores.ROS1_NOETIC), Writer1(path)
    else:
        store, writer = STORE, Writer2(path, version=9, storage_plugin=getattr(StoragePlugin, kind))
    with writer:
        connections = {k: writer.add_connection(*topics[k], typestore=store) for k in ("odom", "imu")}
        for k, t in plan:
            data = (imu if k == "imu" else odometry)(t, angles=(0.1, 0, 0))
            writer.write(connections[k], t, STORE.cdr_to_ros1(data, topics[k][1]) if kind == "ros1" else data)


@pytest.mark.parametrize("kind", ["MCAP", "SQLITE3", "ros1"])
def test_bags_of_any_kind_give_the_same_bytes_in_the_same_order(kind, tmp_path):
    path = tmp_path / ("old.bag" if kind == "ros1" else "bag")
    bag_of_any_kind(kind, path)
    plan = [("imu", T0), ("odometry", T0), ("imu", T0 + STEP), ("imu", T0 + 2 * STEP), ("odometry", T0 + 2 * STEP)]
    made = {"imu": imu, "odometry": odometry}
    assert list(read_motion(path)) == [(t, kind, made[kind](t, angles=(0.1, 0, 0))) for kind, t in plan]


def test_bags_that_cannot_be_used(tmp_path):
    with pytest.raises(BagError, match="does not exist: nothing was read; give the directory of a bag"):
        list(read_motion(tmp_path / "none"))
    with BagWriter(tmp_path / "other") as bag:
        kind = "std_msgs/msg/Header"
        bag.add("/x", kind, T0, bytes(STORE.serialize_cdr(header(T0, ""), kind)))
    with pytest.raises(BagError, match="has neither sensor_msgs/msg/Imu nor nav_msgs/msg/Odometry"):
        list(read_motion(tmp_path / "other"))
