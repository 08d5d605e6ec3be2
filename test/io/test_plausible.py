"""Wrong units and axes are found from the data alone, by name, soon, and are not used; good data is never doubted."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_motion import BAGS, T0, S, imu, odometry
from true_ship import FLIP, SWAP, G, imu_messages, ned, noisy, odometry_messages, rotor, sail, stamps, world

from cable_sim_ros.io.messages.fault_hypotheses import DOUBTS
from cable_sim_ros.io.messages.messages import CAUSES, decode_imu, decode_odometry
from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.io.plausibility.plausibility import Watch
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.physics.heave_filter import Heave, MotionInput
from cable_sim_ros.physics.inputs import SOURCE, make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.tick_output import Source
from cable_sim_ros.sim.tables.attitude import angles_of, rotation

pytestmark = pytest.mark.trust

DEGREES = 180.0 / pi
KNOTS = 1.943844


def events(of_imu=None, of_odometry=None):
    """(stamp, kind, bytes) in order."""
    found = [(s, "imu", d) for s, d in zip(stamps(of_imu), imu_messages(of_imu))] if of_imu else []
    if of_odometry:
        found += [(s, "odometry", d) for s, d in zip(stamps(of_odometry), odometry_messages(of_odometry))]
    return sorted(found, key=lambda event: event[:2])


def through(found, it=None):
    """An ingest that has taken the events, when each cause was first found [s], and rows of odometry after it."""
    it = it or MotionIngest(make_inputs(), Ship(tow_speed=2.2), Heave())
    began, first, used = found[0][0], {}, 0
    for stamp, kind, data in found:
        before = int(it.inputs.motion_head[0])
        it.take(kind, data, stamp)
        for topic, cause in it._watch.causes.items():
            if cause:
                first.setdefault((topic, cause), (stamp - began) * 1e-9)
        if int(it.inputs.motion_head[0]) != before and it._watch.causes["odom" if kind == "odometry" else "imu/data"]:
            used += 1
    return it, first, used


def watched(found, reference=0.0):
    """Causes of refusal and texts of the checks alone."""
    said, refused = [], []
    watch = Watch(G, reference, 2.0, (0.0, 0.0, 0.0), 5.0, said.append)
    for stamp, kind, data in found:
        cause = watch.imu(decode_imu(data), stamp) if kind == "imu" else watch.odometry(decode_odometry(data), stamp)
        refused += [cause] if cause else []
    return refused, said


def angles(m):
    return [angles_of(*q) for q in rotor(m.turn).tolist()]


def down(m):
    """z of pose and twist turned, the attitude right."""
    velocity = np.einsum("nji,nj->ni", m.turn, world(m, m.velocity) * [1, 1, -1])
    return replace(m, position=m.position * [1, 1, -1], velocity=velocity)


def weightless(m):
    return replace(m, force=m.force - np.einsum("nji,j->ni", m.turn, [0, 0, G]))


# name: what is wrong with the odometry, cause, s
ODOMETRY = {
    "rates deg/s": (lambda m: replace(m, rate=m.rate * DEGREES), "rate_degrees", 0.7),
    "z turned": (lambda m: replace(m, position=m.position * [1, 1, -1]), "height_sign", 0.7),
    "NED position": (lambda m: replace(m, position=m.position @ SWAP), "position_ned", 0.7),
    "NED pose": (lambda m: replace(m, position=ned(m).position, turn=ned(m).turn), "velocity_ned", 0.7),
    "NED twist": (lambda m: replace(m, velocity=m.velocity @ FLIP, rate=m.rate @ FLIP), "velocity_ned", 0.7),
    "NED rates": (lambda m: replace(m, rate=m.rate @ FLIP), "rate_ned", 0.7),
    "heading from north": (lambda m: replace(m, position=m.position @ np.abs(SWAP)), "heading_north", 0.7),
    "knots": (lambda m: replace(m, velocity=m.velocity * KNOTS), "velocity_knots", 0.7),
    "km/h": (lambda m: replace(m, velocity=m.velocity * 3.6), "velocity_kmh", 0.7),
    "twist in the world": (
        lambda m: replace(m, velocity=world(m, m.velocity), rate=world(m, m.rate)),
        "velocity_world",
        0.7,
    ),
    "rates in the world": (lambda m: replace(m, rate=world(m, m.rate)), "rate_world", 0.7),
    "z + 3 m": (lambda m: replace(m, position=m.position + [0, 0, 3.0]), "height_offset", 11.0),
}
BESIDE_IMU = {"all in NED": (ned, "attitude_ned", 0.7), "z turned in pose and twist": (down, "heave_sign", 0.7)}
IMU = {
    "rates deg/s": (lambda m: replace(m, rate=m.rate * DEGREES), "rate_degrees", 0.7),
    "all in NED": (ned, "gravity_sign", 0.5),
    "NED rates": (lambda m: replace(m, rate=m.rate @ FLIP), "rate_ned", 0.7),
    "NED attitude": (lambda m: replace(m, turn=ned(m).turn), "rate_ned", 0.7),
    "turned rates": (lambda m: replace(m, rate=m.rate[:, [1, 0, 2]] * [1, -1, 1]), "rate_axes", 0.7),
    "no rates": (lambda m: replace(m, rate=0.0 * m.rate), "rate_absent", 1.0),
    "gravity removed": (weightless, "gravity_removed", 0.5),
    "gravity negative": (lambda m: replace(m, force=-m.force), "gravity_sign", 0.5),
    "in g": (lambda m: replace(m, force=m.force / G), "gravity_units", 0.5),
    "force in other axes": (lambda m: replace(m, force=m.force[:, [2, 0, 1]]), "gravity_direction", 0.5),
}


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("name", ODOMETRY)
def test_wrong_odometry_is_named_and_not_used(name, beside):
    wrong, cause, within = ODOMETRY[name]
    m = sail(13.0 if within > 1.0 else 4.0)
    it, first, used = through(events(m if beside else None, wrong(m)))
    assert list(first) == [("odom", cause)] and first["odom", cause] <= within and used == 0
    assert f"odom: {DOUBTS[cause]}" in it.report(T0)["hint"]
    assert any(notice.startswith(f"odom: {DOUBTS[cause]}") for notice in it.notices)
    assert int(it.inputs.motion[(int(it.inputs.motion_head[0]) - 1) % 1024, SOURCE]) == (
        Source.IMU if beside else Source.ODOMETRY
    )


@pytest.mark.parametrize("name", BESIDE_IMU)
def test_odometry_that_only_an_imu_shows_to_be_wrong(name):
    wrong, cause, within = BESIDE_IMU[name]
    m = sail(4.0)
    it, first, used = through(events(m, wrong(m)))
    assert list(first) == [("odom", cause)] and first["odom", cause] <= within and used == 0
    assert through(events(None, wrong(m)))[1] == {}  # by itself it fits


def test_imu_and_odometry_that_are_down_together_are_both_refused():
    """The IMU alone was convicted, and the odometry beside it believed."""
    m = sail(6.0)
    it, first, used = through(events(ned(m), ned(m)))
    assert first.pop(("imu/data", "gravity_sign")) <= 0.5 and first.pop(("odom", "motion_ned")) <= 4.0
    assert not first and used == 0
    (imu_text, imu_time), (odom_text, odom_time) = it.refusals()
    assert imu_text.startswith(f"imu/data was refused (gravity_sign): {DOUBTS['gravity_sign']}; odom was refused too")
    assert odom_text.startswith("odom was refused (motion_ned)") and imu_time > 5.0 and odom_time > 1.5
    turned = MotionIngest(make_inputs(), Ship(), Heave(), MotionInput(convention="ned"))
    assert through(events(ned(m), ned(m)), turned)[1] == {} and turned.refusals() == []


@pytest.mark.parametrize("name", ["all in NED", "rates deg/s", "gravity removed"])
def test_odometry_that_moves_as_a_refused_imu_is_no_doubt(name):
    m = sail(15.0)
    it, first, _ = through(events(IMU[name][0](m), m))
    assert [topic for topic, _ in first] == ["imu/data"] and it.refusals() == []


def test_odometry_beside_a_refused_imu_in_a_calm_is_in_doubt():
    """A ship that lies still tells nothing of its axes."""
    m = sail(6.0, sea=0.0)
    it, _, _ = through(events(ned(m), m))
    ((text, seconds),) = it.refusals()
    assert "what is wrong with the one may be wrong with both" in text and seconds > 5.0
    it, _, _ = through(events(ned(m)))
    assert it.refusals()[0][0].endswith("nothing else came, so that the ship was on its mean track meanwhile")


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("name", IMU)
def test_wrong_imu_is_named_and_not_used(name, beside):
    wrong, cause, within = IMU[name]
    m = sail(4.0)
    it, first, used = through(events(wrong(m), m if beside else None))
    assert list(first) == [("imu/data", cause)] and first["imu/data", cause] <= within and used == 0
    assert it.counts[cause] >= 100 and it.report(T0)["imu_doubt"] == cause
    if beside:
        assert it.source == Source.ODOMETRY


def test_z_far_off_is_refused_at_once_and_in_a_calm_within_a_second():
    it, first, _ = through(events(None, sail(1.0, height=30.0)))
    assert it.counts["height"] == 50 and first == {}
    _, first, _ = through(events(None, sail(3.0, sea=0.05, height=3.0)))
    assert first == {("odom", "height_offset"): pytest.approx(0.8, abs=0.1)}
    for height in (-1.5, 1.5):  # loading and trim
        assert watched(events(None, sail(60.0, hertz=10, height=height))) == ([], [])


@pytest.mark.parametrize("sea", [0.15, 0.4])
@pytest.mark.parametrize("name", ["rates deg/s", "z turned", "knots", "NED twist"])
def test_in_a_calm_it_takes_until_there_is_motion_enough(name, sea):
    wrong, cause, _ = ODOMETRY[name]
    _, first, used = through(events(None, wrong(sail(15.0, sea=sea, begin=3.0))))
    assert {key[1] for key in first} <= {cause, "rate_ned"} and min(first.values()) < 6.0 and used == 0


def test_what_turns_wrong_under_way_is_found_within_a_second_and_taken_again_when_it_is_mended():
    m = sail(20.0)
    late = (m.t > 4.0) & (m.t < 9.0)
    broken = replace(m, velocity=m.velocity * np.where(late, KNOTS, 1.0)[:, None])
    it, first, used = through(events(m, broken))
    assert list(first) == [("odom", "velocity_knots")] and 4.0 < first["odom", "velocity_knots"] < 5.1 and used == 0
    assert it.source == Source.ODOMETRY and it.counts["source_change"] == 2
    assert 170 < it.counts["velocity_knots"] < 320  # 4 s and the time it takes to believe it
    assert any("fit each other again" in notice for notice in it.notices)


@pytest.mark.parametrize("part", ["velocity", "rate"])
def test_a_part_of_the_twist_that_is_not_filled_in_comes_from_the_poses(part):
    m = sail(6.0)
    it, first, _ = through(events(None, replace(m, **{part: 0.0 * getattr(m, part)})))
    assert first == {} and it.report(T0)["pose_only"] and sum("not filled in" in text for text in it.notices) == 1
    row = it.inputs.motion[(int(it.inputs.motion_head[0]) - 1) % 1024]
    assert np.allclose(row[6:9], world(m, m.velocity)[-2], atol=2e-3)


def test_a_ship_at_rest_tells_nothing():
    still = sail(10.0, sea=0.0, speed=0.0)
    for wrong in (lambda m: m, *(row[0] for row in ODOMETRY.values() if row[1] != "height_offset")):
        assert watched(events(None, wrong(still))) == ([], [])
    random = np.random.default_rng(1)  # a gyro with bias and noise, an attitude with noise
    noise = replace(still, rate=still.rate + 0.005 + 0.003 * random.standard_normal(still.rate.shape))
    assert watched(events(noise, noise)) == ([], [])


@given(
    st.sampled_from([10.0, 20.0, 50.0, 100.0, 200.0]),
    st.sampled_from([0.0, 0.02, 0.1, 0.5, 1.0, 2.0, 3.0]),
    st.floats(-3.0, 3.0),
    st.sampled_from([0.0, 0.5, 2.2, 8.0, -2.0]),
    st.sampled_from([0.0, 0.0, 0.02, -0.05]),
    st.sampled_from([0.0, 0.01, 0.05]),
    st.integers(0, 999),
)
@settings(max_examples=12)
def test_good_data_is_never_doubted(hertz, sea, heading, speed, turning, noise, seed):
    m = sail(min(20.0, 600.0 / hertz), hertz, sea, heading, speed, turning, begin=0.1 * seed)
    sent = noisy(m, noise, seed) if noise else m
    sent = replace(sent, rate=sent.rate + 0.002, force=sent.force + 0.1)
    assert watched(events(sent, replace(sent, force=m.force))) == ([], [])
    assert watched(events(None, sent))[0] == []


def test_pure_surge_and_ten_hertz_with_five_per_cent_of_noise():
    surge = np.array([0.5, 0, 0, 0, 0, 0])
    assert watched(events(None, sail(15.0, size=surge))) == ([], [])
    for seed in range(3):
        m = noisy(sail(30.0, hertz=10.0, heading=0.3 * seed), 0.05, seed)
        assert watched(events(m, m)) == ([], [])


@pytest.mark.parametrize("name", ["nbp1406", "lmg1903"])
def test_the_shipped_bags_are_not_doubted(name):
    """The first 40 s as they are, and with the noise and bias of a cheap gyro and accelerometer."""
    random, clean, rough = np.random.default_rng(3), [], []
    for time, kind, data in read_motion(BAGS / name):
        clean.append((time, kind, data))
        if kind == "imu":
            d = np.frombuffer(data[-296:], "<f8").copy()
            d[13:16] += radians(0.1) * (1.0 + random.standard_normal(3))
            d[25:28] += 0.05 * (1.0 + random.standard_normal(3))
            data = data[:-296] + d.tobytes()
        rough.append((time, kind, data))
        if len(clean) == 4_000:
            break
    assert watched(clean) == ([], []) and watched(rough) == ([], [])


ARM = (30.0, -4.0, 6.0)


def mounted(m, rotation_deg=(0.0, 0.0, 0.0), arm=ARM):
    """What an IMU elsewhere in the ship, and turned, measures; m has a sample each 1/50 s."""
    there = rotation(np.radians([rotation_deg]))[0]
    alpha = np.gradient(m.rate, 1 / 50, axis=0, edge_order=2)
    swing = np.cross(alpha, arm) + np.cross(m.rate, np.cross(m.rate, arm))
    return replace(m, turn=m.turn @ there, rate=m.rate @ there, force=(m.force + swing) @ there)


@pytest.mark.parametrize("convention", ["enu", "ned"])
def test_an_imu_turned_in_the_ship_gives_the_same_motion(convention):
    """With its lever arm, in the axes of either convention, and pitched by 90 deg, where its own angles have no yaw."""
    m, rows = sail(30.0), []
    for rotation_deg in ((0.0, 0.0, 0.0), (180.0, 0.0, 90.0), (0.0, -20.0, 45.0), (10.0, 90.0, -35.0)):
        sent = mounted(m, rotation_deg)
        if convention == "ned":
            sent = ned(sent)
        heave = Heave(imu_position=ARM, imu_rotation_deg=rotation_deg)
        it = MotionIngest(make_inputs(), Ship(tow_speed=2.2), heave, MotionInput(convention=convention))
        it, first, _ = through(events(sent), it)
        assert first == {} and it.source == Source.IMU
        rows.append(it.inputs.motion.copy())
    assert max(np.abs(other - rows[0]).max() for other in rows[1:]) < 1e-6
    last = rows[0][(int(it.inputs.motion_head[0]) - 1) % 1024]
    assert abs(last[2] - m.position[-1, 2]) < 0.5 and np.allclose(last[3:5], angles(m)[-1][:2], atol=1e-9)


def test_an_imu_whose_turn_is_not_declared_is_found():
    m = sail(4.0)
    for turned, cause in (((180.0, 0.0, 90.0), "gravity_sign"), ((0.0, 85.0, 45.0), "gravity_direction")):
        there = rotation(np.radians([turned]))[0]
        wrong = replace(m, force=m.force @ there)  # a driver that turns the attitude and forgets the accelerometer
        assert list(through(events(wrong))[1]) == [("imu/data", cause)]
    far = mounted(m)
    watch = [MotionIngest(make_inputs(), Ship(), Heave(imu_position=ARM)) for _ in range(2)]
    assert through(events(far, m), watch[0])[1] == {}
    assert through(events(far, down(m)), watch[1])[1].keys() == {("odom", "heave_sign")}


@pytest.mark.parametrize("hertz, seconds", [(1_000.0, 1.2), (10_000.0, 0.2)])
def test_fast_topics_lose_nothing(hertz, seconds):
    m = sail(seconds, hertz)
    for topic, found in (("odometry", events(None, m)), ("imu", events(m))):
        it = MotionIngest(make_inputs(), Ship(), Heave(), MotionInput(odometry_timeout=0.02))
        it, first, _ = through(found, it)
        waited = 0.02 * hertz if topic == "imu" else 0
        assert first == {} and int(it.inputs.motion_head[0]) >= len(found) - waited - 1
        assert np.isfinite(it.inputs.motion).all() and not any(it.counts.values())
        newest = it.inputs.motion[(int(it.inputs.motion_head[0]) - 1) % 1024]
        assert np.allclose(newest[3:6], angles(m)[-1], atol=1e-6)


# headers and quaternions


def test_unknown_frames_are_said_once_for_each_topic():
    it = MotionIngest(make_inputs(), Ship(), Heave())
    for k in range(50):
        stamp = T0 + k * S // 50
        it.imu(imu(stamp, frame="/mast"), stamp)
        it.odometry(odometry(stamp, frame="map", child="cog"), stamp)
    texts = list(it.notices)
    assert len(texts) == 3 and it.counts == dict.fromkeys(CAUSES, 0)
    assert texts[0].startswith("imu/data: header.frame_id is 'mast', not 'base_link': no transform is looked up")
    assert texts[1].startswith("odom: header.frame_id is 'map', not 'odom'")
    assert texts[2].startswith("odom: child_frame_id is 'cog', not 'base_link'")
    it = MotionIngest(make_inputs(), Ship(), Heave(), frames=("map", "cog"))
    it.imu(imu(T0, frame=""), T0)
    it.imu(imu(T0 + 1, frame="imu_link"), T0)  # the name that drivers give it
    it.odometry(odometry(T0, frame="map", child="cog"), T0)
    it.odometry(odometry(T0 + 1, frame="x" * 10_000, child="cog"), T0)
    assert len(it.notices) == 1 and len(it.notices[0]) < 250


@pytest.mark.parametrize("norm, said", [(0.995, 1), (1.005, 1), (1.0009, 0), (0.9991, 0)])
def test_a_quaternion_off_by_half_a_per_cent_warns_once_and_is_used(norm, said):
    it = MotionIngest(make_inputs(), Ship(), Heave(), MotionInput(odometry_timeout=0.02))
    q = (0.0, 0.0, 0.6 * norm, 0.8 * norm)
    for k in range(10):
        stamp = T0 + k * S // 50
        assert it.odometry(odometry(stamp, q=q, velocity=(1, 0, 0)), stamp) == stamp
        assert it.imu(imu(stamp, q=q, frame="base_link"), stamp) == stamp
    assert len(it.notices) == 2 * said and all("norm" in text for text in it.notices)


def test_messages_above_64_kb_are_refused_before_they_are_read():
    it = MotionIngest(make_inputs(), Ship(), Heave())
    assert it.odometry(odometry(T0, frame="x" * 66_000), T0) is None and it.counts["size"] == 1
    assert it.imu(imu(T0, frame="x" * 66_000), T0) is None and it.counts["size"] == 2


def test_every_doubt_has_a_test_and_a_remedy():
    tested = {row[1] for table in (ODOMETRY, BESIDE_IMU, IMU) for row in table.values()}
    assert tested | {"motion_ned", "rate_misfit", "velocity_misfit", "height_step", "attitude_axes"} == set(DOUBTS)
    assert all("; " in text and CAUSES[cause] == text for cause, text in DOUBTS.items())


def test_attitudes_in_axes_of_their_own():
    m = sail(4.0)
    other = replace(
        m, turn=m.turn @ np.diag([-1.0, -1.0, 1.0]), rate=m.rate * [-1, -1, 1], velocity=m.velocity * [-1, -1, 1]
    )
    assert list(through(events(m, other))[1]) == [("odom", "attitude_axes")]


def test_a_gross_misfit_is_refused_before_it_has_a_name():
    """Rates in deg/s from the first message on: less than a tenth of what comes before the finding is used."""
    m = sail(4.0)
    it, first, _ = through(events(None, replace(m, rate=m.rate * DEGREES)))
    assert int(it.inputs.motion_head[0]) <= 3 and it.counts["rate_misfit"] >= 25


@pytest.mark.parametrize("amplitude, period", [(5.0, 8.0), (3.0, 40.0), (8.0, 60.0)])
def test_a_heave_of_ones_own_may_be_high_and_slow(amplitude, period):
    """`--heave` and tables: far from the reference for long, but about it."""
    m = sail(200.0, hertz=10.0, sea=0.0)
    w = 2.0 * pi / period
    heave = np.outer(amplitude * np.sin(w * m.t), [0, 0, 1])
    rise = np.outer(amplitude * w * np.cos(w * m.t), [0, 0, 1])
    assert watched(events(None, replace(m, position=m.position + heave, velocity=m.velocity + rise))) == ([], [])
