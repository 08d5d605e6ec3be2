"""Winch: (136) against its solution, limits."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import filled
from scipy.signal import lsim

from cable_sim_ros.physics.winch import DRUM, WINCH, drum_point, servo

pytestmark = pytest.mark.check


def drum_of(**values) -> np.record:
    """A drum of the full-scale winch."""
    usual = {"radius": 0.305, "angle_0": 3.8, "side": 1.0, "gain_p": 250.0, "gain_d": 50.0, "max_rate": 5.0}
    usual |= {"max_accel": 20.0, "timeout": 0.5, "payout_0": 450.0, "min_length": -400.0, "max_length": 1.0}
    usual |= values
    # no soft limits
    return filled(DRUM, **{"min_limit": usual["min_length"], "max_limit": usual["max_length"]} | usual)


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
    winch, drum = filled(WINCH), drum_of(max_rate=0.5, max_accel=2.0, max_length=0.3)
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
    winch, drum, reached = filled(WINCH), drum_of(max_rate=0.49, max_accel=20.0, max_length=100.0), 0
    for k in range(round(2.0 / h)):
        begin = 5.0 if rate == 0.0 else k * h * rate
        servo(h, drum, winch, (begin, rate), (begin + h * rate, rate))
        if abs(winch.rate) == 0.49:
            reached += 1
            assert winch.accel == 0.0
    assert reached > 1.5 / h
    servo(h, drum, winch, (winch.length, 0.0), (winch.length, 0.0))
    assert winch.accel * winch.rate < 0.0, "and brakes at once"


@pytest.mark.parametrize("limits", [{}, {"min_limit": -0.25, "max_limit": 0.25}], ids=["end stop", "soft limit"])
@pytest.mark.parametrize("rate", [4.0, 1.0, -1.0])
def test_in_chosen_steps_the_winch_brakes_no_harder_than_it_can_whatever_their_lengths(rate, limits):
    """A jump of its speed where a step is shorter than the one before would be refused at any length."""
    drum = drum_of(min_length=-0.3, max_length=0.3, exact=1, **limits)
    end, lengths = limits.get("max_limit", 0.3), [0.025, 0.0125, 7.8e-4, 2.4e-5, 3.9e-4, 2.4e-5, 2.4e-5]
    for first in (0, 2, 4):  # the braking falls into other steps
        winch, asked, hardest = filled(WINCH), 0.0, 0.0
        for k in range(100):
            h, before = lengths[(first + k) % len(lengths)], winch.rate
            servo(h, drum, winch, (asked, rate), (asked + h * rate, rate))
            asked, hardest = asked + h * rate, max(hardest, abs(winch.rate - before) / h)
        assert hardest <= 20.0 * (1.0 + 1e-6)
        servo(2.0, drum, winch, (asked, rate), (asked + 2.0 * rate, rate))
        assert winch.length == pytest.approx(np.copysign(end, rate), abs=1e-6) and abs(winch.rate) < 1e-5
        assert abs(winch.length) < end + 1e-9


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
