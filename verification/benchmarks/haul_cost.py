"""What cable costs: on the drum, paid out, in elements. ``cable-sim bench --haul``.

full_scale with compensation under the recorded motion, one mesh for every length; all points in turn, medians.
"""

from __future__ import annotations

import statistics
from functools import partial
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.mesh.mesh_kinds import FeedMesh
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table

from .tow_bench import drive, simulated
from .turns import in_turn

ON_DRUM = (50.0, 200.0, 500.0, 1000.0, 2000.0)  # m, with the scope of the scene out
PAID_OUT = (200.0, 300.0, 450.0, 700.0, 1000.0)  # m of scope, LEFT on the drum
DOUBLINGS = (0, 1, 2, 3)
LEFT, ROOM = 100.0, 10.0  # m; soft limit of the scope beyond that at the start
SECONDS, TICK, TURNS = 20.0, 0.02, 5
HUNDRED = 100.0  # m


class Cost(NamedTuple):
    """A point: what is varied (drum, out: m; elements: 1), its value, CPU s per simulated s, us per correction."""

    varied: str
    at: float
    cpu_s_per_sim_s: float
    us_per_iteration: float


class Study(NamedTuple):
    """Points; change of the cost per 100 m over its mean, of a step and of a correction; how far the cost of a mesh is
    off a straight line through all of them, at most."""

    points: list[Cost]
    slopes: dict[str, tuple[float, float]]
    off_line: float


def scene_with(on_drum: float, scope: float) -> Scene:
    """full_scale with so much cable [m] on the drum and out."""
    base = override(load_scene("full_scale"), {"solver.tick": TICK})
    faired = base.cable.sections["faired"].length
    total = on_drum + layout_of(base).route.inboard + scope
    values = {"cable.sections.bare.length": total - faired, "winch.scope": scope, "winch.most_scope": scope + ROOM}
    return override(base, values)


def jobs() -> list[tuple[str, float, Scene, FeedMesh | None]]:
    """What is varied, its value, scene and mesh."""
    base = override(load_scene("full_scale"), {"solver.tick": TICK})
    mesh, scope = layout_of(base).mesh, float(base.winch.scope or 0.0)
    found = [("drum", metres, scene_with(metres, scope), mesh) for metres in ON_DRUM]
    found += [("out", metres, scene_with(LEFT, metres), mesh) for metres in PAID_OUT]
    for doublings in DOUBLINGS:
        finer = mesh
        for _ in range(doublings):
            finer = None if finer is None else finer.doubled
        found.append(("elements", 0.0 if finer is None else finer.nodes - 1.0, base, finer))
    return found


def costs(turns: int = TURNS, progress: Progress = silent) -> Study:
    """Medians of so many turns over all points."""
    tow, todo = read_tow(find_bag("nbp1406")), jobs()

    def run(scene: Scene, mesh: FeedMesh | None) -> tuple[float, float]:
        driven = drive(scene, tow, mesh, None, SECONDS)
        time = simulated(driven.frames, scene)
        return driven.stepping_cpu_s / time, float(driven.frames.iterations.sum()) / time

    times, corrections = in_turn(
        [partial(run, scene, mesh) for _, _, scene, mesh in todo],
        turns,
        progress,
        [f"{what} {at:g}" for what, at, *_ in todo],
    )
    medians = [statistics.median(t) for t in times]
    points = [Cost(what, at, cost, 1e6 * cost / each) for (what, at, *_), cost, each in zip(todo, medians, corrections)]
    slopes = {what: (slope(points, what, 2), slope(points, what, 3)) for what in ("drum", "out")}
    x, y = np.array([p[1:3] for p in points if p.varied == "elements"]).T
    line = np.polyval(np.polyfit(x, y, 1), x)
    return Study(points, slopes, float(np.abs(y / line - 1.0).max()))


def slope(points: list[Cost], what: str, column: int) -> float:
    """Change of a column of the points per 100 m, over its mean."""
    x, y = np.array([(p[1], p[column]) for p in points if p.varied == what]).T
    return float(HUNDRED * np.polyfit(x, y, 1)[0] / y.mean())


def study(repeats: int | None, progress: Progress) -> tuple[dict, str]:
    """Points and slopes as data, and the table of docs/benchmarks.md."""
    found = costs(repeats or TURNS, progress)
    names = {"drum": "m on the drum", "out": "m paid out", "elements": "elements"}
    lines = [
        (names[p.varied], f"{p.at:g}", f"{p.cpu_s_per_sim_s:.2g}", f"{p.us_per_iteration:.1f}") for p in found.points
    ]
    words = "; ".join(
        f"{names[what]}: {100.0 * step:+.2f} % of a step and {100.0 * each:+.2f} % of a correction per 100 m"
        for what, (step, each) in found.slopes.items()
    )
    table = markdown_table([("varied", "value", "CPU s per s", "us per correction"), *lines])
    data = found._asdict() | {"points": [point._asdict() for point in found.points]}
    return data, f"{table}\n\n{words}; meshes: at most {100.0 * found.off_line:.0f} % off a straight line."
