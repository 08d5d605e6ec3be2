"""Constant tension, feed-forward of a drive and prediction over a dead time, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import filled

from cable_sim_ros.physics.heave_compensation import SETPOINT, set_point
from cable_sim_ros.physics.setpoint_feed_forward import FEED_FORWARD, begin_lead, lead_drive
from cable_sim_ros.physics.setpoint_prediction import MARGIN, PREDICTION, begin_prediction, predict
from cable_sim_ros.physics.setpoint_tension import TENSION, begin_tension, hold_tension
from cable_sim_ros.physics.state import SHEAVE

pytestmark = pytest.mark.check

H = 0.02  # s
SIMPLE, CONSTANT_TENSION = 1, 5


def looked_ahead(tau: float, length, rate, h: float = H) -> np.ndarray:
    """Rows of what the prediction adds to a set-point and to its rate."""
    law = filled(PREDICTION, horizon=tau)
    begin_prediction(law, length[0], rate[0])
    return np.array([predict(law, x, v, h) for x, v in zip(length, rate, strict=True)])


def sea(t, periods=((0.8, 9.0), (0.4, 6.2), (0.1, 4.5))):
    """A set-point of three waves, and its rate."""
    waves = [(a, 2.0 * np.pi / p) for a, p in periods]
    return sum(a * np.sin(w * t) for a, w in waves), sum(a * w * np.cos(w * t) for a, w in waves)


@pytest.mark.parametrize("tau", [0.1, 0.4])
def test_a_delayed_sine_is_late_by_the_formula_and_a_predicted_one_is_not(tau):
    """Of a wave of pulsation w late by tau 2 sin(w tau / 2) is left; 2 % of that once the wave is known."""
    w, t = 2.0 * np.pi / 8.0, np.arange(0.0, 90.0, H)
    length, rate = np.sin(w * t), w * np.cos(w * t)
    lead = looked_ahead(tau, length, rate)[:, 0]
    late = np.sin(w * (t + tau))
    known = t > 30.0
    left = (late - length)[known].std() / length[known].std()
    assert left == pytest.approx(2.0 * np.sin(0.5 * w * tau), rel=0.01)
    assert (late - length - lead)[known].std() < 0.02 * left * length[known].std()


@pytest.mark.parametrize("tau, most", [(0.1, 0.015), (0.4, 0.03), (1.0, 0.08)])
def test_what_is_left_of_a_sea_is_a_small_share(tau, most):
    t = np.arange(0.0, 120.0, H)
    (length, rate), (later, then) = sea(t), sea(t + tau)
    lead = looked_ahead(tau, length, rate)
    known = t > 60.0
    assert (later - length - lead[:, 0])[known].std() < most * (later - length)[known].std()
    assert (then - rate - lead[:, 1])[known].std() < most * (then - rate)[known].std()


def test_a_prediction_begins_at_the_rate_of_now_and_its_way_is_that_of_its_rate():
    t = np.arange(0.0, 30.0, H)
    length, rate = sea(t)
    lead = looked_ahead(0.4, length - length[0], rate)
    assert lead[0, 0] == pytest.approx(0.4 * rate[0], rel=1e-3), "nothing is known yet"
    np.testing.assert_allclose(np.diff(lead[:, 0]), 0.5 * H * (lead[1:, 1] + lead[:-1, 1]), atol=1e-12)
    assert np.abs(lead[:, 0]).max() < 0.4 * MARGIN * np.abs(rate).max() * 1.1


def test_nothing_is_taken_from_the_future_and_the_step_does_not_matter():
    t = np.arange(0.0, 40.0, H)
    length, rate = sea(t)
    other = length.copy()
    other[1500:] += 1.0
    one, two = looked_ahead(0.3, length, rate), looked_ahead(0.3, other, rate)
    np.testing.assert_array_equal(one[:1500], two[:1500])
    assert not np.array_equal(one, two)
    fine = looked_ahead(0.3, *sea(np.arange(0.0, 40.0, 0.5 * H)), h=0.5 * H)[::2]
    assert np.abs(fine - one)[1000:, 0].max() < 0.02 * np.abs(one[:, 0]).max()


@pytest.mark.parametrize("tau", [0.05, 5.0])
def test_a_motion_that_stops_begins_anew_or_is_noise_stays_bounded(tau):
    rng, t = np.random.default_rng(1), np.arange(0.0, 80.0, H)
    length, rate = sea(t)
    rate = np.where((t > 20.0) & (t < 40.0), 0.0, rate) + np.where(t > 60.0, rng.normal(0.0, 1.0, len(t)), 0.0)
    length = np.cumsum(rate) * H
    lead = looked_ahead(tau, length, rate)
    assert np.isfinite(lead).all() and np.abs(lead[:, 0]).max() < 2.0 * MARGIN * tau * np.abs(rate).max()


K1, K2, W, ZETA, G = 250.0, 50.0, 6.0, 0.7, 1.5
DRIVES = {  # factors of the feed-forward, and drum over set-point of the drive for s
    "servo": ((1.0 / K2, 0.0, K1 / K2), lambda s: (K2 * s + K1) / (s * s + K2 * s + K1)),
    "first order": ((1.0 / W, 0.0, G), lambda s: W * (s + G) / (s * s + W * s + W * G)),
    "second order": (
        (2.0 * ZETA / W, 1.0 / W**2, G),
        lambda s: W * W * (s + G) / (s**3 + 2.0 * ZETA * W * s * s + W * W * s + W * W * G),
    ),
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("period", [5.0, 9.0])
def test_the_drum_behind_the_drive_is_where_the_law_wants_it(drive, period):
    """Phasor of the set-point with its lead, times the response of the drive: 1, without the lead up to 0.3 off."""
    (second, third, back), response = DRIVES[drive]
    w, t = 2.0 * np.pi / period, np.arange(0.0, 12.0 * period, 0.01)
    law = filled(FEED_FORWARD, second=second, third=third, back=back, bandwidth=20.0)
    begin_lead(law, 0.0)
    lead = np.array([lead_drive(law, w * np.cos(w * x), 0.01) for x in t])
    np.testing.assert_allclose(np.diff(lead[:, 0]), 0.005 * (lead[1:, 1] + lead[:-1, 1]), atol=1e-9)
    last = t > 6.0 * period
    phasor = 2.0 * np.mean((np.sin(w * t) + lead[:, 0])[last] * np.exp(-1j * w * t[last])) * 1j
    off, before = abs(phasor * response(1j * w) - 1.0), abs(response(1j * w) - 1.0)
    assert off < 0.1 * before + 2e-4, (off, before)
    assert before > 1e-3


def tension_law(**values) -> np.record:
    usual = {
        "at_start": 3000.0,
        "gain": 2.5e-4,
        "time": 0.02,
        "integral_time": 0.1,
        "max_rate": 2.0,
        "back": 1.0 / 60.0,
    }
    return filled(TENSION, **usual | values)


def test_constant_tension_holds_a_tow_that_answers_a_rate():
    """T = T0 + Z (v_ship - v): what is left of a wave of the ship is 1 / (1 + Z C), C the controller's response."""
    z, w, law, paid, left = 1624.0, 2.0 * np.pi / 8.0, tension_law(back=0.0), [0.0], []
    rate = 0.0
    for t in np.arange(0.0, 60.0, 0.01):
        tension = 3000.0 + z * (0.3 * np.cos(w * t) - rate)
        length, rate = hold_tension(law, tension, paid[-1], 20.0, 0.01)
        paid.append(length)
        left.append(tension - 3000.0)
    s = 1j * w
    c = 2.5e-4 * (1.0 + 1.0 / (0.1 * s)) / (1.0 + 0.02 * s)
    assert np.std(left[3000:]) == pytest.approx(0.3 * z / np.sqrt(2.0) / abs(1.0 + z * c), rel=0.02)
    assert abs(np.diff(paid)).max() <= 2.0 * 0.01


