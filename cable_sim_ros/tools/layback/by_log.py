"""The tow of a scene under a log of pay-out, speed, heading and depth: simulated, its drag adjusted to the depth."""

from __future__ import annotations

import warnings
from math import atan2, ceil, degrees, hypot, remainder
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ...errors import RunError
from ...io.scenes.load import SceneWarning, override
from ...io.sources.csv_table import CONSEQUENCE
from ...limits import MAX_TOW_SPEED
from ...physics.winch import DrumModel
from ...runs import offline
from ...runs.step_choice import longest_tick, metrics_of_steps, stepped
from ...runs.stepping import Progress, silent
from ...runs.summary import Run
from ...sim.inputs import ShipMotion, WinchCommand
from ...sim.layout import layout_of
from ...sim.scene import Scene
from ...sim.simulator import Simulator, SolverError
from ...sim.statics.route import DRUM_RESERVE
from ...sim.tables.sensor_tables import aboard
from ..ensemble.plan import Ranges, with_drag
from ..logs.log import LogError
from .laid import NoShape, Samples, Tow, courses, samples_of, spread, static_place
from .tow_log import STEP, TowLog
from .towed import NO_LEVER, Copied, Towed, joined, turned

SECOND = 1_000_000_000  # ns
BEGIN = 1.0  # s, stamp of the first sample: stamps above 0 stay as they are
TICK, LONG_TICK, LONG = 0.25, 0.5, 3600.0  # s between tick outputs, of a log longer than LONG
CRAB = 1.0  # deg between heading and course at the beginning, from which the tow is run in
RUN_IN = 2.0  # times the time in which the ship goes the length of the cable
LONGEST_RUN_IN = 1800.0  # s
LEAST_CABLE = 1.0  # m
BLOCK = 20  # STEPs that copies are run at once: each run costs some ms of its own
POINTS = 6  # samples at which the drag is adjusted
STILL = 0.2  # m/s


class Adjusted(NamedTuple):
    """The drag that gives the measured depths best: factor, whether it is at an end of its range, rms of the depths
    [m] at the samples with the scene's drag and with it."""

    factor: float
    at_end: bool
    before: float
    after: float


def checked_cable(log: TowLog, scene: Scene, offset: float) -> np.ndarray:
    """Cable out from the sheave [n]: the counter plus ``offset``. Raises LogError for what the drum does not have."""
    if scene.winch.drum is not DrumModel.FEED:
        raise LogError(
            f"{scene.name}: winch.drum = {scene.winch.drum.value} has the end of the cable fixed, so that it cannot "
            f"pay out as {log.path} says; {CONSEQUENCE}. Give a scene with winch.drum: feed"
        )
    cable = log.cable + offset
    held = sum(section.length for section in scene.cable.sections.values())
    route = layout_of(scene).route
    most = held - scene.winch.dead_length - DRUM_RESERVE * route.drum - route.on_drum - route.span
    if cable.min() < LEAST_CABLE:
        raise LogError(
            f"{log.path}: cable out goes down to {cable.min():.4g} m (counter {log.cable.min():.4g} m, "
            f"--counter-offset {offset:g} m), less than {LEAST_CABLE:g} m; {CONSEQUENCE}. Give --counter-offset so "
            f"that the cable out counts from the sheave to the towbody, or cut off launch and recovery"
        )
    if cable.max() > most:
        raise LogError(
            f"{log.path}: cable out goes up to {cable.max():.4g} m, and {scene.name} has {held:g} m of cable, of which "
            f"{most:.4g} m can be out; {CONSEQUENCE}. Give the length of your cable (cable.sections.<name>.length), or "
            f"--counter-offset"
        )
    return cable


def adjusted(log: TowLog, scene: Scene, cable: np.ndarray, samples: Samples, ranges: Ranges) -> Adjusted:
    """The factor on the drag, within its range, whose static depths are nearest to the measured ones. Raises LogError.

    The depth is taken as a parabola in the factor through three static tows a sample.
    """
    if log.depth is None:
        raise LogError(f"{log.path}: has no depth_m, so no drag can be adjusted to it; {CONSEQUENCE}. Leave --fit-drag")
    if ranges.drag <= 0.0:
        raise LogError(f"--range drag=0 leaves nothing to adjust; {CONSEQUENCE}. Give a range, or leave --fit-drag out")
    course = np.unwrap(courses(samples.velocity, samples.yaw))
    low, high = 1.0 - ranges.drag, 1.0 + ranges.drag
    factors, gaps = np.array([low, 1.0, high]), []
    for k in spread(samples, course, POINTS):
        east, north = samples.velocity[k].tolist()
        tow = Tow(float(cable[k]), east, north, float(samples.yaw[k]))
        try:
            depths = [static_place(scene, tow, float(factor)).depth for factor in factors]
        except NoShape:
            continue
        gaps.append(np.polyfit(factors - 1.0, np.array(depths) - log.depth[k], 2))
    if not gaps:
        raise LogError(f"{log.path}: no static shape at any sample, so no drag can be adjusted; {CONSEQUENCE}")
    grid = np.linspace(-ranges.drag, ranges.drag, 401)
    rms = np.sqrt(np.mean([np.polyval(gap, grid) ** 2 for gap in gaps], axis=0))
    best = int(np.argmin(rms))
    return Adjusted(1.0 + float(grid[best]), best in (0, len(grid) - 1), float(rms[200]), float(rms[best]))


