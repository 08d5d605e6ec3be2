"""One pass of the simulator over recorded motion: start, chunks of ticks, recording, wall times of each."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..io.messages.commands import CommandIngest, encode_command, encode_flaps
from ..io.messages.messages import CAUSES, Event, Refused, decode_imu, decode_odometry
from ..io.messages.mounting import mounting_of
from ..io.motion.motion import MotionIngest
from ..io.recordings.journal import Start
from ..io.scenes.live_changes import Change, Timetable, fit, refuse_beyond, refuse_unacting, tick_of
from ..io.scenes.load import SceneWarning
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.motion_table import MotionError
from ..io.sources.recorded_tow import Feeder, RecordedTow
from ..physics.inputs import MOTION_ROWS
from ..sim.checks import checks
from ..sim.inputs import FlapCommand, WinchCommand
from ..sim.layout import layout_of
from ..sim.mesh.mesh_kinds import FeedMesh
from ..sim.rebase import carried_over
from ..sim.scene import Scene
from ..sim.tables.rigid_tables import flaps_of
from ..sim.verdict import Reason, refused_motion
from . import mean_track
from .controller import ControllerError, ControlLoop
from .resume import Resumed, nothing_left
from .settings import recorded_intake
from .stepping import Progress, Runner, Stepped, Stepper, silent

SECOND = 1_000_000_000
AHEAD = SECOND // 10  # motion is pushed this far past the end of a chunk, so that no tick looks past the newest
# s and ticks of one compiled call, at most; each begins with cold caches
CHUNK, CHUNK_TICKS = 5.0, 256
MAX_RING = 800  # samples a tick may last: the ring holds 1024, with those of AHEAD and the one before
RING_FRACTION = 400  # samples a chunk may bring: less than half the ring
SETTLE = 5.0  # s of a run without motion
FASTER = 1.1, 0.2  # of ship.tow_speed, m/s: drag laws are looked at again
HEADING_OVER = 60.0  # s of motion whose mean yaw is the heading of the start


class MessageRun(Runner):
    """A run over messages of the ship's motion, and the commands of a plan or of a controller.

    tow: recorded motion, None for the mean track; winch: a plan that commands the winch; mesh: in place of the scene's;
    control: a controller that commands it, in place of a plan. `failed`: its error, which ended the pass; changes: of
    live keys, see `live_changes`, their times from the beginning of the pass.
    """

    def __init__(
        self,
        scene: Scene,
        tow: RecordedTow | None,
        progress: Progress = silent,
        winch: WinchPlan | None = None,
        mesh: FeedMesh | None = None,
        control: ControlLoop | None = None,
        changes: Iterable[Change] = (),
    ) -> None:
        super().__init__(scene, tow, progress, mesh)
        self._check_ring()
        drum = self.sim.model.settings[0].drum
        self.feeder = None if tow is None else Feeder(self.sim.inputs, tow, scene, *recorded_intake(tow), drum)
        self.pending: list[Event] = []
        own = CommandIngest(self.sim.inputs, drum, flaps=flaps_of(scene))
        self.commands = own if self.feeder is None else self.feeder.intake.commands
        self.winch, self.control = winch, control
        self.failed: ControllerError | None = None
        if winch is not None:
            winch.check(self.sim.model.settings[0].drum)
        self.modes = () if winch is None else tuple(winch.modes())
        self.changes = tuple(one for one in fit(scene, [*self.modes, *changes]) if one not in self.modes)
        self.timetable = Timetable()
        self.doubts: list[Reason] = []  # of the run, beside those of its tick outputs
        self.origin = Start(0, (0.0, 0.0), None)  # where the motion was begun with
        self.done = self.done_before = 0  # ticks under this motion, and those of them before this pass
        self.plan_start = self.planned = 0  # ns: the plan's zero; its commands before `planned` are pushed

    def run(
        self,
        duration: float | None,
        bag: Path | None,
        markers: float = 0.0,
        resumed: Resumed | None = None,
        own_plan: bool = False,
    ) -> Stepped:
        """Simulate. duration: s, None for all there is; bag: directory to record to, or None; markers: rate of
        cable/markers in it [Hz]. Raises StartError.

        resumed: a state to begin from in place of the static start, raises SaveError; own_plan: the plan is not that
        of the state.
        """
        self._duration, self._resumed, self._own_plan = duration, resumed, own_plan
        stepped = self._run(bag, markers)
        frames, count = stepped.frames, len(stepped.frames)
        self.done = self.done_before + count
        _warn_of_travel(self.scene, frames["payout"] - self._payout)
        _warn_of_drag(self.scene, frames)
        if self.tow is not None and not self.tow.ship_plan:  # which says another mean track
            self.doubts += mean_track.look(self.scene, self._heading, frames)
        if self.tow is not None:
            self.doubts += mean_track.pitch_sign(frames)
        if self.feeder is not None:
            self.doubts += refused_motion(self.feeder.intake.ingest.refusals(), count * self.tick / SECOND)
        return stepped

    def _prepare(self) -> tuple[Start, int]:
        if self._resumed is None:
            start = self.origin = self.first()
            self.plan_start = self.planned = start.time
        else:
            start = self._resumed.begin(self, self._own_plan)
        ticks = self._ticks(self.origin, self._duration)
        refuse_beyond(self.changes, ticks * self.tick / SECOND)
        since = start.time - self.plan_start  # ns that a plan which goes on has been carried out
        modes = [(tick_of(one, self.tick, since), one) for one in self.modes]
        rows = [(tick_of(one, self.tick), one) for one in self.changes]
        refuse_unacting(self.scene, rows, ticks, 0 if self._resumed is None else int(self.sim.frame["tick"]))
        self.timetable = Timetable([*modes, *rows])
        mean_track.before(self.scene, start.heading)
        if self._resumed is None:
            self._start_at(start)
        self._payout, self._heading = float(self.sim.frame["payout"]), start.heading
        if self.winch is not None:
            _warn_of_plan(self.scene, self.winch, (start.time - self.plan_start + ticks * self.tick) / SECOND)
        return start, ticks

    @property
    def _offset(self) -> int:
        return 0 if self.feeder is None else self.feeder.intake.clock.offset or 0

    def first(self) -> Start:
        """Where the motion begins; pushes it as far as that."""
        tow, feeder = self.tow, self.feeder
        if tow is None or feeder is None:
            return Start(0, (0.0, 0.0), None)
        end = tow.start
        while feeder.intake.ingest.first_pose is None and not feeder.done:
            end += AHEAD
            self.pending += feeder.until(end)
            if feeder.jumped:  # the first stamps were odd
                feeder.follow()
        if feeder.intake.ingest.first_pose is None:
            refused = feeder.intake.refusals()
            counts = ", ".join(f"{cause} {count}" for cause, count in refused.items()) or "none came"
            why = "".join(f" {cause}: {CAUSES[cause]}." for cause in refused if CAUSES.get(cause))
            raise MotionError(
                f"{tow.path}: no message of the ship's motion can be used ({counts}): nothing was simulated, it would "
                f"be a tow on its mean track.{why} See docs/causes.md, or simulate it with --motion none"
            )
        first, x, y, yaw = feeder.intake.ingest.first_pose
        heading = _mean_yaw(tow, yaw, feeder.intake.ingest) if tow.heading is None else tow.heading
        return Start(first, (x, y), heading)

    def _ticks(self, start: Start, duration: float | None) -> int:
        if self.tow is None:
            return max(1, round((SETTLE if duration is None else duration) * SECOND / self.tick))
        length = self.tow.length + self.tow.start - start.time - self.done_before * self.tick
        if self.done_before and length < self.tick:
            raise nothing_left(self.tow.path, self.done_before * self.tick * 1e-9)
        if duration is not None:
            length = min(length, round(duration * SECOND))
        return max(1, length // self.tick)

    def _steps(self, stepper: Stepper, now: int, ticks: int) -> str:
        try:
            self._follow_motion(stepper, now, ticks)
        except ControllerError as error:  # the ticks before it count
            self.failed = error
        return str(self.failed or "")

    def _follow_motion(self, stepper: Stepper, now: int, ticks: int) -> None:
        chunk = max(1, min(min(round(CHUNK * SECOND), self._ring_limit()) // self.tick, CHUNK_TICKS))
        while stepper.done < ticks and not stepper.problem:
            for one in self.timetable.due(stepper.done):
                stepper.change(one.key, one.value)
            count = min(chunk, ticks - stepper.done, self.timetable.left(stepper.done))
            if self.control is not None:
                count = min(count, self.control.maximum)
            if self.feeder is not None and self.tow is not None:
                self.pending += self.feeder.until(now + count * self.tick + AHEAD)
                if self.feeder.jumped:
                    count = min(count, ((self.feeder.intake.newest or now) - now) // self.tick)
                    if count <= 0:
                        went = self._follow(stepper)
                        if went is None:
                            return
                        self.plan_start, self.planned = self.plan_start + went - now, self.planned + went - now
                        now = went
                        continue
            if self.control is not None:
                self._ask(self.control, now)
                count = min(count, self.control.left)
                self.control.left -= count
            now += count * self.tick
            if self.winch is not None:
                self._command(self.winch, self.plan_start, self.planned, now + AHEAD)
                self.planned = now + AHEAD
            stepper.run(count, None, self.pending)
            self.pending = []

    def _follow(self, stepper: Stepper) -> int | None:
        """Take the tow over a jump of the motion's clock, as the node does; the new time, None where nothing comes."""
        feeder = self.feeder
        assert feeder is not None
        feeder.follow()
        while feeder.intake.newest is None and not feeder.done:
            self.pending += feeder.until(feeder.following)
            if feeder.jumped:
                feeder.follow()
        begin = feeder.intake.newest
        if begin is None:
            return None
        row = self.sim.inputs.motion[(int(self.sim.inputs.motion_head[0]) - 1) % MOTION_ROWS]
        position = float(row[0]), float(row[1])
        stepper.count()
        self.sim.restore(carried_over(self.sim.snapshot(), begin, position))
        if stepper.recording is not None:
            stepper.recording.offset = feeder.intake.clock.offset or 0
        stepper.begin(Start(begin, position, float(row[5]), "jump"))
        return begin

    def _command(self, plan: WinchPlan, start: int, begin: int, end: int) -> None:
        """Push the plan's commands with stamps in [begin, end) ns, as messages that a recording has and a replay takes.

        Their arrival is on the clock of the bag, and after that of the motion which the run began with.
        """
        for command in plan.commands(self.sim.model.settings[0].drum, start, begin, end):
            self._push(command, int(command.time_ns or 0))
        self.pending.sort(key=lambda event: event.arrival)

    def _ask(self, control: ControlLoop, now: int) -> None:
        """Ask the controller if it is due, and push its commands, as messages like those of a plan.

        A command counts a nanosecond late, see `WinchPlan.commands`. Raises ControllerError.
        """
        for command in control.ask(self.sim.frame, now, self.origin.time):
            self._push(command, now + 1 if command.time_ns is None else command.time_ns)
        self.pending.sort(key=lambda event: event.arrival)

    def _push(self, command: WinchCommand | FlapCommand, stamp: int) -> None:
        """Push a command as a message with this stamp [ns]."""
        offset, minimum = 0, 0
        if self.feeder is not None:
            offset, minimum = self.feeder.intake.clock.offset or 0, (self.feeder.intake.clock.first or 0) + 1
        arrival, kind = max(stamp + offset, minimum), "command"
        if isinstance(command, FlapCommand):
            kind, data = "flaps", encode_flaps(stamp, command.angles)
        else:
            data = encode_command(stamp, command.payout, command.rate)
        self.pending.append(Event(stamp, arrival, kind, data))
        self.commands.take(data, arrival, stamp, kind)

    def _check_ring(self) -> None:
        """A tick needs all the motion it lasts, and what comes before and after it, in the ring of inputs."""
        if self.tow is None:
            return
        tick, rate = self.scene.solver.tick, self.tow.rate
        if min(tick * rate, len(self.tow.events)) > MAX_RING:
            raise MotionError(
                f"{self.tow.path}: {rate:.4g} motion messages a second are {tick * rate:.4g} in a tick (solver.tick, "
                f"--every) of {tick:g} s, more than the {MAX_RING} that are kept for it; nothing was simulated. Give "
                f"--every of at most {MAX_RING / rate:.2g} s"
            )

    def _ring_limit(self) -> int:
        return round(CHUNK * SECOND) if self.tow is None else round(RING_FRACTION / max(1.0, self.tow.rate) * SECOND)


