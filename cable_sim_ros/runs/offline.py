"""Offline runs: a scene and a recorded bag (or no motion) through the compiled tick, as fast as it goes.

What the figures of a run leave out at its beginning: the take-up of motion, waves and turbulence while they grow.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..io.bags.bag_writer import BagError
from ..io.messages.markers import check_rate
from ..io.recordings.journal import read_journal
from ..io.recordings.recorded_run import load_run
from ..io.scenes.document import SceneError, find_bag
from ..io.scenes.fault_plan import PLANS, FaultPlan, load_faults, timed
from ..io.scenes.live_changes import Change, changes_of
from ..io.scenes.load import scene_from_text
from ..io.scenes.ship_plan import ShipPlan
from ..io.scenes.winch_plan import WinchPlan
from ..io.sources.motion_table import MotionError
from ..io.sources.recorded_tow import (
    RecordedTow,
    SameTicks,
    at_speed,
    paired,
    provenance,
    read_tow,
    recorded_frames,
    residuals,
)
from ..io.sources.vehicle_motion import Pose
from ..limits import LONGEST_RUN
from ..physics.tick_output import Flag
from ..physics.water import WaveKind
from ..sim.drive_mode import WORDS
from ..sim.rule_blocks import Rules
from ..sim.rules.watch import watched
from ..sim.saved.savefile import SaveError, check_place, same_scene
from ..sim.scene import Scene
from ..sim.simulator import Simulator
from ..sim.tables.rigid_tables import flaps_of
from ..sim.verdict import Reason, check
from . import refinement_check, sources, verdict
from .controller import Controller, ControlLoop, alone
from .journal_replay import JournalReplay
from .message_run import MessageRun
from .metrics import METRICS as METRICS
from .passage import phase_figures
from .resume import Resumed, report_of
from .resume import save as save_run
from .settings import NOTHING, Settings, apply_to_bag, of_intake, recorded_intake, refuse_without_bag
from .sources import as_set, beside_vehicle, in_the_sea, motion_of, notes_of, scene_of_bag, sea_motion_kept, seconds_of
from .step_choice import doubts_of_steps, metrics_of_steps, overwritten, stepped
from .stepping import Progress, Stepped, silent
from .summary import SKIP, after_start, bag_path, of_bodies, summarize, write_summary
from .summary import Run as Run

GROWN = 0.95  # of water.ramp: 0.993 of the size

# keys that a run that goes on may have otherwise
DRIVEN = "drive.mode", "drive.set_pull", *(f"rules.{key}" for key in Rules.model_fields)
AFTER_PLAN = 60.0  # s of a run after the last item of a plan or change, without a bag, where no duration is given
NO_JOURNAL = (
    "the bag has no journal of what the run took and when: it was recorded by another program or an older version, so "
    "this is another run under the same motion, from a static start of its own"
)
AFTER = 30.0  # s that are looked at after a fault is mended
BEFORE = 30.0  # s before it, that it is compared with


def growth(scene: Scene) -> tuple[float, str]:
    """Seconds over which the sea grows from the static start, and what grows; (0, "") where nothing does."""
    water = scene.water
    grows = ["waves"] * (water.waves.kind is not WaveKind.OFF) + ["turbulence"] * any(water.turbulence.deviation)
    return (water.ramp if grows else 0.0), " and ".join(grows)


def start_up(scene: Scene, moved: bool) -> float:
    """Seconds that the figures leave out; moved: is there a motion of the ship?"""
    return max(SKIP if moved else 0.0, growth(scene)[0])


def still_growing(scene: Scene, metrics: Mapping[str, Any], before: float = 0.0) -> list[Reason]:
    """The reason that makes a run doubtful whose figures begin before the sea has grown; figures: by JSON name.

    before: s that had been simulated when the run began.
    """
    ramp, what = growth(scene)
    skip = metrics.get("skip_s")
    if ramp == 0.0 or skip is None or skip + before >= GROWN * ramp:
        return []
    x = (skip + before) / ramp
    return [
        check(
            "SEA_GROWING",
            f"{what} grow from the static start over water.ramp = {ramp:g} s, but of a run of "
            f"{metrics['duration_s']:.3g} s the figures leave out no more than half, {skip:.3g} s, after which the "
            f"growth is at {100.0 * x * x * (3.0 - 2.0 * x):.0f} %: they are not those of the grown sea. Simulate "
            f"{2.0 * ramp:g} s or more, or make water.ramp shorter; the static tow is that of the scene without {what}",
        )
    ]


def scenario_of(given: FaultPlan | Mapping | str | os.PathLike | None) -> FaultPlan | None:
    """A scenario, or that of plain data or a file. Raises FaultError."""
    if isinstance(given, Mapping):
        return PLANS.check(given, "faults")
    return given if given is None or isinstance(given, FaultPlan) else load_faults(given)


def in_order(changes: Iterable[Change], plan: FaultPlan | None) -> tuple[Change, ...]:
    """Changes and those that a scenario makes, in order of time."""
    return tuple(sorted((*changes, *(timed(plan) if plan else ())), key=lambda one: one.time))


def found(plan: FaultPlan, frames: np.ndarray) -> list[dict[str, Any]]:
    """One dict a failure mode: function, failure mode, expected, found, and before it; frames: of the whole run.

    beside: failure modes that these figures have too; found: of the time from ``at`` to AFTER past ``until``;
    before: of the BEFORE seconds before.
    """
    times = frames["time"]
    seconds = (times - 2 * times[:1] + times[1:2]) * 1e-9 if len(times) > 1 else np.zeros(len(times))
    rows = []
    for name, case in sorted(plan.faults.items(), key=lambda item: item[1].at):
        end = np.inf if case.until is None else case.until + AFTER
        during, before = (seconds > case.at) & (seconds <= end), (seconds > case.at - BEFORE) & (seconds <= case.at)
        row: dict[str, Any] = {
            "name": name,
            "function": case.function,
            "failure_mode": f"{case.target} {case.kind.value}" + (f" {case.size:g}" if case.size else ""),
            "at_s": case.at,
            "until_s": case.until,
            "expected": case.expected,
        }
        row["beside"] = [
            other
            for other, one in plan.faults.items()
            if other != name and one.at <= end and (one.until is None or one.until > case.at - BEFORE)
        ]
        row["found"] = _figures(frames[during]) if during.any() else None
        row["before"] = _figures(frames[before]) if before.any() else None
        rows.append(row)
    return rows


def _figures(frames: np.ndarray) -> dict[str, Any]:
    words = int(np.bitwise_or.reduce(frames["status"]))
    return {
        "seconds": float(np.diff(frames["time"][[0, -1]])[0]) * 1e-9,
        "tension_min_n": float(frames["tension_tick_min"].min()),
        "tension_max_n": float(frames["tension_tick_max"].max()),
        "tension_std_n": float(frames["tension"].std()),
        "payout_travel_m": float(np.ptp(frames["payout"])),
        "payout_rate_max_m_per_s": float(frames["payout_rate_tick_max"].max()),
        "depth_std_m": float(frames["body_position"][:, 2].std()),
        "flags": [flag.name for flag in Flag if flag and words & flag],
    }


def run(
    scene: Scene | str | os.PathLike | None,
    motion: str | os.PathLike | None = None,
    *,
    heave: tuple[float, float] | None = None,
    rao: str | os.PathLike | None = None,
    ship: ShipPlan | str | os.PathLike | None = None,
    vehicle: Pose | str | os.PathLike | None = None,
    duration: float | None = None,
    algorithm: str | None = None,
    imu_only: bool = False,
    winch: WinchPlan | str | os.PathLike | None = None,
    changes: Iterable[Change | tuple[float, str, Any]] = (),
    faults: FaultPlan | Mapping[str, Any] | str | os.PathLike | None = None,
    step: str | None = None,
    every: float | None = None,
    out: str | os.PathLike | None = None,
    save: str | os.PathLike | None = None,
    resumed: Resumed | str | os.PathLike | None = None,
    markers: float = 0.0,
    check: bool = False,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
    controller: Controller | None = None,
    control_period: float | None = None,
    progress: Progress = silent,
) -> Run:
    """Simulate a scene under the motion of a bag or CSV table, a sinusoidal heave, its waves, or on its mean track.

    heave: amplitude [m] and period [s], in place of ``motion`` (None: mean track); rao: CSV of response amplitude
    operators, or ``simple``, in place of ``motion``: the ship moves in the waves of the scene; ship: a plan of turns
    and speeds, its text or file, in place of ``motion``; vehicle: motion of the vehicle at the far end
    (``towbody.model: vehicle``): a CSV table, a bag, a simple motion such as ``circle 5 60`` (m, s), or a callable that
    takes the seconds of the run and returns x, y, z [m, odom], roll, pitch, yaw [rad], None: what the bag has of it, or
    where the scene has it, going along; duration: s, default all the motion there is, or a short
    settling without any, or a minute after the last item of a winch plan, two cable lengths after a plan of the ship;
    algorithm: set-point in place of the scene's; imu_only: leave odometry out; winch: a plan, its text or file, in
    place of the winch commands of the bag; changes: (seconds, key, value) in order of time, each gives a live key of
    the scene a value from the tick on that holds its time, from the beginning of this run; faults: a scenario, as
    data or a file, docs/instruments.md;
    step and every: see `stepped`; out: folder to make, with the bag ``tow`` of every channel and ``summary.json``;
    save: file to write the state at the end to; resumed: such a file to begin from, see `runs.resume`: scene None is
    that of the file then, and winch None its plan where its motion goes on; markers: rate of ``cable/markers`` in the
    bag [Hz], 0: none; check: run it again finer, see `runs.refinement_check`, not with ``resumed``; settings: other
    values by dotted key, of the scene, or of ``motion.`` and ``heave.`` for how the messages of a bag are taken in;
    topics: those of a bag by kind (imu, odometry, command, command_position, command_velocity) where the search by
    type and name is not to decide.

    controller: commands the winch in place of a plan and of the commands of the bag: a callable that takes a copy of
    the row of the last tick (a record of TICK_OUTPUT, SI units; the first is that of the start) and returns a
    WinchCommand, or None: the command before goes on. It is asked between two ticks, every control_period [s, a whole
    number of ticks; None: every tick] of simulation time, which stands meanwhile. Its command counts from the tick
    that follows, ``winch.command_delay`` later where the scene has one; a rate lasts ``winch.command_timeout``.

    The Run has ``frames`` [ticks] (fields and units: ``cable_sim_ros.physics.tick_output.FIELDS``), ``metrics`` by the
    names of docs/json.md, ``problem`` and ``verdict``. Raises SceneError, BagError, MotionError, PlanError,
    ChangeError, ResourceError, StartError, SaveError; a solver that gives up ends the run, and nothing is saved. Raises
    ControllerError where the controller raises or returns what is no command: the run ends there, what was recorded of
    it and its summary stay, and ``run`` of the error has it.
    """
    alone(winch, controller, control_period, check)
    resumed = resumed if resumed is None or isinstance(resumed, Resumed) else Resumed(resumed)
    if scene is None and resumed is None:
        raise TypeError("run() needs a scene, or a saved state as `resumed`")
    check_rate(markers)
    if check and resumed is not None:
        raise SaveError(
            f"{resumed.path}: no finer mesh begins with its state; nothing was simulated. Leave --check out"
        )
    if duration is not None and not 0.0 < duration <= LONGEST_RUN:
        raise MotionError(
            f"duration = {duration:g} s is outside (0, {LONGEST_RUN:g}] s: nothing was simulated; give seconds"
        )
    plan, scenario = None if winch is None else WinchPlan.of(winch), scenario_of(faults)
    live, way = in_order(changes_of(changes or ()), scenario), None if ship is None else ShipPlan.of(ship)
    report = report_of(motion, heave, imu_only, plan, rao, way, vehicle)
    report = report._replace(settings=of_intake(settings), topics=dict(topics))
    before = 0.0  # s simulated under the same motion
    own_plan = winch is not None
    if resumed is not None:
        before, kept = resumed.before(report), resumed.plan(report)
        own_plan |= controller is not None and kept is not None
        plan = plan or (kept if controller is None else None)
        report = report._replace(winch=None if plan is None else str(plan))
    bag = bag_path(out)
    if save is not None:
        check_place(save)
    with in_the_sea(rao is not None):
        scene = _scene_of(scene, resumed, algorithm, step, every, settings)
    control = None
    if controller is not None:
        control = ControlLoop(controller, control_period, scene.solver.tick, scene.instruments, flaps_of(scene))
    if duration is None and motion is None:
        last = max([one.time for one in live] + ([plan.last - before] if plan is not None else []), default=-AFTER_PLAN)
        duration = max(seconds_of(heave, rao, scene, way) - (0.0 if way is None else before), last + AFTER_PLAN) or None
    endless = (heave, rao, way, vehicle) != (None, None, None, None)
    lasts = before + duration if duration is not None and endless else duration

    def moved() -> RecordedTow | None:
        own = motion_of(scene, motion, heave, lasts, imu_only, settings, topics, rao, way)
        return beside_vehicle(own, vehicle, scene, lasts)

    tow = moved()
    if tow is not None and (plan is not None or control is not None):
        tow.events = [event for event in tow.events if not event.is_command]
    one = MessageRun(scene, tow, progress=progress, winch=plan, control=control, changes=live)
    driven = one.run(duration, bag, markers, resumed, own_plan)
    before = one.done_before * one.tick * 1e-9
    result = _run_of(one.sim, one.tick, tow, driven, bag, before)
    result.metrics.update(_intake_metrics(one))
    result.metrics["imu_only"] = imu_only
    if tow is not None and tow.sea_motion:
        result.metrics["rao"] = tow.sea_motion
    result.metrics |= {} if plan is None else {"winch": str(plan)}
    if way is not None:
        result.metrics |= {"ship": str(way), "phases": phase_figures(way, scene.ship, result.frames, before)}
    if scenario is not None:
        result.metrics |= {"scenario": scenario.scenario, "faults": found(scenario, result.frames)}
    if live:
        result.metrics["changes"] = [str(one) for one in one.changes]
    if control is not None:
        result.metrics["controller"] = control.metrics() | {"limited": dict(one.commands.clamped)}
    if resumed is not None:
        result.metrics["resumed"] = resumed.metrics()
    if save is not None and result.problem:
        result.problem += f"; its state was not saved to {os.fspath(save)}"
    elif save is not None:
        save_run(save, one, report)
        result.metrics["saved"] = os.fspath(save)
    judged(result, scene, [*one.doubts, *(tow.doubts if tow else ()), *_damage(tow)], before=before)
    if check:
        with in_the_sea(rao is not None):
            refinement_check.compare(result, scene, moved, duration, plan, progress, live)
    write_summary(out, result)
    if one.failed is not None:
        one.failed.run = result
        raise one.failed
    return result


def _scene_of(
    scene: Scene | str | os.PathLike | None,
    resumed: Resumed | None,
    algorithm: str | None,
    step: str | None,
    every: float | None,
    settings: Settings,
) -> Scene:
    """The scene to run; SaveError where it is not that of the state to begin from, but for the set-point algorithm."""
    scene = as_set(resumed.scene if scene is None and resumed is not None else scene, settings, algorithm)
    if lost := overwritten(scene, settings, step, every):
        raise SceneError(lost)
    scene = stepped(scene, step, every)
    if resumed is not None:
        but = (*DRIVEN, *(() if algorithm is None else ("setpoint.algorithm",)))
        same_scene(resumed.path, resumed.scene, scene, but=but)
    return scene


def replay(
    bag: str | os.PathLike,
    scene: Scene | str | os.PathLike | None = None,
    *,
    algorithm: str | None = None,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
    out: str | os.PathLike | None = None,
    markers: float = 0.0,
    progress: Progress = silent,
) -> Run:
    """Simulate a recorded bag again and compare with what it recorded of the tow.

    scene: default the one kept in the bag. The start is the recorded one where the bag has it. algorithm, settings,
    topics, markers: as of `run`; how messages are taken in can be set where the bag has no journal alone.
    The Run has ``frames`` [ticks] as of `run`, and ``residuals``, ours less recorded, with their units.
    Raises as `run`, and BagError where no scene is given and the bag keeps none.
    """
    check_rate(markers)
    target = bag_path(out)
    tow = read_tow(find_bag(bag), topics=topics)
    origin = _origin_of(tow)
    with in_the_sea(bool(tow.sea_motion)):
        scene, own = scene_of_bag(tow, scene, algorithm, settings)
    if tow.journal:
        refuse_without_bag(settings, topics, "in the journal of the bag, as the run took it")
    apply_to_bag(tow, settings)
    frames = recorded_frames(tow)
    report = read_journal(tow.journal)
    doubts: list[Reason] = []
    same = again = None
    if report.segments:
        again = JournalReplay(scene, tow, report, frames, progress)
        result = _run_of(again.sim, again.tick, tow, again.run(target, markers), target)
        faults = again.faults
        if again.same:
            same = again.same_ticks
            faults += verdict.uncompared(result.frames, frames, same)
        if faults and own:
            doubts.append(verdict.check("JOURNAL", "; ".join(faults)))
    else:
        tow.events = at_speed(tow.events, tow.about, scene.ship.tow_speed)
        sources.look(tow, scene, *recorded_intake(tow))
        one = MessageRun(scene, tow, progress=progress)
        result = _run_of(one.sim, one.tick, tow, one.run(None, target, markers), target)
        result.metrics.update(_intake_metrics(one))
        doubts += one.doubts
        faults = [*tow.notices, *report.faults, NO_JOURNAL]
        if tow.journal and own:
            said = [*report.faults, "the journal has no start to begin from"]
            doubts.append(verdict.check("JOURNAL", "; ".join(said)))
    result.residuals = residuals(result.frames, tow, same)
    result.metrics.update(
        residuals=[row._asdict() for row in result.residuals],
        largest_difference=largest_difference(result.frames, frames, same),
        recorded_ticks=0 if frames is None else len(frames),
        journal=bool(report.segments),
        replay_faults=faults,
        **origin,
    )
    if not result.residuals and result.metrics["largest_difference"] is None:
        doubts.append(
            verdict.check(
                "NOT_COMPARED",
                f"{tow.path} recorded nothing of the tow at the times of this replay (no sheave/tension, towbody/pose "
                "or winch/state), so nothing says whether this is the tow that was. For a run under its motion: "
                "cable-sim run --motion",
            )
        )
    if own:  # another scene is compared on purpose
        mean = result.metrics.get("tension_mean_n", 0.0)
        doubts += verdict.differences(result.residuals, mean, bool(report.segments))
    if own and again is not None:  # whether it is the run, apart from what the run was
        result.run_verdict = judged(result, scene).verdict
        doubts += again.other_end(result.problem)
        result.verdict = verdict.verdict_of([*doubts, *_damage(tow)])
        result.metrics |= {"run_verdict": result.run_verdict.as_dict(), "verdict": result.verdict.as_dict()}
    else:
        judged(result, scene, [*doubts, *_damage(tow)])
    write_summary(out, result)
    return result


def recorded(path: Path, nothing: str = "no plan is made", instead: str = "cable-sim plan SCENE") -> Run:
    """A recorded run, its figures made again from what it recorded, judged. BagError where it keeps no scene: then
    ``nothing`` is done, and what to do instead."""
    found = load_run(path)
    about, text = found.custom_data, found.custom_data.get("scene_yaml")
    if not text:
        raise BagError(
            f"bag '{path}' keeps no scene, so what its winch has is not known: {nothing}; give a bag that the "
            f"node or the offline run recorded, or {instead}"
        )
    tow = read_tow(path)
    origin = _origin_of(tow)
    with in_the_sea(bool(tow.sea_motion)):
        scene = scene_from_text(text, f"scene kept in {path}")
    metrics = summarize(found.frames, skip_s=start_up(scene, True))
    metrics.update(scene=scene.name, motion=about.get("motion", "as recorded"), setpoint=scene.setpoint.algorithm.value)
    metrics.update({"winch": about["winch_plan"]} if "winch_plan" in about else {}, **watched(scene, found.frames))
    metrics.update(origin)
    segments = read_journal(tow.journal).segments
    problem = "the solver gave up in the recorded run" if segments and segments[-1].halted else ""
    return judged(Run(found.frames, metrics, problem, path, scene=scene), scene)


def _origin_of(tow: RecordedTow) -> dict[str, Any]:
    """Note what a bag says of where its motion comes from, waves or an import; that, for the figures of a run."""
    tow.sea_motion, tow.imported = sea_motion_kept(tow), provenance(tow.about)
    return {name: one for name, one in (("rao", tow.sea_motion), ("imported", tow.imported)) if one}


def _damage(tow: RecordedTow | None) -> list[Reason]:
    return [verdict.check("DAMAGE", tow.damage)] if tow is not None and tow.damage else []


def judged(
    result: Run,
    scene: Scene | None,
    others: Iterable[Reason] = (),
    frames: np.recarray | None = None,
    before: float = 0.0,
) -> Run:
    """The run with its verdict, in its figures too.

    others: reasons beside those of its tick outputs; frames: those that count, default all; before: s before the run.
    """
    counted = result.frames if frames is None else frames
    if scene is not None and not result.problem:
        others = [*others, *still_growing(scene, result.metrics, before)]
    judged_as = verdict.judge(counted, scene, [*others, *doubts_of_steps(result.metrics)], result.problem)
    result.verdict = judged_as._replace(notes=notes_of(result.metrics, scene) + verdict.began(result.frames, scene))
    if result.problem:
        result.metrics["problem"] = result.problem
    result.metrics["verdict"] = result.verdict.as_dict()
    return result


def largest_difference(
    ours: np.recarray, theirs: np.recarray | None, same: SameTicks | None = None
) -> dict[str, Any] | None:
    """Largest difference of any tick output field over the ticks both have (same: which these are, else by time); None
    without a common tick."""
    if theirs is None:
        return None
    at = paired(ours["time"], theirs["time"]) if same is None else same.of("sim_health", theirs["time"])
    mine, other = at[at >= 0], np.flatnonzero(at >= 0)
    if not len(mine):
        return None
    worst: dict[str, Any] = {"field": "", "difference": 0.0, "ticks": len(mine)}
    for name in ours.dtype.names or ():
        gap = np.abs(np.asarray(ours[name][mine], float) - np.asarray(theirs[name][other], float))
        value = float(np.nanmax(gap)) if np.isfinite(gap).any() else 0.0
        if value > worst["difference"]:
            worst.update(field=name, difference=value)
    return worst


def _run_of(
    sim: Simulator, tick: int, tow: RecordedTow | None, driven: Stepped, bag: Path | None, before: float = 0.0
) -> Run:
    """The run's figures; tick: ns; before: s that had been simulated when it began."""
    frames, scene = driven.frames, sim.scene
    metrics: dict[str, Any] = {}
    if len(frames):
        simulated = len(frames) * tick * 1e-9
        skip = max(0.0, start_up(scene, tow is not None) - before)
        metrics = summarize(frames, skip_s=skip, realtime_factor=simulated / driven.stepping_s)
        kept = frames[-1:] if tow is None and not growth(scene)[1] else frames
        if scene.bodies:
            counted, _ = after_start(frames, skip)
            metrics["bodies"] = of_bodies(scene.bodies, driven.bodies[-len(counted) :], counted)
        metrics.update(
            departure_angle_deg=float(np.degrees(kept["departure_angle"].mean())),
            contact_resultant_n=float(kept["contact_resultant"].mean()),
        )
    metrics.update(
        ticks=len(frames),
        compile_s=driven.compile_s,
        start_s=driven.start_s,
        stepping_s=driven.stepping_s,
        scene=scene.name,
        motion="none" if tow is None else Path(tow.path).name,
        setpoint=scene.setpoint.algorithm.value,
        winch_modes={word: driven.modes[word] * tick * 1e-9 for word in WORDS if word in driven.modes},
    )
    metrics.update(watched(scene, frames))
    metrics.update(metrics_of_steps(sim.steps, sim.state.now.control, scene.solver))
    return Run(frames, metrics, driven.problem, bag, scene=scene)


def _intake_metrics(one: MessageRun) -> dict[str, Any]:
    """What of a bag's messages was not taken as it came."""
    if one.feeder is None or one.tow is None:
        return {}
    intake = one.feeder.intake
    return {
        "motion_refused": intake.refusals(),
        "commands_refused": dict(intake.commands.refused),
        "commands_limited": dict(intake.commands.clamped),
        **({} if intake.vehicle is None else {"vehicle_refused": intake.vehicle.refusals_by_cause()}),
        "clock_jumps": intake.clock.jumps,
        "notices": [*one.tow.notices, *intake.ingest.notices],
        **({"motion_rounded": one.tow.rounded} if one.tow.rounded else {}),
        **({"imported": one.tow.imported} if one.tow.imported else {}),
    }