class Told(NamedTuple):
    """What a tow is told, each STEP: scene of the start, seconds [n], track [n, 2] of base_link, yaw, cable out [n]."""

    scene: Scene
    seconds: np.ndarray
    track: np.ndarray
    yaw: np.ndarray
    cable: np.ndarray

    @property
    def stamps(self) -> list[int]:
        """ns."""
        return np.round(self.seconds * SECOND).astype(np.int64).tolist()

    def motion(self) -> list[ShipMotion]:
        """A sample each STEP, the ship level."""
        speed, rate = (CubicSpline(self.seconds, one)(self.seconds, 1).tolist() for one in (self.track, self.yaw))
        rows = zip(self.stamps, self.track.tolist(), speed, self.yaw.tolist(), rate, strict=True)
        return [
            ShipMotion(
                time_ns=stamp,
                position=(*place, self.scene.ship.reference_height),
                velocity=(*v, 0.0),
                attitude=(0.0, 0.0, yaw),
                rate=(0.0, 0.0, r),
            )
            for stamp, place, v, yaw, r in rows
        ]


class Simulated(NamedTuple):
    """A run under a log: tick outputs from the log's beginning on are ``run.frames[first:]``; notes: lines."""

    run: Run
    first: int
    notes: list[str]
    told: Told


def simulated(
    log: TowLog,
    scene: Scene,
    cable: np.ndarray,
    antenna: tuple[float, float] = (0.0, 0.0),
    drag: float = 1.0,
    progress: Progress = silent,
) -> Simulated:
    """Simulate the tow of a scene under a log; cable: out from the sheave [n]; antenna: in base_link, x and y [m];
    drag: factor on that of the scene. Raises LogError, SceneError, StartError."""
    swivels = "the block of the sheave swivels (sheave.swivel), which the scene's does not"
    notes = [] if scene.sheave.swivel else [swivels]
    track = log.track - turned(log.yaw, *antenna)
    velocity = np.gradient(track, STEP, axis=0)
    begin = velocity[: max(2, round(5.0 / STEP))].mean(axis=0)
    speed, yaw = hypot(*begin), float(log.yaw[0])
    if speed > MAX_TOW_SPEED:
        raise LogError(
            f"{log.path}: the ship begins at {speed:.3g} m/s, above {MAX_TOW_SPEED:g} m/s; {CONSEQUENCE}. Check "
            f"speed_mps and the positions"
        )
    crab = remainder(degrees(atan2(begin[1], begin[0]) - yaw), 360.0) if speed > STILL else 0.0
    run_in = 0
    if abs(crab) > CRAB:
        run_in = max(1, round(min(LONGEST_RUN_IN, RUN_IN * float(cable[0]) / speed) / STEP))
        notes.append(
            f"the ship begins {abs(crab):.3g} deg off its heading: the tow is run in over {run_in * STEP:g} s of a "
            f"straight way before the log"
        )
        before = track[0] - np.arange(run_in, 0, -1)[:, None] * STEP * begin
        track, log_yaw = np.vstack([before, track]), np.concatenate([np.full(run_in, yaw), log.yaw])
        cable = np.concatenate([np.full(run_in, cable[0]), cable])
    else:
        log_yaw = log.yaw
    seconds = BEGIN + STEP * np.arange(len(track))
    with warnings.catch_warnings(action="ignore", category=SceneWarning):  # the log has another start than the scene
        at_start = override(
            scene,
            {
                "winch.scope": float(cable[0]),
                "ship.tow_speed": speed,
                "ship.heading_deg": remainder(degrees(yaw), 360.0),
                "winch.command_timeout": max(scene.winch.command_timeout, 2.0 * STEP),
                "ship.max_gap": max(scene.ship.max_gap, 1.5 * STEP),
                "setpoint.algorithm": "hold",
                "sheave.swivel": True,
            },
        )
        at_start = stepped(at_start, "chosen", _tick(at_start, TICK if seconds[-1] < LONG else LONG_TICK))
    told = Told(with_drag(at_start, drag), seconds, track, log_yaw, cable)
    run = _run(told, progress)
    first = int(np.searchsorted(run.frames["time"], round((BEGIN + run_in * STEP) * SECOND)))
    gap = np.abs(run.frames["scope"] - np.interp(run.frames["time"] / SECOND, seconds, cable))[first:]
    if not len(gap):
        raise RunError(
            f"{log.path}: the run under the log ended before it began: {run.problem or 'no tick was simulated'}"
        )
    notes.append(f"the simulated winch is up to {gap.max():.2g} m from the cable out of the log")
    return Simulated(run, first, notes, told)


