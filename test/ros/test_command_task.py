"""The task `command` of /diagnostics: what a controller's author sees of his commands. No network."""

import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
from test_commands import NOW, S, command

from cable_sim_ros.io.messages.commands import CommandIngest
from cable_sim_ros.io.messages.messages import CAUSES
from cable_sim_ros.physics.heave_compensation import Setpoint
from cable_sim_ros.physics.heave_filter import MotionInput
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.physics.winch import DRUM
from cable_sim_ros.physics.winch_drive import BRAKE
from cable_sim_ros.ros.report.diagnostics import OK, WARN, Watch
from cable_sim_ros.ros.timing import Distance

pytestmark = pytest.mark.check

SECOND = 10**9


@pytest.fixture
def passed(monkeypatch):
    """Function: let so many seconds of the process's clock pass."""
    hands = [1000 * SECOND]
    monkeypatch.setattr(time, "monotonic_ns", lambda: hands[0])
    return lambda seconds: hands.append(hands.pop() + round(seconds * SECOND))


def watched(flags=Flag.NONE, payout=450.0, mode=0):
    """(ingest, its task): a winch with 20 to 465 m of travel that stands at ``payout``."""
    drum = records(1, DRUM)[0]
    drum.payout_0, drum.max_rate, drum.min_reach, drum.max_reach = 450.0, 2.0, -430.0, 15.0
    commands = CommandIngest(make_inputs(), drum)
    frame = np.zeros((), TICK_OUTPUT)
    frame["payout"], frame["status"], frame["winch_mode"] = payout, flags, mode
    session = SimpleNamespace(
        intake=SimpleNamespace(commands=commands),
        node=SimpleNamespace(motion=MotionInput()),
        distance=Distance(30_000_000, 500_000_000),
        scene=SimpleNamespace(winch=SimpleNamespace(command_delay=0.2), ship=Ship(), setpoint=Setpoint()),
    )
    watch = Watch(session)
    return commands, lambda: watch._command(SimpleNamespace(latest=frame), 5 * SECOND)


def test_before_there_is_a_winch():
    session = SimpleNamespace(node=SimpleNamespace(motion=MotionInput()), scene=SimpleNamespace(ship=Ship()))
    task = Watch(session)._command(None, 0)
    assert (task.level, task.message) == (OK, "not yet listening")


def test_no_command_yet():
    _, task = watched()
    status = task()
    assert (status.level, status.message) == (OK, "no command yet: the winch holds")
    assert status.values["newest"] == "none" and status.values["age_s"] == "never" and status.values["lag_clock"] == "-"
    assert status.values["remaining_out_m"] == "15.000" and status.values["remaining_in_m"] == "430.000"
    assert status.values["data_clock_lead_ms"] == "30.000" and status.values["delay_ms"] == "200.000"


def test_a_mode_in_which_commands_move_nothing():
    commands, task = watched(mode=BRAKE)
    commands.take(command(NOW, velocity=[-0.5]), 4 * SECOND, NOW)
    status = task()
    assert status.values["mode"] == "brake" and status.level == OK
    assert status.message.startswith("mode brake: commands and set-point law do not move the drum; 15.00 m can be paid")


def test_a_good_command():
    commands, task = watched()
    commands.take(command(NOW - S // 4, velocity=[-0.5]), 4 * SECOND, NOW)
    status = task()
    assert (status.level, status.message) == (
        OK,
        "commanded: rate -0.5 m/s; 15.00 m can be paid out and 430.00 m hauled in",
    )
    assert (
        status.values["mode"] == "rate" and status.values["age_s"] == "1.000" and status.values["lag_ms"] == "250.000"
    )
    assert status.values["lag_largest_ms"] == "250.000" and status.values["stale"] == "false"


@pytest.mark.parametrize(
    "flags, given, text",
    [
        (
            Flag.COMMAND_STALE,
            {"velocity": [0.5]},
            "command stale: the newest, rate 0.5 m/s, is older than winch.command_timeout, the winch "
            "brakes and holds: 450.00 m out now",
        ),
        (
            Flag.NONE,
            {"velocity": [3.0]},
            "a rate of 3 m/s is beyond winch.max_rate = 2 m/s: carried out at that; 15.00 m can be paid out and 430.00 "
            "m hauled in",
        ),
        (
            Flag.COMMAND_LIMITED,
            {"velocity": [2.0]},
            "the newest, rate 2 m/s, asks for more than the winch can do: 15.00 m can be paid out and 430.00 m hauled "
            "in",
        ),
        (Flag.NONE, {"velocity": [np.inf]}, "1 command refused in the last second: " + CAUSES["not_finite"]),
    ],
    ids=["stale", "clamped", "limited", "refused"],
)
def test_what_is_wrong_is_warned_of(passed, flags, given, text):
    commands, task = watched(flags)
    commands.take(command(NOW, **given), 4 * SECOND, NOW)
    status = task()
    assert (status.level, status.message) == (WARN, text)
    passed(1.1)
    task()
    assert task().level == (WARN if flags else OK), "what was counted is new for a second, a flag as long as it lasts"


def test_a_controller_that_is_not_active_is_no_warning_and_is_shown(passed):
    commands, task = watched()
    for _ in range(3):
        commands.take(command(NOW, [np.nan], [np.nan]), 4 * SECOND, None)
    status = task()
    assert (status.level, status.message) == (
        OK,
        "no command yet: the winch holds; messages without a command in the last second: 3, is the controller active?",
    )
    assert status.values["no_command"] == "3" and not [key for key in status.values if key.startswith("refused")]
    commands.take(command(NOW, velocity=[0.5]), 4 * SECOND, NOW)
    passed(1.1)
    task()
    assert task().message.startswith("commanded: rate 0.5 m/s; 15.00 m") and "without" not in task().message


def test_messages_of_nothing_after_a_command_are_said_where_it_is_stale():
    commands, task = watched(Flag.COMMAND_STALE)
    commands.take(command(NOW, velocity=[0.5]), 4 * SECOND, NOW)
    commands.take(command(NOW), 4 * SECOND, NOW)
    status = task()
    assert status.level == WARN and status.message.endswith(
        "450.00 m out now; messages without a command in the last second: 1, is the controller active?"
    )


def test_a_rate_beside_a_length_is_shown():
    commands, task = watched()
    commands.take(command(NOW, [455.0], [0.3]), 4 * SECOND, NOW)
    assert task().values["newest"] == "length 455 m, not the rate 0.3 m/s beside it"
    commands.take(command(NOW, [455.0], [0.0]), 4 * SECOND, NOW)
    assert task().values["newest"] == "length 455 m"


def test_twenty_metres_out_given_as_a_length_is_seen():
    commands, task = watched(payout=300.0)
    commands.take(command(NOW, [20.0]), 4 * SECOND, NOW)
    assert task().message == (
        "commanded: length 20 m, 280.0 m to haul in; 165.00 m can be paid out and 280.00 m hauled in"
    )
    commands.take(command(NOW, [300.05]), 4 * SECOND, NOW)
    assert task().message.startswith("commanded: length 300.05 m; 165.00 m")
    commands.take(command(NOW, [-20.0]), 4 * SECOND, NOW)
    status = task()
    assert status.values["newest"] == "length -20 m" and status.values["clamped: length"] == "1"
    assert status.message == (
        "a length of -20 m is outside the travel, 20.00 to 465.00 m of pay-out: the winch goes to 20.00 m; 165.00 m "
        "can be paid out and 280.00 m hauled in"
    )
