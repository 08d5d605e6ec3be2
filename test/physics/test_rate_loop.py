"""Rate loop and reference of a motor: the answer of the loop's equation, and of a reference that jumps."""

import numpy as np
import pytest
from bench_cable import filled
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from cable_sim_ros.physics.integrate import coefficients
from cable_sim_ros.physics.rate_loop import _follow_rate as follow_rate
from cable_sim_ros.physics.rate_loop import changed, early
from cable_sim_ros.physics.winch import DRUM, WINCH
from cable_sim_ros.physics.winch_drive import DRIVE, DRIVING, balance, begin_turn

pytestmark = pytest.mark.check

FREE = 1e6


def records(w, zeta, gain):
    drum = filled(DRUM, **dict.fromkeys(("max_rate", "max_accel", "max_length", "max_limit"), FREE))
    drum.min_length = drum.min_limit = -FREE
    return drum, filled(DRIVE, bandwidth=w, damping=zeta, length_gain=gain), filled(WINCH), filled(DRIVING)


def answer(w, zeta, gain, tick, ticks, goal, rate):
    """Pay-out and rate after each tick [m, m/s] of a loop that follows a set-point goal(t), rate(t)."""
    drum, drive, winch, driving = records(w, zeta, gain)
    driving.given, driving.given_rate, found = goal(0.0), rate(0.0), []
    for k in range(1, ticks + 1):
        follow_rate(tick, drum, drive, winch, driving, goal(k * tick), rate(k * tick))
        driving.given, driving.given_rate = goal(k * tick), rate(k * tick)
        found.append((float(winch.length), float(winch.rate)))
    return np.array(found)


def integrated(w, zeta, gain, tick, ticks, goal, rate):
    """The same by Runge-Kutta."""

    def change(t, y):
        want = rate(t) + gain * (goal(t) - y[0])
        return [y[1], y[2], w * w * (want - y[1]) - 2.0 * zeta * w * y[2]]

    def of_first_order(t, y):
        return [y[1], w * (rate(t) + gain * (goal(t) - y[0]) - y[1])]

    way, start = (of_first_order, [0.0, 0.0]) if zeta == 0.0 else (change, [0.0, 0.0, 0.0])
    times = tick * np.arange(1, ticks + 1)
    return solve_ivp(way, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-12, max_step=0.25 * tick).y[:2].T


LOOPS = st.floats(0.5, 500.0), st.one_of(st.just(0.0), st.just(1.0), st.floats(0.05, 10.0))


@settings(max_examples=25)
@given(*LOOPS, st.floats(0.002, 0.05))
def test_a_step_is_answered_exactly_whatever_the_bandwidth(w, zeta, tick):
    """Implicit steps of 1 ms, as these were, are 0.015 of the step out at 60 rad/s and 0.065 at 300."""
    step = (lambda t: 0.5 * t), (lambda t: 0.5)
    ticks = 12
    ours, exact = answer(w, zeta, 0.0, tick, ticks, *step), integrated(w, zeta, 0.0, tick, ticks, *step)
    assert np.abs(ours[:, 1] - exact[:, 1]).max() < 1e-6
    assert np.abs(ours[:, 0] - exact[:, 0]).max() < 0.5 * (1e-3 * max(w, 1.0)) ** 2 / max(w, 1.0)


@pytest.mark.parametrize("w, zeta", [(6.0, 0.7), (60.0, 0.0), (300.0, 0.7)])
def test_a_length_that_lags_is_made_good_to_second_order(w, zeta):
    swell = (lambda t: np.sin(2.0 * t) - 2.0 * t), (lambda t: 2.0 * np.cos(2.0 * t) - 2.0)
    apart = []
    for tick in (0.02, 0.01):
        way = w, zeta, 0.25 * w, tick, round(0.4 / tick), *swell
        apart.append(np.abs(answer(*way)[:, 0] - integrated(*way)[:, 0]).max())
    assert apart[1] < 2e-5 and (apart[0] / apart[1] > 2.5 or apart[1] < 1e-6)


@given(st.floats(-2.0, 2.0), st.floats(0.01, 2.0), st.floats(0.0, 1.0), st.floats(1e-3, 0.1))
def test_the_lengths_tell_when_a_rate_changed(begin, change, share, h):
    """A ramp over a share of the step and then the rate, as a command has it, or the rate and then the ramp."""
    at_first, at_last = h * (begin + change * (1.0 - 0.5 * share)), h * (begin + change * 0.5 * share)
    for length, expected in ((at_first, 0.5 - 0.5 * share), (at_last, 0.5 * share - 0.5)):
        part = early(h, (0.0, begin), (length, begin + change))
        assert part == pytest.approx(expected, abs=1e-9)
        assert np.mean([changed(part, (i + 0.5) / 500) for i in range(500)]) == pytest.approx(0.5 + part, abs=3e-3)
    assert early(h, (0.0, begin), (1.0, begin)) == 0.0 and early(h, (0.0, 0.0), (1e3, change)) == 0.5


def bare(w, zeta, tick, ticks, goal, rate, mass=500.0):
    """Pay-out after each tick [m] of a drum that a motor turns and no cable pulls."""
    drum, drive, winch, driving = records(w, zeta, 0.0)
    drive.mass, drive.points, drive.peak, drive.max_power = mass, 2, 1e12, np.inf
    drive.curve_speed[1], drive.curve_pull[:2] = FREE, 1e12
    drive.gain_p, drive.gain_i = 2.0 * zeta * w * mass, w * w * mass
    drive.brake_set_time = drive.brake_lift_time = 1.0
    found = []
    for k in range(1, ticks + 1):
        old, before = winch.copy(), driving.copy()
        begin_turn(tick, drum, drive, old, before, driving, winch, goal(k * tick), rate(k * tick))
        balance(tick, coefficients(tick, 0.3), drum, drive, old, before, winch, driving, 0.0, 0.0)
        driving.given, driving.given_rate = goal(k * tick), rate(k * tick)
        found.append(float(winch.length))
    return np.array(found)


@pytest.mark.parametrize("jumps", [True, False], ids=["jump", "swell"])
def test_a_motor_takes_its_reference_to_second_order_also_where_it_jumps(jumps):
    """Of the bare drum v'' = w^2 (v_r - v) - 2 zeta w v'. A jump that came to the integral half a step late left
    0.5 h of it, 2.5 mm of 0.5 m/s at 10 ms, for good."""
    step = (lambda t: 0.5 * t), (lambda t: 0.5 if t > 0.0 else 0.0)
    swell = (lambda t: 0.5 - 0.5 * np.cos(2.0 * t)), (lambda t: np.sin(2.0 * t))
    goal, rate = step if jumps else swell
    apart = []
    for tick in (0.01, 0.005):
        way = tick, round(1.0 / tick), goal, rate
        apart.append(np.abs(bare(6.0, 0.7, *way) - integrated(6.0, 0.7, 0.0, *way)[:, 0]).max())
    assert apart[0] < 3e-4 and apart[0] / apart[1] > 3.0