def copied(run: Simulated, towed: Towed, progress: Progress = silent) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Copies of the tow under the log: seconds since its first sample, figures of copy 0 [n, 4] and of the others
    [copies, n, 4]. Raises EnsembleEnded."""
    told, stamps = run.told, run.told.stamps
    motion, count = told.motion(), len(towed.draws) - 1
    towed.start(stamps[0], motion[0].position[:2], float(told.yaw[0]))
    inboard = float(towed.nominal.frame["payout"] - towed.nominal.frame["scope"])
    towed.push(motion[0])
    ticks, bands = round(STEP / told.scene.solver.tick), []
    for k in range(1, len(stamps), BLOCK):
        block = range(k, min(k + BLOCK, len(stamps)))
        for j in block:
            towed.push(motion[j])
            towed.push(WinchCommand(payout=inboard + float(told.cable[j]), time_ns=stamps[j - 1]))
        bands.append(towed.run(len(block) * ticks, ticks))
        progress(f"{count} copies of the tow", told.seconds[k] - BEGIN, told.seconds[-1] - BEGIN)
    times, nominal, copies = joined(bands)
    return (times - run.run.frames["time"][run.first]) / SECOND, nominal, copies


def interval_of(
    run: Simulated, ranges: Ranges, lever: tuple[float, float, float] = NO_LEVER, progress: Progress = silent
) -> Copied:
    """The interval of copies of the tow under the log. Raises EnsembleEnded, EnsembleError."""
    towed = Towed(run.told.scene, ranges, lever)
    seconds, nominal, copies = copied(run, towed, progress)
    return Copied(seconds, towed.interval(nominal, copies), len(towed.ends), [])


def _tick(scene: Scene, tick: float) -> float:
    """Seconds between tick outputs: a part of STEP, and as rules and instruments of the scene want it."""
    wanted = scene.solver.tick if aboard(scene) else min(tick, longest_tick(scene))
    return STEP / ceil(STEP / wanted - 1e-9)


def _run(told: Told, progress: Progress) -> Run:
    """The run of a scene whose ship and winch go as they are told."""
    progress("compiling or loading", 0.0, 0.0)
    scene, seconds, stamps, motion = told.scene, told.seconds, told.stamps, told.motion()
    sim = Simulator(scene)
    sim.warm_up()
    sim.start(stamps[0], motion[0].position[:2], float(told.yaw[0]))
    inboard = float(sim.frame["payout"] - sim.frame["scope"])
    ticks = round(STEP / scene.solver.tick)
    parts, problem = [], ""
    sim.push(motion[0])
    for k in range(1, len(stamps)):
        sim.push(motion[k])
        sim.push(WinchCommand(payout=inboard + float(told.cable[k])))
        try:
            parts.append(sim.run(ticks))
        except SolverError as error:
            parts.append(error.frames)
            problem = f"the solver gave up after {seconds[k - 1] - seconds[0]:.6g} s: {error}"
            break
        if k % 60 == 0:
            progress("simulating", seconds[k] - seconds[0], seconds[-1] - seconds[0])
    frames = np.concatenate(parts).view(np.recarray)
    run = Run(frames, metrics_of_steps(sim.steps, sim.state.now.control, scene.solver), problem, scene=scene)
    return offline.judged(run, scene)


def samples_of_log(
    log: TowLog, run: Simulated, antenna: tuple[float, float], lever: tuple[float, float, float] = NO_LEVER
) -> Samples:
    """Samples of a run under a log, with the depths that were measured where there are any."""
    made = samples_of(run.run.frames[run.first :].view(np.recarray), STEP, antenna, lever)
    if log.depth is None:
        return made
    return made._replace(depth=np.interp(made.seconds, log.seconds, log.depth))


def before_run(log: TowLog, scene: Scene, cable: np.ndarray, antenna: tuple[float, float]) -> Samples:
    """Samples of a log before anything is simulated: no towbody yet."""
    ahead, aside, up = scene.sheave.position
    sheave = log.track + turned(log.yaw, ahead - antenna[0], aside - antenna[1])
    velocity, height = np.gradient(sheave, STEP, axis=0), np.full(len(cable), up + scene.ship.reference_height)
    none = np.full(len(cable), np.nan)
    depth, fish = none if log.depth is None else log.depth, np.column_stack([none, none])
    return Samples(log.seconds, log.track, sheave, velocity, log.yaw, height, cable, depth, fish, none, none)
