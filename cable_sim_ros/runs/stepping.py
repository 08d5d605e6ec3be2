"""Steps a simulator in chunks, with the times they took, and records what it was given and what it answered: one run
over a source of input, messages (message_run.py) or a journal (journal_replay.py)."""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..io.bags.bag import BagWriter
from ..io.messages.channels import Context, Encoder, channels_of
from ..io.messages.markers import markers_channel
from ..io.messages.messages import KINDS, Event
from ..io.recordings.journal import MSGTYPE, TOPIC, Journal, Start
from ..io.scenes.load import dump_scene
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.recorded_tow import RecordedTow
from ..physics.tick_output import BODY_COLUMNS, TICK_OUTPUT, body_rows
from ..sim.drive_mode import count_modes
from ..sim.live_parameters import put_live
from ..sim.mesh.mesh_kinds import FeedMesh
from ..sim.rules.watch import rule_watch
from ..sim.scene import Scene
from ..sim.simulator import Simulator, SolverError
from ..sim.tables.material import body_places
from ..sim.tables.rigid_tables import flaps_of
from ..version import __version__

COUNT_OVER = 100  # ticks, fewer than the ring of inputs keeps commands
Progress = Callable[[str, float, float], None]  # what is done, seconds done, seconds in all (0 = not known)


def silent(what: str, done: float, total: float) -> None:
    """Progress that is not reported."""


class Stepped(NamedTuple):
    """Tick outputs of a pass, wall times [s] of compiling, static start and stepping, CPU time [s] of stepping, and
    why it ended early ("" = not), ticks by the mode of the winch in force, bodies on the line [ticks, bodies,
    BODY_COLUMNS]."""

    frames: np.recarray
    compile_s: float
    start_s: float
    stepping_s: float
    stepping_cpu_s: float
    problem: str
    modes: Mapping[str, int]
    bodies: np.ndarray


class Stepper:
    """Chunks of ticks of one simulator, recorded or not. `done` ticks of `total` (0 = not known).

    `live`: live parameters that are not as in the scene of the pass.
    """

    def __init__(self, sim: Simulator, recording: RunRecorder | None, progress: Progress, total: int = 0) -> None:
        self.sim, self.recording, self.progress, self.total = sim, recording, progress, total
        self.tick = int(sim.model.settings[0].tick_ns) * 1e-9  # s
        self.done, self.problem = 0, ""
        self.live: dict[str, Any] = {}
        self.modes: Counter[str] = Counter()  # ticks by the mode of the winch in force
        self.stepping = self.cpu = 0.0
        self._rows = bytearray()  # of TICK_OUTPUT: of many chunks of a tick arrays are joined slower than it simulates
        self._places = body_places(sim.scene)
        self._bodies = [np.zeros((0, len(self._places), len(BODY_COLUMNS)))]
        self._counted = 0  # ticks that `modes` has

    def begin(self, start: Start) -> None:
        """The simulator has been started, or taken to another clock."""
        if self.recording is not None:
            self.recording.begin(self.done, start, self.sim, self.live)

    def count(self) -> None:
        """Count the modes of the ticks since the last time, while scene and commands are theirs."""
        if self.done > self._counted:
            rows = np.frombuffer(self._rows, TICK_OUTPUT, -1, self._counted * TICK_OUTPUT.itemsize)
            self.modes += count_modes(rows, self.sim.inputs, self.sim.scene.setpoint.algorithm)
        self._counted = self.done

    def change(self, name: str, value: Any) -> None:
        """Give a live parameter another value from the next tick on. Raises KeyError, ValueError."""
        self.count()
        put_live(self.sim, name, value)
        self.live[name] = value
        if self.recording is not None:
            self.recording.changed(self.done, name, value)

    def run(self, count: int, heads: np.ndarray | None = None, events: list[Event] | None = None) -> bool:
        """Simulate ``count`` ticks, see `Simulator.run`; events: came before them. False where the solver gives up."""
        recording, inputs = self.recording, self.sim.inputs
        if recording is not None:
            recording.inputs(events or [])
            rows = heads if heads is not None else [inputs.heads]
            recording.seen(self.done, rows)
        begun, used = time.perf_counter(), time.process_time()
        halted = None
        try:
            frames = self.sim.run(count, heads=heads)
        except SolverError as error:  # the ticks before it count
            frames, halted = error.frames, error
        self.stepping += time.perf_counter() - begun
        self.cpu += time.process_time() - used
        self._rows += frames.tobytes()
        if self._places and len(frames):
            self._bodies.append(body_rows(self.sim.chunk_tables[0][: len(frames)], self._places))
        self.done += len(frames)
        if self.done - self._counted >= COUNT_OVER:
            self.count()
        if recording is not None:
            recording.outputs(frames, *self.sim.chunk_tables)
        if halted is not None:
            self.problem = f"the solver gave up after {self.done * self.tick:.2f} s: {halted}"
            return False
        self.progress("simulating", self.done * self.tick, self.total * self.tick)
        return True

    def close(self) -> None:
        """End the recording."""
        self.count()
        if self.recording is not None:
            self.recording.close(self.done, "halted" if self.problem else "end")

    @property
    def bodies(self) -> np.ndarray:
        """Bodies on the line of every tick so far [ticks, bodies, BODY_COLUMNS]."""
        return np.concatenate(self._bodies)

    @property
    def frames(self) -> np.recarray:
        """Every tick so far."""
        return np.frombuffer(self._rows, TICK_OUTPUT).copy().view(np.recarray)


