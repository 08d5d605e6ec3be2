"""Motion held for the clock, and the cadence of a sender: periods, slack, silence, odd stamps."""

from __future__ import annotations

import pytest

from cable_sim_ros.io.motion.time_sequencer import CONFIRM, MAX, Cadence, MotionGate

pytestmark = pytest.mark.check

MS = 1_000_000
S = 1_000_000_000


def stamps(gate: MotionGate, clock: int) -> list[tuple[str, int]]:
    return [(message.kind, message.stamp // MS) for message in gate.take(clock)]


def test_the_order_is_that_of_the_stamps_however_they_came():
    want = [("imu", 0), ("odometry", 0), ("imu", 10), ("imu", 20), ("odometry", 20)]
    messages = [(kind, stamp * MS) for kind, stamp in want]
    for order in (messages, messages[::-1], [*messages[1::2], *messages[::2]]):
        gate = MotionGate(5)
        for kind, stamp in order:
            assert gate.put(kind, S + stamp, b"", S) == ("", 0)
        found = []
        for clock in (S - 1, S, S + 15 * MS, S + 20 * MS):
            found += stamps(gate, clock)
        assert found == [(kind, 1000 + stamp) for kind, stamp in want] and gate.held == 0


def test_each_topic_is_awaited_by_its_own_rate_and_one_that_came_early_is_not_missing():
    gate = MotionGate(5)
    for k in range(4):
        gate.put("imu", S + k * 10 * MS, b"", S + 30 * MS)
    for k in range(2):
        gate.put("odometry", S + k * 20 * MS, b"", S + 30 * MS)
    assert gate.awaited(S + 39 * MS) == [] and gate.awaited(S + 40 * MS) == ["imu", "odometry"]
    gate.put("imu", S + 40 * MS, b"", S + 40 * MS)
    assert gate.awaited(S + 40 * MS) == ["odometry"]
    gate.put("odometry", S + 60 * MS, b"", S + 40 * MS)
    assert gate.awaited(S + 40 * MS) == [], "what is due is known, and not due"


def test_one_that_is_missing_is_counted_and_a_silent_one_is_not_awaited_until_it_speaks():
    gate = MotionGate(3)
    for k in range(3):
        gate.put("imu", S + k * 20 * MS, b"", S + k * 20 * MS)
    gate.take(1040 * MS)
    missed = 0
    for clock in range(1050, 1400, 10):
        if gate.awaited(clock * MS):
            gate.miss(clock * MS)
            missed += 1
    cadence = gate.cadence["imu"]
    assert missed == cadence.missed == 3 and cadence.silent
    gate.put("imu", 1400 * MS, b"", 1400 * MS)
    assert not cadence.silent and gate.awaited(1419 * MS) == [] and stamps(gate, 1400 * MS) == [("imu", 1400)]
    assert gate.awaited(1420 * MS) == ["imu"], "the gap is not taken for its rate"


def test_one_odd_stamp_is_refused_and_a_jump_ahead_is_held_until_the_clock_is_there():
    gate = MotionGate(5)
    assert gate.put("imu", S, b"", S) == ("", 0)
    assert gate.put("imu", 60 * S, b"", S) == ("", 0), "not yet known"
    assert gate.put("imu", S + 20 * MS, b"", S) == ("stamp_off_clock", 1)
    assert gate.put("imu", -60 * S, b"", S) == ("stamp_off_clock", 1)
    assert stamps(gate, 100 * S) == [("imu", 1000), ("imu", 1020)]
    for k in range(CONFIRM):
        assert gate.put("imu", 30 * S + k * 20 * MS, b"", 2 * S) == ("", 0)
    assert gate.put("imu", 90 * S, b"", 2 * S) == ("", 0) and gate.held == CONFIRM + 1
    assert gate.put("imu", 95 * S, b"", 2 * S) == ("stamp_off_clock", 1), "two odd ones do not agree"
    assert stamps(gate, 31 * S) == [("imu", 30000 + 20 * k) for k in range(CONFIRM)]
    assert gate.awaited(94 * S) == [] and stamps(gate, 95 * S) == [("imu", 95000)], "nothing spoke against the last"


def test_a_bag_poured_in_at_once_is_held_as_far_as_there_is_room():
    gate = MotionGate(5)
    refused = [gate.put("odometry", k * MS, b"", 0) for k in range(MAX + 2)]
    assert gate.held == MAX and refused.count(("held_full", 1)) == 2
    assert len(gate.take(50 * MS)) == 51


def test_a_message_without_a_stamp_counts_for_the_clock():
    gate = MotionGate(5)
    gate.put("imu", 0, b"", 7 * S)
    assert stamps(gate, 7 * S) == [("imu", 7000)]


def run(cadence: Cadence, arrivals: dict[int, list[int]], steps: range) -> list[int]:
    """Clock by clock [ms]: what comes at it, then what is waited for in vain; returns the clocks of those."""
    missed = []
    for clock in steps:
        for stamp in arrivals.get(clock, ()):
            cadence.received(stamp * MS, clock * MS)
        if cadence.due(clock * MS):
            cadence.miss(clock * MS)
            missed.append(clock)
    return missed


def test_a_controller_that_answers_the_step_before_is_waited_for_one_step_later():
    """It stamps with the clock of the tick that it answers, so its command comes a step later than it says."""
    cadence = Cadence(5, eager=True)
    assert run(cadence, {k + 10: [k] for k in range(100, 400, 10)}, range(110, 400, 10)) == [120, 130][:2]
    assert cadence.slack == 10 * MS and cadence.missed == 2
    assert cadence.due(410 * MS), "now it is due a step after its stamp, no later"


def test_one_command_that_comes_late_teaches_nothing():
    cadence = Cadence(5, eager=True)
    arrivals = {k: [k] for k in range(100, 400, 10)}
    arrivals[210] = [200, 210]
    del arrivals[200]
    assert run(cadence, arrivals, range(100, 400, 10)) == [200] and cadence.slack == 0


def test_the_period_is_that_of_the_first_two_a_shorter_one_shortens_it_and_a_slower_sender_lengthens_it():
    cadence = Cadence(5, eager=True)
    cadence.received(0, 0)
    assert cadence.period is None and not cadence.due(10 * S)
    cadence.received(40 * MS, 40 * MS)
    cadence.received(60 * MS, 60 * MS)
    assert cadence.period == 20 * MS
    missed = run(cadence, {k: [k] for k in range(100, 500, 40)}, range(70, 500, 10))
    assert missed == [80, 120] and cadence.period == 40 * MS
    fixed = Cadence(5, period=50 * MS)
    fixed.received(0, 0)
    assert fixed.period == 50 * MS and fixed.due(50 * MS) and not fixed.due(49 * MS)


def test_a_timer_that_does_not_fit_the_clock_is_not_missed_for_ever():
    """Every 15 ms on a clock of 10 ms: at 20, 30, 50, 60, ..."""
    cadence = Cadence(5, eager=True)
    fires = sorted({-(-15 * k // 10) * 10 for k in range(1, 60)})
    assert len(run(cadence, {k: [k] for k in fires}, range(10, 880, 10))) <= 2


def test_where_a_period_is_given_the_first_command_is_awaited_too():
    cadence = Cadence(3, period=20 * MS)
    assert not cadence.due(10 * S)
    cadence.expect(100 * MS)
    assert cadence.due(100 * MS) and not cadence.received_count
    cadence.miss(100 * MS)
    cadence.received(110 * MS, 110 * MS)
    assert not cadence.due(120 * MS) and cadence.due(130 * MS) and cadence.missed == 1
    learnt = Cadence(3, eager=True)
    learnt.expect(100 * MS)
    assert not learnt.due(10 * S)


def test_the_second_message_of_a_topic_is_awaited_where_a_tick_would_run_ahead_of_the_first():
    gate = MotionGate(3, delay=30 * MS)
    gate.put("odometry", S, b"", S)
    assert gate.awaited(S + 30 * MS) == [] and gate.awaited(S + 40 * MS) == ["odometry"]
    gate.miss(S + 40 * MS)
    assert gate.awaited(S + 50 * MS) == [] and gate.cadence["odometry"].missed == 1
    gate.put("odometry", S + 20 * MS, b"", S + 50 * MS)
    assert gate.awaited(S + 50 * MS) == ["odometry"], "its period is known now"
