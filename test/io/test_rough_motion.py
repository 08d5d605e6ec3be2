"""Jittering stamps and positions that do not fit their rates: clean streams stay, rough ones make no acceleration."""

from itertools import takewhile
from math import radians
from pathlib import Path

import numpy as np
import pytest
from test_motion import BAGS, STEP, T0, S, imu, ingest, newest, odometry, samples

from cable_sim_ros.io.messages.messages import Event
from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.io.motion.position_rate_fit import PositionRateFit
from cable_sim_ros.io.motion.stamps import SOUGHT, RegularStamps
from cable_sim_ros.io.sources.recorded_tow import RecordedTow, read_motion
from cable_sim_ros.physics.heave_filter import Heave, MotionInput
from cable_sim_ros.physics.inputs import EPOCH, SOURCE, make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.tick_output import Source

ARM = np.array([1.0, 1, 1, 40, 40, 40])  # m: what an angle moves at the sheave


def sea(t):
    """Coordinates, rates, accelerations [n, 6] of a ship in three waves that goes ahead at 2.2 m/s."""
    t, out = np.asarray(t, float), np.zeros((3, len(t), 6))
    for c, size in enumerate((0.4, 0.4, 1.0, 0.02, 0.05, 0.01)):
        for w, a, p in ((0.6, 1.5, 0.0), (0.95, 0.5, 1.0), (1.6, 0.1, 2.0)):
            phase = w * t + 1.3 * c + p
            out[:, :, c] += size * a * np.array([np.sin(phase), w * np.cos(phase), -w * w * np.sin(phase)])
    out[0, :, 0] += 2.2 * t
    out[1, :, 0] += 2.2
    return out


def jittered(t, jitter, seed=1):
    """Stamps of samples at t [s] with normal jitter [s], ns, advancing."""
    noise = jitter * np.random.default_rng(seed).standard_normal(len(t))
    return np.maximum.accumulate(T0 + np.round((t + noise) * S).astype(np.int64))


def through(t, stamps, measured, regular=0.2, time=3.0):
    """(time used [s], rows [n, 12], stage) of samples through both stages."""
    line, fit, rows, used = RegularStamps(regular), PositionRateFit(time), [], []
    for stamp, row in zip(stamps.tolist(), measured):
        used.append(line.take(stamp))
        rows.append(fit.push((used[-1] - used[-2]) * 1e-9 if len(used) > 1 else 0.0, row))
    assert np.all(np.diff(used) > 0)
    return (np.array(used) - T0) * 1e-9, np.array(rows), (line, fit)


def false_acceleration(time, rows, after=2.0):
    """Acceleration of the cubics at both ends of each interval less that of the sea, m/s^2 at ARM [n, 6]."""
    true = sea(time)[2]
    h, x, v = np.diff(time)[:, None], rows[:, :6], rows[:, 6:]
    bend = 6.0 * np.diff(x, axis=0) / h**2
    start = bend - (4.0 * v[:-1] + 2.0 * v[1:]) / h - true[:-1]
    end = (2.0 * v[:-1] + 4.0 * v[1:]) / h - bend - true[1:]
    return np.concatenate([start[time[:-1] > after], end[time[:-1] > after]]) * ARM


def rms(values):
    return np.sqrt(np.mean(values**2, axis=0))


# stamps


