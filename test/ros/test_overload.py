"""Standstill, overload and what arrived when, on made-up times: no process, no network.

Statistics of the running node that need no ROS.
"""

import math
import time

import pytest

from cable_sim_ros.ros.overload import RECOVERED, Pace, Rate
from cable_sim_ros.ros.timing import Arrivals

pytestmark = pytest.mark.check

SECOND = 1_000_000_000

PERIOD = 10_000_000
POLL = 50_000_000


def test_a_rate_that_is_asked_twice_at_once_stays():
    """A state that changes is published beside the regular second: over a millisecond a stream of 100 Hz shows 0."""
    rate = Rate()
    assert math.isnan(rate.of(0, 5 * SECOND)) and math.isnan(rate.of(0, 5 * SECOND + 1))
    assert rate.of(100, 6 * SECOND) == 100.0
    assert rate.of(100, 6 * SECOND + 1_000_000) == 100.0
    assert rate.of(150, 7 * SECOND) == 50.0, "counted from the last whole interval, none is lost"
    assert rate.of(150, 8 * SECOND) == 0.0


class Row:
    def __init__(self, wake, done):
        self.wake, self.done = wake, done


class Loop:
    """A loop of made-up ticks and its Pace, polled every 50 ms of made-up time."""

    def __init__(self):
        self.now, self.rows, self.skipped, self.lines = 0, [], 0, []
        self.pace = Pace(PERIOD)
        self.pace.begin(PERIOD, 0)
        self.polled = 0
        self.seen_overloaded = None

    def run(self, seconds, work, gap=PERIOD):
        """Tick for some seconds: `work` ns a tick, one a `gap` ns or when the one before is done."""
        end = self.now + round(seconds * SECOND)
        while self.now < end:
            self.rows.append(Row(self.now, self.now + work))
            later = self.now + max(gap, work)
            while self.polled + POLL <= later:
                self.polled += POLL
                self.look(self.polled)
            self.now = later

    def stand_still(self, seconds):
        self.now += round(seconds * SECOND)
        self.skipped += round(seconds * SECOND) // PERIOD
        self.polled = self.now

    def look(self, now):
        done = sum(row.done <= now for row in self.rows)
        row = self.rows.__getitem__
        self.lines += self.pace.look(now, done, 128, row, self.skipped)
        if self.pace.overloaded and self.seen_overloaded is None:
            self.seen_overloaded = now


def test_a_loop_that_holds_real_time_is_left_alone():
    loop = Loop()
    loop.run(10.0, 2_000_000)
    assert not loop.lines and not loop.pace.overloaded and loop.pace.stops == 0
    assert loop.pace.factor == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("work", [0.015, 0.05, 0.4, 3.0], ids="{} s a tick".format)
def test_a_model_too_big_is_overloaded_within_a_second(work):
    loop = Loop()
    loop.run(max(8.0, 4 * work), round(work * SECOND))
    assert loop.seen_overloaded <= SECOND
    assert loop.pace.overloads == 1 and loop.pace.stops == 0
    assert loop.pace.factor == pytest.approx(0.01 / work, rel=0.35, abs=0.02)
    assert len(loop.lines) == 1 and loop.lines[0][0] == "error"
    assert "overloaded: simulated time passes at" in loop.lines[0][1] and "coarser mesh" in loop.lines[0][1]


def test_an_overload_ends_when_real_time_is_held_again():
    loop = Loop()
    loop.run(5.0, 20_000_000)
    assert loop.pace.overloaded
    ended = loop.now
    loop.run(1.5, 2_000_000)
    assert loop.pace.overloaded, "left before real time was held for 2 s"
    loop.run(3.0, 2_000_000)
    assert not loop.pace.overloaded and loop.lines[-1] == ("info", "no longer overloaded: real time is held again")
    assert 4.0 < loop.pace.overloaded_s < 5.0 + (RECOVERED + SECOND) * 1e-9
    assert loop.pace.min_factor == pytest.approx(0.5, abs=0.05) and ended < loop.now


