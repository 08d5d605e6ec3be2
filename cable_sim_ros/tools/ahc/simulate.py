"""One run of a cell: its scene, its motion, the entrant at the winch, live changes at their times.

Motion is that of a recorded ship about its mean track, put on the track of a scene, at its scale.
"""

from __future__ import annotations

import tempfile
import warnings
from contextlib import closing
from dataclasses import replace
from functools import lru_cache
from importlib.util import find_spec
from math import cos, isclose, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import NEEDS_ROS, CableSimError
from ...io.bags.bag_writer import BagWriter
from ...io.messages.messages import KINDS, Event, decode_odometry
from ...io.scenes.load import SceneError, SceneWarning, dump_scene, load_scene, override
from ...io.sources.motion_table import SECOND, MotionWarning, Samples, mean_track, odometry_events
from ...io.sources.recorded_tow import RecordedTow, read_tow
from ...io.sources.sea_motion import sea_motion
from ...runs import verdict
from ...runs.controller import Controller, ControlLoop
from ...runs.message_run import MessageRun
from ...runs.step_choice import stepped
from ...sim.compensation_setup import setpoint_warnings
from ...sim.layout import layout_of
from ...sim.live_parameters import set_live
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ...sim.tables.attitude import angle_rates, to_world
from ...sim.tables.rigid_tables import flaps_of
from ...sim.verdict import FAILED, OK, Verdict, verdict_of
from . import definition
from .definition import CONTROL, HULL, TWIN, Cell, Motion, Place, bag_of, condition, motion, place, scaled, scene_file
from .entrants import LAW, PROGRAM, Entrant, words_of
from .remote import AhcError, Remote

MORE = 2.0  # s of motion beyond the run

CHANGE = 1.0  # s: live changes come at whole multiples of it, where no controller is asked in between
SCENE, PERIOD = "AHC_SCENE", "AHC_PERIOD"  # what the program finds in its environment: file of the scene; s
SKIPPED = "skipped"


@lru_cache(maxsize=2)
def _odometry(bag: Path) -> list[Event]:
    return [event for event in read_tow(bag).events if event.kind == "odometry"]