@pytest.mark.parametrize("period", [STEP, S // 3, 33_333_333 + 1 / 3, 5_000_000, S])
def test_exactly_periodic_stamps_stay(period):
    line = RegularStamps(0.2)
    stamps = [T0 + round(k * period) for k in range(400) if k % 17]  # with dropped ones
    assert [line.take(stamp) for stamp in stamps] == stamps
    assert line.period == pytest.approx(period, abs=1.0) and line.jitter < 1e3 and not line.active


@pytest.mark.parametrize("jitter", [1e-3, 2e-3, 3e-3])
@pytest.mark.parametrize("dropped", [0.0, 0.1])
def test_jitter_is_taken_out_and_dropped_samples_keep_their_time(jitter, dropped):
    t = np.arange(3000) * 0.02
    t = t[np.random.default_rng(2).random(len(t)) >= dropped]
    line = RegularStamps(0.2)
    used = np.array([line.take(stamp) for stamp in jittered(t, jitter).tolist()])
    off = ((used - T0) * 1e-9 - t)[100:]
    assert rms(off) < 0.3 * jitter and rms(np.diff(off)) < (0.04 if jitter < 3e-3 else 0.3) * jitter
    assert line.active and line.jitter * 1e-9 == pytest.approx(jitter, rel=0.25)
    assert line.period * 1e-9 == pytest.approx(0.02, rel=2e-3)


@pytest.mark.parametrize("after", [0.01, 0.0222, 0.033, 0.04, 0.1])
@pytest.mark.parametrize("jitter", [0.0, 1e-3])
def test_another_rate_is_followed(after, jitter):
    t = np.concatenate([np.arange(500) * 0.02, 10.0 + np.arange(500) * after])
    line = RegularStamps(0.2)
    used = (np.array([line.take(stamp) for stamp in jittered(t, jitter).tolist()]) - T0) * 1e-9
    off = np.abs(used - t)
    assert off.max() <= (1e-6 if jitter == 0.0 else 0.5 * 0.02)
    assert rms((used - t)[500 + 3 * SOUGHT :]) <= (1e-6 if jitter == 0.0 else 0.6 * jitter)


@pytest.mark.parametrize("gap", [0.31, 0.9, 7.0])
def test_a_gap_keeps_its_length(gap):
    t = np.concatenate([np.arange(500) * 0.02, 9.98 + gap + np.arange(300) * 0.02])
    for jitter in (0.0, 1e-3):
        line = RegularStamps(0.2)
        used = (np.array([line.take(stamp) for stamp in jittered(t, jitter).tolist()]) - T0) * 1e-9
        assert np.abs(used - t).max() <= (0.0 if jitter == 0.0 else 5e-3) + 1e-6


def test_stamps_without_a_period_and_with_the_parameter_at_zero_stay():
    waits = np.random.default_rng(3).exponential(0.02, 2000)
    stamps = (T0 + np.cumsum(np.round(waits * S).astype(np.int64) + 1)).tolist()
    line, off = RegularStamps(0.2), RegularStamps(0.0)
    assert np.mean([line.take(stamp) != stamp for stamp in stamps]) < 0.02
    assert [off.take(stamp) for stamp in stamps] == stamps


# positions and rates


@pytest.mark.parametrize("rate", [1, 2, 5, 10, 20, 50, 100, 200])
def test_a_clean_stream_stays_as_it_is(rate):
    t = np.arange(0, 30, 1 / rate)
    x, v, _ = sea(t)
    stamps, measured = jittered(t, 0.0), np.hstack([x, v])
    time, rows, (line, fit) = through(t, stamps, measured)
    assert np.array_equal(rows, measured) and np.array_equal(time, (stamps - T0) * 1e-9)
    assert not fit.integrated.any() and not fit.smoothed.any() and not line.active


@pytest.mark.parametrize(
    "jitter, grain, speed, angle, bound",
    [
        (1e-3, 0.0, 0.0, 0.0, 0.02),
        (2e-3, 0.0, 0.0, 0.0, 0.02),
        (3e-3, 0.0, 0.0, 0.0, 0.03),
        (0.0, 0.01, 0.0, 0.0, 0.005),
        (2e-3, 0.005, 0.0, 0.0, 0.02),
        (0.0, 0.0, 0.005, 0.0, 0.05),
        (0.0, 0.0, 0.0, 0.01, 0.005),
        (3e-3, 0.01, 0.005, 0.01, 0.05),
    ],
)
def test_the_false_acceleration_of_a_rough_stream_is_bounded(jitter, grain, speed, angle, bound):
    """jitter [s], grain of the position [m], noise of velocity [m/s] and attitude [deg] at 50 Hz."""
    random, t = np.random.default_rng(4), np.arange(0, 30, 0.02)
    x, v, _ = sea(t)
    if grain:
        x[:, :3] = np.round(x[:, :3] / grain) * grain
    v[:, :3] += speed * random.standard_normal((len(t), 3))
    x[:, 3:] += radians(angle) * random.standard_normal((len(t), 3))
    stamps = jittered(t, jitter)
    time, rows, _ = through(t, stamps, np.hstack([x, v]))
    assert rms(false_acceleration(time, rows)).max() < bound
    assert np.max(rms((rows[:, :6] - sea(time)[0])[time > 2]) * ARM) < 0.012
    as_it_is = false_acceleration(*through(t, stamps, np.hstack([x, v]), 0.0, 0.0)[:2])
    assert rms(as_it_is).max() > 0.3


@pytest.mark.parametrize("rate, bound", [(1, 0.06), (2, 0.03), (5, 0.01), (10, 0.01), (20, 0.01), (100, 0.01)])
def test_a_grain_of_a_centimetre_at_any_rate(rate, bound):
    t = np.arange(0, 30, 1 / rate)
    x, v, _ = sea(t)
    x[:, :3] = np.round(x[:, :3] / 0.01) * 0.01
    time, rows, _ = through(t, jittered(t, 0.0), np.hstack([x, v]))
    assert rms(false_acceleration(time, rows)[:, :3]).max() < bound


def test_a_velocity_with_a_bias_does_not_carry_the_ship_away():
    t = np.arange(0, 60, 0.02)
    x, v, _ = sea(t)
    time, rows, _ = through(t, jittered(t, 0.0), np.hstack([x, v + 0.1]))
    assert np.abs(rows[-500:, :6] - x[-500:]).max() < 2e-3
    assert np.abs(rows[-500:, 6:] - v[-500:]).max() < 2e-3
    assert rms(false_acceleration(time, rows)[:, :3]).max() < 0.05


# through the ingest


def send(it, t, x, v, *, stamps=None, imu_too=False, odometry_too=True):
    for k in range(len(t)):
        stamp = T0 + round(t[k] * S) if stamps is None else int(stamps[k])
        if imu_too:
            it.imu(imu(stamp), stamp)
        if odometry_too:
            it.odometry(odometry(stamp, x[k, :3], velocity=v[k, :3]), stamp)


def level(t, grain=0.0):
    x, v, _ = sea(t)
    x[:, 3:], v[:, 3:] = 0.0, 0.0
    if grain:
        x[:, :3] = np.round(x[:, :3] / grain) * grain
    return x, v


def test_the_report_tells_what_was_done():
    t = np.arange(0, 10, 0.02)
    it = ingest()
    send(it, t, *level(t))
    report = it.report(T0 + 10 * S)
    assert (report["odometry_stamps_regular"], report["integrated"], report["smoothed"]) == (False, "", "")
    assert report["odometry_stamp_period_s"] == pytest.approx(0.02)
    it = ingest()
    send(it, t, *level(t, 0.01), stamps=jittered(t, 1e-3))
    report = it.report(T0 + 10 * S)
    assert report["odometry_stamps_regular"] and {"x", "y", "z"} <= set(report["integrated"].split())
    assert report["odometry_stamp_jitter_s"] == pytest.approx(1e-3, rel=0.3)


def test_both_can_be_switched_off():
    t = np.arange(0, 10, 0.02)
    x, v = level(t, 0.01)
    stamps = jittered(t, 1e-3)
    it = MotionIngest(make_inputs(), Ship(), Heave(), MotionInput(stamp_jitter=0.0, position_time=0.0))
    send(it, t, x, v, stamps=stamps)
    times, rows = samples(it)
    assert np.array_equal(times, stamps) and np.allclose(rows[:, :3], x[:, :3], atol=1e-12)
    assert it.report(T0)["integrated"] == ""


def test_a_gap_and_a_jump_begin_anew_where_the_ship_is_measured():
    t = np.concatenate([np.arange(0, 5, 0.02), np.arange(8, 13, 0.02)])
    x, v = level(t, 0.01)
    it = ingest(max_gap=1.5)
    send(it, t, x, v)
    _, rows = samples(it)
    first = np.flatnonzero(rows[:, EPOCH] == 2)[0]
    assert it.epoch == 2 and first == 250 and np.allclose(rows[first, :3], x[250, :3], atol=1e-12)
    send(it, t[-1:] + 0.02, x[-1:] + [1000.0, 0, 0, 0, 0, 0], v[-1:])
    assert it.counts["position_jump"] == 1 and it.epoch == 3 and it.report(T0)["integrated"] == ""


def test_a_small_step_of_the_position_is_gone_over_slowly():
    t = np.arange(0, 40, 0.02)
    x, v = level(t)
    true = x.copy()
    x[500:, :2] += 3.0
    it = ingest()
    rows = []
    for k in range(len(t)):
        send(it, t[k : k + 1], x[k : k + 1], v[k : k + 1])
        rows.append(newest(it)[1][:12].copy())
    rows = np.array(rows)
    assert it.epoch == 1 and np.abs(np.diff(rows[:, 6] - v[:, 0])).max() / 0.02 < 1.5
    assert np.abs(rows[-1, :2] - true[-1, :2] - 3.0).max() < 0.05


def test_odometry_without_twist_is_left_alone():
    t = np.arange(0, 5, 0.02)
    x, v = level(t, 0.01)
    it = ingest()
    send(it, t, x, 0.0 * v)
    assert np.allclose(samples(it)[1][:, :3], x[:-1, :3], atol=1e-12)


def test_the_imu_takes_over_from_rough_odometry_and_has_its_own_stamps():
    t = np.arange(0, 20, 0.02)
    x, v = level(t, 0.01)
    stamps = jittered(t, 1e-3)
    it = ingest()
    send(it, t[:500], x[:500], v[:500], stamps=stamps[:500], imu_too=True)
    send(it, t[500:], x[500:], v[500:], stamps=stamps[500:], imu_too=True, odometry_too=False)
    times, rows = samples(it)
    taken = rows[:, SOURCE] == Source.IMU
    assert rows[0, SOURCE] == Source.ODOMETRY and taken[-1] and it.epoch == 2 and np.all(np.diff(times) > 0)
    assert rms(np.diff(times[taken]) * 1e-9 - 0.02) < 1e-4
    assert it.report(T0)["imu_stamps_regular"]


def test_noise_of_the_attitude_from_the_imu_alone():
    random, t = np.random.default_rng(5), np.arange(0, 20, 0.02)
    it = ingest()
    for k in range(len(t)):
        stamp = T0 + k * STEP
        it.imu(imu(stamp, angles=radians(0.01) * random.standard_normal(3)), stamp)
    times, rows = samples(it)
    h = 0.02
    bend = 6.0 * np.diff(rows[100:, 3:6], axis=0) / h**2 - (4.0 * rows[100:-1, 9:12] + 2.0 * rows[101:, 9:12]) / h
    assert rms(bend * 40.0).max() < 0.05


@pytest.mark.parametrize(
    "name, seconds",
    [("nbp1406", 30.0), *(pytest.param(name, np.inf, marks=pytest.mark.nightly) for name in ("nbp1406", "lmg1903"))],
)
def test_the_shipped_motion_stays_as_it_is(name, seconds):
    both, only = ingest(), ingest()
    plain = MotionIngest(make_inputs(), Ship(), Heave(), MotionInput(stamp_jitter=0.0, position_time=0.0))
    begin = next(iter(read_motion(BAGS / name)))[0]
    for time, kind, data in takewhile(lambda event: event[0] - begin < seconds * S, read_motion(BAGS / name)):
        for it in (both, plain):
            (it.imu if kind == "imu" else it.odometry)(data, time)
        if kind == "imu":
            only.imu(data, time)
    for it in (both, only):
        assert it.report(time)["integrated"] == "" and it.report(time)["smoothed"] == ""
    assert np.array_equal(both.inputs.motion, plain.inputs.motion)
    assert np.array_equal(both.inputs.motion_time, plain.inputs.motion_time)


# through the simulator


def rough(event, random):
    """A message of odometry with 2 ms of jitter on its stamp and a grain of 5 mm in its position."""
    stamp = event.time + round(2e-3 * S * random.standard_normal())
    numbers = np.frombuffer(event.data[-680:], "<f8").copy()
    numbers[:3] = np.round(numbers[:3] / 5e-3) * 5e-3
    head = np.array([stamp // S, stamp % S], "<u4").tobytes()
    return Event(stamp, event.arrival, "odometry", event.data[:4] + head + event.data[12:-680] + numbers.tobytes())


def test_rough_odometry_tows_as_clean_odometry_does():
    from cable_sim_ros.io.scenes.load import load_scene
    from cable_sim_ros.runs.message_run import MessageRun

    random = np.random.default_rng(6)
    clean = [Event(time, time, kind, data) for time, kind, data in read_motion(BAGS / "nbp1406") if kind == "odometry"][
        :1100
    ]
    scene = load_scene(str(Path(__file__).parents[2] / "config" / "full_scale.yaml"))
    runs = [
        MessageRun(scene, RecordedTow(name, events)).run(20.0, None).frames
        for name, events in (("clean", clean), ("rough", [rough(event, random) for event in clean]))
    ]
    tension, other = (run["tension"] for run in runs)
    assert len(tension) == len(other) == 2000
    assert np.abs(other - tension).max() < 50.0
    assert np.std(other[200:]) == pytest.approx(np.std(tension[200:]), rel=0.03)
    assert np.sqrt(np.mean((other - tension)[200:] ** 2)) < 0.1 * np.std(tension[200:])
    assert runs[1]["iterations"].mean() < 3.5