def test_nothing_winds_up_at_the_excursion_nor_behind_a_drive_that_stands():
    for stands, most in ((False, 20.0), (True, 2.0 * 1.0)):
        law, paid, rates = tension_law(), 0.0, []
        for t in np.arange(0.0, 200.0, H):
            paid, rate = hold_tension(law, 3000.0 + (500.0 if t < 150.0 else -500.0), 0.0 if stands else paid, 20.0, H)
            rates.append(rate)
            assert abs(paid) <= most + 1e-9
            if 100.0 < t < 150.0:
                assert paid > 0.9 * most and law.held == 1
        turned = np.array(rates[round(150.0 / H) :])
        assert turned[round(1.0 / H)] < -1.0, "it hauls in within a second"
        assert np.abs(rates).max() <= 2.0


def test_a_tension_set_under_way_moves_the_rate_by_no_jump():
    law = tension_law()
    begin_tension(law, 3.0, 0.4, 3100.0)
    length, rate = hold_tension(law, 3100.0, 3.0, 20.0, H)
    assert length == pytest.approx(3.0 + 0.4 * H, abs=1e-3) and rate == pytest.approx(0.4, abs=0.02)
    law.wanted = 3500.0
    rates = [hold_tension(law, 3100.0, 3.0, 20.0, H)[1] for _ in range(100)]
    assert np.abs(np.diff([rate, *rates])).max() < 0.03 and rates[-1] < rate - 0.1, "hauls in for more tension"


