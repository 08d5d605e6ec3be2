"""One pass of the simulator over recorded motion: start, chunks of ticks, recording, wall times of each."""

from __future__ import annotations

import json
import math
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..io.bag import BagWriter
from ..io.channels import Context, Encoder
from ..io.commands import CommandIngest, encode_command
from ..io.load import SceneWarning, dump_scene
from ..io.messages import KINDS, Refused, decode_imu, decode_odometry
from ..io.motion_table import MotionError
from ..io.replay import Event, Feeder, RecordedTow, late_ticks
from ..io.winch_plan import WinchPlan
from ..physics.frame import FRAME
from ..physics.heave import Heave, MotionInput
from ..physics.quantity import Block
from ..sim import checks
from ..sim.mesh_kinds import FeedMesh
from ..sim.scene import Scene
from ..sim.simulator import Simulator, SolverError
from ..sim.verdict import Reason
from . import mean_track

SECOND = 1_000_000_000
AHEAD = SECOND // 10  # motion is pushed this far past the end of a chunk, so that no tick looks past the newest
# s and ticks of one compiled call, at most; each begins with cold caches
CHUNK, CHUNK_TICKS = 5.0, 256
RING_MOST = 800  # samples a tick may last: the ring holds 1024, with those of AHEAD and the one before
RING_SHARE = 400  # samples a chunk may bring: less than half the ring
SETTLE = 5.0  # s of a run without motion
HEADING_OVER = 60.0  # s of motion whose mean yaw is the heading of the start
Progress = Callable[[str, float, float], None]  # what is done, seconds done, seconds in all (0 = not known)


def silent(what: str, done: float, total: float) -> None:
    """Progress that is not reported."""


class Start(NamedTuple):
    """Where and when the static start is: ns, m in odom, rad (None: the scene's heading)."""

    time: int
    position: tuple[float, float]
    heading: float | None


class Driven(NamedTuple):
    """Frames of a pass, wall times [s] of compiling, static start and stepping, CPU time [s] of stepping, and why it
    ended early ("" = not)."""

    frames: np.recarray
    compile_s: float
    start_s: float
    stepping_s: float
    stepping_cpu_s: float
    problem: str