def about_track(bag: Path, begin: float, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [n, s], coordinates [n, 6] and rates [n, 6] of a recorded ship about its mean track: ahead, to port, up,
    roll, pitch, yaw."""
    events = _odometry(bag)
    first = events[0].time + round(begin * SECOND)
    rows = [decode_odometry(event.data) for event in events if 0 <= event.time - first <= round(seconds * SECOND)]
    time = np.array([row.stamp - first for row in rows]) / SECOND
    value = np.array([(*row.position, *row.angles) for row in rows])
    rate = np.array(
        [(*to_world(row.angles, row.velocity), *angle_rates(row.angles[0], row.angles[1], row.rate)) for row in rows]
    )
    value[:, 5] = np.unwrap(value[:, 5])
    heading = float(value[:, 5].mean())
    value[:, 5] -= heading
    since = time - time.mean()
    for k in range(3):
        value[:, k] -= value[:, k].mean()
    for k in range(2):
        slope = (since * value[:, k]).sum() / (since * since).sum()
        value[:, k] -= since * slope
        rate[:, k] -= slope
    for array in (value, rate):
        array[:, :2] = _turned(array[:, :2], -heading)
    return time, value, rate


def _turned(pairs: np.ndarray, angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.column_stack((c * pairs[:, 0] - s * pairs[:, 1], s * pairs[:, 0] + c * pairs[:, 1]))


def recorded(moved: Motion, at: Place, scene: Scene, seconds: float) -> RecordedTow:
    """A recorded ship on the mean track of a scene; seconds: of the run, in the scene's own time."""
    pace = at.scale**0.5
    time, value, rate = about_track(bag_of(moved), moved.begin, seconds / pace + MORE)
    lengths = np.array([at.scale] * 3 + [1.0] * 3)
    moved_by, going = lengths * value, lengths / pace * rate
    own = pace * time
    where, track = mean_track(own, scene.ship)
    yaw = radians(scene.ship.heading_deg)
    for to, of in ((where, moved_by), (track, going)):
        to[:, :2] += _turned(of[:, :2], yaw)
        to[:, 2:] += of[:, 2:]
    title = f"{moved.name} on the track of {scene.name}"
    stamps = SECOND + np.round(own * SECOND).astype(np.int64)
    tow = RecordedTow(title, odometry_events(Samples(stamps, where, track), title))
    tow.heading = yaw
    return tow


def with_gaps(tow: RecordedTow, gaps: tuple[tuple[float, float], ...]) -> RecordedTow:
    """The motion without the messages between these seconds since its first."""
    first = tow.events[0].time
    kept = [
        event
        for event in tow.events
        if not any(round(a * SECOND) < event.time - first < round(b * SECOND) for a, b in gaps)
    ]
    return replace(tow, events=kept)


class Done(NamedTuple):
    """Tick outputs of a run, the state of its verdict (or skipped), and why it is not ok."""

    frames: np.recarray | None
    state: str
    reason: str = ""


class Span(NamedTuple):
    """Seconds of full scale that are simulated, and of them left out of the figures."""

    duration: float
    start_up: float


class Scheduled:
    """A controller that also makes live changes at their times; `sim` is given before the first call."""

    sim: Simulator

    def __init__(self, inner: Controller | None, changes: tuple[tuple[float, str, Any], ...]) -> None:
        """changes: s since the first call, key, value."""
        self.inner, self.left, self.begin = inner, list(changes), 0

    def __call__(self, row: np.record) -> Any:
        """Makes what is due, and asks the controller."""
        self.begin = self.begin or int(row["time"])
        since = (int(row["time"]) - self.begin) * 1e-9
        while self.left and since >= self.left[0][0] - 1e-6:
            _, key, value = self.left.pop(0)
            set_live(self.sim, key, value)
        return None if self.inner is None else self.inner(row)


def values_of(cell: Cell, algorithm: str) -> dict[str, Any]:
    """Values of the scene of a cell by dotted key, at its scale."""
    at, one = place(cell.scene), condition(cell.condition)
    changed = {**at.values, **(_sea(cell) if at.waves else {}), **(scaled(at.drive, at.scale) if one.drive else {})}
    return {**changed, **scaled(one.values, at.scale), "setpoint.algorithm": algorithm}


def _sea(cell: Cell) -> dict[str, Any]:
    """The waves of a cell at its scale."""
    return scaled(motion(cell.motion).values, place(cell.scene).scale)


def scene_of(cell: Cell, algorithm: str) -> Scene:
    """The scene of a cell. Raises SceneError."""
    with _quiet():
        return override(load_scene(scene_file(place(cell.scene))), values_of(cell, algorithm))


@lru_cache(maxsize=2)
def _motion(scene_name: str, motion_name: str, duration: float) -> RecordedTow:
    """Motion of all classes of a scene, without gaps. Raises MotionError, BagError."""
    at, moved, cell = place(scene_name), motion(motion_name), Cell(scene_name, motion_name, "ideal")
    with _quiet():
        scene = override(scene_of(cell, "hold"), _sea(cell))
    if moved.bag:
        return recorded(moved, at, scene, duration)
    hull = ",".join(f"{key}={at.scale * value:g}" for key, value in HULL.items())
    return sea_motion(f"simple:{hull}", scene, duration)


def motion_of_cell(cell: Cell, duration: float) -> RecordedTow:
    """Messages of the ship's motion in a cell; duration: s in the scene's own time."""
    pace = place(cell.scene).scale ** 0.5
    gaps = tuple((pace * a, pace * b) for a, b in condition(cell.condition).gaps)
    return with_gaps(_motion(cell.scene, cell.motion, duration), gaps)


def run_cell(entrant: Entrant, cell: Cell, span: Span) -> Done:
    """The run of an entrant in a cell; what cannot be run says why."""
    one, at, version = condition(cell.condition), place(cell.scene), definition.version_of(cell)
    if version not in entrant.tracks:
        return Done(None, SKIPPED, f"its entry is not for {version}")
    heard = version == definition.MRU
    if heard and entrant.kind == PROGRAM:
        return Done(None, SKIPPED, f"a program of rclpy hears every topic; {version} takes FILE.py:NAME")
    pace = at.scale**0.5
    duration = pace * span.duration
    if any(begin >= span.duration for begin, _, _ in one.changes) or any(a >= span.duration for a, _ in one.gaps):
        return Done(None, SKIPPED, f"its events are beyond the {span.duration:g} s of this run")
    try:
        scene = scene_of(cell, entrant.what if entrant.kind == LAW else "hold")
        if entrant.kind == LAW and (problem := _unfit(scene)):
            return Done(None, SKIPPED, problem)
        tow = motion_of_cell(cell, duration)
        changes = tuple((pace * when, key, value) for when, key, value in one.changes)
        if entrant.kind == PROGRAM:
            return through_topics(entrant, scene, tow, duration, period_of(at), changes, one.expected)
        if entrant.kind == LAW:
            return offline(scene, tow, duration, None, period_of(at), changes, one.expected)
        period = period_of(at, definition.HEARD_CONTROL if heard else CONTROL)
        with closing(Remote(entrant.what)) as remote:
            controller = remote.begin(scene, period, heard)
            return offline(scene, tow, duration, controller, period, changes, one.expected)
    except SceneError as error:
        of_law = entrant.kind == LAW and _serves(cell)
        return Done(None, SKIPPED if of_law else FAILED, " ".join(str(error).split()))
    except CableSimError as error:
        return Done(None, FAILED, " ".join(str(error).split()))


def _serves(cell: Cell) -> bool:
    """Is the scene of a cell right but for the law? Then the law is not for it, as one by an angle nobody measures."""
    try:
        scene_of(cell, TWIN)
    except SceneError:
        return False
    return True


def period_of(at: Place, control: float = CONTROL) -> float:
    """Control period of a scene [s]: that of full scale at its scale, in whole ticks."""
    tick = at.values["solver.tick"]
    return max(1, round(control * at.scale**0.5 / tick)) * tick


def offline(
    scene: Scene,
    tow: RecordedTow,
    duration: float,
    controller: Controller | None = None,
    period: float = CHANGE,
    changes: tuple[tuple[float, str, Any], ...] = (),
    expected: tuple[str, ...] = (),
) -> Done:
    """One pass, one step a tick; period: of the controller; expected: flags that make no run doubtful.

    Raises CableSimError where it cannot begin, or where the controller fails.
    """
    scheduled = Scheduled(controller, changes) if controller is not None or changes else None
    loop = None
    with _quiet():
        scene = stepped(scene, "fixed", None)
        if scheduled is not None:
            tick = scene.solver.tick
            whole = all(isclose(when % CHANGE, 0.0, abs_tol=1e-9) for when, _, _ in changes)
            asked = period if controller is not None else CHANGE if whole else tick
            loop = ControlLoop(scheduled, asked, tick, scene.instruments, flaps_of(scene))
        one = MessageRun(scene, tow, control=loop)
        if scheduled is not None:
            scheduled.sim = one.sim
        driven = one.run(duration, None)
    if one.failed is not None:
        raise one.failed
    judged = verdict.judge(driven.frames, scene, one.doubts, driven.problem)
    if judged.state == FAILED or not len(driven.frames):
        return Done(None, FAILED, driven.problem or judged.headline)
    return _done(driven.frames, judged, expected)


def _done(frames: np.recarray, judged: Verdict, expected: tuple[str, ...]) -> Done:
    """The run without the reasons of the flags that were expected."""
    judged = verdict_of(reason for reason in judged.reasons if reason.flag not in expected)
    return Done(frames, judged.state, "" if judged.state == OK else judged.headline)


def through_topics(
    entrant: Entrant,
    scene: Scene,
    tow: RecordedTow,
    duration: float,
    period: float,
    changes: tuple[tuple[float, str, Any], ...],
    expected: tuple[str, ...],
) -> Done:
    """The run with a program of rclpy at the winch: the node in lockstep, in a domain of its own.

    period: of the commands [s], for which lockstep waits. Live changes are made by parameters of the node, between two
    steps. Raises AhcError, TowError.
    """
    if find_spec("rclpy") is None:
        raise AhcError(f"--command {NEEDS_ROS.format(error='it is not installed')}")
    from ...testing import tow as node

    with tempfile.TemporaryDirectory(prefix="ahc_") as folder:
        at = Path(folder)
        (at / "scene.yaml").write_text(dump_scene(scene), "utf-8")
        with BagWriter(at / "motion") as bag:
            for event in tow.events:
                msgtype, topic = KINDS[event.kind]
                bag.add(f"/tow_sim/{topic}", msgtype, event.arrival, event.data, event.time)
        with node(
            at / "scene.yaml",
            mode="lockstep",
            parameters={"lockstep.command_period": period},
            folder=at / "log",
            environment={SCENE: str(at / "scene.yaml"), PERIOD: f"{period:.9g}"},
            may_be_doubtful=True,
        ) as sim:
            sim.run(words_of(entrant.what), name=entrant.name)
            sim.feed(at / "motion")
            done = 0.0
            for when, key, value in changes:
                if when > done:
                    sim.advance(when - done, motion_may_end=True)
                    done = when
                sim.set(key, value)
            sim.advance(duration - done, motion_may_end=True)
            frames, missing = sim.frames.copy(), sim.missing
    if missing:
        return Done(None, FAILED, f"{missing} tick outputs were not heard")
    return _done(frames, verdict.judge(frames, scene), expected)


def _unfit(scene: Scene) -> str:
    """Why a set-point law is not for the cable of a scene, "": it is."""
    found = next(setpoint_warnings(scene, layout_of(scene).water_speed), None)
    return f"the law is not for this cable: {found.remedy}" if found else ""


class _quiet(warnings.catch_warnings):
    """Without the cautions of scenes and motion that the definition has chosen."""

    def __enter__(self) -> Any:
        found = super().__enter__()
        warnings.simplefilter("ignore", SceneWarning)
        warnings.simplefilter("ignore", MotionWarning)
        return found