def _warn_of_travel(scene: Scene, payout: np.ndarray) -> None:
    """Warn where the winch took a coarse element onto the sheave, or had too little cable on the drum."""
    layout = layout_of(scene)
    fine = layout.route.feeds or min(layout.fine_zone) > 0.0  # else the scene itself has been warned of
    if fine and len(payout):
        for warning in checks.travel_warnings(layout, max(0.0, -payout.min()), max(0.0, payout.max())):
            warnings.warn(f"{scene.name}: {warning.key} {warning.text}. {warning.remedy}", SceneWarning, stacklevel=3)


def _warn_of_drag(scene: Scene, frames: np.ndarray) -> None:
    """Warn where a ship faster than ship.tow_speed (the scene has been warned of that) left a drag law's range."""
    speed = float(np.percentile(np.hypot(*frames["ship_velocity"][:, :2].T), 95.0)) if len(frames) else 0.0
    if not speed > FASTER[0] * abs(scene.ship.tow_speed) + FASTER[1]:
        return
    ship = scene.ship.model_copy(update={"tow_speed": math.copysign(speed, scene.ship.tow_speed)})
    run = scene.model_copy(update={"ship": ship})
    known = {warning.key for warning in checks.drag_warnings(scene, layout_of(scene).water_speed)}
    for warning in checks.drag_warnings(run, layout_of(run).water_speed):
        if warning.key not in known:
            warnings.warn(
                f"{scene.name}: the ship reached {speed:.3g} m/s, and {warning.key} {warning.text}. {warning.remedy}",
                SceneWarning,
                stacklevel=3,
            )


