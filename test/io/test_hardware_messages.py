"""The messages of ros2_control's hardware component, one by one, and a controller whose command is equal to the state.

The component is the stand-in of hardware_component.py; the winch's commands are the compiled ones.
"""

from math import inf, isnan, nan

import numpy as np
import pytest
from hardware_component import INTERFACES, Component, Joint, Message
from test_commands import NOW, S, command, pushed

from cable_sim_ros.io.messages.commands import CommandIngest
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.winch import DRUM, WINCH
from cable_sim_ros.physics.winch_command import command as carry

pytestmark = pytest.mark.check

STEP = S // 100


def joint(*commands):
    return Joint(commands, INTERFACES)


def component(commands="velocity", drum=True, threshold=None, **others):
    """A system with the joint `payout`, in front of the drum where there is one, and others as they are given."""
    joints = {"payout": joint(*commands.split())} | ({"drum": joint()} if drum else {}) | others
    return Component(joints, {} if threshold is None else {"trigger_joint_command_threshold": str(threshold)})


def sent(it, **values):
    """What the component sends after a controller wrote the values, as CDR bytes."""
    it.command |= {key.replace("__", "/"): value for key, value in values.items()}
    message = it.write()
    return command(NOW, message.position, message.velocity, message.name, message.effort)


# what is sent -> what comes of it: None nothing, (pay-out, rate) a command, a text the cause of refusal

RATE, LENGTH = {"payout__velocity": 0.3}, {"payout__position": 455.0}
ONE_BY_ONE = {
    "velocity claimed": (component(drum=False), RATE, (nan, 0.3)),
    "velocity, drum named without an entry": (component(), RATE, (nan, 0.3)),
    "position, drum named without an entry": (component("position"), LENGTH, (455.0, nan)),
    "both claimed, both written": (component("position velocity"), LENGTH | RATE, (455.0, 0.3)),
    "both claimed, velocity alone written": (component("position velocity"), RATE, (nan, 0.3)),
    "both claimed, position alone written": (component("position velocity"), LENGTH, (455.0, nan)),
    "no controller wrote yet: NaN": (component(), {}, None),
    "both claimed, none written: NaN": (component("position velocity"), {}, None),
    "no command interface at all": (component("", threshold=-1), {}, None),
    "effort claimed, none written": (component("effort"), {}, None),
    "effort claimed and written": (component("effort"), {"payout__effort": 900.0}, "effort_only"),
    "velocity and effort written": (component("velocity effort"), RATE | {"payout__effort": 900.0}, (nan, 0.3)),
    "another joint, also by velocity": (
        component(crane=joint("velocity"), drum=False),
        RATE | {"crane__velocity": -7.0},
        (nan, 0.3),
    ),
    "another joint, ours not written": (component(crane=joint("velocity")), {"crane__velocity": -7.0}, None),
    "another joint by effort alone, ours not written": (
        component(brake=joint("velocity", "effort"), drum=False),
        {"brake__velocity": 0.0, "brake__effort": 900.0},
        None,
    ),
    "another joint without a command interface": (component(crane=joint()), RATE, "array_length"),
    "another joint by position": (component(crane=joint("position")), RATE | {"crane__position": 1.0}, "array_length"),
    "a controller that divides by zero": (component(), {"payout__velocity": inf}, "not_finite"),
    "a rate in encoder counts": (component(), {"payout__velocity": 3e5}, "out_of_range"),
    "no joint payout": (Component({"winch": joint("velocity")}), {"winch__velocity": 0.3}, "joint_name"),
}


@pytest.mark.parametrize("case", ONE_BY_ONE)
def test_each_message_of_the_component_is_what_it_means(case):
    it, values, wanted = ONE_BY_ONE[case]
    ingest = CommandIngest(make_inputs())
    ingest.take(command(NOW - S, velocity=[0.1]), 0, NOW - S)
    cause = ingest.take(sent(it, **values), 5, NOW)
    if isinstance(wanted, str):
        assert cause == wanted and ingest.no_command == 0 and ingest.accepted == 1
        return
    assert cause == "" and not ingest.refused
    assert ingest.no_command == (wanted is None) and ingest.accepted == 2 - (wanted is None)
    found = [row[1:] for row in pushed(ingest.inputs)]
    assert np.array_equal(found, [(nan, 0.1), *([wanted] if wanted else [])], equal_nan=True)
    if wanted is None:
        assert ingest.last.rate == 0.1 and ingest.last_arrival == 0, "the command before goes on"


def test_what_the_component_sends_has_the_entries_of_its_interfaces_alone():
    assert component().write() == Message(["payout", "drum"], [], [pytest.approx(nan, nan_ok=True)], [])
    it = component("position velocity", crane=joint("velocity"))
    it.command |= {"payout/position": 1.0, "payout/velocity": 2.0, "crane/velocity": 3.0}
    assert it.write() == Message(["payout", "drum", "crane"], [1.0], [2.0, 3.0], [])


def test_arrays_filled_up_with_nan_are_understood_too():
    """As a change upstream would send them, topic_based_hardware_interfaces #101."""
    ingest = CommandIngest(make_inputs())
    names = ["drum", "payout"]
    assert ingest.take(command(NOW, [nan, nan], [nan, 0.3], names, [nan, nan]), 0, NOW) == ""
    assert ingest.take(command(NOW, [nan, nan], [nan, nan], names, [nan, nan]), 0, NOW) == ""
    assert ingest.last.rate == 0.3 and (ingest.accepted, ingest.no_command) == (1, 1)


