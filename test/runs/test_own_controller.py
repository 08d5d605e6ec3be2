"""A controller of one's own in an offline run: when it is asked, what its command does, and what ends the run."""

import json

import numpy as np
import pytest
from short_bag import put_short_bag

from cable_sim_ros import ControllerError, WinchCommand, replay, run
from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.physics.tick_output import Flag

pytestmark = pytest.mark.trust
S = 1_000_000_000
HEAVE = {"heave": (0.5, 8.0)}


class Keeper:
    """Keeps the rows, and answers with a rate that follows the sheave."""

    def __init__(self, gain=0.5):
        self.gain, self.rows = gain, []

    def __call__(self, row):
        self.rows.append(row)
        return WinchCommand(rate=self.gain * float(row.sheave_velocity[2]))


@pytest.fixture
def bag(monkeypatch):
    """Two seconds of the shipped motion, and a way to change them."""
    return put_short_bag(monkeypatch, 2, ("odometry",))


def test_it_sees_the_row_of_every_tick_from_the_start_on():
    keeper = Keeper()
    result = run("side_scan", duration=0.5, controller=keeper, **HEAVE)
    times = [int(row.time) for row in keeper.rows]
    begin = result.frames.time[0] - S // 100
    assert times == [begin, *result.frames.time[:-1]]
    for row, frame in zip(keeper.rows[1:], result.frames):
        assert row.tobytes() == frame.tobytes(), "a copy, that is the same after the run"
    assert result.metrics["controller"] == {"period_s": 0.01, "calls": 50, "commands": 50, "limited": {}}


