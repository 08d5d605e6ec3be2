"""Is the error promised for a mesh kept? ``cable-sim bench --mesh``: every tow against its own finer mesh and step;
those of other kinds, driven, against four times their elements and small fixed steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.io.sources.motion_table import sine_heave
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.runs.mesh import at_scope, check, heave_of, kept, plan_of
from cable_sim_ros.runs.message_run import MessageRun, Progress, silent
from cable_sim_ros.runs.step_choice import stepped
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.mesh.mesh_kinds import FeedMesh
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.terminal import markdown_table

from .mesh_tows import Tow, other_tows, tows

NOTES = {
    "flume_10m": "the line skims the water over metres, tension 0.03 N: where it leaves the surface moves with the mesh"
}


class Promise(NamedTuple):
    """A tow: promised and measured errors, tension relative, place in m; measured against twice the elements."""

    scene: str
    scope: float
    elements: int
    tick: float
    tension_promised: float
    position_promised: float
    tension_static: float
    position_static: float
    tension_mean: float
    tension_deviation: float
    position_heave: float
    kept: bool
    note: str


def promise_of(scene: Scene, seconds: float = 60.0) -> Promise:
    """Promise and check of one tow; seconds 0: statics alone (zeros for the heave). The step is the plan's."""
    _, plan = plan_of(scene)
    scene = scene.model_copy(update={"solver": scene.solver.model_copy(update={"tick": plan.tick})})
    start = layout_of(scene).route.scope
    promised, changes = at_scope(plan, start), check(scene, plan, seconds=seconds)
    static, heave = changes[0], changes[-1]
    moved = seconds > 0.0
    return Promise(
        scene.name,
        start,
        plan.mesh.nodes - 1,
        plan.tick,
        promised.tension,
        promised.position,
        static.tension,
        static.position,
        heave.tension if moved else 0.0,
        heave.deviation if moved else 0.0,
        heave.position if moved else 0.0,
        kept(plan, start, changes),
        NOTES.get(scene.name, ""),
    )


def promised_table(rows: list[Promise]) -> str:
    """The first table of docs/mesh_tables.md."""
    head = "tow | scope [m] | heave [m] | elements | step [ms] | promised: tension [%] / place [mm] | static"
    head += " | heave: mean / deviation [%] / place [mm] | kept"
    heaves = {scene.name: heave_of(scene)[0] for scene in tows()}
    lines = [
        (
            f"`{r.scene}`",
            f"{r.scope:.4g}",
            f"{heaves[r.scene]:.2g}",
            str(r.elements),
            f"{1e3 * r.tick:g}",
            f"{100 * r.tension_promised:.2g} / {1e3 * r.position_promised:.2g}",
            f"{100 * r.tension_static:.1g} / {1e3 * r.position_static:.1g}",
            f"{100 * r.tension_mean:.1g} / {100 * r.tension_deviation:.1g} / {1e3 * r.position_heave:.1g}",
            "yes" if r.kept else "**no**" + (f": {r.note}" if r.note else ""),
        )
        for r in rows
    ]
    return markdown_table([head.split(" | "), *lines])


SECONDS, SKIP = 60.0, 20.0  # of a run, and what of it is left out of mean and deviation
EVERY = 0.1  # s between tick outputs
STEP, SMALL_STEP = 0.01, 0.0025  # s: as in real time, and of the reference


class Got(NamedTuple):
    """A tow: promised, and got by fixed steps of STEP and by chosen ones; tension relative, place in m."""

    tow: str
    scope: float
    elements: int
    tension_promised: float
    position_promised: float
    tension_static: float
    position_static: float
    tension_mean: float
    tension_deviation: float
    position: float
    deviation_of_mean: float  # deviation of the tension over its mean: what the errors are relative to
    chosen_mean: float
    chosen_deviation: float
    chosen_position: float
    kept: bool
    problem: str


def _run(tow: Tow, scene: Scene, mesh: FeedMesh, seconds: float) -> tuple[np.ndarray, np.ndarray, str]:
    """Tension [n] and place of the towbody [n, 3] each EVERY s, and why it ended early."""
    motion = None if tow.heave is None else sine_heave(*tow.heave, seconds, scene.ship)
    plan = None if tow.plan is None else WinchPlan(tow.plan)
    done = MessageRun(scene, motion, winch=plan, mesh=mesh).run(seconds, None)
    fraction = round(EVERY / scene.solver.tick)
    frames = done.frames[fraction - 1 :: fraction]
    return frames["tension"], frames["body_position"], done.problem