class RunRecorder:
    """Every channel, every input and the journal of a run in one bag; nothing from a clock: the same run has the same
    bytes. Log times are on the clock of the bag's arrivals, in order."""

    def __init__(
        self, path: Path, scene: Scene, tow: RecordedTow | None, winch: WinchPlan | None, markers: float = 0.0
    ) -> None:
        """markers: rate of cable/markers [Hz], 0: none."""
        self.context = Context(bodies=body_places(scene), flaps=tuple(flaps_of(scene).items()))
        drawn = (markers_channel(scene, markers),) if markers > 0.0 else ()
        self.encoder = Encoder(self.context, scene.solver.tick, (*channels_of(scene), *drawn))
        about = {
            "scene": scene.name,
            "scene_yaml": dump_scene(scene),
            "cable_sim_ros": __version__,
            "namespace": self.context.namespace,
            "motion": "none" if tow is None else Path(tow.path).name,
        }
        if winch is not None:
            about["winch_plan"] = str(winch)
        if tow is not None and tow.ship_plan:
            about["ship_plan"] = tow.ship_plan
        if tow is not None and "node" in tow.about:
            about["node"] = tow.about["node"]  # how the motion was taken in
        if tow is not None and tow.sea_motion:
            about["rao"] = json.dumps(tow.sea_motion)  # what moved the ship in the waves of the scene
        if tow is not None and tow.imported:
            about["imported"] = json.dumps(tow.imported)  # what its motion was made of
        self.rules = rule_watch(scene)
        self.writer = BagWriter(path, custom_data=about)
        self.encoder.declare(self.writer)
        self.offset = 0  # ns, arrival less stamp
        self._last = 0
        self.journal: Journal | None = None

    def begin(self, done: int, start: Start, sim: Simulator, live: Mapping[str, Any]) -> None:
        """The simulation begins here, or goes on here; live: parameters that are not as in the scene."""
        if self.journal is None:
            self.journal = Journal(self._entry, sim.inputs)
        self._time = start.time
        self.offset = max(self.offset, self._last - start.time)  # log times go on where the clock goes back
        self.journal.start(done, start, live, sim.snapshot())

    def changed(self, done: int, name: str, value: Any) -> None:
        """A live parameter has another value from the next tick on."""
        assert self.journal is not None, "begin comes first"
        self.journal.set(done, name, value)

    def inputs(self, events: list[Event]) -> None:
        """Messages that came."""
        for event in events:
            msgtype, topic = KINDS[event.kind]
            self.writer.add(f"{self.context.namespace}/{topic}", msgtype, event.arrival, event.data, event.time)

    def seen(self, done: int, rows: Iterable) -> None:
        """What each of the next ticks sees of the rings: heads a tick, see `Simulator.run`."""
        assert self.journal is not None, "begin comes first"
        for k, heads in enumerate(rows):
            self.journal.tick(done + k, *map(int, heads))

    def outputs(self, frames: np.recarray, shapes: np.ndarray, contacts: np.ndarray) -> None:
        """What a chunk of ticks answered."""
        if self.rules is not None:
            self.rules.add(frames)
        for frame, shape, contact in zip(frames, shapes, contacts):
            self._time = int(frame["time"])
            log = self._log()
            for channel, topic, data in self.encoder.encode(frame, shape, contact):
                self.writer.add(topic, channel.msgtype, log, data, self._time)

    def close(self, done: int, why: str) -> None:
        """End journal and bag after ``done`` ticks; a start that failed leaves no journal."""
        if self.journal is not None:
            self.journal.end(done, why)
        if self.rules is not None:
            self.writer.custom_data["rules"] = json.dumps(self.rules.report())
        self.writer.close()

    def _entry(self, data: bytes) -> None:
        self.writer.add(f"{self.context.namespace}/{TOPIC}", MSGTYPE, self._log(), data, self._time)

    def _log(self) -> int:
        self._last = max(self._last, self._time + self.offset)
        return self._last


