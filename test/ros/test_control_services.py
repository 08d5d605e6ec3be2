"""Pause, step, save, restore, reset and record by service, over a real network, in both time modes."""

from __future__ import annotations

import importlib.util
import time
from types import SimpleNamespace

import pytest
from conftest import COMPILED, ns, poll
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from cable_sim_ros.ros.parameters import settle
from cable_sim_ros.ros.services.control import SimulationControl

pytestmark = COMPILED


def test_in_real_time_the_tow_is_saved_and_restored_and_time_does_not_stand(world):
    ears = world.ears()
    ship = world.ship(ears).sail()
    root = world.folder / "states"
    node = world.node(recording__root=str(root), recording__least_free=0.0).until("running")
    if importlib.util.find_spec("simulation_interfaces") is None:
        assert "simulation_interfaces is not installed: its services are not offered" in node.text
    for answer in (ears.ask("pause", True), ears.ask("step")):
        assert answer[0] is False and answer[1].startswith("time_mode is realtime: the clock of the motion drives")
    missing = ears.ask("restore")
    assert missing[0] is False and "state.npz: cannot be read (No such file or directory)" in missing[1]
    assert not root.exists() and node.state()["state"] == "running"
    saved, text = ears.ask("save")
    assert saved and text.endswith("states/state.npz") and [path.name for path in root.iterdir()] == ["state.npz"]
    restored, text = ears.ask("restore")
    assert restored, text
    assert restored and "it goes on at the present, and the winch holds until it is commanded" in text
    assert node.state()["state"] == "running"
    assert "not a name for a state file" in ears.set("state_file", "../x")
    assert ears.set("state_file", "broken") == ""
    (root / "broken.npz").write_bytes(b"x")
    refused, text = ears.ask("restore")
    assert refused is False and "broken.npz: is no saved simulation; nothing was loaded" in text
    ship.silent = {"imu", "odometry"}
    assert node.stop() == 0


def test_in_lockstep_a_step_is_answered_when_it_is_done(world):
    ears = world.ears()
    ship = world.ship(ears)
    clocks = ears.listen(Clock, "/clock")
    parameters = {"recording__root": str(world.folder), "recording__least_free": 0.0, "publish__state_rate": 0.0}
    parameters["lockstep__wait"] = 600.0  # s: a step without motion stands for as long as this test lives
    node = world.node(time_mode="lockstep", lockstep__paused=True, lockstep__rate=0.0, **parameters).until("waiting")
    poll(lambda: clocks, "a clock")
    refused, text = ears.ask("save")
    assert refused is False and text == "the node is waiting: there is no tow under way; nothing was saved"

    def sail(first: int, last: int) -> None:
        for k in range(first, last):
            for message, topic in zip(ship.messages(10**9 + 20_000_000 * k, 0.02 * k), (ship.imu, ship.odom)):
                topic.publish(message)

    poll(lambda: ship.odom.get_subscription_count(), "the node's ears")
    sail(0, 100)
    assert ears.set("lockstep.steps", 50) == ""
    assert ears.ask("step") == (True, "50 of 50 ticks done")
    # the answer may be here before the last clock: one that stands is said again and again
    poll(lambda: clocks[-1].clock.nanosec and clocks[-1] == clocks[-2] == clocks[-3], "the clock after it")
    stamp = ns(clocks[-1].clock)
    saved, text = ears.ask("save")
    assert saved, text
    assert ears.ask("step") == (True, "50 of 50 ticks done")
    later = poll(lambda: ns(clocks[-1].clock) > stamp and ns(clocks[-1].clock), "a later clock")
    restored, text = ears.ask("restore")
    assert restored and text.endswith("the clock goes back to it")
    poll(lambda: ns(clocks[-1].clock) == stamp < later, "the clock goes back")
    running, text = ears.ask("pause", False)
    assert running and text.startswith("running, /clock ")
    refused, text = ears.ask("step")
    assert refused is False and text == "it runs; pause it first, by ~/pause with data: true"
    paused, text = ears.ask("pause", True)
    assert paused and text.startswith("paused, /clock ")
    assert ears.set("lockstep.steps", 500) == "", "more than there is motion for"
    answered = ears.begin(Trigger, "cable_sim/step", Trigger.Request())
    poll(lambda: int(ears.task("lockstep")[2].get("steps_left", "0")) > 50, "this step, not one of before")
    assert ears.ask("pause", True)[0], "is heard while a step is under way, as timers and parameters are"
    text = poll(answered.done, "its answer") and answered.result().message
    assert text.endswith("of 500 ticks done: the rest was dropped by ~/pause, ~/reset or ~/restore")
    assert ears.ask("reset")[0]
    assert ears.ask("record", True)[0] and "messages in" in ears.ask("record", False)[1]
    assert ears.ask("record", False) == (False, "nothing was recorded")
    assert node.stop() == 0


class Stepped:
    """A session in lockstep that does a tick when it is asked to."""

    lockstep = paused = True
    state, problem, steps_left = "running", "", 0

    def step(self, count: int) -> tuple[bool, str]:
        self.steps_left = count
        return True, ""

    def pause(self, on: bool) -> tuple[bool, str]:
        self.steps_left = 0
        return True, ""

    def restore(self, path) -> tuple[bool, str]:
        return False, "no such file"


@pytest.fixture
def control():
    timer = SimpleNamespace(cancel=lambda: None, reset=lambda: None)
    node = SimpleNamespace(session=Stepped(), settings=settle({"lockstep.wait": 2.0}), report_state=lambda: None)
    node.create_service, node.create_timer = lambda *given, **named: None, lambda *given, **named: timer
    node.get_logger = lambda: SimpleNamespace(info=lambda text: None)
    node.get_parameter = lambda name: SimpleNamespace(value="state")
    return SimulationControl(node)


def answer(step, *events) -> tuple[bool, str]:
    """What a step answers, each event between two looks of it."""
    for event in events:
        assert step.send(None) is None, "it waits"
        event()
    with pytest.raises(StopIteration) as end:
        step.send(None)
    return end.value.value


def test_a_step_that_does_not_end_by_itself_is_answered_with_the_reason(control, monkeypatch):
    session, now = control.node.session, [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def does(left=None, after=0.0, **fields):
        def happen():
            now[0] += after
            vars(session).update(fields, **({} if left is None else {"steps_left": left}))

        return happen

    assert answer(control.step(3), does(2), does(0)) == (True, "3 of 3 ticks done")
    slow = [does(k, after=8.9) for k in (2, 1, 0)]
    assert answer(control.step(3), *slow) == (True, "3 of 3 ticks done"), "each within its bound"
    stuck, text = answer(control.step(3), does(2), does(after=9.1))
    assert not stuck and text == (
        "1 of 3 ticks done: nothing has moved for 9 s (see the task lockstep of /diagnostics). They are still to be "
        "done; ~/pause with data: true drops them"
    )
    text = answer(control.step(3), does(state="waiting"), does(after=9.1))[1]
    assert "nothing has moved for 9 s (there is no motion yet)" in text
    session.state = "running"
    dropped = (False, "1 of 3 ticks done: the rest was dropped by ~/pause, ~/reset or ~/restore")
    assert answer(control.step(3), does(2), lambda: control.pause(True)) == dropped
    assert answer(control.step(3), does(2), control.restore, does(0)) == (True, "3 of 3 ticks done"), "it was refused"
    halts = does(0, state="halted", problem="the solver gave up")
    assert answer(control.step(3), does(2), halts) == (False, "the solver gave up")
    session.state = "running"
    assert answer(control.step(3), does(2, state="ready")) == (False, "1 of 3 ticks done: the node is ready")
