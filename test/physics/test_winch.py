"""Winch: (136) against its solution, commands, limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from cable_sim_ros.physics.inputs import make_inputs, push_command
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.winch import DRUM, WINCH, command, command_between, drum_point, servo


def filled(kind: np.dtype, **values) -> np.record:
    """One record of a kind, zero but for these fields."""
    row = records(1, kind)[0]
    for name, value in values.items():
        row[name] = value
    return row


def drum_of(**values) -> np.record:
    """A drum of the full-scale winch."""
    usual = {"radius": 0.305, "angle_0": 3.8, "side": 1.0, "gain_p": 250.0, "gain_d": 50.0, "rate_most": 5.0}
    usual |= {"accel_most": 20.0, "timeout": 0.5, "payout_0": 450.0, "length_least": -400.0, "length_most": 1.0}
    row = usual | values
    row = {"limit_least": row["length_least"], "limit_most": row["length_most"]} | row  # no soft limits
    return filled(DRUM, **row)


def test_servo_follows_the_printed_equation():
    """phi'' = k1 (sp - phi) + k2 (sp' - phi'): a slow sine against scipy's solution of the same equation."""
    t = np.arange(0.0, 8.0, 0.01)
    wanted, rate = 0.4 * np.sin(0.6 * t), 0.24 * np.cos(0.6 * t)
    _, exact, _ = lsim(([50.0, 250.0], [1.0, 50.0, 250.0]), wanted, t)
    winch, drum, got = filled(WINCH), drum_of(), [0.0]
    for k in range(1, t.size):
        servo(0.01, drum, winch, (wanted[k - 1], rate[k - 1]), (wanted[k], rate[k]))
        got.append(winch.length)
    assert np.abs(np.array(got[200:]) - exact[200:]).max() < 2e-4


def test_servo_keeps_its_limits_and_stops_at_the_end_of_the_drum():
    winch, drum = filled(WINCH), drum_of(rate_most=0.5, accel_most=2.0, length_most=0.3)
    rates = [0.0]
    for _ in range(400):
        servo(0.01, drum, winch, (5.0, 0.0), (5.0, 0.0))
        rates.append(winch.rate)
        assert winch.at_end == 1
    rates = np.array(rates)
    assert np.abs(rates).max() <= 0.5 + 1e-12
    assert np.abs(np.diff(rates)).max() <= 2.0 * 0.01 * 1.05
    assert winch.length == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("h", [0.01, 0.0005])
@pytest.mark.parametrize("rate", [0.0, 1.0, -1.0], ids=["a step", "too fast a ramp out", "too fast a ramp in"])
def test_at_the_largest_rate_the_drum_does_not_accelerate(rate, h):
    """From the step on with which it comes there: that one was published with what had brought it there."""
    winch, drum, reached = filled(WINCH), drum_of(rate_most=0.49, accel_most=20.0, length_most=100.0), 0
    for k in range(round(2.0 / h)):
        begin = 5.0 if rate == 0.0 else k * h * rate
        servo(h, drum, winch, (begin, rate), (begin + h * rate, rate))
        if abs(winch.rate) == 0.49:
            reached += 1
            assert winch.accel == 0.0
    assert reached > 1.5 / h
    servo(h, drum, winch, (winch.length, 0.0), (winch.length, 0.0))
    assert winch.accel * winch.rate < 0.0, "and brakes at once"


def test_paying_out_turns_the_drum_from_the_end_towards_its_top():
    drum = drum_of()

    def end(length: float, rate: float, accel: float):
        return drum_point(drum, filled(WINCH, length=length, rate=rate, accel=accel))

    p0, _, _ = end(0.0, 0.0, 0.0)
    p1, v, _ = end(0.1, 1.0, 0.0)
    assert p0 == pytest.approx((0.305 * np.sin(3.8), 0.0, 0.305 * np.cos(3.8)))
    assert np.hypot(p1[0], p1[2]) == pytest.approx(0.305)
    assert np.linalg.norm(v) == pytest.approx(1.0), "rim speed is the pay-out rate"
    assert np.dot(np.subtract(p1, p0), v) > 0.0
    h = 1e-5
    a = end(0.1, 1.0, 0.4)[2]
    ahead, behind = (end(0.1 + s * h + 0.2 * h * h, 1.0 + 0.4 * s * h, 0.4)[1] for s in (1, -1))
    np.testing.assert_allclose(a, np.subtract(ahead, behind) / (2 * h), atol=1e-6)


