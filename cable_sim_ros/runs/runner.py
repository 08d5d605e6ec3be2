"""One run of a simulator over a source of input: messages (message_run.py) or a journal (journal_replay.py)."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from ..io.recordings.journal import Start
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.recorded_tow import RecordedTow
from ..sim.mesh.mesh_kinds import FeedMesh
from ..sim.scene import Scene
from ..sim.simulator import Simulator
from .stepping import Progress, RunRecorder, Stepped, Stepper


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