def _warn_of_plan(scene: Scene, plan: WinchPlan, seconds: float) -> None:
    """Warn of items that the run is too short for."""
    late = [str(item) for item in plan.items if item.time >= seconds]
    if late:
        warnings.warn(
            f"{scene.name}: the run ends after {seconds:g} s, before item{'s' if len(late) > 1 else ''} "
            f"'{', '.join(late)}' of the winch plan: not carried out. A longer --duration, and motion for it",
            SceneWarning,
            stacklevel=6,
        )


def _mean_yaw(tow: RecordedTow, yaw: float, ingest: MotionIngest) -> float:
    """Mean yaw [rad] of the first minute: the heading of a single sample would leave the tow 10 m to one side."""
    convention, mounting = ingest.settings.convention, mounting_of(ingest.heave.imu_rotation_deg)
    until, total = tow.start + round(HEADING_OVER * SECOND), [0.0, 0.0]
    for event in tow.events:
        if not event.is_motion or event.kind in tow.unfit or not tow.start <= event.time <= until:
            continue
        try:
            if event.kind == "imu":
                angle = decode_imu(event.data, convention, mounting).angles[2]
            else:
                angle = decode_odometry(event.data, convention).angles[2]
        except Refused:
            continue
        total[0] += math.cos(angle)
        total[1] += math.sin(angle)
    return math.atan2(total[1], total[0]) if any(total) else yaw
