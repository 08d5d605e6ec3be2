"""A recording run again from its journal: every tick sees what it saw, so nothing is left to guess."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..io.recordings.journal import STATIC, Report, Segment, Start
from ..io.scenes.load import dump_scene
from ..io.sources.recorded_tow import RecordedTow, SameTicks
from ..sim.live_parameters import put_live
from ..sim.saved.savefile import LAYOUT, SaveError, fitting
from ..sim.scene import Scene
from ..sim.verdict import Reason, check
from .stepping import Progress, Runner, Stepped, Stepper, silent

CHUNK_TICKS = 256  # of one compiled call, at most; each begins with cold caches
# samples, commands, samples of a vehicle and rows of flaps a chunk may bring: less than half of each ring
RING_FRACTION = 400, 100, 400, 50
MORE_TICKS = 2_000  # that a journal may say beyond those in the bag: a slow disk drops what was published
MAX_UNSEEN = 360_000  # ticks of a bag that has none to compare with: an hour of 10 ms
NO_END = 2**62


class JournalReplay(Runner):
    """Simulates the segments of a journal again.

    frames: recorded tick outputs, which say how long a recording goes on that was cut off, and how much a journal may
    ask for; `faults` has what could not be done as it was recorded, as texts.
    """

    def __init__(
        self, scene: Scene, tow: RecordedTow, report: Report, frames: np.recarray | None, progress: Progress = silent
    ) -> None:
        super().__init__(scene, tow, progress)
        self.recorded = tow
        self.segments, self.faults = report.segments, list(report.faults)
        self.same = tow.about.get("scene_yaml") == dump_scene(scene)
        self._done: list[np.ndarray] = []  # numbers of the ticks that were simulated
        self._bound(frames)

    @property
    def same_ticks(self) -> SameTicks:
        """Which recorded tick is which of those that have been simulated."""
        numbers = np.concatenate(self._done) if self._done else np.zeros(0, np.int64)
        return SameTicks(self.recorded, self.segments, numbers, self.tick)

    def other_end(self, problem: str) -> list[Reason]:
        """Reason where this ended early (problem), and the recorded run did not."""
        return [check("HALTED", problem)] if problem and not self.segments[-1].halted else []

    def _bound(self, frames: np.recarray | None) -> None:
        """No more ticks than were recorded, and some that were not."""
        recorded = None if frames is None else self.same_ticks.recorded("sim_health", frames["time"])
        if recorded is not None and not (recorded >= 0).any():  # a scene with another tick
            recorded = None
        left = MAX_UNSEEN
        for k, segment in enumerate(self.segments):
            maximum = min(left, MAX_UNSEEN)
            if recorded is not None:
                until = self.segments[k + 1].first if k + 1 < len(self.segments) else None
                of = recorded[(recorded >= segment.first) & (recorded < (NO_END if until is None else until))]
                have = int(of.max()) + 1 - segment.first if len(of) else 0
                maximum = have + min(left, MORE_TICKS)
                if not segment.ended:  # cut off: its journal may be ahead of its tick outputs
                    segment.ticks = have
                left -= max(0, min(segment.ticks, maximum) - have)
            else:
                left -= min(segment.ticks, maximum)
            if segment.ticks > maximum:
                self.faults.append(
                    f"the journal says {segment.ticks} ticks from {segment.start.time * 1e-9:.3f} s "
                    f"({segment.start.cause}) on, of which the bag does not have that many: {maximum} were simulated"
                )
                segment.ticks, segment.halted = maximum, False

    def run(self, bag: Path | None, markers: float = 0.0) -> Stepped:
        """Simulate; bag: directory to record to, or None; markers: rate of cable/markers [Hz]. Raises StartError."""
        return self._run(bag, markers)

    def _prepare(self) -> tuple[Start, int]:
        self._begin(self.segments[0])
        return self.segments[0].start, sum(segment.ticks for segment in self.segments)

    @property
    def _offset(self) -> int:
        events = self.recorded.events
        return events[0].arrival - events[0].time if events else 0

    def _steps(self, stepper: Stepper, now: int, ticks: int) -> str:
        for segment in self.segments:
            if segment is not self.segments[0]:
                stepper.count()
                self._begin(segment)
                stepper.begin(segment.start)
            before = stepper.done
            self._segment(segment, stepper)
            self._done.append(segment.first + np.arange(stepper.done - before))
        if stepper.recording is not None:
            stepper.recording.inputs(self.recorded.events)
        return ""

    def _begin(self, segment: Segment) -> None:
        start = segment.start
        if self.same:  # else the scene that was given decides
            for name, value in segment.parameters.items():
                self._set(name, value)
        if start.cause not in STATIC and self.same and segment.layout == LAYOUT:
            try:
                self.sim.restore(fitting(self.recorded.path, segment.arrays, self.sim.snapshot()))
                return
            except SaveError as error:
                self.faults.append(str(error))
        elif start.cause not in STATIC:
            why = "of another scene" if not self.same else "of another version of this program"
            self.faults.append(
                f"the state of the tow at {start.time * 1e-9:.3f} s ({start.cause}) is {why}: begun there from the "
                f"static equilibrium"
            )
        segment.load(self.sim.inputs)  # a start takes the pose of a vehicle from there
        self._start_at(start, keep_inputs=True)

    def _segment(self, segment: Segment, stepper: Stepper) -> None:
        heads, inputs, done = segment.heads(), self.sim.inputs, 0
        changes: dict[int, list[tuple[str, object]]] = {segment.ticks: []}
        for tick, name, value in segment.sets:
            if tick < segment.ticks:
                changes.setdefault(tick, []).append((name, value))
        for until in sorted(changes):
            while done < until:
                maximum = np.array(inputs.heads) + RING_FRACTION
                part = heads[done : min(until, done + CHUNK_TICKS)]
                part = part[: max(1, int((part <= maximum).all(axis=1).sum()))]
                segment.push(inputs, *part[-1].tolist())
                if not stepper.run(len(part), part):
                    return
                done += len(part)
            for name, value in changes[until]:
                self._set(name, value, stepper)
        if segment.halted:  # it gave up here, and does so again
            stepper.run(1)

    def _set(self, name: str, value: object, stepper: Stepper | None = None) -> None:
        """Give a live parameter its value, as of a start or, with a stepper, from the next tick on."""
        if not self.same:
            self.faults.append(f"parameter {name} was changed to {value} in the run: left out, with another scene")
            return
        try:
            if stepper is not None:
                stepper.change(name, value)
            else:
                put_live(self.sim, name, value)
                self.live[name] = value
        except (KeyError, ValueError) as error:
            self.faults.append(f"parameter {name} was changed to {value} in the run: refused here ({error})")