@pytest.mark.parametrize("seconds", [0.1, 0.5, 1.0, 5.0])
def test_a_standstill_is_seen_with_its_length_and_is_no_overload(seconds):
    loop = Loop()
    loop.run(3.0, 2_000_000)
    loop.stand_still(seconds)
    loop.run(3.0, 2_000_000)
    assert loop.pace.stops == 1 and not loop.pace.overloaded and loop.pace.overloads == 0
    assert loop.pace.last_stop == pytest.approx(seconds, abs=0.02)
    assert loop.pace.last_skipped == round(seconds * 100)
    wanted = f"the process stood still for {seconds:.1f} s, {round(seconds * 100)} ticks skipped (1 times so far)"
    assert loop.lines == [("warn", wanted)]
    assert loop.pace.stop_text(loop.now) == wanted and loop.pace.stop_text(loop.now + 20 * SECOND) == ""


def test_one_long_tick_is_no_standstill():
    loop = Loop()
    loop.run(3.0, 2_000_000)
    loop.run(0.01, 300_000_000)
    loop.run(3.0, 2_000_000)
    assert loop.pace.stops == 0, "the polls went on meanwhile: the process did not stand still"


def test_a_lag_that_grew_without_standstill_is_an_overload():
    loop = Loop()
    loop.run(3.0, 2_000_000)
    assert not loop.pace.stopped_lately(loop.now, 2.0)
    assert loop.pace.overload(loop.now)[0][0] == "error" and loop.pace.overload(loop.now) == []
    assert loop.pace.overloads == 1 and math.isfinite(loop.pace.factor)


# ---- arrivals


@pytest.fixture
def clocks(monkeypatch):
    """CLOCK_MONOTONIC and wall clock of the process, to be set: {"mono": ns, "wall": ns}."""
    pytest.importorskip("numpy")
    hands = {"mono": 1000 * SECOND, "wall": 1_700_000_000 * SECOND}
    monkeypatch.setattr(time, "monotonic_ns", lambda: hands["mono"])
    monkeypatch.setattr(time, "time_ns", lambda: hands["wall"])
    return hands


def passed(clocks, seconds):
    clocks["mono"] += round(seconds * SECOND)
    clocks["wall"] += round(seconds * SECOND)


@pytest.mark.parametrize("step", [3600.0, -3600.0, 0.5, -0.5, 0.003])
def test_a_step_of_the_wall_clock_does_not_move_an_arrival(clocks, step):
    arrivals = Arrivals()

    def waited(seconds, after=0.0):
        """Error of the arrival of a message that waited for some seconds, the clock stepping `after` meanwhile."""
        arrived, info = clocks["mono"], {"received_timestamp": clocks["wall"]}
        passed(clocks, seconds)
        clocks["wall"] += round(after * SECOND)
        return (arrivals.of(info) - arrived) * 1e-9

    assert waited(0.004) == 0.0, "the wait in the queue is taken off"
    assert abs(waited(0.004, step)) <= 0.004, "the step went into an arrival"
    for _ in range(20):
        passed(clocks, 0.04)
        assert abs(waited(0.004)) <= 0.004
    passed(clocks, 1.0)
    assert waited(0.004) == 0.0
    assert arrivals.steps == 1 and arrivals.last_step == pytest.approx(step)


def test_what_was_sent_while_the_process_stood_still_arrived_when_it_was_sent(clocks):
    arrivals, offset = Arrivals(), -5 * SECOND
    arrivals.awake()
    begun = clocks["mono"]
    passed(clocks, 5.0)
    for age in (4.9, 2.5, 0.1):  # everything is received at the end of the standstill
        sent = clocks["mono"] - round(age * SECOND)
        arrival = arrivals.of({"received_timestamp": clocks["wall"]}, sent - offset, offset)
        assert arrival == sent
    wild = begun - 100 * SECOND  # a stamp that is wrong stays wrong
    assert arrivals.of({"received_timestamp": clocks["wall"]}, wild - offset, offset) == clocks["mono"]
    passed(clocks, 2.0)
    arrivals.awake()
    late = begun + SECOND
    assert arrivals.of({"received_timestamp": clocks["wall"]}, late - offset, offset) == clocks["mono"]