def test_it_is_asked_once_a_period_and_other_ticks_go_by():
    keeper = Keeper()
    result = run("side_scan", duration=0.5, controller=keeper, control_period=0.2, **HEAVE)
    begin = result.frames.time[0] - S // 100
    assert [int(row.time) - begin for row in keeper.rows] == [0, S // 5, 2 * S // 5]
    assert result.metrics["controller"]["calls"] == 3


@pytest.mark.parametrize(
    "given",
    [HEAVE | {"control_period": 0.05}, HEAVE | {"step": "chosen"}, {"motion": "nbp1406"}, {}],
    ids=["heave", "steps chosen", "bag", "no motion"],
)
def test_a_replay_of_its_recording_gives_the_same_bits(given, tmp_path, bag):
    keeper = Keeper() if given else lambda row: WinchCommand(payout=208.0 + 0.2 * np.sin(row.tick))
    first = run("side_scan", duration=0.6, controller=keeper, out=tmp_path, **given)
    again = replay(first.bag)
    assert np.ptp(first.frames.payout) > 0.005, "it moves the winch"
    assert again.frames.tobytes() == first.frames.tobytes() and again.verdict.state == "ok"
    with BagReader(first.bag) as recorded:
        commands = [message for message in recorded if message.topic.endswith("winch/command")]
    assert len(commands) == first.metrics["controller"]["commands"]


def test_its_command_is_taken_by_the_tick_that_follows():
    """As a plan's: the same orders at the same times are the same run, to the bit."""

    def order(row):
        return WinchCommand(rate=0.0 if row.time < 0.5 * S else 0.4)

    ours = run("side_scan", duration=1.0, controller=order, control_period=0.25)
    plan = run("side_scan", duration=1.0, winch="0 hold, 0.5 rate 0.4")
    assert ours.frames.tobytes() == plan.frames.tobytes()
    assert ours.frames.payout_setpoint[49] == ours.frames.payout_setpoint[0] < ours.frames.payout_setpoint[50]
    assert ours.frames.command_age[50] == pytest.approx(0.01, abs=1e-8)


def test_without_an_answer_the_command_before_goes_on_and_runs_out():
    answers = [WinchCommand(rate=0.4)]
    result = run("side_scan", duration=1.0, controller=lambda row: answers.pop() if answers else None)
    stale = (result.frames.status & Flag.COMMAND_STALE) != 0
    assert not stale[:49].any() and stale[52:].all(), "winch.command_timeout is 0.5 s"
    assert result.metrics["controller"]["commands"] == 1 and result.metrics["controller"]["calls"] == 100


def test_a_command_may_count_later_in_its_period():
    def late(row):
        return WinchCommand(rate=0.4, time_ns=int(row.time) + S // 10) if row.tick == 0 else None

    result = run("side_scan", duration=0.4, controller=late, control_period=0.2)
    moved = result.frames.payout_setpoint - result.frames.payout_setpoint[0]
    assert moved[8] == 0.0 < moved[11]


def test_what_asks_for_too_much_is_limited_and_counted():
    result = run("side_scan", duration=0.1, controller=lambda row: WinchCommand(rate=99.0))
    assert result.metrics["controller"]["limited"] == {"rate": 10}


def test_the_commands_of_the_bag_are_left_out(tmp_path):
    first = run("side_scan", duration=0.5, controller=lambda row: WinchCommand(rate=0.4), out=tmp_path, **HEAVE)
    held = run("side_scan", first.bag, controller=lambda row: None)
    moved = run("side_scan", first.bag)
    assert np.ptp(held.frames.payout) < 0.01 < np.ptp(moved.frames.payout)


def test_saved_and_gone_on_with_the_parts_are_the_whole(tmp_path):
    path = tmp_path / "state.npz"
    whole = run("side_scan", duration=1.2, controller=Keeper(), **HEAVE)
    first = run("side_scan", duration=0.7, controller=Keeper(), save=path, **HEAVE)
    second = run(None, duration=0.5, controller=Keeper(), resumed=path, **HEAVE)
    assert first.frames.tobytes() + second.frames.tobytes() == whole.frames.tobytes()


def test_it_takes_the_place_of_a_saved_plan(tmp_path):
    path, keeper = tmp_path / "state.npz", Keeper()
    run("side_scan", duration=0.5, winch="0 rate 0.4", save=path)
    under = run(None, duration=0.2, controller=keeper, resumed=path, **HEAVE)
    assert int(keeper.rows[0].time) == under.frames.time[0], "of the motion's clock, not of the state's"
    held = run(None, duration=0.5, controller=lambda row: None, resumed=path)
    assert held.frames.payout_rate[-1] == pytest.approx(0.0, abs=0.01) and "winch" not in held.metrics


def test_after_a_jump_of_the_clock_it_is_asked_a_tick_later(bag):
    for k in range(len(bag) // 2, len(bag)):
        bag[k] = bag[k].moved(40 * S)
    keeper = Keeper()
    result = run("side_scan", "nbp1406", controller=keeper)
    assert result.metrics["clock_jumps"] == 1
    asked, (at,) = {int(row.time) for row in keeper.rows}, np.flatnonzero(np.diff(result.frames.time) > S)
    assert set(result.frames.time[:-1].tolist()) - asked == {int(result.frames.time[at])}, "no row of the other clock"
    assert all(int(row.time) in {*result.frames.time.tolist(), keeper.rows[0].time} for row in keeper.rows)


def changed():
    command = WinchCommand(rate=0.1)
    object.__setattr__(command, "rate", float("nan"))
    return command


FAULTS = {
    "nan": (
        lambda row: WinchCommand(rate=float("nan")),
        r"raised InputError: WinchCommand.rate = nan m/s is not a number: .* give a number in \[-1e\+05, 1e\+05\] m/s",
    ),
    "nan behind its back": (
        lambda row: changed(),
        r"returned what is no command. WinchCommand.rate = nan m/s is not a number: nothing",
    ),
    "too large": (lambda row: WinchCommand(payout=1e6), r"payout = 1e\+06 m is outside \[-1e\+05, 1e\+05\] m"),
    "its own": (lambda row: 1 / 0, r"raised ZeroDivisionError: division by zero. The run ended there; correct the"),
    "a number": (
        lambda row: 0.5,
        r"returned 0.5, a float and no command. The run ended there; return WinchCommand\(rate",
    ),
    "of the past": (
        lambda row: WinchCommand(rate=0.1, time_ns=int(row.time)),
        r"time_ns = (\d+) ns, outside \(\1, \d+\] ns, the control period that begins. The run ended there; leave",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_ends_the_run_and_says_so(fault):
    fails, text = FAULTS[fault]
    with pytest.raises(ControllerError, match=r"^controller, after 0.200 s of the run: .*" + text) as caught:
        run("side_scan", duration=0.5, controller=lambda row: fails(row) if row.tick >= 20 else None)
    result = caught.value.run
    assert len(result.frames) == 20 and result.verdict.state == "failed"
    assert result.problem == result.metrics["problem"] == str(caught.value)


def test_what_was_recorded_before_a_fault_stays_and_is_replayed(tmp_path):
    def controller(row):
        return WinchCommand(rate=0.3) if row.tick < 20 else 1 / 0

    with pytest.raises(ControllerError, match="division by zero") as caught:
        run("side_scan", duration=0.5, controller=controller, out=tmp_path, save=tmp_path / "state.npz")
    result = caught.value.run
    assert not (tmp_path / "state.npz").exists() and "its state was not saved" in result.problem
    report = json.loads((tmp_path / "summary.json").read_text("utf-8"))
    assert str(caught.value) in report["problem"] and report["verdict"]["state"] == "failed"
    again = replay(result.bag)
    assert again.frames.tobytes() == result.frames.tobytes() and again.verdict.state == "ok"


def test_a_fault_on_the_first_row_leaves_no_frames():
    with pytest.raises(ControllerError, match="after 0.000 s of the run: raised KeyError") as caught:
        run("side_scan", duration=0.1, controller=lambda row: {}["gain"], **HEAVE)
    assert len(caught.value.run.frames) == 0 and isinstance(caught.value.__cause__, KeyError)


def test_what_it_cannot_be_given_with_is_refused():
    def nothing(row):
        return None

    for given, text in (
        ({"controller": 3}, "controller = 3 is a int, no callable; nothing was simulated. Give a function"),
        ({"controller": nothing, "winch": "0 hold"}, "winch = '0 hold' both command the winch: nothing was simulated"),
        ({"controller": nothing, "check": True}, "check=True would run a second time"),
        ({"control_period": 0.1}, "control_period = 0.1 s was given without a controller: nothing was simulated"),
        ({"controller": nothing, "control_period": "1"}, "control_period = '1' is a str, no number; nothing was"),
        (
            {"controller": nothing, "control_period": 0.015},
            "control_period = 0.015 s is no whole number of ticks of 0.01 s; nothing was simulated. Give a multiple",
        ),
        ({"controller": nothing, "control_period": float("nan")}, "control_period = nan s is no whole number"),
        ({"controller": nothing, "control_period": 0.0}, "control_period = 0 s is no whole number"),
    ):
        with pytest.raises(ControllerError, match=text):
            run("side_scan", duration=0.1, **given)