class Runner(ABC):
    """Compile, start, step to the end and record; what is pushed and when the source says."""

    winch: WinchPlan | None = None  # that commands the winch

    def __init__(self, scene: Scene, tow: RecordedTow | None, progress: Progress, mesh: FeedMesh | None = None):
        """tow: recorded motion, None: none; mesh: in place of the scene's."""
        self.scene, self.tow, self.progress = scene, tow, progress
        self.sim = Simulator(scene, mesh)
        self.tick = int(self.sim.model.settings[0].tick_ns)
        self.live: dict[str, Any] = {}  # live parameters that are not as in the scene
        self._starting = 0.0  # s of wall time

    def _start_at(self, start: Start, keep_inputs: bool = False) -> None:
        """The static start, see `Simulator.start`. Raises StartError."""
        self.progress("static start", 0.0, 0.0)
        begun = time.perf_counter()
        self.sim.start(start.time, start.position, start.heading, keep_inputs)
        self._starting += time.perf_counter() - begun

    def _run(self, bag: Path | None, markers: float) -> Stepped:
        """Simulate; bag: directory to record to, or None; markers: rate of cable/markers in it [Hz]."""
        begun = time.perf_counter()
        self.sim.warm_up(progress=lambda text: self.progress(text, 0.0, 0.0))
        compiled = time.perf_counter()
        start, ticks = self._prepare()
        recording = None if bag is None else RunRecorder(bag, self.scene, self.tow, self.winch, markers)
        stepper = Stepper(self.sim, recording, self.progress, ticks)
        stepper.live = self.live
        if recording is not None:
            recording.offset = self._offset
        problem = ""
        try:
            stepper.begin(start)
            problem = self._steps(stepper, start.time, ticks)
        finally:
            stepper.close()
        problem = stepper.problem or problem
        times = compiled - begun, self._starting, stepper.stepping, stepper.cpu
        return Stepped(stepper.frames, *times, problem, stepper.modes, stepper.bodies)

    @abstractmethod
    def _prepare(self) -> tuple[Start, int]:
        """Take the simulator to where the run begins; that, and the ticks to come. Raises StartError."""

    @abstractmethod
    def _steps(self, stepper: Stepper, now: int, ticks: int) -> str:
        """Push input and step, from ``now`` [ns] on, to the end; why it ended early, "": it did not."""

    @property
    @abstractmethod
    def _offset(self) -> int:
        """Arrival less stamp of the input [ns]."""
