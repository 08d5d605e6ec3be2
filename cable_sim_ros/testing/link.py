"""The topics and services of a node under test, as the test uses them."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from ..io.commands import encode_command
from ..io.messages import KINDS
from ..ros.params import ParameterError, settle
from ..ros.topics import message_class
from .ears import Ears
from .errors import TowError
from .feeder import AHEAD, Feeder
from .frames import FrameBox
from .motion import SECOND, Message

NAMESPACE, NODE = "/tow_sim", "/tow_sim/cable_sim"
COMMAND = KINDS["command"][1]
SERVICE = 30.0  # s for an answer


class Link:
    """Hears one node and speaks to it. TowError for parameters that it could not use."""

    def __init__(
        self, domain: int, parameters: Mapping[str, Any], environment: Mapping[str, str | None], lockstep: bool
    ) -> None:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # cautions of a scene are in the node's log
                settings = settle(dict(parameters))
        except ParameterError as error:
            raise TowError(str(error)) from None
        self.lockstep, self.scene, self.blocks = lockstep, settings.scene, settings.node
        self.tick = round(self.scene.solver.tick * SECOND)
        self.box = FrameBox()
        self.now: int | None = None  # what /clock said last, ns
        self.clock_came = threading.Event()
        self.ears = Ears(domain, NAMESPACE, environment)
        self.feeder = Feeder(self._send, lockstep)
        self._publishers = {
            kind: self.ears.publisher(message_class(KINDS[kind][0]), KINDS[kind][1]) for kind in ("imu", "odometry")
        }
        self._health = self.ears.hear(JointState, "sim/health", self.box.put)
        self._status = self.ears.listen(DiagnosticArray, "/diagnostics")
        if lockstep:
            self.ears.hear(Clock, "/clock", self._on_clock, reliable=False)

    def connected(self) -> bool:
        """Do both ends know of each other, on every topic that is used?"""
        heard = all(publisher.get_subscription_count() for publisher in self._publishers.values())
        return heard and self._health.get_publisher_count() > 0 and (not self.lockstep or self.clock_came.is_set())

    def check(self) -> None:
        """TowError when a thread of ours has failed."""
        self.ears.check()
        if self.feeder.failure is not None:
            raise TowError(f"motion could not be sent: {self.feeder.failure!r}") from self.feeder.failure

    def _on_clock(self, data: bytes) -> None:
        self.now = int.from_bytes(data[4:8], "little") * SECOND + int.from_bytes(data[8:12], "little")
        self.feeder.clock(self.now)
        self.clock_came.set()

    def _send(self, message: Message) -> None:
        self._publishers[message.kind].publish(message.data)

    def _commander(self) -> Any:
        """The publisher of commands, made when it is first used: beside a user's it is a second one."""
        if "command" not in self._publishers:
            made = self.ears.publisher(JointState, COMMAND)
            deadline = time.monotonic() + SERVICE
            while not made.get_subscription_count():
                if time.monotonic() > deadline:
                    raise TowError(f"the node does not listen on {COMMAND}, within {SERVICE:g} s: nothing was sent")
                time.sleep(0.01)
            self._publishers["command"] = made
        return self._publishers["command"]

    def feed(self, messages: Sequence[Message]) -> int:
        """Queue motion; the stamp of the first, ns: the clock's time in lockstep, else from now on."""
        if any(message.kind == "command" for message in messages):
            self._commander()
        first = self.now if self.lockstep else time.time_ns() + AHEAD
        return self.feeder.add(messages, first)

    def command(self, payout: float | None, rate: float | None) -> None:
        """Publish a command, stamped with the clock of the motion."""
        stamp = self.now if self.lockstep and self.now is not None else time.time_ns()
        self._commander().publish(encode_command(stamp, payout, rate))

    def commanders(self) -> int:
        """Publishers of winch commands beside our own."""
        return self.ears.others_on(f"{NAMESPACE}/{COMMAND}")

    def set(self, name: str, value: Any) -> None:
        """Set a parameter; TowError with the node's reason where it refuses."""
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        (result,) = self.ears.call(SetParameters, f"{NODE}/set_parameters", request, SERVICE).results
        if not result.successful:
            raise TowError(f"{name} = {value!r} was refused: {result.reason}")

    def call(self, service: str, data: bool | None, within: float = SERVICE) -> str:
        """Call a Trigger or, with data, a SetBool of the node; TowError with its text where it did not succeed."""
        kind: Any = Trigger if data is None else SetBool
        request = kind.Request() if data is None else kind.Request(data=data)
        answer = self.ears.call(kind, f"{NODE}/{service}", request, within)
        if not answer.success:
            raise TowError(f"{service}: {answer.message}")
        return answer.message

    def diagnostics(self) -> dict[str, tuple[int, str, dict[str, str]]]:
        """Newest status of each task: name -> (level, text, values)."""
        if not self._status:
            return {}
        return {
            status.name.partition(": ")[2]: (
                status.level[0],
                status.message,
                {value.key: value.value for value in status.values},
            )
            for status in self._status[-1].status
        }

    def close(self) -> None:
        """End our threads and leave the domain."""
        self.feeder.close()
        self.ears.close()
