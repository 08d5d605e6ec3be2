"""Commands of the winch: ramps, streams of lengths, time-outs, ends, and the bounds that no sequence of them breaks."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import filled
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.physics.inputs import make_inputs, push_command
from cable_sim_ros.physics.winch import DRUM, WINCH, servo
from cable_sim_ros.physics.winch_command import approach, between, command, command_between
from cable_sim_ros.sim.loop import look

pytestmark = pytest.mark.check

NAN, S, TICK = np.nan, 1_000_000_000, 10_000_000


def drum_of(**values) -> np.record:
    """450 m paid out, a travel of 400 m in and 100 m out of that; 2 m/s^2."""
    usual = {"max_rate": 5.0, "max_accel": 20.0, "ramp": 2.0, "timeout": 0.5, "payout_0": 450.0}
    usual |= {"gain_p": 250.0, "gain_d": 50.0, "min_reach": -400.0, "max_reach": 100.0} | values
    for end in ("min", "max"):
        usual[f"{end}_length"] = usual[f"{end}_limit"] = usual[f"{end}_reach"]
    return filled(DRUM, **usual)


class Carried:
    """Commands carried out tick by tick."""

    def __init__(self, **values) -> None:
        self.inputs, self.winch, self.drum = make_inputs(), filled(WINCH), drum_of(**values)
        self.now, self.lengths, self.rates = 0, [], []

    def give(self, payout=NAN, rate=NAN, at=None) -> None:
        push_command(self.inputs, self.now if at is None else at, payout, rate)
        look(self.inputs)

    def run(self, seconds: float) -> Carried:
        for _ in range(round(seconds * S / TICK)):
            self.now += TICK
            command(self.now, TICK * 1e-9, self.drum, self.inputs, self.winch)
            self.lengths.append(float(self.winch.commanded))
            self.rates.append(float(self.winch.command_rate))
        return self

    @property
    def jump(self) -> float:
        """Largest change of the rate in a tick [m/s]."""
        return float(np.abs(np.diff([0.0, *self.rates])).max())


def test_rate_is_taken_up_kept_to_its_time_out_and_given_up_with_the_ramp():
    it = Carried()
    it.give(rate=0.2)
    it.run(0.5)
    assert it.lengths[-1] == pytest.approx(0.2 * 0.5 - 0.2**2 / 4.0) and it.winch.stale == 0
    it.run(0.5)
    assert it.lengths[-1] == pytest.approx(0.2 * 0.5) and it.rates[-1] == 0.0, "what it gave away it gets back"
    assert it.winch.stale == 1 and it.winch.command_age == pytest.approx(1.0)
    assert it.jump <= 2.0 * 0.01 * (1 + 1e-9)
    it.give()  # nothing commanded: the one before holds
    assert it.run(0.01).winch.stale == 1
    it.give(rate=0.0)
    assert it.run(2.0).winch.stale == 0, "a stop does not run out"


def test_length_alone_is_gone_to_at_the_largest_rate_and_lands_at_rest():
    """10 m at 2 m/s, 2 m/s^2: 10/2 + 2/2 s, without overshoot."""
    it = Carried(max_rate=2.0)
    it.give(payout=460.0)
    it.run(5.99)
    assert max(it.rates) == pytest.approx(2.0) and it.lengths[-1] < 10.0
    it.run(60.0)
    assert it.lengths[-1] == 10.0 and max(it.lengths) < 10.0 + 1e-12
    assert it.rates[-1] == 0.0 and it.jump <= 0.02 * (1 + 1e-9)
    assert it.winch.stale == 0, "a length alone is held for as long as nothing else comes"


def test_length_wins_over_rate_of_the_same_message():
    it = Carried()
    it.give(payout=449.0, rate=0.5)
    assert it.run(0.1).rates[-1] == pytest.approx(-0.2)


def test_the_newest_wins_from_where_the_winch_is_and_stop_stops():
    """A rate takes over half way to a length, and rate 0 brakes it; the length is forgotten."""
    it = Carried(max_rate=0.5)
    it.give(payout=440.0)
    it.run(1.0)
    it.give(rate=0.5)
    it.run(0.3)
    assert it.rates[-1] > 0.0
    it.give(rate=0.0)
    it.run(0.25)
    held = it.lengths[-1]
    assert it.rates[-1] == 0.0 and it.run(5.0).lengths[-1] == held and it.jump <= 0.02 * (1 + 1e-9)


@pytest.mark.parametrize("payout, rate", [(NAN, 0.5), (900.0, NAN), (1e308, NAN), (NAN, 1e308)])
def test_what_is_asked_past_the_end_is_not_saved_up(payout, rate):
    """Ten seconds against the end: at rest there, said, and the first tick of the way back hauls in."""
    it = Carried(max_rate=0.5, max_reach=0.3, timeout=60.0)
    it.give(payout, rate)
    it.run(10.0)
    assert it.lengths[-1] == max(it.lengths) == 0.3 and it.rates[-1] == 0.0 and it.winch.limited == 1
    assert it.jump <= 0.02 * (1 + 1e-9), "it brakes ahead of the end"
    servo(0.01, it.drum, it.winch, (0.3, 0.0), (0.3, 0.0))
    assert it.winch.at_end == 1
    it.give(rate=-0.5)
    it.run(0.01)
    assert it.rates[-1] == pytest.approx(-0.02) and it.lengths[-1] < 0.3 and it.winch.limited == 0


def test_limited_says_that_more_is_asked_than_can_be():
    it = Carried(timeout=60.0)
    for asked, limited in (
        ({"rate": 5.0}, 0),
        ({"rate": 5.1}, 1),
        ({"payout": 550.0}, 0),
        ({"payout": 550.1}, 1),
        ({"payout": 20.0}, 1),
        ({"rate": 0.1}, 0),
    ):
        it.give(**asked)
        assert it.run(0.01).winch.limited == limited, asked
        it.run(2.0)


def test_a_command_counts_from_its_time_and_the_delay_of_the_drive():
    it = Carried()
    it.give(rate=1.0, at=50_000_000)
    assert it.run(0.04).rates[-1] == 0.0 and it.winch.command_age == -1.0
    assert it.run(0.01).rates[-1] == pytest.approx(0.02)
    late = Carried(delay=300_000_000)
    late.give(rate=1.0)
    late.run(0.29)
    assert max(late.rates) == 0.0 and late.run(0.02).rates[-1] > 0.0
    assert late.winch.command_age == pytest.approx(0.31), "its age is from its arrival"
    assert late.run(0.45).winch.stale == 0 and late.run(0.1).winch.stale == 1, "the time-out from when it counts"


# streams of lengths


def streamed(rate_hz: float, seconds: float, jitter: float = 0.0, **values) -> tuple[np.ndarray, np.ndarray, Carried]:
    """(rate commanded, that of the wave, the winch) of lengths 450 + sin(2 pi t/8) sent at ``rate_hz``."""
    it, random, sent = Carried(**values), np.random.default_rng(1), 0
    due, period = 0.0, 1.0 / rate_hz
    for _ in range(round(seconds * 100)):
        while due * S <= it.now + TICK:
            it.give(payout=450.0 + np.sin(2 * np.pi * sent * period / 8.0), at=round(due * S))
            sent += 1
            due = sent * period + random.uniform(0.0, jitter)
        it.run(0.01)
    t = 0.01 * np.arange(1, len(it.rates) + 1) - period  # a line is followed one interval late
    return np.array(it.rates), 2 * np.pi / 8.0 * np.cos(2 * np.pi * t / 8.0), it


@pytest.mark.parametrize("rate_hz, jitter, within", [(10.0, 0.0, 0.06), (50.0, 0.0, 0.02), (10.0, 0.01, 0.12)])
def test_a_stream_of_lengths_gives_a_smooth_rate(rate_hz, jitter, within):
    """A position controller at 10 Hz: not a step of 0.1 s at the largest rate, but the wave, one interval late."""
    rates, wave, it = streamed(rate_hz, 24.0, jitter)
    assert np.abs(rates - wave)[400:].max() < within, "of 0.785 m/s"
    assert it.jump <= 0.02 * (1 + 1e-9) and it.winch.limited == 0 and it.winch.stale == 0


def test_a_stream_that_ends_is_stale_and_holds_its_last_length():
    _, _, it = streamed(10.0, 8.05)
    last = it.inputs.command[(int(it.inputs.command_head[0]) - 1) % 256, 0] - 450.0
    it.run(0.4)
    assert it.winch.stale == 0
    it.run(0.1)
    assert it.winch.stale == 1, "a dead controller is seen within the time-out"
    it.run(2.0)
    assert it.lengths[-1] == last and it.rates[-1] == 0.0
    it.give(payout=452.0)
    assert it.run(0.01).winch.stale == 0, "the next is one alone"
    assert it.run(10.0).lengths[-1] == 2.0 and it.winch.stale == 0


def test_the_same_length_again_and_again_is_that_length():
    once, often = Carried(), Carried()
    once.give(payout=440.0)
    for k in range(40):
        if k % 3 == 0:
            often.give(payout=440.0)
        once.run(0.1), often.run(0.1)
    assert often.lengths == once.lengths


def test_a_stream_faster_than_the_winch_is_followed_at_the_largest_rate():
    it = Carried(max_rate=1.0)
    for k in range(40):
        it.give(payout=450.0 + 0.3 * k)
        it.run(0.1)
    assert it.winch.limited == 1 and max(it.rates) <= 1.0 + 1e-12 and it.rates[-1] == pytest.approx(1.0)
    assert it.run(20.0).lengths[-1] == pytest.approx(0.3 * 39, abs=1e-12)


# steps, and bounds


def test_a_step_of_any_length_takes_every_command_from_its_time_to_its_time_out():
    """Rate 1 from 0.13 s, -2 from 0.37 s, which times out at 0.87 s, and as they come without a ramp."""
    for ramp in (2.0, 1e9):
        found = []
        for step in (3_000_000_000, 500_000_000, 100_000_000, 7_812_500):
            it = Carried(ramp=ramp)
            it.give(rate=1.0, at=130_000_000)
            it.give(rate=-2.0, at=370_000_000)
            for begin in range(0, 3 * S, step):
                command_between(begin, begin + step, it.drum, it.inputs, it.winch)
            found.append(it.winch.commanded)
            assert it.winch.command_rate == 0.0 and it.winch.stale == 1
            assert it.winch.command_age == pytest.approx(3.0 - 0.37, abs=1e-9)
        assert found == pytest.approx([found[0]] * 4, abs=1e-12)
    assert found[0] == pytest.approx(0.24 - 1.0, abs=1e-8)


@given(st.floats(-50, 50), st.floats(-5, 5), st.floats(0.01, 100), st.floats(1e-3, 30), st.integers(1, 7))
def test_the_way_to_rest_is_the_same_however_it_is_cut(offset, rate, a, seconds, parts):
    whole = approach(offset, rate, -5.0, 5.0, a, seconds)
    e, w = offset, rate
    for _ in range(parts):
        e, w = approach(e, w, -5.0, 5.0, a, seconds / parts)
    assert (e, w) == (pytest.approx(whole[0], abs=1e-6), pytest.approx(whole[1], abs=1e-4))
    assert abs(w) <= 5.0 and abs(w - rate) <= a * seconds * (1 + 1e-9) + 1e-12


def test_a_halved_tick_goes_from_its_beginning_to_its_end():
    assert between((1.0, 2.0), (1.5, 3.0), 1.0, 0.2) == (1.5, 3.0)
    length, rate = between((1.0, 2.0), (1.5, 3.0), 0.5, 0.2)
    assert length == pytest.approx(1.225) and rate == pytest.approx(2.5), "constant acceleration: 2 t + 2.5 t^2"


numbers = st.one_of(st.floats(-600, 1200), st.sampled_from([1e308, -1e308, 0.0, 1e5, -1e5, 450.0, 550.0, 50.0]))
orders = st.lists(
    st.tuples(st.integers(0, 1500), st.sampled_from(["length", "rate", "both", "none"]), numbers),
    min_size=1,
    max_size=25,
)


@settings(max_examples=40)
@given(orders, st.sampled_from([0.3, 2.0, 50.0]), st.sampled_from([0, 120_000_000]))
def test_no_sequence_of_commands_breaks_rate_ramp_or_travel(sequence, ramp, delay):
    """And what comes out depends on the commands so far alone: later ones in the ring do not change a bit."""
    it, ahead = (Carried(ramp=ramp, delay=delay) for _ in range(2))
    time, given = 0, []
    for wait, kind, value in sequence:
        time += wait * 1_000_000 + 1
        given.append((NAN if kind in ("rate", "none") else value, NAN if kind in ("length", "none") else value, time))
    for payout, rate, at in given:
        ahead.give(payout, rate, at)
    last = -(-time // TICK) + 100
    for k in range(last):
        while given and given[0][2] <= (k + 1) * TICK:
            it.give(*given.pop(0))
        it.run(0.01)
    ahead.run(last * 0.01)
    assert ahead.lengths == it.lengths and ahead.rates == it.rates
    lengths, rates = np.array(it.lengths), np.array(it.rates)
    assert np.isfinite(lengths).all() and np.abs(rates).max() <= 5.0
    assert lengths.min() >= -400.0 and lengths.max() <= 100.0
    assert it.jump <= ramp * 0.01 * (1 + 1e-9) + 1e-12
    assert np.abs(np.diff([0.0, *lengths]) - 0.005 * (rates + [0.0, *rates[:-1]])).max() <= 0.25 * ramp * 1e-4 + 1e-9