def test_it_reads_our_two_joints_by_name_in_any_order():
    it = component()
    it.read(Message(["drum", "payout", "other"], [7.0, 458.0, 0.0], [0.1, nan, 0.0], [12.0, 3e3, 0.0]))
    assert it.state["payout/position"] == 458.0 and it.state["drum/position"] == 7.0
    assert it.state["payout/effort"] == 3e3 and isnan(it.state["payout/velocity"]), "NaN is not taken"


def test_a_joint_without_a_state_that_we_publish_fails_there():
    it = Component({"payout": Joint(("velocity",), ("position", "velocity"))})
    with pytest.raises(RuntimeError, match="payout/effort"):
        it.read(Message(["payout"], [1.0], [0.0], [3e3]))


# a controller whose command is equal to the state


def driven(it, write, seconds=4.0, timeout=0.5, cycle=2):
    """Rates [m/s] of the winch at 100 Hz and whether stale, messages sent; write(component, step): the controller."""
    ingest, messages = CommandIngest(make_inputs()), 0
    winch, drum = records(1, WINCH)[0], records(1, DRUM)[0]
    drum.ramp, drum.max_rate, drum.timeout, drum.payout_0 = 20.0, 5.0, timeout, 450.0
    drum.min_reach, drum.max_reach = -400.0, 100.0
    rates, stale = [], []
    for step in range(int(seconds * 100)):
        time = NOW + step * STEP
        if step % cycle == 0:
            write(it, step)
            message = it.write()
            if message is not None:
                messages += 1
                data = command(time, message.position, message.velocity, message.name)
                assert ingest.take(data, time, time) == ""
        ingest.inputs.command_seen[:] = ingest.inputs.command_head
        carry(time + STEP, 0.01, drum, ingest.inputs, winch)
        it.read(Message(["payout", "drum"], [450.0 + winch.commanded, 0.0], [winch.command_rate, 0.0], [3e3, 0.0]))
        rates.append(float(winch.command_rate))
        stale.append(bool(winch.stale))
    return np.array(rates), np.array(stale), messages


def rate(it, step):
    it.command["payout/velocity"] = 0.3


def test_a_rate_that_is_suppressed_runs_into_the_time_out_again_and_again():
    """Sent until the winch has it, then not: half a second of 0.3 m/s, a stop, and from the start again."""
    rates, stale, messages = driven(component(), rate)
    stops = np.flatnonzero((rates[1:] < 0.3) & (rates[:-1] == 0.3))
    assert len(stops) >= 6 and (np.diff(stops) < 60).all() and stale.sum() >= 6
    assert messages <= 4 * len(stops), "of 200 cycles"


@pytest.mark.parametrize(
    "how",
    [
        {"threshold": -1},  # every command is sent
        {"commands": "position velocity"},  # one that is NaN is never equal
    ],
    ids=["threshold below zero", "position claimed and not written"],
)
def test_a_rate_lasts_where_each_cycle_sends_it(how):
    rates, stale, messages = driven(component(**how), rate)
    assert messages == 200 and not stale.any() and (rates[5:] == 0.3).all()


def test_a_rate_lasts_within_a_longer_time_out_and_then_a_dead_controller_goes_unseen_as_long():
    rates, stale, messages = driven(component(), rate, timeout=60.0)
    assert messages <= 4 and not stale.any() and (rates[5:] == 0.3).all()


def test_a_stop_is_sent_and_lasts_though_it_is_suppressed():
    def stop(it, step):
        it.command["payout/velocity"] = 0.3 if step < 100 else 0.0

    rates, stale, _ = driven(component(threshold=1e-5), stop)
    assert (rates[110:] == 0.0).all() and not stale[110:].any()


def test_a_stop_is_lost_where_the_winch_stands_because_it_was_stale():
    """Nothing to lose: the command is a stop, and it stands."""
    rates, stale, messages = driven(component(), lambda it, step: it.command.update({"payout/velocity": 0.0}), 1.0)
    assert messages == 1 and (rates == 0.0).all() and not stale.any(), "NaN states differ once, then it is equal"


def test_a_length_is_reached_and_held_though_it_is_suppressed():
    def length(it, step):
        it.command["payout/position"] = 451.0

    rates, stale, messages = driven(component("position"), length)
    assert messages < 60 and (rates[200:] == 0.0).all()
    assert rates.sum() * 0.01 == pytest.approx(1.0, abs=0.01)


def test_the_end_of_a_trajectory_is_held_and_stale_where_it_is_suppressed_and_not_where_it_is_sent():
    def trajectory(it, step):
        it.command["payout/position"] = 450.0 + min(step, 100) * 0.003

    _, stale, _ = driven(component("position"), trajectory)
    assert stale[200:].all() and not stale[:100].any()
    rates, stale, _ = driven(component("position", threshold=-1), trajectory)
    assert not stale.any() and rates.sum() * 0.01 == pytest.approx(0.3, abs=1e-3)


def test_nan_after_a_controller_lets_the_rate_run_out():
    """A component that is emptied again: as silence, the rate lasts its time-out."""

    def emptied(it, step):
        it.command["payout/velocity"] = 0.3 if step < 100 else nan

    rates, stale, messages = driven(component(threshold=-1), emptied)
    assert messages == 200 and (rates[100:145] == 0.3).all() and (rates[160:] == 0.0).all() and stale[160:].all()


def test_a_length_that_a_controller_left_behind_hides_the_rate_of_the_next():
    """Both claimed, a position controller gone, a velocity controller on: the component still sends the length."""

    def switched(it, step):
        it.command["payout/position"] = 450.2
        it.command["payout/velocity"] = 0.3 if step >= 200 else nan

    rates, _, _ = driven(component("position velocity"), switched)
    assert (rates[200:] == 0.0).all()