def setpoint_of(law: int) -> np.record:
    usual = {"algorithm": law, "engaged": law, "angle": 1.0, "departure": 1.0, "departure_time": 5.0, "transfer": 10.0}
    state = filled(SETPOINT, **usual, max_gain=2.0, max_excess=1.0, max_excess_rate=0.6, max_amplitude=20.0)
    own = {
        "tension": {"at_start": 3000.0, "gain": 2.5e-4, "time": 0.02, "integral_time": 0.1, "max_rate": 2.0},
        "feed_forward": {"second": 1.4 / 6.0, "third": 1.0 / 36.0, "back": 1.5, "bandwidth": 20.0},
        "prediction": {"horizon": 0.3},
    }
    for name, values in own.items():
        for key, value in values.items():
            state[name][key] = value
    return state


def follow(state, seconds: float, begin: float) -> np.ndarray:
    """Rows of set-point and rate under a heaving sheave, with the tension that the set-point leaves."""
    rows, w = [], 2.0 * np.pi / 8.0
    for t in begin + H * np.arange(1, round(seconds / H) + 1):
        sheave = filled(SHEAVE, position=(0.0, 0.0, np.sin(w * t)), velocity=(0.0, 0.0, w * np.cos(w * t)))
        tension = 3000.0 + 1600.0 * (0.54 * w * np.cos(w * t) - state.asked_rate)
        rows.append(set_point(state, sheave, 1.0, H, tension, state.asked))
    return np.array(rows)


def switch(state, name: str, value: int) -> None:
    """Change the law, or an option of it."""
    if name == "law":
        state.algorithm = value
    else:
        state[name].on = value


@pytest.mark.parametrize(
    "first, changes",
    [
        (SIMPLE, [("law", CONSTANT_TENSION), ("law", SIMPLE), ("law", 0)]),
        (SIMPLE, [("feed_forward", 1), ("prediction", 1), ("feed_forward", 0), ("prediction", 0)]),
        (SIMPLE, [("prediction", 1), ("feed_forward", 1), ("law", 2), ("law", CONSTANT_TENSION)]),
    ],
)
def test_a_change_under_way_is_no_jump(first, changes):
    state = setpoint_of(first)
    rows = [follow(state, 15.0, 0.0)]
    for n, change in enumerate(changes):
        switch(state, *change)
        rows.append(follow(state, 15.0, 15.0 * (n + 1)))
    rows = np.concatenate(rows)
    assert np.abs(np.diff(rows[:, 1])).max() < 0.06, "m/s in 20 ms: 3 m/s^2"
    np.testing.assert_allclose(np.diff(rows[:, 0]), 0.5 * H * (rows[1:, 1] + rows[:-1, 1]), atol=2e-4)


def test_options_that_were_switched_off_leave_nothing():
    state, plain = setpoint_of(SIMPLE), setpoint_of(SIMPLE)
    state.feed_forward.on = state.prediction.on = 1
    on = follow(state, 20.0, 0.0)
    state.feed_forward.on = state.prediction.on = 0
    off = follow(state, 12.0, 20.0)
    alone = follow(plain, 32.0, 0.0)
    assert np.abs(on[-200:] - alone[800:1000]).max() > 0.05
    np.testing.assert_allclose(off[-50:], alone[-50:], atol=1e-12)
