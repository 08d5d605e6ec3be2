"""A node under test: started in a process and domain of its own, fed, stepped, commanded, read, always ended.

Files in shared memory that a killed process of a test leaves behind: Fast DDS removes its own only where it ends.

With discovery on this host alone rmw_fastrtps always adds the shared memory transport, whatever its settings say.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
import tempfile
import time
import uuid
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TowError
from ..ros import watchdog
from ..ros.child import MARK, Process, failure, opened
from ..sim.flag_rules import DOUBTFUL, OK
from .arguments import COMMAND, SENT_AGAIN, agree, as_text, number, process_of, scene_text, too_late, unmet, with_motion
from .domain import reserve

SHARED = Path("/dev/shm")
_NAME = re.compile(rf"{SHARED}/(fastdds_\w+)$", re.M)

READY_WITHIN = 300.0  # s; compiling everything from nothing takes minutes on a slow machine
COMPILING = "the first start on a machine compiles for up to two minutes: give ready_within=300 or leave it out"
START_WITHIN = 60.0  # s of wall time from the first motion to the first tick output
STALLED = 30.0  # s of wall time, beside what real time takes
SECOND = 1_000_000_000
ALONE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}  # neither heard by a ship nor hearing it
OPENING = ("ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS_SUPER_CLIENT")  # lead out of it


def mapped(process: int) -> set[str]:
    """Names of the files of Fast DDS that a process has mapped; none where it has ended or is another user's."""
    try:
        return set(_NAME.findall(Path(f"/proc/{process}/maps").read_text("utf-8", errors="replace")))
    except OSError:
        return set()


def remove(names: set[str], within: float = 1.0) -> set[str]:
    """Remove those that no living process has mapped, with their locks; returns what was removed.

    within: s that are waited for those of this process, which lets go of them soon after it has left the domain.
    """
    there = {name for name in names if (SHARED / name).exists()}
    if not there:
        return set()
    deadline = time.monotonic() + within
    while there & mapped(os.getpid()) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in os.listdir("/proc"):
        if process.isdigit():
            there -= mapped(int(process))
    for name in there:
        for file in (name, f"{name}_el", f"sem.{name}_mutex"):
            (SHARED / file).unlink(missing_ok=True)
    return there


def tow(scene: str | os.PathLike = "full_scale", **options: Any) -> Tow:
    """A node under test, ready for motion; use it in a `with`. Options as in `Tow`."""
    return Tow(scene, **options)


