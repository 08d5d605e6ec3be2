"""The ROS 2 standard `simulation_interfaces` (2.1) on top of `control.py`, where that package is installed.

Services under the node's own name, as Gazebo has them, so that two simulators on one graph stay apart; remap them for a
tool that looks elsewhere. What is offered and refused, with the result codes: docs/control.md. The message packages
come as arguments, so that nothing here needs them to be imported.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

from rclpy.lifecycle import TransitionCallbackReturn

from ...terminal import clean
from ...version import __version__
from .control import SimulationControl

PACKAGE = "simulation_interfaces"
SERVICES = ("GetSimulatorFeatures", "GetSimulationState", "SetSimulationState", "StepSimulation", "ResetSimulation")
MAX_STEPS = 1_000_000  # as lockstep.steps


def service_name(name: str) -> str:
    """snake_case, as the standard's simulators name their services."""
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in name).lstrip("_")


def offer(control: SimulationControl) -> Standard | None:
    """Make the services of the package, or say that it is not there."""
    try:
        msg, srv = (import_module(f"{PACKAGE}.{part}") for part in ("msg", "srv"))
    except ImportError:
        control.node.get_logger().info(
            clean(f"package {PACKAGE} is not installed: its services are not offered; ~/pause, ~/step and ~/reset are")
        )
        return None
    standard = Standard(control, msg, srv)
    for name in SERVICES:
        service = service_name(name)
        control.offer(getattr(srv, name), service, getattr(standard, service))
    control.node.get_logger().info(clean(f"services of {PACKAGE} under {control.node.get_fully_qualified_name()}"))
    return standard


