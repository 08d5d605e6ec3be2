"""Control of a running simulation by services of std_srvs: pause, step, save, restore, reset, record.

The node's names; what each does and refuses: docs/control.md. `simulation_interfaces.py` offers the same under the
standard names, where that package is installed.

Recordings of a running node: where they go, what they say of themselves, and their end.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Generator
from inspect import iscoroutinefunction
from pathlib import Path
from typing import Any, Protocol

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile
from std_srvs.srv import SetBool, Trigger

from ...io.bags.bag_writer import BagError
from ...io.recordings.journal import MSGTYPE, TOPIC, Journal
from ...io.recordings.recorder import Recorder, RecorderStats
from ...io.recordings.recording_place import Names, name_problem, root_problem
from ...io.scenes.load import dump_scene
from ...version import __version__
from ..parameters import Settings
from ..publisher import TickPublisher
from ..session import Session
from ..stepped import SteppedSession

MEGABYTE = 1_000_000

QUIT_AFTER = 0.3  # s, for the answer to reach its client
# calls that may wait; the middleware drops what comes beyond without a word, from ten on where nothing else is said
WAITING = 1000
SERVICES = QoSProfile(depth=WAITING)
STUCK = 5.0  # s beyond the bounded waits of a step, after which it is answered that it stands still


class RecordingControl:
    """At most one Recorder at a time; `recorder` is None while nothing is recorded."""

    def __init__(self, settings: Settings, namespace: str) -> None:
        self.settings, self.namespace = settings, namespace
        self.wanted = settings.node.recording.path
        self.names = Names(settings.node.recording.root)
        self.path: Path | None = None
        self.recorder: Recorder | None = None
        self._closing: Recorder | None = None
        self._last: RecorderStats | None = None

    def about(self) -> dict[str, str]:
        """What a recording that begins now says of itself; live parameters are in its scene as they are."""
        return {
            "scene": self.settings.scene.name,
            "scene_yaml": dump_scene(self.settings.scene),
            "cable_sim_ros": __version__,
            "namespace": self.namespace,
            "node": self.settings.node.model_dump_json(),
        }

    def begin(self, session: Session, publisher: TickPublisher | None) -> str:
        """Record a session and what its publisher has; returns "" or why there is no recording."""
        text = self.start(lambda: self.finish(session, publisher))
        recorder = self.recorder
        if not text and recorder is not None and publisher is not None:
            topic = f"{self.namespace.rstrip('/')}/{TOPIC}"

            def put(data: bytes) -> None:
                recorder.put(topic, MSGTYPE, session.record_time(), data, keep=True)

            journal = Journal(put, session.built_sim.inputs)
            publisher.record(recorder, journal)  # first: it must miss no tick
            session.record(journal)
        return text

    def finish(self, session: Session, publisher: TickPublisher | None, timeout: float = 10.0) -> RecorderStats | None:
        """End the recording with the ticks that are done; see `stop`."""
        if publisher is not None:
            publisher.end_recording()
            if publisher.rules is not None and self.recorder is not None:
                self.recorder.writer.custom_data["rules"] = json.dumps(publisher.rules.report())
        session.journal = None
        return self.stop(timeout)

    def start(self, finish: Callable[[], object] | None = None) -> str:
        """Open a recording; returns "" or why there is none. finish(): ends one that has ended by itself."""
        if self.recorder is not None:
            ended = self.recorder.stats().ended
            if not ended:
                return f"already recording to {self.path}"
            (finish or self.stop)()
        if self._closing is not None and self._closing.alive:
            return f"no recording: the disk has not taken all of {self.path} yet; try again"
        block = self.settings.node.recording
        least_free = round(block.least_free * MEGABYTE)
        problem = name_problem("recording.path", self.wanted) or root_problem(block.root, least_free)
        if problem:
            return f"no recording: {problem}"
        path = self.names.next(self.wanted)
        try:
            self.recorder = Recorder(path, custom_data=self.about(), least_free=least_free)
        except (BagError, OSError) as error:
            return f"no recording: {error}"
        self.names.made()
        self.path = path
        return ""

    def stop(self, timeout: float = 10.0) -> RecorderStats | None:
        """Finish the recording; its counts, None when there was none.

        timeout: s to wait for the disk, which goes on writing behind it.
        """
        recorder, self.recorder = self.recorder, None
        if recorder is None:
            return None
        self._last, self._closing = recorder.close(timeout), recorder
        return self._last

    def stats(self) -> RecorderStats | None:
        """Counts of this recording or of the last one."""
        return self.recorder.stats() if self.recorder is not None else self._last


class SimulationNode(Protocol):
    """What the services need of the node, beside what every rclpy node has."""

    session: Session
    settings: Settings
    publisher: TickPublisher | None
    recording: RecordingControl
    create_service: Callable[..., Any]
    create_timer: Callable[..., Any]
    get_parameter: Callable[[str], Any]
    get_logger: Callable[[], Any]
    get_fully_qualified_name: Callable[[], str]
    trigger_activate: Callable[[], Any]
    trigger_deactivate: Callable[[], Any]

    def report_state(self) -> None: ...


class SimulationControl:
    """The services of one node; made once, they work on the session that the node has."""

    def __init__(self, node: SimulationNode) -> None:
        self.node = node
        self.steps = MutuallyExclusiveCallbackGroup()  # of the node's own, a step would hold up all else until its end
        for kind, name, answer in (
            (SetBool, "pause", lambda request, response: self._answer(response, self.pause(request.data))),
            (Trigger, "step", self._on_step),
            (Trigger, "save", lambda request, response: self._answer(response, self.save())),
            (Trigger, "restore", lambda request, response: self._answer(response, self.restore())),
            (Trigger, "reset", lambda request, response: self._answer(response, self.reset())),
            (SetBool, "record", lambda request, response: self._answer(response, self.record(request.data))),
        ):
            self.offer(kind, name, answer)
        self._dropped = 0  # ticks of a step that something else has ended
        self.on_quit: Callable[[], None] | None = None  # ends the process; set by whoever runs it
        self._quits = node.create_timer(QUIT_AFTER, self._quit, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._quits.cancel()

    def offer(self, kind: type, name: str, answer: Callable[..., Any]) -> None:
        """A service under the node's name; one that takes several turns of the executor, a step, waits for another."""
        group = self.steps if iscoroutinefunction(answer) else None
        self.node.create_service(kind, f"~/{name}", answer, qos_profile=SERVICES, callback_group=group)

    # ---- what the services do: (done, text)

    def pause(self, on: bool) -> tuple[bool, str]:
        """Hold simulation time, or let it go on."""
        return self._dropping(self.node.session.pause, on)

    async def step(self, count: int) -> tuple[bool, str]:
        """So many ticks; comes back when they are done, or will not be."""
        session = self.node.session
        begun, text = session.step(count)
        if not begun:
            return False, text
        self._dropped = 0
        left, moved = session.steps_left, time.monotonic()
        maximum = STUCK + 2.0 * self.node.settings.node.lockstep.wait  # for motion, then for a command
        while session.steps_left:
            if self.node.session is not session or session.state not in ("waiting", "running"):
                return False, f"{self._done(count, session.steps_left)}: the node is {self.node.session.state}"
            if session.steps_left != left:
                left, moved = session.steps_left, time.monotonic()
            elif time.monotonic() - moved > maximum:
                return False, (
                    f"{self._done(count, left)}: nothing has moved for {maximum:g} s ({self._why_not()}). They are "
                    f"still to be done; ~/pause with data: true drops them"
                )
            await _Turn()
        if session.state not in ("waiting", "running"):
            return False, session.problem or f"the node is {session.state}"
        if self._dropped:
            return False, f"{self._done(count, self._dropped)}: the rest was dropped by ~/pause, ~/reset or ~/restore"
        return True, self._done(count, 0)

    def save(self) -> tuple[bool, str]:
        """The tow into `state_file` under recording.root."""
        block = self.node.settings.node.recording
        problem = root_problem(block.root, round(block.least_free * MEGABYTE), "saved")
        return (False, problem) if problem else self.node.session.save(self.state_file)

    def restore(self) -> tuple[bool, str]:
        """The tow from `state_file` under recording.root."""
        return self._dropping(self.node.session.restore, self.state_file)

    def reset(self) -> tuple[bool, str]:
        """Static start again."""
        return self._dropping(self.node.session.reset)

    def begin_anew(self) -> tuple[bool, str]:
        """Lockstep: as if the node had just been activated."""
        session = self.node.session
        assert isinstance(session, SteppedSession), "in real time the time is that of the stamps"
        return self._dropping(session.begin_anew)

    def quit_soon(self) -> None:
        """End the process once the answer to the request is out."""
        self._quits.reset()

    def _quit(self) -> None:
        self._quits.cancel()
        if self.on_quit is not None:
            self.on_quit()

    def record(self, on: bool) -> tuple[bool, str]:
        """Begin or end a recording."""
        node = self.node
        if on:
            if node.publisher is None:
                return False, "the node is not configured: there is nothing to record"
            text = node.recording.begin(node.session, node.publisher)
            return not text, text or f"recording to {node.recording.path}"
        # inputs wait meanwhile; a slow disk goes on writing behind it
        stats = node.recording.finish(node.session, node.publisher, timeout=2.0)
        if stats is None:
            return False, "nothing was recorded"
        lost = f"; {stats.dropped} lost: {stats.error}" if stats.error else ""
        return True, f"{stats.written} messages in {node.recording.path}{lost}"

    @property
    def state_file(self) -> Path:
        """Where ~/save and ~/restore have their file."""
        name = self.node.get_parameter("state_file").value
        return Path(self.node.settings.node.recording.root) / f"{name}.npz"

    async def _on_step(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, await self.step(self.node.get_parameter("lockstep.steps").value))

    @staticmethod
    def _answer(response, result: tuple[bool, str]):
        response.success, response.message = result
        return response

    def _dropping(self, act: Callable[..., tuple[bool, str]], *given: Any) -> tuple[bool, str]:
        """Do what ends a step that is under way, and say what state that makes."""
        left = self.node.session.steps_left
        result = act(*given)
        if left and not self.node.session.steps_left:
            self._dropped = left
        self.node.report_state()
        return result

    def _done(self, count: int, left: int) -> str:
        return f"{count - left} of {count} ticks done"

    def _why_not(self) -> str:
        session = self.node.session
        return "there is no motion yet" if session.state == "waiting" else "see the task lockstep of /diagnostics"


class _Turn:
    """Awaited: lets the executor do something else, and comes back at its next turn."""

    def __await__(self) -> Generator[None, None, None]:
        yield
