"""Offline runs: a scene and a recorded bag (or no motion) through the compiled tick, as fast as it goes."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from ..io.bag import BagError, BagWriter
from ..io.channels import Context, Encoder
from ..io.load import dump_scene, load_scene, override, scene_from_text
from ..io.replay import Event, Feeder, RecordedTow, Residual, read_tow, recorded_frames, residuals
from ..io.resources import find_bag
from ..io.wire import KINDS, Refused, decode_imu, decode_odometry
from ..physics.heave import MotionInput
from ..sim.frame import FRAME
from ..sim.scene import Scene
from ..sim.simulator import Simulator, SolverError
from .summary import SKIP, summarize

SECOND = 1_000_000_000
AHEAD = SECOND // 10        # motion is pushed this far past the end of a chunk, so that no tick looks past the newest
CHUNK = 1.0                 # s, at most
RING_SHARE = 400            # samples a chunk may bring: less than half the ring
SETTLE = 5.0                # s of a run without motion
HEADING_OVER = 60.0         # s of motion whose mean yaw is the heading of the start
# JSON names beside those of lab/summary.py: name, unit, meaning
FIGURES = (
    ("departure_angle_deg", "deg", "mean angle of the departing cable from the downward vertical"),
    ("contact_resultant_n", "N", "mean resultant of the cable on the sheave, whole run"),
    ("ticks", "1", "ticks simulated"),
    ("compile_s", "s", "wall time of compiling, or of loading the compiled kernels"),
    ("start_s", "s", "wall time of the static start"),
    ("stepping_s", "s", "wall time of the stepping alone; `realtime_factor` is made from it"),
    ("scene", "", "name of the scene"),
    ("motion", "", "name of the bag, or none"),
    ("setpoint", "", "set-point algorithm"),
    ("imu_only", "", "true: odometry was left out"),
    ("motion_refused", "1", "motion messages refused or bridged, by cause"),
    ("residuals", "", "`replay`: list of channel, quantity, unit, mean, rms, largest, count; ours less recorded"),
    ("largest_difference", "", "`replay`: largest difference of any field of `sim/health` over the common ticks"),
    ("node", "", "`live`: figures of the node, as in its statistics file"),
    ("problem", "", "why the run ended early; absent when it did not"),
)
Progress = Callable[[str, float, float], None]   # what is done, seconds done, seconds in all (0 = not known)


def _silent(what: str, done: float, total: float) -> None:
    pass


@dataclass
class Run:
    """What a run gave: Frames, plain figures by JSON name, why it ended early ("" = it did not), files made."""

    frames: np.recarray
    figures: dict[str, Any]
    problem: str = ""
    bag: Path | None = None
    residuals: list[Residual] = field(default_factory=list)


class Start(NamedTuple):
    """Where and when the static start is: ns, m in odom, rad (None: the scene's heading)."""

    time: int
    position: tuple[float, float]
    heading: float | None


def run(scene: Scene | str | os.PathLike, motion: str | os.PathLike | None = None, *, duration: float | None = None,
        algorithm: str | None = None, imu_only: bool = False, out: str | os.PathLike | None = None,
        progress: Progress = _silent) -> Run:
    """Simulate a scene under the motion of a bag, or on its mean track (motion None).

    duration: s, default the whole bag, or a short settling without motion; algorithm: set-point in place of the
    scene's; imu_only: leave odometry out; out: folder to make, with the bag ``tow`` of every channel and
    ``summary.json``. Raises SceneError, BagError, ResourceError, StartError; a solver that gives up ends the run.
    """
    bag = _bag_path(out)
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    if algorithm is not None:
        scene = override(scene, {"setpoint.algorithm": algorithm})
    tow = None if motion is None else read_tow(find_bag(motion), imu_only=imu_only)
    result = _Drive(scene, tow, None, progress).go(duration, bag)
    result.figures.update(scene=scene.name, motion="none" if tow is None else Path(tow.path).name,
                          setpoint=scene.setpoint.algorithm.value, imu_only=imu_only)
    _write_summary(out, result)
    return result


def replay(bag: str | os.PathLike, scene: Scene | str | os.PathLike | None = None, *,
           out: str | os.PathLike | None = None, progress: Progress = _silent) -> Run:
    """Simulate a recorded bag again and compare with what it recorded of the tow.

    scene: default the one kept in the bag, else ``full_scale``. The start is the recorded one where the bag tells it.
    Raises as `run`.
    """
    target = _bag_path(out)
    tow = read_tow(find_bag(bag))
    if scene is None:
        text = tow.about.get("scene_yaml")
        scene = scene_from_text(text, f"scene kept in {tow.path}") if text else load_scene("full_scale")
    elif not isinstance(scene, Scene):
        scene = load_scene(scene)
    frames = recorded_frames(tow)
    result = _Drive(scene, tow, frames, progress).go(None, target)
    result.residuals = residuals(result.frames, tow)
    result.figures.update(
        scene=scene.name, motion=Path(tow.path).name, setpoint=scene.setpoint.algorithm.value,
        residuals=[row._asdict() for row in result.residuals],
        largest_difference=largest_difference(result.frames, frames))
    _write_summary(out, result)
    return result


def figures_markdown() -> str:
    """FIGURES as a Markdown table, for the README."""
    rows = [f"| `{name}` | {'' if unit == '1' else unit} | {meaning} |" for name, unit, meaning in FIGURES]
    return "\n".join(["| field | unit | meaning |", "|---|---|---|", *rows])


def largest_difference(ours: np.recarray, theirs: np.recarray | None) -> dict[str, Any] | None:
    """Largest difference of any Frame field over the ticks both have (by tick number); None without a common tick."""
    if theirs is None:
        return None
    _, mine, other = np.intersect1d(ours["time"], theirs["time"], return_indices=True)
    if not len(mine):
        return None
    worst = {"field": "", "difference": 0.0, "ticks": len(mine)}
    for name in ours.dtype.names:
        gap = np.abs(np.asarray(ours[name][mine], float) - np.asarray(theirs[name][other], float))
        value = float(np.nanmax(gap)) if np.isfinite(gap).any() else 0.0
        if value > worst["difference"]:
            worst.update(field=name, difference=value)
    return worst


class _Drive:
    """One pass of the simulator over its input."""

    def __init__(self, scene: Scene, tow: RecordedTow | None, frames: np.recarray | None, progress: Progress) -> None:
        self.scene, self.tow, self.progress = scene, tow, progress
        self.recorded = frames
        self.sim = Simulator(scene)
        self.tick = round(scene.solver.tick * SECOND)
        self.feeder = None if tow is None else Feeder(self.sim.inputs, tow, scene, _motion_input(tow))
        self.pending: list[Event] = []

    def go(self, duration: float | None, bag: Path | None) -> Run:
        begun = time.perf_counter()
        self.sim.warm_up(progress=lambda text: self.progress(text, 0.0, 0.0))
        warm_up = time.perf_counter() - begun
        start = self._start()
        self.progress("static start", 0.0, 0.0)
        begun = time.perf_counter()
        self.sim.start(time_ns=start.time, position=start.position, heading=start.heading)
        start_cost = time.perf_counter() - begun
        ticks = self._ticks(start, duration)
        frames, stepping, problem = self._steps(start, ticks, bag)
        if len(frames):
            figures = summarize(frames, skip_s=0.0 if self.tow is None else SKIP,
                                realtime_factor=len(frames) * self.tick * 1e-9 / stepping)
            kept = frames[-1:] if self.tow is None else frames
            figures.update(
                departure_angle_deg=float(np.degrees(kept["departure_angle"].mean())),
                contact_resultant_n=float(kept["contact_resultant"].mean()))
        else:
            figures = {}
        figures.update(ticks=len(frames), compile_s=warm_up, start_s=start_cost, stepping_s=stepping)
        if self.feeder is not None:
            figures["motion_refused"] = {k: v for k, v in self.feeder.ingest.counts.items() if v}
        return Run(frames, figures, problem, bag)

    def _start(self) -> Start:
        tow = self.tow
        if tow is None:
            return Start(0, (0.0, 0.0), None)
        recorded = tow.started()
        if recorded is not None:
            return Start(*recorded)
        end = tow.start
        while self.feeder.ingest.first_pose is None and not self.feeder.done:
            end += AHEAD
            self.pending += self.feeder.until(end)
        if self.feeder.ingest.first_pose is None:
            return Start(tow.start, (0.0, 0.0), None)
        first, x, y, yaw = self.feeder.ingest.first_pose
        if self.recorded is not None and len(self.recorded):
            first = int(self.recorded["time"][0]) - int(self.recorded["tick"][0]) * self.tick
        return Start(first, (x, y), _mean_yaw(tow, yaw, self.feeder.ingest.settings))

    def _ticks(self, start: Start, duration: float | None) -> int:
        if self.tow is None:
            return max(1, round((SETTLE if duration is None else duration) * SECOND / self.tick))
        length = self.tow.end - start.time
        if self.recorded is not None and len(self.recorded):
            length = max(0, int(self.recorded["time"][-1]) - start.time)
        if duration is not None:
            length = min(length, round(duration * SECOND))
        return max(1, length // self.tick)

    def _steps(self, start: Start, ticks: int, bag: Path | None) -> tuple[np.recarray, float, str]:
        chunk = max(1, min(round(CHUNK * SECOND), self._ring_limit()) // self.tick)
        recording = None
        if bag is not None:
            recording = _Recording(bag, self.scene, start, self.tow)
        parts, done, stepping, problem, now = [], 0, 0.0, "", start.time
        try:
            while done < ticks and not problem:
                count = min(chunk, ticks - done)
                now += count * self.tick
                if self.feeder is not None:
                    self.pending += self.feeder.until(now + AHEAD)
                begun = time.perf_counter()
                try:
                    frames = self.sim.run(count)
                except SolverError as error:
                    problem = f"the solver gave up after {done * self.tick * 1e-9:.2f} s: {error}"
                    break
                finally:
                    stepping += time.perf_counter() - begun
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
        return frames, stepping, problem

    def _ring_limit(self) -> int:
        return round(CHUNK * SECOND) if self.tow is None else round(RING_SHARE / max(1.0, self.tow.rate) * SECOND)


class _Recording:
    """Every channel and every input of a run in one bag; nothing from a clock: the same run has the same bytes."""

    def __init__(self, path: Path, scene: Scene, start: Start, tow: RecordedTow | None) -> None:
        self.context = Context()
        self.encoder = Encoder(self.context, scene.solver.tick)
        about = {"scene": scene.name, "scene_yaml": dump_scene(scene), "cable_sim_ros": __version__,
                 "namespace": self.context.namespace, "motion": "none" if tow is None else Path(tow.path).name,
                 "start_time_ns": str(start.time), "start_position_m": json.dumps(start.position)}
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


def _motion_input(tow: RecordedTow) -> MotionInput:
    """How the recording node took its motion in, where the bag says so."""
    try:
        node = json.loads(tow.about["node"])
        return MotionInput(convention=node["imu"]["convention"], odometry_timeout=node["odometry_timeout"])
    except (KeyError, ValueError, TypeError):
        return MotionInput()


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


def _bag_path(out) -> Path | None:
    if out is None:
        return None
    bag = Path(out) / "tow"
    if bag.exists():   # said before the run, not after it
        raise BagError(f"'{bag}' exists already: nothing was simulated, a recording is not overwritten; "
                       "give another folder with --out, or remove it")
    Path(out).mkdir(parents=True, exist_ok=True)
    return bag


def _write_summary(out, result: Run) -> None:
    if out is not None:
        (Path(out) / "summary.json").write_text(json.dumps(result.figures, indent=1) + "\n", "utf-8")