class Standard:
    """Handlers of the services; msg, srv: the package's own modules."""

    def __init__(self, control: SimulationControl, msg: ModuleType, srv: ModuleType) -> None:
        self.control, self.srv = control, srv
        self.State, self.Result, self.Features = msg.SimulationState, msg.Result, msg.SimulatorFeatures

    @property
    def lockstep(self) -> bool:
        """Is time ours to hold?"""
        return bool(self.control.node.session.lockstep)

    @property
    def state(self) -> int:
        """One of the STATE constants."""
        session = self.control.node.session
        if session.state not in ("waiting", "running"):
            return int(self.State.STATE_STOPPED)
        return int(self.State.STATE_PAUSED if session.paused else self.State.STATE_PLAYING)

    # ---- services

    def get_simulator_features(self, request: Any, response: Any) -> Any:
        """What of the standard there is; more in lockstep than in real time."""
        has = self.Features
        features = [has.SIMULATION_RESET, has.SIMULATION_RESET_STATE]
        features += [has.SIMULATION_STATE_GETTING, has.SIMULATION_STATE_SETTING]
        if self.lockstep:
            features += [has.SIMULATION_RESET_TIME, has.SIMULATION_STATE_PAUSE]
            features += [has.STEP_SIMULATION_SINGLE, has.STEP_SIMULATION_MULTIPLE]
        response.features.features = sorted(features)
        response.features.custom_info = (
            f"cable_sim_ros {__version__}, time_mode {'lockstep' if self.lockstep else 'realtime'}: a cable tow; save "
            f"and restore by ~/save and ~/restore; see docs/control.md"
        )
        return response

    def get_simulation_state(self, request: Any, response: Any) -> Any:
        """STOPPED, PLAYING or PAUSED, with why where it stopped by itself."""
        response.state.state = self.state
        return self._answer(response, self.Result.RESULT_OK, self.control.node.session.problem)

    def set_simulation_state(self, request: Any, response: Any) -> Any:
        """Play, pause, stop or quit."""
        target, state = request.state.state, self.State
        if target == self.state:
            return self._answer(response, self.srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE, "")
        change = {
            state.STATE_PLAYING: self._play,
            state.STATE_PAUSED: self._pause,
            state.STATE_STOPPED: self._stop,
            state.STATE_QUITTING: self._quit,
        }.get(target)
        if change is None:
            text = f"state {target} is none that can be set: give 0 (stopped), 1 (playing), 2 (paused) or 3 (quitting)"
            return self._answer(response, self.Result.RESULT_FEATURE_UNSUPPORTED, text)
        return self._answer(response, *change())

    async def step_simulation(self, request: Any, response: Any) -> Any:
        """So many ticks while paused; the answer comes when they are done."""
        result, session, steps = self.Result, self.control.node.session, int(request.steps)
        if not self.lockstep:
            return self._answer(response, result.RESULT_FEATURE_UNSUPPORTED, session.step(steps)[1])
        if self.state == self.State.STATE_STOPPED:
            text = f"the node is {session.state}: set the state to paused first"
            return self._answer(response, result.RESULT_INCORRECT_STATE, text)
        if not 1 <= steps <= MAX_STEPS:
            text = f"steps = {steps} is outside [1, {MAX_STEPS}]: nothing was stepped"
            return self._answer(response, result.RESULT_OPERATION_FAILED, text)
        done, text = await self.control.step(steps)
        return self._answer(response, result.RESULT_OK if done else result.RESULT_OPERATION_FAILED, text)

    def reset_simulation(self, request: Any, response: Any) -> Any:
        """The state alone, from the static equilibrium; in lockstep also everything, the time with it."""
        scopes, result = self.srv.ResetSimulation.Request, self.Result
        scope = request.scope or scopes.SCOPE_ALL
        if scope == scopes.SCOPE_STATE:
            done, text = self.control.reset()
        elif scope & scopes.SCOPE_STATE and scope & scopes.SCOPE_TIME and self.lockstep:
            done, text = self.control.begin_anew()
        else:
            text = (
                f"scope = {request.scope} cannot be reset: give {scopes.SCOPE_STATE} (state)"
                + (f", or {scopes.SCOPE_ALL} (all)" if self.lockstep else ": the time is that of the motion's stamps")
                + "; nothing was reset"
            )
            return self._answer(response, result.RESULT_FEATURE_UNSUPPORTED, text)
        if not done and self.control.node.session.state in ("unconfigured", "ready", "closed"):
            return self._answer(response, result.RESULT_INCORRECT_STATE, text)
        return self._answer(response, result.RESULT_OK if done else result.RESULT_OPERATION_FAILED, text)

    # ---- changes of state: (result code, text)

    def _play(self) -> tuple[int, str]:
        paused = self.state == self.State.STATE_PAUSED
        if self.lockstep:
            done = self.control.pause(False)
            if paused:
                return self._judged(done)
        return self._begin()

    def _pause(self) -> tuple[int, str]:
        done, text = self.control.pause(True)
        if not done:
            return (self._failed() if self.lockstep else int(self.Result.RESULT_FEATURE_UNSUPPORTED)), text
        return self._begin() if self.state == self.State.STATE_STOPPED else self._judged((done, text))

    def _begin(self) -> tuple[int, str]:
        """From stopped, by activation or, where a tow stopped by itself, by a reset."""
        node = self.control.node
        if node.session.state in ("halted", "failed"):
            return self._judged(self.control.reset())
        if node.session.state != "ready":
            return self._failed(), (
                f"the node is {node.session.state}: ros2 lifecycle set {node.get_fully_qualified_name()} configure"
            )
        done = node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        return self._judged((done, "" if done else "the node could not be activated: see its log"))

    def _stop(self) -> tuple[int, str]:
        done = self.control.node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
        return self._judged((done, "" if done else "the node could not be deactivated: see its log"))

    def _quit(self) -> tuple[int, str]:
        if self.control.on_quit is None:
            return self._failed(), "this process is not the node's own: end it yourself"
        if self.state != self.State.STATE_STOPPED:
            self._stop()
        self.control.quit_soon()
        return int(self.Result.RESULT_OK), ""

    def _failed(self) -> int:
        return int(self.srv.SetSimulationState.Response.STATE_TRANSITION_ERROR)

    def _judged(self, done: tuple[bool, str]) -> tuple[int, str]:
        return (int(self.Result.RESULT_OK) if done[0] else self._failed()), done[1]

    @staticmethod
    def _answer(response: Any, code: int, text: str) -> Any:
        response.result.result, response.result.error_message = int(code), text
        return response
