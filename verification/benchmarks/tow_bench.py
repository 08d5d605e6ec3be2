"""P7: the whole tow of full_scale under recorded ship motion, the feeding drum beside the one with contact.

Every setting runs ``repeats`` times, all of them in turn; the speed is the median of the CPU time of stepping
alone. The feeding drum is measured against its own refined mesh, the drum with contact, the yardstick, against its own.
"""

from __future__ import annotations

import statistics
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.io.sources.recorded_tow import RecordedTow, read_tow
from cable_sim_ros.runs.message_run import MessageRun, Progress, Stepped, silent
from cable_sim_ros.runs.offline import stepped
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.mesh.mesh_kinds import FeedMesh
from cable_sim_ros.sim.scene import Scene

from .row import Row
from .turns import in_turn

SECONDS, SKIP = 40.0, 10.0  # of nbp1406, and what of it is left out of the statistics
LAWS = ("hold", "simplified_sheave")
FEED_TICKS = (0.01, 0.02, 0.05, None)  # s; None: steps chosen by their error
CONTACT_TICKS = (0.01, 0.05)
REFINED_CONTACT = (52, 4, 144, 48, 36)  # elements of drum, span, sheave, bare, faired
FINE_TICK = 0.005
SAMPLE = 0.1  # s between the samples that are compared
FINE_TOLERANCE = 2e-8  # of the working tension; ten times that leaves millimetres of the towbody's place


class Setting(NamedTuple):
    """What is run; it is measured against the reference of its drum."""

    law: str
    drum: str
    scene: Scene

    @property
    def name(self) -> str:
        """Set-point, mesh and step, as in the table."""
        return shown_setting(self.law, self.drum, self.scene)


def shown_setting(law: str, drum: str, scene: Scene) -> str:
    """Set-point, drum, mesh and step, as in the table."""
    solver = scene.solver
    step = f"{1e3 * solver.tick:g} ms" if solver.tension_error is None else f"chosen, {solver.tension_error:g}"
    return f"{law}, {drum} {'-'.join(map(str, mesh_numbers(scene)))}, {step}"


def mesh_numbers(scene: Scene) -> list[int]:
    """Elements of the parts of the mesh, from the drum."""
    plan = layout_of(scene).plan
    if plan is None:
        return [section.elements or 0 for section in scene.cable.sections.values()]
    return [part.elements for part in plan.parts]


class Fine(NamedTuple):
    """A reference: a scene and a feeding mesh in place of the scene's, None: that of the scene."""

    scene: Scene
    mesh: FeedMesh | None

    @property
    def elements(self) -> int:
        """Elements of its mesh."""
        return sum(mesh_numbers(self.scene)) if self.mesh is None else self.mesh.nodes - 1


def refined(scene: Scene, doublings: int, tick: float) -> Fine:
    """The scene on its feeding mesh doubled so often, with steps of ``tick`` [s] solved to FINE_TOLERANCE."""
    mesh = layout_of(scene).mesh
    for _ in range(doublings):
        mesh = None if mesh is None else mesh.doubled
    fine = stepped(scene, "fixed", tick)
    return Fine(override(fine, {"solver.tolerance": FINE_TOLERANCE}), mesh)


def settings(law: str) -> list[Setting]:
    """The rows of one set-point algorithm."""
    feed = override(load_scene("full_scale"), {"setpoint.algorithm": law})
    contact = override(load_scene("full_scale_contact"), {"setpoint.algorithm": law})
    rows = [Setting(law, "feed", stepped(feed, "chosen" if tick is None else "fixed", tick)) for tick in FEED_TICKS]
    return rows + [Setting(law, "contact", stepped(contact, "fixed", tick)) for tick in CONTACT_TICKS]


def references(law: str) -> dict[str, Fine]:
    """What a Setting is measured against, by name; `check` is what that of `feed` is measured against."""
    feed = override(load_scene("full_scale"), {"setpoint.algorithm": law})
    contact = load_scene("full_scale_contact")
    meshes = {
        f"cable.sections.{name}.elements": n for name, n in zip(contact.cable.sections, REFINED_CONTACT, strict=True)
    }
    return {
        "feed": refined(feed, 2, FINE_TICK),
        "check": refined(feed, 3, 0.5 * FINE_TICK),
        "contact": Fine(override(contact, meshes | {"setpoint.algorithm": law, "solver.tick": FINE_TICK}), None),
    }


def rows(repeats: int, progress: Progress = silent) -> list[Row]:
    """P7, both set-points and both drums in turn."""
    tow = read_tow(find_bag("nbp1406"))
    jobs = [setting for law in LAWS for setting in settings(law)]
    times, last = in_turn(
        [partial(timed, job.scene, tow) for job in jobs], repeats, progress, [f"P7 {job.name}" for job in jobs]
    )
    costs = [statistics.median(t) for t in times]
    found = []
    for law in LAWS:
        fine = {name: (by, drive(by.scene, tow, by.mesh)) for name, by in references(law).items()}
        here = [k for k, job in enumerate(jobs) if job.law == law]
        yardstick = {jobs[k].scene.solver.tick: costs[k] for k in here if jobs[k].drum == "contact"}
        for k in here:
            by, reference = fine[jobs[k].drum]
            found.append(_row(jobs[k], last[k], costs[k], sampled(reference.frames, by.scene), yardstick))
        (by, driven), (check, checked) = fine["feed"], fine["check"]
        wrong = errors(sampled(driven.frames, by.scene), sampled(checked.frames, check.scene))
        found.append(of_reference("P7", law, by, check, driven, wrong))
    return found


