"""Set-points: signs of (1) and (2), rates against differences, limits, filter of the angle, change of the law."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import filled

from cable_sim_ros.physics.heave_compensation import (
    SETPOINT,
    compensation,
    mean_track,
    set_point,
    signed_departure,
    within,
)
from cable_sim_ros.physics.state import SHEAVE

pytestmark = pytest.mark.check

HOLD, SIMPLE, RIGOROUS, SIMPLE_WATERLINE, RIGOROUS_WATERLINE = range(5)
H = 0.01  # s


def setpoint_of(law: int, **values) -> np.record:
    """A SETPOINT with the shipped filter and transfer and limits far away."""
    usual = {"algorithm": law, "engaged": law, "angle": 1.3, "departure": 1.0, "height": 3.7, "departure_time": 5.0}
    usual |= {"max_gain": 20.0, "max_excess": 1e3, "max_excess_rate": 1e3, "max_amplitude": 1e4, "transfer": 10.0}
    return filled(SETPOINT, **usual | values)


def asked(state, sheave):
    """What a law that follows the ship asks for."""
    return compensation(state, sheave, 0.0, 0.0, H)


def heave(t: float, amplitude: float = 1.5, period: float = 9.0) -> np.record:
    """A sheave at 3.7 m that heaves and surges half as much."""
    w = 2.0 * np.pi / period
    up, rate = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return filled(SHEAVE, position=(0.5 * up, 0.0, 3.7 + up), velocity=(0.5 * rate, 0.0, rate))


@pytest.mark.parametrize(
    "law, moved, length",
    [
        (0, (1.0, 0.0, 1.0), 0.0),
        (1, (1.0, 0.0, 0.0), np.sin(1.3)),
        (1, (0.0, 0.0, 1.0), np.cos(1.3)),
        (1, (0.0, 1.0, 0.0), 0.0),
        (2, (0.0, 0.0, 1.0), np.cos(1.0)),
        (3, (0.0, 0.0, 1.0), 1.0 / np.cos(1.3)),
        (4, (0.0, 0.0, 0.0), 3.7 / np.cos(1.0) - 3.7 / np.cos(1.3)),
    ],
)
def test_set_points_pay_out_when_the_sheave_goes_up_and_ahead(law, moved, length):
    """(2) L = dx sin + dz cos, (1) L = H/cos - H_nom/cos_nom; nominal angle 1.3, measured 1.0, nominal height 3.7."""
    state = setpoint_of(law)

    def wanted(dx: float, dy: float, dz: float, velocity=(0.0, 0.0, 0.0)):
        position = (moved[0] + dx, moved[1] + dy, 3.7 + moved[2] + dz)
        along, rate, beyond, beyond_rate = asked(state, filled(SHEAVE, position=position, velocity=velocity))
        return along + beyond, rate + beyond_rate

    got, rate = wanted(0.0, 0.0, 0.0)
    assert got == pytest.approx(length) and rate == 0.0
    ahead, _ = wanted(1e-6, 0.0, 2e-6)
    _, rate = wanted(0.0, 0.0, 0.0, (1.0, 0.0, 2.0))
    assert rate == pytest.approx((ahead - got) / 1e-6, abs=1e-6)


@pytest.mark.parametrize("law", [RIGOROUS, RIGOROUS_WATERLINE])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_the_rate_holds_the_turning_of_the_cable_and_of_the_mean_track(law, turn):
    """Everything moves at once: place, angle, gain near its limit, heading of the track; against differences."""

    def at(t: float):
        state = setpoint_of(law, departure=0.9 + turn * t, departure_rate=turn, max_gain=1.8)
        state.track[:] = 1.0 + 0.2 * t, -0.5 * t, 0.4 + 0.05 * t
        state.track_speed[:] = 0.2, -0.5, 0.05
        place = (3.0 + 0.7 * t, 2.0 - 0.4 * t, 4.5 + 0.9 * t)
        along, rate, beyond, beyond_rate = asked(state, filled(SHEAVE, position=place, velocity=(0.7, -0.4, 0.9)))
        return along + beyond, rate + beyond_rate

    e = 1e-5
    assert at(0.0)[1] == pytest.approx((at(e)[0] - at(-e)[0]) / (2 * e), abs=1e-6)


def test_mean_track_follows_a_drift_and_lets_waves_through():
    state, left = filled(SETPOINT, washout=300.0), []
    sheave = filled(SHEAVE)
    for k in range(12_000):
        t = 0.1 * k
        x = sheave.position[0] = 0.1 * t + 0.5 * np.sin(2 * np.pi * t / 10.0)
        mean_track(state, sheave, 0.0, 0.1)
        left.append(x - state.track[0])
    left = np.array(left[6_000:])
    assert abs(left.mean()) < 0.02, "a steady drift of 0.1 m/s is followed"
    assert left.std() * np.sqrt(2) == pytest.approx(0.5, rel=0.03), "a wave of 10 s is not"


def test_the_track_tells_how_fast_it_moves():
    state, sheave, before = filled(SETPOINT, washout=60.0), filled(SHEAVE), 0.0
    for k in range(2000):
        sheave.position[0] = np.sin(0.3 * k * H)
        before, speed = state.track[0], state.track_speed[0]
        mean_track(state, sheave, 0.0, H)
        assert 0.5 * (speed + state.track_speed[0]) == pytest.approx((state.track[0] - before) / H, abs=1e-9)


def test_where_the_track_is_does_not_depend_on_the_step():
    """A ship 2 m/s faster than its mean track: with one implicit rate the track led by half a step of it."""
    ends = []
    for h in (0.1, 0.05, 0.025):
        state, sheave = filled(SETPOINT, washout=300.0), filled(SHEAVE)
        for k in range(1, round(100.0 / h) + 1):
            sheave.position[0] = 2.0 * k * h
            mean_track(state, sheave, 0.0, h)
        ends.append(state.track[0])
    assert abs(ends[0] - ends[2]) < 1e-3 and abs(ends[1] - ends[2]) < 0.3 * abs(ends[0] - ends[2])


def test_a_cable_that_leads_forward_has_an_angle_below_zero():
    """Ship heading north, mean track too: the cable astern, ahead, to the side."""
    state = filled(SETPOINT)
    state.track[2] = 0.5 * np.pi
    assert signed_departure(state, (0.0, -np.sin(0.7), -np.cos(0.7))) == pytest.approx(0.7)
    assert signed_departure(state, (0.0, np.sin(0.7), -np.cos(0.7))) == pytest.approx(-0.7)
    assert signed_departure(state, (np.sin(0.7), 0.0, -np.cos(0.7))) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("law", [SIMPLE, RIGOROUS])
def test_under_a_cable_that_leads_forward_surge_ahead_hauls_in(law):
    state = setpoint_of(law, angle=-0.6, departure=-0.6)
    length, rate, *_ = asked(state, filled(SHEAVE, position=(1.0, 0.0, 3.7), velocity=(2.0, 0.0, 0.0)))
    assert length == pytest.approx(-np.sin(0.6)) and rate == pytest.approx(-2.0 * np.sin(0.6))


def test_a_limit_changes_nothing_far_below_it_and_is_smooth():
    x = np.linspace(-30.0, 30.0, 60001)
    y, slope = np.array([within(value, 2.0) for value in x]).T
    inside = np.abs(x) <= 1.6
    np.testing.assert_array_equal(y[inside], x[inside])
    assert np.abs(y).max() <= 2.0 and (np.diff(y) >= 0.0).all()
    np.testing.assert_allclose(np.gradient(y, x)[1:-1], slope[1:-1], atol=2e-3)
    assert within(5.0, 0.0) == (0.0, 0.0)


def follow(state, seconds: float, measured=lambda t: 1.0, begin: float = 0.0, h: float = H) -> np.ndarray:
    """Rows of time, set-point and its rate, excess and its rate, limited."""
    rows = []
    for k in range(round(seconds / h)):
        t = begin + (k + 1) * h
        length, rate = set_point(state, heave(t), measured(t), h, 0.0, 0.0)
        rows.append((t, length, rate, state.excess, state.excess_rate, state.limited))
    return np.array(rows)


@pytest.mark.parametrize("law", [SIMPLE_WATERLINE, RIGOROUS_WATERLINE])
def test_a_waterline_law_on_a_flat_cable_is_limited_and_says_so(law):
    """1/cos(1.36 rad) = 4.8: 6.9 m either way are asked for."""
    state = setpoint_of(law, angle=1.36, departure=1.36, max_gain=2.0, max_excess=1.0, max_excess_rate=0.6)
    rows = follow(state, 60.0, lambda t: 1.36)
    assert np.abs(rows[:, 3]).max() <= 1.0 + 1e-3 and np.abs(rows[:, 4]).max() <= 0.6
    assert np.abs(rows[:, 3]).max() > 0.5, "limited, not off"
    assert rows[500:, 5].mean() > 0.8
    np.testing.assert_allclose(np.diff(rows[:, 1]) / H, rows[1:, 2], atol=0.02)  # the rate is that of the length


def test_a_waterline_law_on_a_steep_cable_is_the_printed_one():
    """Within its limits (1) to 20 micrometres, and no flag."""
    state = setpoint_of(SIMPLE_WATERLINE, angle=0.5, max_gain=2.0, max_excess=1.0, max_excess_rate=0.6)
    rows = follow(state, 30.0)
    up = 1.5 * np.sin(2.0 * np.pi / 9.0 * rows[:, 0])
    np.testing.assert_allclose(rows[1000:, 1], up[1000:] / np.cos(0.5), atol=2e-5)
    assert not rows[200:, 5].any()


def test_a_drift_is_paid_out_to_the_largest_amplitude_only():
    """A ship that is 1 m/s faster than its mean track, for 100 s."""
    state, length = setpoint_of(SIMPLE, max_amplitude=20.0), []
    for k in range(10_000):
        sheave = filled(SHEAVE, position=(k * H, 0.0, 3.7), velocity=(1.0, 0.0, 0.0))
        length.append(set_point(state, sheave, 1.0, H, 0.0, 0.0)[0])
    assert max(length) < 20.0 and length[-1] > 19.9 and state.limited == 1
    assert length[1000] == pytest.approx(10.0 * np.sin(1.3), rel=1e-9), "far below its limit it is as printed"


def test_the_angle_is_filtered_the_same_whatever_the_step():
    """A ripple of 0.1 rad at 2 Hz goes; a step of 0.2 rad is followed as by two time constants of 5 s."""
    seen = []
    for h in (0.01, 0.001):
        state = setpoint_of(RIGOROUS, departure=1.0)
        rows = follow(state, 5.0, lambda t: 1.2 + 0.1 * np.sin(4.0 * np.pi * t), h=h)
        assert state.departure == pytest.approx(1.0 + 0.2 * (1.0 - 2.0 * np.exp(-1.0)), abs=2e-3)
        rates = rows[:, 2]
        seen.append(np.abs(np.diff(rates)).max() / h)
    w = 2.0 * np.pi / 9.0
    assert max(seen) < 1.5 * 1.5 * w * w, "the set-point accelerates as the heave does, whatever the angle ripples"


def apart(law: int, h: float) -> float:
    """Largest difference [m] of a set-point's way in one step of h [s] and the mean of its rates before and after: of a
    ship that drifts with 0.3 m/s against its mean track, under a cable that turns by 0.01 rad/s."""
    state, before, found = setpoint_of(law, washout=300.0, departure=1.0), (0.0, 0.0), []
    for n in range(1, round(20.0 / h)):
        t = n * h
        sheave = heave(t)
        sheave.position[0] += 0.3 * t
        sheave.velocity[0] += 0.3
        mean_track(state, sheave, 0.0, h)
        length, rate = set_point(state, sheave, 1.0 + 0.01 * t, h, 0.0, 0.0)
        found.append(abs(length - before[0] - 0.5 * h * (rate + before[1])))
        before = length, rate
    return max(found[1:])


@pytest.mark.parametrize("law", [SIMPLE, RIGOROUS])
def test_the_way_of_a_set_point_is_that_of_its_rate(law):
    """To the third power of the step, as of any smooth motion: the winch follows the cubic through both, and what they
    disagree by is 6/h^2 of it in acceleration, so one of second order stays however short the steps are."""
    assert apart(law, 0.1) / apart(law, 0.05) > 6.5


@pytest.mark.parametrize("law", [HOLD, RIGOROUS, SIMPLE_WATERLINE, RIGOROUS_WATERLINE])
def test_a_change_of_the_law_under_way_is_no_jump(law):
    state = setpoint_of(SIMPLE, max_gain=2.0, max_excess=1.0, max_excess_rate=0.6)
    before = follow(state, 11.0)
    state.algorithm = law
    after = follow(state, 25.0, begin=11.0)
    rows = np.concatenate((before, after))
    away = rows[1100, 1] - (rows[1099, 1] + H * rows[1099, 2])
    assert abs(away) < 1e-9 and rows[1100, 2] == pytest.approx(rows[1099, 2], abs=1e-9)
    assert np.abs(np.diff(rows[:, 2])).max() / H < 2.5  # m/s^2; was a step of the length
    alone = setpoint_of(law, max_gain=2.0, max_excess=1.0, max_excess_rate=0.6)
    alone = follow(alone, 36.0)
    if law != RIGOROUS_WATERLINE and law != SIMPLE_WATERLINE:  # the excess has a past of its own
        np.testing.assert_allclose(rows[2200:, 1], alone[2200:, 1], atol=1e-6)


def test_two_changes_in_a_row_are_taken_up_too():
    state = setpoint_of(SIMPLE)
    rows = [follow(state, 3.0)]
    for n, law in enumerate((HOLD, RIGOROUS, HOLD)):
        state.algorithm = law
        rows.append(follow(state, 2.0, begin=3.0 + 2.0 * n))
    rows = np.concatenate(rows)
    assert np.abs(np.diff(rows[:, 2])).max() / H < 2.5
    assert follow(state, 12.0, begin=9.0)[-1, 1] == 0.0, "hold is the length of the start"