class Pass:
    """One pass of the simulator over its input.

    tow: recorded motion, None for the mean track; recorded: Frames of the run to repeat, None for a fresh start; winch:
    a plan that commands the winch; mesh: in place of the scene's.
    """

    def __init__(
        self,
        scene: Scene,
        tow: RecordedTow | None,
        recorded: np.recarray | None = None,
        progress: Progress = silent,
        winch: WinchPlan | None = None,
        mesh: FeedMesh | None = None,
    ) -> None:
        self.scene, self.tow, self.progress = scene, tow, progress
        self.recorded = recorded
        self.sim = Simulator(scene, mesh)
        self.tick = round(scene.solver.tick * SECOND)
        self._check_ring()
        self.feeder = None if tow is None else Feeder(self.sim.inputs, tow, scene, *_taken_in(tow))
        self.pending: list[Event] = []
        self.commands = CommandIngest(self.sim.inputs) if self.feeder is None else self.feeder.commands
        self.winch = winch
        if winch is not None:
            winch.check(self.sim.model.settings[0].drum)
        self._late, self._newest = late_ticks(recorded)
        self.doubts: list[Reason] = []  # of the run, beside those of its Frames

    def go(self, duration: float | None, bag: Path | None) -> Driven:
        """Simulate. duration: s, None for all there is; bag: directory to record to, or None. Raises StartError."""
        begun = time.perf_counter()
        self.sim.warm_up(progress=lambda text: self.progress(text, 0.0, 0.0))
        compiled = time.perf_counter()
        start = self._start()
        mean_track.before(self.scene, start.heading)
        self.progress("static start", 0.0, 0.0)
        starting = time.perf_counter()
        self.sim.start(time_ns=start.time, position=start.position, heading=start.heading)
        started = time.perf_counter()
        payout = float(self.sim.frame["payout"])
        frames, stepping, cpu, problem = self._steps(start, self._ticks(start, duration), bag)
        _warn_of_travel(self.scene, frames["payout"] - payout)
        if self.tow is not None:
            self.doubts += mean_track.look(self.scene, start.heading, frames)
        return Driven(frames, compiled - begun, started - starting, stepping, cpu, problem)

    def _start(self) -> Start:
        tow, feeder = self.tow, self.feeder
        if tow is None or feeder is None:
            return Start(0, (0.0, 0.0), None)
        recorded = tow.started()
        if recorded is not None:
            return Start(*recorded)
        end = tow.start
        while feeder.ingest.first_pose is None and not feeder.done:
            end += AHEAD
            self.pending += feeder.until(end)
        if feeder.ingest.first_pose is None:
            return Start(tow.start, (0.0, 0.0), None)
        first, x, y, yaw = feeder.ingest.first_pose
        if self.recorded is not None and len(self.recorded):
            return _start_before(self.recorded[0], self.scene, self.tick)
        return Start(first, (x, y), _mean_yaw(tow, yaw, feeder.ingest.settings))

    def _ticks(self, start: Start, duration: float | None) -> int:
        if self.tow is None:
            return max(1, round((SETTLE if duration is None else duration) * SECOND / self.tick))
        length = self.tow.end - start.time
        if self.recorded is not None and len(self.recorded):
            length = max(0, int(self.recorded["time"][-1]) - start.time)
        if duration is not None:
            length = min(length, round(duration * SECOND))
        return max(1, length // self.tick)

    def _steps(self, start: Start, ticks: int, bag: Path | None) -> tuple[np.recarray, float, float, str]:
        chunk = max(1, min(min(round(CHUNK * SECOND), self._ring_limit()) // self.tick, CHUNK_TICKS))
        recording = None
        if bag is not None:
            recording = _RunRecorder(bag, self.scene, start, self.tow, self.winch)
        parts, done, stepping, cpu, problem, now = [], 0, 0.0, 0.0, "", start.time
        planned = start.time  # commands before it are pushed
        if self.winch is not None:
            _warn_of_plan(self.scene, self.winch, ticks * self.tick * 1e-9)
        try:
            while done < ticks and not problem:
                count, newest = self._shown(now, min(chunk, ticks - done))
                now += count * self.tick
                if self.feeder is not None:
                    self.pending += self.feeder.until(now + AHEAD, newest)
                if self.winch is not None:
                    self._command(self.winch, start.time, planned, now + AHEAD)
                    planned = now + AHEAD
                begun, used = time.perf_counter(), time.process_time()
                try:
                    frames = self.sim.run(count)
                except SolverError as error:
                    problem = f"the solver gave up after {done * self.tick * 1e-9:.2f} s: {error}"
                    break
                finally:
                    stepping += time.perf_counter() - begun
                    cpu += time.process_time() - used
                parts.append(frames.copy())
                if recording is not None:
                    recording.write(frames, *self.sim.chunk_tables, self.pending)
                self.pending = []
                done += count
                self.progress("simulating", done * self.tick * 1e-9, ticks * self.tick * 1e-9)
        finally:
            if recording is not None:
                recording.close()
        frames = np.concatenate(parts).view(np.recarray) if parts else np.zeros(0, FRAME).view(np.recarray)
        return frames, stepping, cpu, problem

    def _command(self, plan: WinchPlan, start: int, begin: int, end: int) -> None:
        """Push the plan's commands with stamps in [begin, end) ns, as messages that a recording has and a replay takes.

        Their arrival is on the clock of the bag, and after that of the motion which the run began with.
        """
        offset, least = 0, 0
        if self.feeder is not None:
            offset, least = self.feeder.clock.offset or 0, (self.feeder.clock.first or 0) + 1
        for command in plan.commands(self.sim.model.settings[0].drum, start, begin, end):
            stamp = int(command.time_ns or 0)
            data, arrival = encode_command(stamp, command.payout, command.rate), max(stamp + offset, least)
            self.commands.take(data, arrival, stamp)
            self.pending.append(Event(stamp, arrival, "command", data))
        self.pending.sort(key=lambda event: event.arrival)

    def _shown(self, now: int, count: int) -> tuple[int, int | None]:
        """Ticks to run at once and the newest motion they may see [ns]: what came late in the recording stays late."""
        following = int(np.searchsorted(self._late, now, side="right"))
        if following == len(self._late):
            return count, None
        ahead = (int(self._late[following]) - now) // self.tick
        return min(count, max(1, ahead - 1)), int(self._newest[following])

    def _check_ring(self) -> None:
        """A tick needs all the motion it lasts, and what comes before and after it, in the ring of inputs."""
        if self.tow is None:
            return
        tick, rate = self.scene.solver.tick, self.tow.rate
        if min(tick * rate, len(self.tow.events)) > RING_MOST:
            raise MotionError(
                f"{self.tow.path}: {rate:.4g} motion messages a second are {tick * rate:.4g} in a tick (solver.tick, "
                f"--every) of {tick:g} s, more than the {RING_MOST} that are kept for it; nothing was simulated. Give "
                f"--every of at most {RING_MOST / rate:.2g} s"
            )

    def _ring_limit(self) -> int:
        return round(CHUNK * SECOND) if self.tow is None else round(RING_SHARE / max(1.0, self.tow.rate) * SECOND)


class _RunRecorder:
    """Every channel and every input of a run in one bag; nothing from a clock: the same run has the same bytes."""

    def __init__(
        self, path: Path, scene: Scene, start: Start, tow: RecordedTow | None, winch: WinchPlan | None
    ) -> None:
        self.context = Context()
        self.encoder = Encoder(self.context, scene.solver.tick)
        about = {
            "scene": scene.name,
            "scene_yaml": dump_scene(scene),
            "cable_sim_ros": __version__,
            "namespace": self.context.namespace,
            "motion": "none" if tow is None else Path(tow.path).name,
            "start_time_ns": str(start.time),
            "start_position_m": json.dumps(start.position),
        }
        if winch is not None:
            about["winch_plan"] = str(winch)
        if tow is not None and "node" in tow.about:
            about["node"] = tow.about["node"]  # so that this one can be replayed too
        if start.heading is not None:
            about["start_heading_rad"] = repr(start.heading)
        self.writer = BagWriter(path, custom_data=about)
        self.encoder.declare(self.writer)

    def write(self, frames: np.recarray, shapes: np.ndarray, contacts: np.ndarray, events: list[Event]) -> None:
        for event in events:
            msgtype, topic = KINDS[event.kind]
            self.writer.add(f"{self.context.namespace}/{topic}", msgtype, event.arrival, event.data, event.time)
        for frame, shape, contact in zip(frames, shapes, contacts):
            for channel, topic, data in self.encoder.encode(frame, shape, contact):
                self.writer.add(topic, channel.msgtype, int(frame["time"]), data)

    def close(self) -> None:
        self.writer.close()


def _taken_in(tow: RecordedTow) -> tuple[MotionInput, Heave]:
    """How the recording node took its motion in, where the bag says so; keys of other versions are left out."""
    try:
        node = json.loads(tow.about["node"])
        return (
            MotionInput.model_validate(_known(MotionInput, node.get("motion", {}))),
            Heave.model_validate(_known(Heave, node.get("heave", {}))),
        )
    except (KeyError, ValueError, TypeError, AttributeError):
        return MotionInput(), Heave()


def _known(block: type[Block], values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key in block.model_fields}


def _start_before(frame: np.record, scene: Scene, tick: int) -> Start:
    """Start of a run whose bag does not have it, from its first Frame: the ship still is on its mean track there."""
    x, y, z, w = frame["ship_quaternion"]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    ahead = scene.ship.tow_speed * int(frame["tick"]) * tick * 1e-9
    east, north = frame["ship_position"][0] - ahead * math.cos(yaw), frame["ship_position"][1] - ahead * math.sin(yaw)
    return Start(int(frame["time"]) - int(frame["tick"]) * tick, (float(east), float(north)), yaw)


def _warn_of_travel(scene: Scene, payout: np.ndarray) -> None:
    """Warn where the winch took a coarse element onto the sheave, or had too little cable on the drum."""
    if min(checks.fine_zone(scene)) > 0.0 and len(payout):  # else the scene itself has been warned of
        for caution in checks.travel_cautions(scene, max(0.0, -payout.min()), max(0.0, payout.max())):
            warnings.warn(f"{scene.name}: {caution.key} {caution.text}. {caution.remedy}", SceneWarning, stacklevel=3)


def _warn_of_plan(scene: Scene, plan: WinchPlan, seconds: float) -> None:
    """Warn of items that the run is too short for."""
    late = [str(item) for item in plan.items if item.time >= seconds]
    if late:
        warnings.warn(
            f"{scene.name}: the run ends after {seconds:g} s, before item{'s' if len(late) > 1 else ''} "
            f"'{', '.join(late)}' of the winch plan: not carried out. A longer --duration, and motion for it",
            SceneWarning,
            stacklevel=4,
        )


def _mean_yaw(tow: RecordedTow, yaw: float, settings: MotionInput) -> float:
    """Mean yaw [rad] of the first minute: the heading of a single sample would leave the tow 10 m to one side."""
    until, total = tow.start + round(HEADING_OVER * SECOND), [0.0, 0.0]
    for event in tow.events:
        if event.kind == "command" or event.time > until:
            continue
        try:
            decode = decode_imu if event.kind == "imu" else decode_odometry
            angle = decode(event.data, settings.convention).angles[2]
        except Refused:
            continue
        total[0] += math.cos(angle)
        total[1] += math.sin(angle)
    return math.atan2(total[1], total[0]) if any(total) else yaw
