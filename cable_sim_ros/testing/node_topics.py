"""The topics and services of a node under test, as the test uses them."""

from __future__ import annotations

import difflib
import threading
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from ..errors import TowError
from ..io.messages.channels import decode_frames
from ..io.messages.commands import encode_command
from ..io.messages.messages import COMMANDED, KINDS, Event, stamp_of
from ..physics.tick_output import TICK_OUTPUT
from ..ros.child import Process
from ..ros.client import Client
from ..ros.parameters import FOREIGN, settle
from ..ros.topics import inputs_there, message_class
from .arguments import COMMAND
from .chain import NODE, SETTLE, Chain
from .feeder import AHEAD, SECOND, Feeder

SERVICE = 30.0  # s for an answer
STALLED = 60.0  # s of wall time without a tick output
PIECE = 250  # ticks stepped at once: half of what the node keeps for a listener that is slow, so that none is lost
EARLY = SECOND // 2  # ns before /clock that motion is sent, so that no tick waits for it; a reliable publisher keeps it
LATE = 1.0  # s of wall time without one more tick output, after a step
LOOK = 0.5  # s between two looks at who else is in the domain
PATIENCE = 5.0  # s, lockstep.wait where what is waited for is known to come: a busy machine may need more than 1 s
SPEAK = 3.0  # s of wall time for the first command of a controller, which may also come when the clock moves
ANSWERED = 2  # commands of a controller from which on the node knows when the next is due, and waits for it
CONNECT = 5.0  # s that the nodes of a chain may take to be heard
EMPTY = np.zeros(0, TICK_OUTPUT).view(np.recarray)


class FrameBox:
    """Tick outputs of `sim/health`: collects messages in one thread, gives one array in another."""

    def __init__(self) -> None:
        self._fresh: list[bytes] = []
        self._frames: np.recarray = EMPTY
        self.count = self.newest = 0  # stamp of the newest, ns
        self.changed = threading.Condition()

    def put(self, data: bytes) -> None:
        """One message of `sim/health` as CDR bytes."""
        with self.changed:
            self._fresh.append(data)
            self.newest = stamp_of(data) or 0
            self.count += 1
            self.changed.notify_all()

    @property
    def frames(self) -> np.recarray:
        """Every tick output so far, in order: recarray of TICK_OUTPUT [n], read-only."""
        with self.changed:
            fresh, self._fresh = self._fresh, []
        if fresh:
            self._frames = np.concatenate([self._frames, decode_frames(fresh)]).view(np.recarray)
            self._frames.flags.writeable = False
        return self._frames

    @property
    def missing(self) -> int:
        """Ticks between the first and the last tick output that were not heard; a reset begins anew."""
        steps = np.diff(self.frames["tick"])
        return int((steps[steps > 1] - 1).sum())


