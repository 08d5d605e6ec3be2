"""Heave filter: closed forms, invariants, and the error of the IMU-only path on both shipped bags."""

import cmath
from math import degrees, pi, radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.signal import csd, welch

from cable_sim_ros.io.messages.messages import decode_imu, decode_odometry
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.physics.heave_filter import SETTLED, Heave, HeaveFilter
from cable_sim_ros.sim.tables.attitude import rotation

pytestmark = pytest.mark.check

BAGS = Path(__file__).parents[2] / "bags"
G = 9.81
BIAS = 1e-3 * G  # 1 mg on every axis
FORCE_NOISE = 100e-6 * G  # m/s^2/sqrt(Hz), white: 100 ug/sqrt(Hz)
RATE_NOISE = radians(0.005)  # rad/s/sqrt(Hz), white
LEVEL = np.zeros(3)


def run(heave, t, force, angles, rate):
    """Filter output [n, 6] for rows of specific force, angles and body rates."""
    filter_, dt = HeaveFilter(heave), np.diff(t, prepend=t[0])
    return np.array([filter_.push(dt[k], force[k], angles[k], rate[k]) for k in range(len(t))]), filter_


def heaving(t, acceleration, bias=0.0):
    """Level ship: specific force rows for a vertical acceleration."""
    force = np.zeros((len(t), 3))
    force[:, 2] = G + acceleration + bias
    return force, np.zeros((len(t), 3)), np.zeros((len(t), 3))


def response(period, corner_period):
    """H of the filter's docstring at a wave period, both in s."""
    s, w = 2j * pi / period, 2.0 * pi / corner_period
    return s**3 * (s**2 + 5.0 * w * s + 10.0 * w**2) / (s + w) ** 5


@given(st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)))
@settings(max_examples=20)
def test_at_rest_in_any_attitude_nothing_moves(angles):
    force = rotation(np.array([angles]))[0].T @ [0.0, 0.0, G]
    t = np.arange(0, 60, 0.1)
    out, _ = run(Heave(), t, np.tile(force, (len(t), 1)), np.tile(angles, (len(t), 1)), np.zeros((len(t), 3)))
    assert abs(out).max() < 1e-9


@pytest.mark.parametrize("period", [5.0, 10.2, 80.0])
def test_a_sinusoid_comes_out_as_the_transfer_function_says(period):
    t, w = np.arange(0, 800, 0.05), 2 * pi / period
    out, _ = run(Heave(), t, *heaving(t, -w * w * np.sin(w * t)))
    n = int(round(int(240 / period) * period / 0.05))  # whole periods, long after the start
    tail, wave = slice(len(t) - n, None), np.exp(-1j * w * t)
    got = 2j * np.mean(out[tail, 2] * wave[tail])
    assert abs(got - response(period, 60.0)) < 2e-3
    slope = 2j * np.mean(out[tail, 5] * wave[tail]) / (1j * w)
    assert abs(slope - got) < 2e-3  # velocity is the derivative of the displacement


def test_error_at_wave_periods_falls_with_the_cube():
    errors = [abs(1 - response(period, 60.0)) for period in (4.0, 8.0)]
    assert errors[1] / errors[0] == pytest.approx(8.0, rel=0.1)
    assert abs(response(300.0, 60.0)) < 0.1


def test_a_constant_bias_leaves_no_displacement_and_is_found():
    t = np.arange(0, 400, 0.1)
    out, filter_ = run(Heave(), t, *heaving(t, 0.0, BIAS))
    assert abs(out[t > 300, 2]).max() < 1e-3
    assert filter_.bias[2] == pytest.approx(BIAS, rel=1e-3)


@given(st.tuples(*[st.floats(-40, 40)] * 3))
@settings(max_examples=5)
def test_roll_and_pitch_about_base_link_move_the_imu_only(lever):
    t = np.arange(0, 90, 0.02)
    angles = np.column_stack([0.1 * np.sin(0.6 * t), 0.05 * np.sin(0.55 * t + 1), 0.02 * np.sin(0.3 * t)])
    first = CubicSpline(t, angles)(t, 1)
    turned = rotation(angles)
    acceleration = CubicSpline(t, turned @ lever)(t, 2)
    force = np.einsum("nji,nj->ni", turned, acceleration + [0, 0, G])
    (sr, sp, _), (cr, cp, _) = np.sin(angles).T, np.cos(angles).T
    rate = np.column_stack(
        [
            first[:, 0] - first[:, 2] * sp,
            first[:, 1] * cr + first[:, 2] * cp * sr,
            first[:, 2] * cp * cr - first[:, 1] * sr,
        ]
    )
    out, _ = run(Heave(imu_position=lever), t, force, angles, rate)
    assert abs(out[:, :3]).max() < 2e-3  # where the IMU itself moves by up to 4 m
    wrong, _ = run(Heave(), t, force, angles, rate)
    if np.abs(lever).max() > 5:
        assert abs(wrong[:, :3]).max() > 0.05


