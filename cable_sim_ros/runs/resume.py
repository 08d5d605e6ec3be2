"""Runs that go on from a saved state: what a run notes in its file of motion and plan, and how the next takes it up.

Under the same motion, event for event, the run goes on as if it had not been interrupted. Another motion takes the tow
up at its own beginning, the cable as it hangs, as after a jump of the clock (sim/rebase.py).
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from pydantic import BaseModel, ConfigDict, ValidationError

from ..io.messages.commands import CommandIngest
from ..io.messages.messages import Event
from ..io.motion.checkpoint import set_back, taken
from ..io.motion.checkpoint_values import Count, Real, Whole
from ..io.recordings.journal import Start
from ..io.scenes.load import SceneWarning
from ..io.scenes.ship_plan import ShipPlan
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.motion_table import MotionError
from ..io.sources.recorded_tow import Feeder, RecordedTow
from ..physics.inputs import make_inputs
from ..sim.rebase import carried_over, heading_problem, place
from ..sim.saved import savefile
from ..sim.saved.savefile import SaveError
from ..sim.scene import Scene
from ..sim.simulator import Simulator

RUN = "run"  # key of the notes in the file


class RunGiven(NamedTuple):
    """What a run was told of its inputs; motion: a bag or table as given, None: none."""

    motion: str | None = None
    heave: tuple[Real, Real] | None = None
    imu_only: bool = False
    winch: str | None = None
    settings: dict[str, Any] = {}  # how messages of the bag were taken in
    topics: dict[str, str] = {}
    rao: str | None = None  # a table as given, or the simple hull
    ship: str | None = None  # the plan of the ship
    vehicle: str | None = None  # motion of the vehicle as given


class Note(BaseModel):
    """What a run notes in its file."""

    model_config = ConfigDict(strict=True)

    report: RunGiven
    origin: tuple[Whole, Real, Real, Real | None]  # ns, m, m, rad
    done: Count  # ticks
    plan: tuple[Whole, Whole]  # ns
    next: Count  # message of the motion
    so_far: str  # fingerprint of those before it
    commands: dict[str, Any]  # of `io.motion.checkpoint`
    intake: dict[str, Any] | None = None


def report_of(
    motion: str | os.PathLike | None,
    heave: tuple[float, float] | None,
    imu_only: bool,
    winch: WinchPlan | None,
    rao: str | os.PathLike | None = None,
    ship: ShipPlan | None = None,
    vehicle: Any = None,
) -> RunGiven:
    """As noted in a file: a path is kept absolute, a shipped bag by its name."""
    plan = None if winch is None else str(winch)
    way, moves = None if ship is None else str(ship), "a callable" if callable(vehicle) else _kept(vehicle)
    return RunGiven(_kept(motion), heave, imu_only, plan, rao=_kept(rao), ship=way, vehicle=moves)


def _kept(path: str | os.PathLike | None) -> str | None:
    if path is None:
        return None
    return str(Path(path).resolve()) if Path(path).exists() else os.fspath(path)


def save(path: str | os.PathLike, one: Position, report: RunGiven) -> None:
    """Write the state at the end of a pass, with where its motion and plan stand. Raises SaveError."""
    origin = one.origin
    note: dict[str, Any] = {
        "report": report._asdict(),
        "origin": [origin.time, *origin.position, origin.heading],
        "done": one.done,
        "plan": [one.plan_start, one.planned],
        "next": 0,
        "so_far": "",
        "commands": taken(one.commands),
    }
    if one.feeder is not None and one.tow is not None:
        count = one.feeder.position
        note |= {"next": count, "so_far": fingerprint(one.tow.events[:count]), "intake": taken(one.feeder.intake)}
    savefile.write(path, one.sim.scene, one.sim.snapshot(), {RUN: note})


def fingerprint(events: list[Event]) -> str:
    """The same for the same messages at the same times."""
    digest = hashlib.sha256()
    for event in events:
        digest.update(f"{event.time} {event.arrival} {event.kind} {len(event.data)}\n".encode())
        digest.update(event.data)
    return digest.hexdigest()


class Position(Protocol):
    """Where a run stands in its motion, its plan and its commands."""

    sim: Simulator
    scene: Scene
    tow: RecordedTow | None
    feeder: Feeder | None
    commands: CommandIngest
    origin: Start
    plan_start: int
    planned: int
    done: int
    done_before: int

    def first(self) -> Start:
        """Where the motion begins; pushes it as far as that."""
        ...


class Resumed:
    """A state file that a pass begins from. `same_motion` is known after `begin`."""

    def __init__(self, path: str | os.PathLike) -> None:
        """Raises SaveError."""
        self.path, self.saved = os.fspath(path), savefile.read(path)
        self.note = self._note(self.saved.notes.get(RUN))
        self.same_motion = False
        self.time = 0  # ns, of the state; known after `begin`

    def _note(self, found: Any) -> Note | None:
        """The note of a run, checked; None in a file of something else."""
        try:
            return None if found is None else Note.model_validate_json(json.dumps(found))
        except RecursionError as error:
            raise self._damaged(error) from None
        except ValidationError as error:
            first = error.errors(include_url=False, include_context=False)[0]
            raise self._damaged(ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}")) from None

    @property
    def scene(self) -> Scene:
        """Of the file."""
        return self.saved.scene

    def report(self) -> RunGiven:
        """What the saved run was told. Raises MotionError for a file of something else than `cable-sim run`."""
        if self.note is None:
            raise MotionError(
                f"{self.path}: was not saved by a run, so it does not say under which motion to go on; nothing was "
                f"simulated. Give --motion or --heave (--motion none: without)"
            )
        return self.note.report

    def _as_before(self, report: RunGiven) -> bool:
        """Is a run told the same motion as the saved one?"""
        return self.note is not None and self.report()._replace(winch=None) == report._replace(winch=None)

    def before(self, report: RunGiven) -> float:
        """Seconds that the saved run simulated under the motion that a run is told; 0 for another."""
        return self.note.done * self.scene.solver.tick if self.note is not None and self._as_before(report) else 0.0

    def plan(self, report: RunGiven) -> WinchPlan | None:
        """The plan of the saved run, for one under the same motion."""
        plan = self.report().winch if self._as_before(report) else None
        return None if plan is None else WinchPlan(plan)

    def metrics(self) -> dict[str, Any]:
        """For the JSON of a run."""
        return {
            "file": self.path,
            "time_s": self.time * 1e-9,
            "motion": "goes on" if self.same_motion else "taken up anew",
        }

    def begin(self, one: Position, own_plan: bool) -> Start:
        """Take the state into a pass that has not begun; own_plan: its plan is not that of the file.

        Raises SaveError for a state that does not fit, or whose heading is another than that of the motion.
        """
        arrays = one.sim.taken(self.path, self.saved)
        now = self.time = int(arrays["memory"].time.now)
        try:
            self.same_motion = self.note is not None and self._is_same(one)
            if self.same_motion:
                one.sim.restore(arrays)
                return self._go_on(one, now, own_plan)
        except ValueError as error:  # of set_back
            raise self._damaged(error) from None
        if one.tow is not None and one.tow.sea_motion:
            raise SaveError(
                f"{self.path}: was not saved under {one.tow.path}: the waves of the state have gone on since its start "
                f"and those that move the ship would begin anew, so that they would not be the same; nothing was "
                f"simulated. Begin without --from, or go on under the --rao it was saved under"
            )
        arrays |= {f"inputs_{name}": array for name, array in make_inputs()._asdict().items()}
        at = place(arrays["memory"])
        if one.tow is None:
            start = Start(now, at, None, "restore")
        else:
            start = one.first()._replace(cause="restore")
            warnings.warn(
                f"{self.path}: was not saved under {one.tow.path}: the tow as it hangs is taken to the beginning of "
                f"that motion, and takes it up over ship.start_blend = {one.scene.ship.start_blend:g} s. To go on "
                f"where it was, give the motion it was saved under, or none of the options for it",
                SceneWarning,
                stacklevel=6,
            )
        problem = heading_problem(arrays["memory"], start.heading)
        if problem:
            raise SaveError(f"{self.path}: {problem}; nothing was simulated. Start the scene anew under this motion")
        fresh = {k: v.copy() for k, v in one.sim.inputs._asdict().items()}  # what has been pushed of the motion
        one.sim.restore(carried_over(arrays, start.time, start.position))
        for name, array in one.sim.inputs._asdict().items():
            array[...] = fresh[name]
        one.origin, one.plan_start, one.planned = start, start.time, start.time
        return start

    def _is_same(self, one: Position) -> bool:
        """Is the motion so far that of the saved run, message for message?"""
        assert self.note is not None
        if one.tow is None:
            return self.note.so_far == ""
        return self.note.next > 0 and self.note.so_far == fingerprint(one.tow.events[: self.note.next])

    def _go_on(self, one: Position, now: int, own_plan: bool) -> Start:
        assert self.note is not None
        time, x, y, heading = self.note.origin
        one.origin = Start(time, (x, y), heading)
        one.done_before = self.note.done
        one.plan_start, one.planned = self.note.plan
        if one.feeder is None:
            set_back(one.commands, self.note.commands)
        else:
            set_back(one.feeder.intake, self.note.intake)
            one.feeder.position = self.note.next
        if own_plan:  # it takes the place of what was commanded before
            one.commands.reset()
            one.sim.inputs.command_head[0] = 0
            one.plan_start = one.planned = now
        return Start(now, place(one.sim.state.now), one.origin.heading, "restore")

    def _damaged(self, error: Exception) -> SaveError:
        return savefile.damaged(self.path, f"its notes of the run do not fit, {type(error).__name__}: {error}")


def nothing_left(where: str, seconds: float) -> MotionError:
    """The error for a motion that has ended where the state was saved; seconds: simulated under it."""
    return MotionError(
        f"{where}: the motion has ended where the state was saved, after {seconds:g} s; nothing was simulated. Give "
        f"another --motion, --heave, or --motion none"
    )