def test_rate_command_runs_until_its_time_out_then_holds():
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of()
    push_command(inputs, 0, np.nan, 0.2)
    for k in range(100):
        command((k + 1) * 10_000_000, 0.01, drum, inputs, winch)
    assert winch.commanded == pytest.approx(0.2 * 0.5, abs=1e-9)
    assert winch.stale == 1
    push_command(inputs, 1_000_000_000, np.nan, np.nan)  # nothing commanded: the one before holds
    command(1_010_000_000, 0.01, drum, inputs, winch)
    assert winch.stale == 1


def test_length_command_is_approached_at_the_largest_rate_and_held():
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of(rate_most=0.5)
    push_command(inputs, 0, 450.4, np.nan)
    lengths = []
    for k in range(300):
        command((k + 1) * 10_000_000, 0.01, drum, inputs, winch)
        lengths.append(winch.commanded)
    assert np.diff(lengths).max() <= 0.5 * 0.01 + 1e-12
    assert lengths[-1] == pytest.approx(0.4)
    assert winch.stale == 0, "a length is held for as long as nothing else comes"


def test_a_length_wins_over_a_rate_of_the_same_message():
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of(rate_most=0.5)
    push_command(inputs, 0, 449.0, 0.5)
    assert command(10_000_000, 0.01, drum, inputs, winch) == pytest.approx(-0.5)


def test_the_newest_command_wins_from_where_the_winch_is():
    """A rate takes over half way to a length, and rate 0 stops it."""
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of(rate_most=0.5)
    push_command(inputs, 0, 440.0, np.nan)
    for k in range(100):
        command((k + 1) * 10_000_000, 0.01, drum, inputs, winch)
    push_command(inputs, 1_000_000_001, np.nan, 0.0)
    assert command(1_010_000_000, 0.01, drum, inputs, winch) == 0.0
    assert winch.commanded == pytest.approx(-0.5) and winch.stale == 0


@pytest.mark.parametrize("payout, rate", [(np.nan, 0.5), (900.0, np.nan)], ids=["rate", "length"])
def test_a_command_past_the_end_does_not_pile_up(payout, rate):
    """Ten seconds against the end of the drum: the first tick of the way back hauls in."""
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of(rate_most=0.5, length_most=0.3, timeout=60.0)
    push_command(inputs, 0, payout, rate)
    for k in range(1000):
        before = winch.commanded
        now = command((k + 1) * 10_000_000, 0.01, drum, inputs, winch)
        servo(0.01, drum, winch, (before, 0.0), (winch.commanded, now))
    assert winch.commanded == pytest.approx(0.3, abs=1e-12) and now == 0.0
    assert winch.at_end == 1, "standing at the end is reported for as long as it lasts"
    push_command(inputs, 10_000_000_001, np.nan, -0.5)
    assert command(10_010_000_000, 0.01, drum, inputs, winch) == pytest.approx(-0.5)
    servo(0.01, drum, winch, (0.3, 0.0), (winch.commanded, -0.5))
    assert winch.at_end == 0


def test_a_command_of_the_future_waits():
    inputs, winch, drum = make_inputs(), filled(WINCH), drum_of()
    push_command(inputs, 50_000_000, np.nan, 1.0)
    assert command(10_000_000, 0.01, drum, inputs, winch) == 0.0
    assert winch.command_age == -1.0
    assert command(60_000_000, 0.01, drum, inputs, winch) == pytest.approx(1.0)


def test_a_step_of_any_length_takes_every_command_from_its_stamp_to_its_time_out():
    """Rate 1 from 0.13 s, -2 from 0.37 s, which times out at 0.87 s: pay-out 0.24 - 1.0 m, whatever the steps."""
    inputs, drum = make_inputs(), drum_of(timeout=0.5)
    push_command(inputs, 130_000_000, np.nan, 1.0)
    push_command(inputs, 370_000_000, np.nan, -2.0)
    for step in (1_000_000_000, 500_000_000, 100_000_000, 7_812_500):
        winch, rate = filled(WINCH), 0.0
        for begin in range(0, 1_000_000_000, step):
            rate = command_between(begin, begin + step, drum, inputs, winch)
        assert winch.commanded == pytest.approx(0.24 - 1.0, abs=1e-12), step
        assert rate == 0.0 and winch.stale == 1 and winch.command_age == pytest.approx(1.0 - 0.37, abs=1e-9)
