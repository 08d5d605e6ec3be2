"""The standard simulation_interfaces on the wire, with type support made of its own definitions; and where the package
is not there."""

from __future__ import annotations

import importlib
import os
import sys
from types import SimpleNamespace

import pytest
import standard_package
from conftest import COMPILED, LONG, poll
from rclpy.lifecycle import TransitionCallbackReturn as Done

from cable_sim_ros.ros.services.policy import differences
from cable_sim_ros.ros.services.simulation_interfaces import Standard as Handlers
from cable_sim_ros.ros.services.simulation_interfaces import service_name
from cable_sim_ros.ros.timing import NOT_IN_REAL_TIME

pytestmark = [COMPILED, pytest.mark.skipif(bool(standard_package.why_not()), reason=standard_package.why_not())]
OK, UNSUPPORTED, INCORRECT_STATE, FAILED = 1, 0, 3, 4  # of Result.msg
ALREADY, TRANSITION_ERROR = 101, 102  # of SetSimulationState.srv
STOPPED, PLAYING, PAUSED, QUITTING, NO_WORLD = range(5)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Where the package is, importable while this file is tested."""
    path = standard_package.make(tmp_path_factory.mktemp("standard"))
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(str(path))
        yield path
    for name in [name for name in sys.modules if name.partition(".")[0] == standard_package.PACKAGE]:
        del sys.modules[name]


class Standard:
    """The services of one node."""

    def __init__(self, ears) -> None:
        self.ears, self.srv = ears, importlib.import_module("simulation_interfaces.srv")

    def call(self, name: str, **fields):
        kind = getattr(self.srv, name)
        return self.ears.call(kind, f"cable_sim/{service_name(name)}", kind.Request(**fields))

    def result(self, name: str, **fields) -> tuple[int, str]:
        result = self.call(name, **fields).result
        return result.result, result.error_message

    def set(self, state: int) -> tuple[int, str]:
        request = self.srv.SetSimulationState.Request()
        request.state.state = state
        return self.result("SetSimulationState", state=request.state)

    def state(self) -> int:
        return self.call("GetSimulationState").state.state


@pytest.fixture
def standard(world, package):
    path = os.pathsep.join([str(package), world.environment["PYTHONPATH"]])

    def start(**parameters):
        ears = world.ears()
        node = world.node(environment={"PYTHONPATH": path}, **parameters)
        return node, ears, Standard(ears)

    return start


def test_in_lockstep_all_of_it_works(world, standard):
    node, ears, it = standard(time_mode="lockstep", lockstep__paused=True)
    node.until("waiting")
    assert "services of simulation_interfaces under /tow_sim/cable_sim" in node.text
    features = it.call("GetSimulatorFeatures").features
    assert list(features.features) == [20, 21, 22, 24, 25, 26, 31, 32] and not features.spawn_formats
    assert "time_mode lockstep" in features.custom_info and "docs/control.md" in features.custom_info
    assert it.state() == PAUSED and it.set(PAUSED) == (ALREADY, "")
    assert it.result("StepSimulation", steps=3) == (OK, "3 of 3 ticks done")
    code, text = it.result("StepSimulation", steps=0)
    assert code == FAILED and text == "steps = 0 is outside [1, 1000000]: nothing was stepped"
    assert it.set(PLAYING)[0] == OK and it.state() == PLAYING
    code, text = it.result("StepSimulation", steps=1)
    assert code == FAILED and text.startswith("it runs; pause it first")
    assert it.result("ResetSimulation", scope=2) == (OK, "waiting for motion")
    assert it.result("ResetSimulation") == (OK, "/clock 1.000 s; waiting for motion") and it.state() == PAUSED
    code, text = it.result("ResetSimulation", scope=1)
    assert code == UNSUPPORTED and text == "scope = 1 cannot be reset: give 2 (state), or 255 (all); nothing was reset"
    assert it.set(STOPPED)[0] == OK and it.state() == STOPPED and node.state()["state"] == "ready"
    code, text = it.result("StepSimulation", steps=1)
    assert code == INCORRECT_STATE and text == "the node is ready: set the state to paused first"
    assert it.result("ResetSimulation")[0] == INCORRECT_STATE == it.result("ResetSimulation", scope=2)[0]
    assert it.set(PAUSED)[0] == OK and it.state() == PAUSED
    code, text = it.set(NO_WORLD)
    assert code == UNSUPPORTED and text.startswith("state 4 is none that can be set: give 0 (stopped), 1 (playing)")
    poll(lambda: differences(ears.node) == [], "the policy has the services")
    assert it.set(QUITTING) == (OK, "") and node.wait(LONG) == 0


def test_in_real_time_what_needs_time_to_stand_is_refused(package):
    """The handlers by themselves, with the classes of the package."""
    msg, srv = (importlib.import_module(f"simulation_interfaces.{part}") for part in ("msg", "srv"))
    refused = (False, NOT_IN_REAL_TIME)
    session = SimpleNamespace(state="unconfigured", problem="", lockstep=False, paused=False, step=lambda n: refused)
    node = SimpleNamespace(session=session, get_fully_qualified_name=lambda: "/tow_sim/cable_sim")
    resets = iter([(False, "no static start"), (True, "started"), (False, "the node is ready: activate it first")])
    control = SimpleNamespace(node=node, pause=lambda on: refused, reset=lambda: next(resets), on_quit=None)
    it = Handlers(control, msg, srv)

    def result(name, **fields):
        kind = getattr(srv, name)
        answer = getattr(it, service_name(name))(kind.Request(**fields), kind.Response())
        if hasattr(answer, "send"):
            with pytest.raises(StopIteration) as stop:
                answer.send(None)
            answer = stop.value.value
        return answer.result.result, answer.result.error_message

    def set_to(state):
        return result("SetSimulationState", state=msg.SimulationState(state=state))

    features = it.get_simulator_features(None, srv.GetSimulatorFeatures.Response()).features
    assert list(features.features) == [20, 22, 24, 25] and "time_mode realtime" in features.custom_info
    assert it.state == STOPPED and set_to(STOPPED) == (ALREADY, "")
    text = "the node is unconfigured: ros2 lifecycle set /tow_sim/cable_sim configure"
    assert set_to(PLAYING) == (TRANSITION_ERROR, text)
    assert set_to(PAUSED) == result("StepSimulation", steps=1) == (UNSUPPORTED, NOT_IN_REAL_TIME)
    text = "scope = 0 cannot be reset: give 2 (state): the time is that of the motion's stamps; nothing was reset"
    assert result("ResetSimulation") == (UNSUPPORTED, text)
    session.state, session.problem = "halted", "the solver gave up"
    assert result("GetSimulationState") == (OK, "the solver gave up")
    assert set_to(PLAYING) == (TRANSITION_ERROR, "no static start") and set_to(PLAYING) == (OK, "started")
    session.state = "ready"
    assert result("ResetSimulation", scope=2) == (INCORRECT_STATE, "the node is ready: activate it first")
    node.trigger_activate = lambda: Done.FAILURE
    assert set_to(PLAYING) == (TRANSITION_ERROR, "the node could not be activated: see its log")
    session.state, node.trigger_deactivate = "running", lambda: Done.FAILURE
    assert set_to(STOPPED) == (TRANSITION_ERROR, "the node could not be deactivated: see its log")
    assert set_to(QUITTING) == (TRANSITION_ERROR, "this process is not the node's own: end it yourself")