def measure(tow: Tow, seconds: float = SECONDS, small_step: float = SMALL_STEP) -> Got:
    """Promise and result of one tow; seconds 0: statics alone (zeros for the rest)."""
    hold = tow.scene.setpoint.model_copy(update={"algorithm": SetpointLaw.HOLD})
    scene, plan = plan_of(tow.scene.model_copy(update={"setpoint": hold}))
    start, fine = layout_of(scene).route.scope, plan.mesh.doubled.doubled
    promised, rest = at_scope(plan, start), []
    for mesh in (plan.mesh, fine):
        sim = Simulator(scene, mesh)
        sim.start()
        rest.append(sim.frame.copy())
    static = float(rest[0].tension / rest[1].tension - 1.0)
    apart = float(np.linalg.norm(rest[0].body_position - rest[1].body_position))
    errors, fraction, problem = [(0.0, 0.0, 0.0)] * 2, 0.0, ""
    if seconds > 0.0:
        reference = _run(tow, stepped(scene, "fixed", small_step), fine, seconds)
        late = slice(round(SKIP / SECONDS * seconds / EVERY), len(reference[0]))
        pull, problem, errors = reference[0][late], reference[2], []
        fraction = float(pull.std() / pull.mean())
        for one in (stepped(scene, "fixed", STEP), stepped(scene, "chosen", EVERY)):
            tension, place, ended = _run(tow, one, plan.mesh, seconds)
            problem = problem or ended
            count = min(len(tension), len(reference[0]))
            got = tension[:count][late]
            away = np.linalg.norm(place[:count] - reference[1][:count], axis=1)
            errors.append(
                (float(got.mean() / pull.mean() - 1.0), float(got.std() / pull.std() - 1.0), float(away.max()))
            )
    kept = not problem and all(
        abs(mean) <= promised.tension and abs(deviation) <= promised.tension and place <= promised.position
        for mean, deviation, place in [(static, 0.0, apart), *errors]
    )
    return Got(
        scene.name,
        start,
        plan.mesh.nodes - 1,
        promised.tension,
        promised.position,
        static,
        apart,
        *errors[0],
        fraction,
        *errors[1],
        kept,
        problem,
    )


def others(seconds: float = SECONDS, progress: Progress = silent) -> list[Got]:
    """Every tow of `other_tows`."""
    tows, found = other_tows(), []
    for i, tow in enumerate(tows):
        progress(tow.scene.name, float(i), float(len(tows)))
        found.append(measure(tow, seconds))
    return found


def study(repeats: None, progress: Progress) -> tuple[dict, str]:
    """Both kinds of tows as data, and docs/mesh_tables.md."""
    first, second = [promise_of(scene) for scene in tows()], others(progress=progress)
    text = (
        "# Is the promise of the mesh kept?\n\n"
        "Made by `cable-sim bench --mesh --out DIR` as `DIR/mesh.md`; do not edit. Conditions and\n"
        "misses: [mesh](mesh.md#is-the-promise-kept).\n\n"
        f"## Tows of one cable, one towbody\n\n{promised_table(first)}\n\n## Other tows\n\n{markdown(second)}"
    )
    return {"tows": [row._asdict() for row in first], "other_tows": [row._asdict() for row in second]}, text


def markdown(rows: list[Got]) -> str:
    """The second table of docs/mesh_tables.md."""
    head = "tow | scope [m] | elements | promised: tension [%] / place [mm] | static"
    head += " | fixed 10 ms: mean / deviation [%] / place [mm] | chosen steps | deviation over mean [%] | kept"
    lines = [
        (
            f"`{r.tow}`",
            f"{r.scope:.4g}",
            str(r.elements),
            f"{100 * r.tension_promised:.2g} / {1e3 * r.position_promised:.2g}",
            f"{100 * r.tension_static:.1g} / {1e3 * r.position_static:.1g}",
            f"{100 * r.tension_mean:.1g} / {100 * r.tension_deviation:.2g} / {1e3 * r.position:.2g}",
            f"{100 * r.chosen_mean:.1g} / {100 * r.chosen_deviation:.2g} / {1e3 * r.chosen_position:.2g}",
            f"{100 * r.deviation_of_mean:.2g}",
            "yes" if r.kept else f"**no** {r.problem}".strip(),
        )
        for r in rows
    ]
    return markdown_table([head.split(" | "), *lines])