def of_reference(name: str, law: str, fine: Fine, check: Fine, driven: Stepped, wrong: Errors) -> Row:
    """The row of a reference, run once, against one that is finer still."""
    scene, frames = fine.scene, driven.frames
    cost = driven.stepping_cpu_s / simulated(frames, scene)
    setting = f"{law}, feed refined, {1e3 * scene.solver.tick:g} ms"
    note = f"the reference, one run, against {check.elements} elements at {1e3 * check.scene.solver.tick:g} ms"
    return row_of(name, setting, fine.elements, scene, frames, cost, wrong)._replace(note=note)


def drive(
    scene: Scene,
    tow: RecordedTow,
    mesh: FeedMesh | None = None,
    winch: WinchPlan | None = None,
    seconds: float = SECONDS,
) -> Stepped:
    """So many seconds of recorded motion. Raises RuntimeError where the solver gives up."""
    driven = MessageRun(scene, tow, winch=winch, mesh=mesh).run(seconds, None)
    if driven.problem:
        raise RuntimeError(driven.problem)
    return driven


def timed(scene: Scene, *driven_by: Any) -> tuple[float, Stepped]:
    """CPU time of stepping [s per simulated s], and what was driven; arguments as of `drive`."""
    driven = drive(scene, *driven_by)
    return driven.stepping_cpu_s / simulated(driven.frames, scene), driven


def simulated(frames: np.recarray, scene: Scene) -> float:
    """Simulated time [s]."""
    return len(frames) * scene.solver.tick


def sampled(frames: np.recarray, scene: Scene) -> np.recarray:
    """Tick outputs each SAMPLE seconds, without the first SKIP."""
    every = round(SAMPLE / scene.solver.tick)
    frames = frames[every - 1 :: every]
    return frames[frames.time - frames.time[0] >= SKIP * 1e9]


class Errors(NamedTuple):
    """Relative errors of mean and standard deviation of the tension, rms of its difference [N], largest distance of
    the towbody [m]."""

    mean: float
    deviation: float
    rms: float
    place: float

    @property
    def tension(self) -> float:
        """The worse of mean and deviation."""
        return max(abs(self.mean), abs(self.deviation))


def errors(frames: np.recarray, fine: np.recarray) -> Errors:
    """Errors of frames against ``fine`` at the same times."""
    away = np.linalg.norm(frames.body_position - fine.body_position, axis=1).max()
    return Errors(
        float(frames.tension.mean() / fine.tension.mean() - 1.0),
        float(frames.tension.std() / fine.tension.std() - 1.0),
        float(np.sqrt(((frames.tension - fine.tension) ** 2).mean())),
        float(away),
    )


def row_of(
    name: str, setting: str, elements: int, scene: Scene, frames: np.recarray, cost: float, wrong: Errors
) -> Row:
    """The row of a run without its note; cost: CPU s per simulated s."""
    iterations = float(frames.iterations.sum())
    each = 1e6 * cost * simulated(frames, scene) / (elements * iterations)
    step, per_step = scene.solver.tick, iterations / float(frames.substeps.sum())
    return Row(name, "cable_sim_ros", setting, elements, step, wrong.tension, wrong.place, cost, each, per_step)


def compared(name: str, setting: str, scene: Scene, frames: np.recarray, cost: float, fine: np.recarray) -> Row:
    """The row of a run against a finer one at the same times; cost: CPU s per simulated s."""
    wrong = errors(sampled(frames, scene), fine)
    metrics = {
        "realtime_factor": 1.0 / cost,
        "error_mean": wrong.mean,
        "error_deviation": wrong.deviation,
        "rms_difference_n": wrong.rms,
    }
    row = row_of(name, setting, sum(mesh_numbers(scene)), scene, frames, cost, wrong)
    return row._replace(note=f"{1.0 / cost:.0f} x real time", metrics=metrics)


def _row(job: Setting, driven: Stepped, cost: float, fine: np.recarray, yardstick: dict[float, float]) -> Row:
    row = compared("P7", job.name, job.scene, driven.frames, cost, fine)
    deviation, note = float(sampled(driven.frames, job.scene).tension.std()), row.note
    metrics = row.metrics | {"tension_std_n": deviation, "reference_std_n": float(fine.tension.std())}
    if job.drum == "feed" and yardstick:
        ratios = {tick: base / cost for tick, base in yardstick.items()}
        metrics |= {f"over_contact_{1e3 * tick:g}_ms": ratio for tick, ratio in ratios.items()}
        shown = ", ".join(f"{ratio:.1f} x contact at {1e3 * tick:g} ms" for tick, ratio in ratios.items())
        note += f", {shown}"
    return row._replace(note=f"{note}; std {deviation:.1f} N, reference {fine.tension.std():.1f} N", metrics=metrics)