class Link:
    """Hears one node and speaks to it. TowError for parameters that it could not use."""

    _patience = 0.0  # s, lockstep.wait as it was given
    _flaps_alone = False

    def __init__(
        self,
        domain: int,
        parameters: Mapping[str, Any],
        environment: Mapping[str, str | None],
        lockstep: bool,
        processes: Sequence[Process],
    ) -> None:
        try:
            with warnings.catch_warnings(action="ignore"):  # cautions of a scene are in the node's log
                settings = settle(dict(parameters))
        except ValueError as error:  # ParameterError, ResourceError
            raise TowError(str(error)) from error
        self.processes = processes  # of the test
        self.domain, self.lockstep, self.scene = domain, lockstep, settings.scene
        self._patience = self._wait = settings.node.lockstep.wait
        given = settings.node.lockstep  # the node waits for flaps by itself, and before a tick nothing asks for them
        self._flaps_alone = given.flap_period is not None and given.command_period is None
        self._given = not lockstep or "lockstep.wait" in parameters
        self._names = [row.name for row in settings.rows] + list(FOREIGN)
        self._looked = 0.0  # s, at who else is there
        self.tick, self._delay = round(self.scene.solver.tick * SECOND), round(settings.node.input_delay * SECOND)
        self.box = FrameBox()
        self.now: int | None = None  # what /clock said last, ns
        self.clock_came = threading.Event()
        self.spoken = threading.Event()  # has a command been heard since the last controller was started?
        self._commands = 0  # heard since then
        self._unpaced = 0.0  # s of wall time that may still be spent on the first commands of a controller
        self._controlled = False  # does a process of the test publish commands?
        self._stamped: int | None = None  # stamp of our newest command that has one, ns
        self._awaited = False  # may its first command come before the next step?
        self._fed = False  # has motion been fed since it came? Then it has what to answer
        self._until = 0  # ns: where /clock will be after the step that is under way
        self.client = Client(domain, environment=environment)
        self.feeder = Feeder(self._send, lockstep)
        self._publishers = {
            kind: self.client.publisher(message_class(KINDS[kind][0]), KINDS[kind][1]) for kind in ("imu", "odometry")
        }
        self.chain = Chain(self.client, self._publishers, lambda: self.now)
        if lockstep:  # before the tick outputs: the clock of one is known when it is
            self.client.hear(Clock, "/clock", self._on_clock, reliable=False)
            for kind, made in inputs_there()[0].items():
                if kind in COMMANDED:
                    self.client.hear(made, KINDS[kind][1], self._on_command, reliable=False)
        self._health = self.client.hear(JointState, "sim/health", self.box.put)
        self.client.listen(DiagnosticArray, "/diagnostics")

    def connected(self) -> bool:
        """Do both ends know of each other, on every topic that is used?"""
        received = all(publisher.get_subscription_count() for publisher in self._publishers.values())
        return received and self._health.get_publisher_count() > 0 and (not self.lockstep or self.clock_came.is_set())

    def check(self) -> None:
        """TowError when a thread of ours has failed."""
        self.client.check()
        if self.feeder.failure is not None:
            raise TowError(f"motion could not be sent: {self.feeder.failure!r}") from self.feeder.failure
        if self.feeder.sent and time.monotonic() > self._looked + LOOK:
            self._looked = time.monotonic()
            for kind in ("imu", "odometry"):
                topic = KINDS[kind][1]
                if (count := self.client.node.count_publishers(topic)) > 1:
                    raise TowError(
                        f"{count} publishers of {topic} in domain {self.domain}: the node hears another motion than "
                        f"this test feeds, and nothing that it says counts. Is a process on this domain that reserved "
                        f"none?"
                    )

    def _on_clock(self, data: bytes) -> None:
        self.now = int.from_bytes(data[4:8], "little") * SECOND + int.from_bytes(data[8:12], "little")
        self._feed_on()
        self.clock_came.set()
        with self.box.changed:
            self.box.changed.notify_all()

    def _feed_on(self) -> None:
        """Send the motion that is due; in a step that of the next ticks too, but where another node than ours hears
        it: that would know what is to come."""
        assert self.now is not None
        alone = all(self._publishers[kind].get_subscription_count() == 1 for kind in ("imu", "odometry"))
        ahead = min(self._until, self.now + EARLY) if alone else 0
        self.client.prompt = ahead <= self.now
        self.feeder.clock(self.now, ahead)

    def _on_command(self, data: bytes) -> None:
        self._commands += 1
        self.spoken.set()

    def _send(self, message: Event) -> None:
        self._publishers[message.kind].publish(message.data)

    def _commander(self) -> Any:
        """The publisher of commands, made when it is first used: beside a user's it is a second one."""
        if "command" not in self._publishers:
            made = self.client.publisher(JointState, COMMAND)
            deadline = time.monotonic() + SERVICE
            while not made.get_subscription_count():
                if time.monotonic() > deadline:
                    raise TowError(f"the node does not listen on {COMMAND}, within {SERVICE:g} s: nothing was sent")
                time.sleep(0.01)
            time.sleep(SETTLE)
            self._publishers["command"] = made
        return self._publishers["command"]

    def feed(self, messages: Sequence[Event]) -> int:
        """Queue motion; the stamp of the first, ns: the clock's time in lockstep, else from now on."""
        if any(message.is_command for message in messages):
            self._commander()
        first = self.now if self.lockstep else time.time_ns() + AHEAD
        stamp = self.feeder.add(messages, first)
        self._awaited = self._fed = self._controlled
        if self.lockstep:
            self._sent()
        return stamp

    def step(self, count: int, check: Callable[[], None]) -> None:
        """Lockstep: so many ticks, all their tick outputs heard. check(): raises where the node or a controller has
        ended."""
        if not self.feeder.sent and not self.feeder.waiting:
            raise TowError("no motion was fed: nothing was stepped; call feed() first")
        target, tried = self.box.count + count, 0
        while self.box.count < target:
            left = target - self.box.count
            sent = 0 if self.now is None or self.feeder.end is None else (self.feeder.end - self.now) // self.tick
            piece = min(left, PIECE, sent if sent > 0 else PIECE) if self._paced() else 1
            if tried and self.box.missing:
                raise TowError(f"{self.box.missing} ticks were not heard: the machine stood still; nothing counts now")
            if tried > 3:
                raise TowError(f"{left} of {count} ticks gave no tick output; see the task lockstep of /diagnostics")
            self._sent()
            self._closed_chain(check)
            self._first_command(check)
            received, fed, commands = self.box.count + piece, self.feeder.sent, self._commands
            self._be_patient(sent > 0)
            self._put("lockstep.steps", piece)
            if self._paced() and self.now is not None:
                self._until = self.now + piece * self.tick
                self._feed_on()
            try:
                self.call("step", None, STALLED, self._progress(check))
            finally:
                self._until = 0
            deadline = time.monotonic() + LATE
            with self.box.changed:  # in the step that takes up the first motion there is no tick
                while not self._heard(received) and time.monotonic() < deadline:
                    before = self.box.count
                    self.box.changed.wait(0.2)
                    if self.box.count > before:  # a machine that is slow: they are on their way
                        deadline = time.monotonic() + LATE
            tried = 0 if self.box.count >= received else tried + 1
            if not self._paced() and self.feeder.sent > fed:
                self._answer(commands, check)

    def _heard(self, count: int) -> bool:
        """Have so many tick outputs come, and the clock of the newest?"""
        return self.box.count >= count and self.now is not None and self.now >= self.box.newest + self._delay

    def _progress(self, check: Callable[[], None]) -> Callable[[], bool]:
        seen = self.box.count

        def moved() -> bool:
            nonlocal seen
            check()
            self._be_patient(self._wait > self._patience)  # but where a process has ended
            before, seen = seen, self.box.count
            return seen > before

        return moved

    def _sent(self) -> None:
        """Of the first motion the node must say that it has come, or a step may begin without it."""
        deadline = time.monotonic() + SERVICE
        while self.now is None or not self._motion_came():
            if time.monotonic() > deadline:
                raise TowError(f"motion could not be sent within {SERVICE:g} s: the node has had none")
            time.sleep(0.002)

    def _motion_came(self) -> bool:
        found = self.client.diagnostics()
        if not self.feeder.sent or "lockstep" not in found:
            return not self.feeder.sent
        heard = (found["motion"][2].get(f"{kind}_received_age_s", "never") != "never" for kind in self.feeder.kinds)
        return found["lockstep"][2]["motion_spoke"] == "true" and all(heard)

    def _be_patient(self, patient: bool) -> None:
        """Let the node wait longer for motion that we send, and for the commands of a process that runs; not for those
        of the test itself, whose second one the node takes for the beginning of a row."""
        patient &= self._controlled or "command" not in self._publishers
        patient &= all(process.code is None for process in self.processes)
        wait = max(PATIENCE, self._patience) if patient else self._patience
        if not self._given and wait != self._wait:
            self._wait = wait
            self._put("lockstep.wait", wait)

    def _closed_chain(self, check: Callable[[], None]) -> None:
        """TowError where a link of the chain is heard by nobody, at most CONNECT after its start."""
        deadline = time.monotonic() + CONNECT
        while self._awaited and (problem := self.chain.closed()):
            check()
            if time.monotonic() > deadline:
                raise TowError(problem)
            time.sleep(0.01)

    def _first_command(self, check: Callable[[], None]) -> None:
        """After motion was fed, until a controller has answered it, at most SPEAK or lockstep.wait: one that answers at
        the standing clock is then always in time for the first step. One that came later has no motion to answer before
        the clock moves, at most a clock to command by: SPEAK."""
        deadline = time.monotonic() + (max(SPEAK, self._patience) if self._fed else SPEAK)
        while self._awaited and not (self._flaps_alone or self.spoken.wait(0.01)) and time.monotonic() < deadline:
            check()
        self._awaited = False

    def _paced(self) -> bool:
        """Does the node wait for the controller by itself?"""
        return self._unpaced <= 0.0 or self._commands >= ANSWERED

    def _answer(self, before: int, check: Callable[[], None]) -> None:
        """After a tick with new motion, until a controller has answered it, at most LOOK: its first commands are due at
        no time that the node knows, which would go on without them."""
        limit = min(LOOK, self._unpaced)
        deadline = time.monotonic() + limit
        while self._commands <= before:
            check()
            if time.monotonic() > deadline:
                self._unpaced -= limit
                return
            time.sleep(0.002)

    def command(self, payout: float | None, rate: float | None) -> None:
        """Publish a command, stamped with the clock of the motion; a second one while the clock stands has no stamp:
        one of the same stamp would be refused as sent twice, and the newest is to win."""
        stamp = self.now if self.lockstep and self.now is not None else time.time_ns()
        self._stamped, stamp = stamp, 0 if stamp == self._stamped else stamp
        self._commander().publish(encode_command(stamp, payout, rate))

    def comes(self, topics: Sequence[str]) -> None:
        """A process is about to start that publishes these topics: what was commanded before is not its answer."""
        self.spoken.clear()
        self._commands = 0
        self.chain.comes(topics)

    def came(self, name: str, within: float, check: Callable[[], None]) -> None:
        """It publishes them: let it, the node and our motion learn of each other."""
        self.chain.came(name, within, check)
        self._controlled = self._awaited = True
        self._fed, self._unpaced = False, 0.0 if self._flaps_alone else SPEAK

    def set(self, name: str, value: Any) -> None:
        """Set a parameter; TowError where there is none of that name, or with the node's reason where it refuses."""
        self._given |= name == "lockstep.wait"
        self._put(name, value)

    def _put(self, name: str, value: Any) -> None:
        if name not in self._names:
            near = difflib.get_close_matches(str(name), self._names, 1, 0.6)
            raise TowError(
                f"parameter {name!r} = {value!r}: the node has no such parameter; nothing was changed. "
                + (f"Did you mean {near[0]!r}?" if near else "All names are in docs/parameters.md")
            )
        try:
            request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        except (TypeError, ValueError, AssertionError) as error:
            raise TowError(
                f"parameter {name!r} = {value!r} is of a type that no parameter has ({error}); nothing was changed. "
                f"Give a float, int, bool, str or a list of floats"
            ) from error
        (result,) = self.client.call(SetParameters, f"{NODE}/set_parameters", request, SERVICE).results
        if not result.successful:
            raise TowError(f"{name} = {value!r} was refused: {result.reason}")

    def call(
        self, service: str, data: bool | None, within: float = SERVICE, meanwhile: Callable[[], bool] = lambda: False
    ) -> str:
        """Call a Trigger or, with data, a SetBool of the node; TowError with its text where it did not succeed."""
        kind: Any = Trigger if data is None else SetBool
        request = kind.Request() if data is None else kind.Request(data=data)
        answer = self.client.call(kind, f"{NODE}/{service}", request, within, meanwhile)
        if not answer.success:
            raise TowError(f"{service}: {answer.message}")
        return answer.message

    def close(self) -> None:
        """End our threads and leave the domain."""
        self.feeder.close()
        self.client.close()