def test_displacement_is_the_integral_of_the_velocity_between_samples():
    """A cubic through both must not wiggle: its end slopes and its chord agree, also while the memory expands."""
    t, w = np.arange(0, 120, 0.02), 0.6
    out, _ = run(Heave(), t, *heaving(t, -w * w * np.sin(w * t), BIAS))
    p, v = out[:, 2], out[:, 5]
    slope = CubicSpline(t, v)(t, 1)
    excess = np.diff(p) / 0.02 - 0.5 * (v[1:] + v[:-1]) + 0.02 / 12 * np.diff(slope)
    assert abs(excess[2:-2]).max() < 2e-5  # 6/dt of it would be false acceleration; kinks where the fade ends
    assert abs(excess[t[1:] > 100][:-2]).max() < 1e-7


def test_the_sample_rate_does_not_matter():
    ends = []
    for rate in (10, 50, 200):
        t = np.arange(0, 100 + 1e-9, 1 / rate)
        out, _ = run(Heave(), t, *heaving(t, -0.36 * np.sin(0.6 * t)))
        ends.append(out[-1])
    assert np.allclose(ends[0], ends[2], atol=5e-3) and np.allclose(ends[1], ends[2], atol=2e-4)


def test_nothing_is_answered_before_the_first_start_period():
    t = np.arange(0, 60, 0.02)
    out, _ = run(Heave(), t, *heaving(t, np.full(len(t), 0.5)))
    assert not out[t < 14.9].any() and out[t > 20].any()


def test_settled_valid_and_diverged():
    filter_ = HeaveFilter(Heave(period=20.0, start_period=10.0))
    up = np.array([0.0, 0.0, G])
    for _ in range(int(SETTLED * 20.0 / 0.1) - 2):
        filter_.push(0.1, up, LEVEL, LEVEL)
    assert not filter_.settled and not filter_.valid
    for _ in range(4):
        filter_.push(0.1, up, LEVEL, LEVEL)
    assert filter_.settled and filter_.valid and not filter_.diverged
    for _ in range(3000):  # a sensor without gravity: all of it goes into the bias
        filter_.push(0.1, LEVEL, LEVEL, LEVEL)
    assert filter_.settled and not filter_.valid
    for _ in range(100):
        filter_.push(0.1, 3 * up, LEVEL, LEVEL)
    assert filter_.diverged
    filter_.reset()
    assert filter_.age == 0.0 and not filter_.diverged


@pytest.fixture(scope="module", params=["nbp1406", "lmg1903"])
def recorded(request):
    """Stamps, specific force, angles, rates of the bag's IMU and height by its odometry."""
    imu, odometry = [], []
    for _, kind, data in read_motion(BAGS / request.param):
        if kind == "imu":
            imu.append(decode_imu(data))
        else:
            odometry.append(decode_odometry(data))
    assert [m.stamp for m in imu] == [m.stamp for m in odometry]
    t = (np.array([m.stamp for m in imu]) - imu[0].stamp) * 1e-9
    return (
        t,
        np.array([m.force for m in imu]),
        np.array([m.angles for m in imu]),
        np.array([m.rate for m in imu]),
        np.array([m.position[2] for m in odometry]),
    )


def heave_error(recorded, seed, **parameters):
    t, force, angles, rate, height = recorded
    random = np.random.default_rng(seed)
    white = np.sqrt(0.5 / 0.02)  # density to standard deviation at 50 Hz
    force = force + BIAS + FORCE_NOISE * white * random.standard_normal(force.shape)
    out, _ = run(Heave(**parameters), t, force, angles, rate + RATE_NOISE * white * random.standard_normal(rate.shape))
    return out[:, 2], height


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (2, 3))])
def test_imu_only_heave_within_five_percent_of_the_significant_heave(recorded, seed):
    """Required: after at most 180 s of settling, RMS error <= max(5 cm, 5 % Hs), with 1 mg of bias and noise."""
    estimate, height = heave_error(recorded, seed)
    t, significant = recorded[0], 4.0 * height.std()
    error = np.sqrt(np.mean((estimate - height)[t >= 180.0] ** 2))
    f, cross = csd(height[t >= 180.0], estimate[t >= 180.0], 50.0, nperseg=6400)
    peak = 1 + welch(height[t >= 180.0], 50.0, nperseg=6400)[1][1:].argmax()
    phase = degrees(cmath.phase(cross[peak]))
    print(
        f"Hs {significant:.2f} m, RMS {100 * error:.1f} cm = {100 * error / significant:.1f} % of Hs, "
        f"phase at {1 / f[peak]:.1f} s {phase:+.1f} deg"
    )
    assert error <= max(0.05, 0.05 * significant)
    assert abs(phase) < 3.0


def test_the_requirement_is_not_met_by_any_filter(recorded):
    """The check can fail: a period as short as the waves does not pass on the rough bag, nor a very long one."""
    worst = []
    for period in (20.0, 240.0):
        estimate, height = heave_error(recorded, 1, period=period)
        error = (estimate - height)[recorded[0] >= 180.0]
        worst.append(np.sqrt(np.mean(error**2)) / max(0.05, 0.2 * height.std()))
    assert max(worst) > 1.0