class Tow:
    """A node in a process of its own on a domain of its own. Raises TowError with the node's last lines.

    scene: path or name of a shipped one; mode: "realtime" or "lockstep"; parameters: of the node (docs/parameters.md);
    record: to folder/tow; folder: for logs and recording, a temporary one by default; environment: further variables of
    every process; ready_within: s; may_be_doubtful: a run whose verdict is doubtful is no failure of `close`; command:
    what to run in place of the node.
    """

    def __init__(
        self,
        scene: str | os.PathLike = "full_scale",
        *,
        mode: str = "realtime",
        parameters: Mapping[str, Any] | None = None,
        record: bool = False,
        folder: str | os.PathLike | None = None,
        environment: Mapping[str, str] | None = None,
        ready_within: float = READY_WITHIN,
        may_be_doubtful: bool = False,
        command: Sequence[str] = (sys.executable, "-m", "cable_sim_ros.ros.node"),
    ) -> None:
        number("ready_within", ready_within, "s", "nothing was started", COMPILING)
        agree(mode, scene, parameters or {})
        self.mode, self.lockstep, self.may_be_doubtful = mode, mode == "lockstep", may_be_doubtful
        try:
            self.folder = Path(folder) if folder is not None else self._temporary()
            self.folder.mkdir(parents=True, exist_ok=True)
        except (OSError, TypeError) as error:
            raise TowError(
                f"folder = {folder!r} for logs and recording could not be made ({error}): nothing was started; give "
                f"one that can be written, or leave it out"
            ) from error
        self.recording = self.folder / "tow" if record else None
        self.processes: list[Process] = []
        self.leftovers: list[int] = []  # ids of processes that outlived those we started, and were ended
        self._closing: list[Callable[[], Any]] = []  # in reverse order
        self._closed = False
        opened.add(self)
        self._segments: set[str] = set()  # in shared memory, of our processes
        self._mark = f"{MARK}-{uuid.uuid4().hex}"
        self._wanted: dict[str, Any] = {"scene": scene_text(scene), "time_mode": mode}
        if self.lockstep:
            self._wanted |= {"lockstep.paused": True, "lockstep.rate": 0.0} | SENT_AGAIN
        if record:
            self._wanted |= {"recording.enabled": True, "recording.path": "tow"}
        self._wanted |= {"recording.root": str(self.folder.absolute())} | dict(parameters or {})
        try:
            self._start(command, environment or {}, ready_within)
        except BaseException:
            self._end()
            raise

    def _temporary(self) -> Path:
        path = Path(tempfile.mkdtemp(prefix="cable_sim_test_"))
        weakref.finalize(self, shutil.rmtree, path, ignore_errors=True)
        return path

    # ---- start

    def _start(self, command: Sequence[str], environment: Mapping[str, str], within: float) -> None:
        domain = reserve()
        self._closing.append(domain.close)
        self.domain, self._descriptor = domain.number, domain.descriptor
        own = {"ROS_DOMAIN_ID": str(self.domain), **ALONE, **environment}
        self.environment = {name: value for name, value in os.environ.items() if name not in OPENING} | own
        self.environment |= {"ROS_LOG_DIR": str(self.folder / "log"), watchdog.VARIABLE: self._mark}
        self._status = self.folder / f"node_{self._mark[-8:]}.json"
        arguments = [*command, "--ros-args"]
        for name, value in (self._wanted | {"statistics_file": str(self._status)}).items():
            arguments += ["-p", f"{name}:={as_text(name, value)}"]
        package = str(Path(__file__).resolve().parents[2])  # the node's is the one under test, however it was imported
        path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
        self._closing.append(self._sweep)
        self.node = Process(
            "the node", arguments, self.folder / "node.log", self.environment | {"PYTHONPATH": path}, [self._descriptor]
        )
        self._closing.append(self.node.stop)
        from .node_topics import Link  # imports ROS, while the node does

        closed: dict[str, str | None] = dict.fromkeys(OPENING)
        self._link = Link(self.domain, self._wanted, closed | own, self.lockstep, self.processes)
        self._closing.append(self._link.close)
        self._link.client.give_up = self.check
        self._await(lambda: self.state == "waiting", within, "ready for motion", remedy=f"; {COMPILING}")
        self._await(self._link.connected, START_WITHIN, "connected")
        self._segments |= mapped(self.node.pid)

    @property
    def state(self) -> str:
        """State of the node: docs/realtime.md."""
        return str(self.metrics.get("state", "starting"))

    @property
    def metrics(self) -> dict[str, Any]:
        """What the node wrote of itself last; after `close` its final figures."""
        try:
            return json.loads(self._status.read_text("utf-8"))
        except FileNotFoundError:
            return {}

    # ---- motion and commands

    def feed(
        self,
        source: Any = None,
        *,
        heave: tuple[float, float] | None = None,
        start: float = 0.0,
        duration: float | None = None,
        imu_only: bool = False,
        commands: bool = False,
    ) -> float:
        """Send ship motion from now on, behind what was fed before; returns the stamp of its first message, s.

        source: a bag (path or name of a shipped one), a CSV file, a sequence of ShipMotion; or heave=(m, s), a sine.
        start, duration: part of it, s; imu_only: without odometry; commands: with the winch commands of the bag.
        """
        from .feeder import messages

        self._open()
        ship = self._link.scene.ship
        found = messages(
            source, ship, heave=heave, start=start, duration=duration, imu_only=imu_only, commands=commands
        )
        return self._link.feed(found) / SECOND

    def command(self, *, rate: float | None = None, payout: float | None = None) -> None:
        """One winch command: a rate [m/s] or a length [m], positive out; docs/winch.md."""
        if rate is None and payout is None:
            raise TowError("give rate=... in m/s or payout=... in m: nothing was commanded")
        if rate is not None and payout is not None:
            raise TowError(
                f"both rate = {rate!r} m/s and payout = {payout!r} m were given: nothing was commanded; give one"
            )
        self._open()
        for name, value, unit in (("rate", rate, "m/s"), ("payout", payout, "m")):
            if value is not None:
                number(name, value, unit, "nothing was commanded", "rate=0.0 stops the winch", minimum=-math.inf)
        self._link.command(payout, rate)

    def run(
        self,
        command: Sequence[object],
        *,
        name: str = "",
        may_end: bool = False,
        within: float = 30.0,
        publishes: str | Sequence[str] = COMMAND,
    ) -> Process:
        """Start a process of yours in the domain, and wait until it publishes winch commands (within=0: do not wait).

        publishes: topics (relative to /tow_sim) of a node between sample and command, or of several; the first step
        waits until each has a subscriber. It ends with this tow. If it ends by itself with another code than 0 the next
        wait raises TowError, unless it may_end; `kill()` and `stop()` of what is returned are no surprise.
        """
        topics, link = process_of(command, publishes, within), self._link
        self._open()
        if within:
            link.comes(topics)
        count = len(self.processes)
        name = name or f"controller {count}"
        log = self.folder / f"process{count}.log"
        process = Process(name, [str(part) for part in command], log, self.environment, [self._descriptor])
        process.watched = not may_end
        self.processes.append(process)
        self._closing.append(process.stop)
        if within:
            more = " or of other commands" if COMMAND in topics else ""
            what = f"ready: {name} has no publisher of {' or '.join(topics)}{more}"
            self._await(lambda: not link.chain.missing(), within, what)
            link.came(name, within, self.check)
            self._segments |= mapped(process.pid)
        return process

    def set(self, name: str, value: Any) -> None:
        """Set a parameter of the running node."""
        self._open()
        self._link.set(name, value)

    def call(self, service: str, data: bool | None = None) -> str:
        """Call `reset` and other Trigger services of the node, or with data `record` and `pause`; returns its text."""
        self._open()
        return self._link.call(service, data)

    # ---- time

    def advance(self, seconds: float, *, motion_may_end: bool = False) -> np.recarray:
        """Let so many seconds of simulation pass; returns the tick outputs of this time.

        TowError where the motion that was fed ran out meanwhile, unless it may: most thresholds pass in a calm.
        """
        tick = self._link.tick / SECOND
        seconds = number("seconds", seconds, "s (one tick)", "nothing was simulated", "time goes forward", minimum=tick)
        self._open()
        box, begun = self._link.box, self._link.box.count
        steps = round(seconds * SECOND) // self._link.tick
        if self.lockstep:
            self.step(steps)
            return self._since(begun, motion_may_end)
        target = (
            int((box.frames if begun else self._first())["time"][-1])
            + round(seconds * SECOND) // self._link.tick * self._link.tick
        )
        self._await(
            lambda: box.frames["time"][-1] >= target, 1.5 * seconds + STALLED, f"{seconds:g} s further", every=0.05
        )
        return self._since(begun, motion_may_end)

    def _since(self, begun: int, motion_may_end: bool) -> np.recarray:
        frames = self._link.box.frames[begun:].view(np.recarray)
        return frames if motion_may_end else with_motion(frames, self._link.feeder.end)

    def step(self, count: int = 1) -> None:
        """Lockstep: so many ticks, and no more."""
        if not self.lockstep:
            raise TowError("step() is for mode='lockstep': real time goes on by itself; use advance() or wait_until()")
        if int(number("count", count, "tick", "nothing was stepped", "give whole ticks", minimum=1)) != count:
            raise TowError(f"count = {count!r} is no whole number of ticks: nothing was stepped; advance() takes s")
        self._open()
        self._link.step(int(count), self.check)

    def wait_until(
        self,
        condition: Callable[[np.recarray], Any],
        within: float,
        every: float = 0.1,
        *,
        motion_may_end: bool = False,
    ) -> np.recarray:
        """Go on until condition(frames) is true, at most `within` s of simulation; returns the tick outputs so far.

        every: s of simulation between two looks; motion_may_end: as of `advance`.
        """
        for name, value in (("within", within), ("every", every)):
            number(name, value, "s", "nothing was simulated", "give seconds of simulation")
        begun = self._link.box.frames["time"][-1] if self._link.box.count else None
        while True:
            frames = self.frames
            if len(frames) and condition(frames):
                return frames
            begun = int(frames["time"][0]) if begun is None and len(frames) else begun
            if begun is not None and len(frames) and frames["time"][-1] - begun >= within * SECOND:
                raise too_late(within, frames[-1])
            self.advance(every, motion_may_end=motion_may_end)

    def _first(self) -> np.recarray:
        self._await(lambda: self._link.box.count > 0, START_WITHIN, "running: has it been fed motion?")
        return self._link.box.frames

    def _open(self) -> None:
        if self._closed:
            raise TowError("this tow is closed: nothing was done; use it inside its `with`, or start another")

    def _await(
        self, condition: Callable[[], Any], within: float, what: str, every: float = 0.01, remedy: str = ""
    ) -> None:
        deadline = time.monotonic() + within
        while not condition():
            self.check()
            if time.monotonic() > deadline:
                raise TowError(f"not {what}, within {within:g} s (state {self.state}){remedy}\n{self.node.tail()}")
            time.sleep(every)

    def check(self) -> None:
        """TowError when the node or a process beside it has ended or failed."""
        code, metrics = self.node.code, self.metrics  # in this order: what a node says last it writes before it ends
        if why := failure(metrics):
            raise TowError(f"the node {why}\n{self.node.tail()}")
        if code is not None:
            raise TowError(f"the node ended with code {code}\n{self.node.tail()}")
        for process in self.processes:
            if process.watched and process.code not in (None, 0):
                raise TowError(f"{process.name} ended with code {process.code}\n{process.tail()}")
        self._link.check()

    # ---- what it says

    @property
    def frames(self) -> np.recarray:
        """Every tick output so far, in order, fields by name (`frames.tension`): docs/testing.md."""
        return self._link.box.frames

    @property
    def missing(self) -> int:
        """Ticks between the first and the last tick output that were not heard."""
        return self._link.box.missing

    @property
    def unmet(self) -> dict[str, int]:
        """Lockstep: inputs that did not come at their time, by what became of them. Empty: this run repeats."""
        if not self.lockstep:
            raise TowError("unmet is of mode='lockstep': in real time nothing waits, and no run repeats")
        found = self.metrics.get("lockstep") if self._closed else None
        ticks = 0 if self._closed else self._link.box.count
        return unmet(found or self.diagnostic("lockstep", lambda level, text, v: int(v["step"]) >= ticks)[2])

    @property
    def diagnostics(self) -> dict[str, tuple[int, str, dict[str, str]]]:
        """Newest status of each task of /diagnostics: (level, text, values)."""
        return self._link.client.diagnostics()

    def diagnostic(
        self, task: str, condition: Callable[[int, str, dict[str, str]], Any], within: float = 5.0
    ) -> tuple[int, str, dict[str, str]]:
        """Status of a task as soon as condition(level, text, values) is true, within so many s of wall time."""

        def fits() -> bool:
            found = self.diagnostics.get(task)
            return found is not None and bool(condition(*found))

        self._await(fits, within, f"so in task {task} of /diagnostics: {self.diagnostics.get(task)}", every=0.02)
        return self.diagnostics[task]

    def listen(self, kind: type, topic: str) -> list:
        """A list that grows by every message of a topic (relative to /tow_sim) from now on."""
        return self._link.client.listen(kind, topic)

    # ---- end

    def __enter__(self) -> Tow:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        try:
            self.close()
        except TowError:
            if kind is None:  # else the failure of the test itself is shown
                raise

    def close(self) -> None:
        """End every process and leave the domain; a second call does nothing.

        TowError when the node had crashed, or where its run is not ok and may not be doubtful.
        """
        if self._closed:
            return
        crashed = self.node.code if self.node.watched else None
        self._end()
        if crashed is not None and (crashed < 0 or crashed > 1):
            raise TowError(f"the node had ended with code {crashed}\n{self.node.tail()}")
        verdict = self.metrics.get("verdict") or {}
        if verdict.get("state", OK) == DOUBTFUL and not self.may_be_doubtful:
            why = "; ".join(f"{r['flag']} for {r['seconds']:.3g} s: {r['text']}" for r in verdict["reasons"])
            raise TowError(f"the run is doubtful: {why}. Where the test means it so, give may_be_doubtful=True")

    def _end(self) -> None:
        self._closed = True
        problems = []
        while self._closing:
            try:
                self._closing.pop()()
            except Exception as error:  # the others are ended all the same
                problems.append(str(error))
        if problems:
            raise TowError("; ".join(problems))

    def _sweep(self) -> None:
        self.leftovers = watchdog.end(self._mark, patience=2.0)
        remove(self._segments)
