"""Is the error promised for a mesh kept? ``cable-sim bench --mesh``: every tow against its own finer mesh and step."""

from __future__ import annotations

from typing import NamedTuple

from cable_sim_ros.runs.mesh import at_scope, check, heave_of, kept
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table

from .mesh_tows import tows

NOTES = {
    "flume_10m": "the line skims the water over metres, tension 0.03 N: where it leaves the surface moves with the mesh"
}


class Row(NamedTuple):
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


def measure(scene: Scene, seconds: float = 60.0) -> Row:
    """Promise and check of one tow; seconds 0: statics alone (zeros for the heave). The step is the plan's."""
    plan = layout_of(scene).plan
    if plan is None:
        raise ValueError(f"{scene.name} has no mesh made for it")
    scene = scene.model_copy(update={"solver": scene.solver.model_copy(update={"tick": plan.tick})})
    start = layout_of(scene).route.scope
    promised, changes = at_scope(plan, start), check(scene, plan, seconds=seconds)
    static, heave = changes[0], changes[-1]
    moved = seconds > 0.0
    return Row(
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


def promises(seconds: float = 60.0) -> list[Row]:
    """Every tow of mesh_tows."""
    return [measure(scene, seconds) for scene in tows()]


def markdown(rows: list[Row]) -> str:
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
