"""What each option of the water costs a tick: the same tow without it, with its keys there but off, and with it on.
``cable-sim bench --water``.

full_scale with compensation under the recorded motion, ticks of 10 ms, one mesh for all; all runs in turn, medians of
the ratios of runs that follow each other.
What an option changes in the work of the solver (corrections of a tick) is part of its cost and stands beside it.
"""

from __future__ import annotations

import statistics
from functools import partial
from typing import Any, NamedTuple

from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.mesh.mesh_kinds import FeedMesh
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table

from ..shipped import scene_with
from .tow_bench import drive, simulated
from .turns import in_turn

SECONDS, TURNS = 30.0, 11
DEPTHS = {"depth": [0.0, 50.0, 200.0], "speed": [0.3, 0.2, 0.1], "towards_deg": [90.0, 60.0, 30.0]}
SEA = {
    "kind": "jonswap",
    "height": 2.0,
    "period": 8.0,
    "towards_deg": 180.0,
    "spreading": 10.0,
    "frame": "heading",
    "seed": 3,
}

# option: what switches it off with its keys there (none: it has no such state), what switches it on
Changes = dict[str, Any]
OPTIONS: dict[str, tuple[Changes | None, Changes]] = {
    "drag law `huston_kamman_10`": (None, {"cable.sections.bare.drag_law": "huston_kamman_10"}),
    "drag law `dymore`": (
        None,
        {
            "cable.sections.bare.drag_law": "dymore",
            "cable.sections.bare.drag_coefficient": 1.2,
            "cable.sections.bare.friction_coefficient": 0.01,
        },
    ),
    "constant amplification 2": (
        {"cable.sections.bare.drag_amplification": 1.0},
        {"cable.sections.bare.drag_amplification": 2.0},
    ),
    "strumming (`viv`)": (
        {"viv.law": "off"},
        {"viv.law": "govardhan_williamson", "cable.sections.bare.drag_amplification": 1.0},
    ),
    "current by depth": (None, {"water.current_table": DEPTHS, "water.current_frame": "heading"}),
    "turbulence, 100 components an axis": (
        {"water.turbulence.deviation": [0.0, 0.0, 0.0]},
        {"water.turbulence.deviation": [0.03, 0.03, 0.015], "water.turbulence.time_scale": 8.0},
    ),
    "waves, 100 components": ({"water.waves.kind": "off"}, {f"water.waves.{key}": value for key, value in SEA.items()}),
    "links (`cable.model: segments`)": ({"cable.model": "ancf"}, {"cable.model": "segments"}),
}


class Cost(NamedTuple):
    """One option: microseconds a tick of the tow without it, with its keys there but off, on; corrections a tick."""

    option: str
    absent_us: float
    off_us: float | None
    on_us: float
    absent_corrections: float
    on_corrections: float

    @property
    def off(self) -> float | None:
        """What its keys add, switched off [%]."""
        return None if self.off_us is None else 100.0 * (self.off_us / self.absent_us - 1.0)

    @property
    def on(self) -> float:
        """What it adds, switched on [%]."""
        return 100.0 * (self.on_us / self.absent_us - 1.0)


def changed(changes: Changes) -> Scene:
    """full_scale without any factor found by hand, and with these changes."""
    plain = {f"cable.sections.{name}.drag_amplification": 1.0 for name in load_scene("full_scale").cable.sections}
    return scene_with("full_scale", plain | changes)


def costs(turns: int = TURNS, progress: Progress = silent) -> list[Cost]:
    """Medians over ``turns`` runs of each option, the three of an option in turn within seconds."""
    tow, found = read_tow(find_bag("nbp1406")), []
    for k, (name, (off, on)) in enumerate(OPTIONS.items()):
        scenes = [changed(changes) for changes in ({}, off, on) if changes is not None]
        mesh = layout_of(scenes[0]).mesh
        progress(name, k, len(OPTIONS))

        def run(scene: Scene, mesh: FeedMesh | None = mesh) -> tuple[float, float]:
            driven = drive(scene, tow, mesh, None, SECONDS)
            ticks = round(simulated(driven.frames, scene) / scene.solver.tick)
            return 1e6 * driven.stepping_cpu_s / ticks, float(driven.frames.iterations.sum()) / ticks

        times, corrections = in_turn([partial(run, scene) for scene in scenes], turns)
        absent = statistics.median(times[0])
        us = [absent * statistics.median(b / a for a, b in zip(times[0], t, strict=True)) for t in times]
        found.append(Cost(name, absent, us[1] if off is not None else None, us[-1], corrections[0], corrections[-1]))
    return found


def study(repeats: int | None, progress: Progress) -> tuple[list[dict], str]:
    """Costs as data, and the table of docs/benchmarks.md."""
    rows = costs(repeats or TURNS, progress)
    head = ("option", "without, us a tick", "there but off", "on", "corrections a tick")
    lines = [
        (
            r.option,
            f"{r.absent_us:.0f}",
            "-" if r.off is None else f"{r.off:+.1f} %",
            f"{r.on:+.0f} % ({r.on_us - r.absent_us:+.0f} us)",
            f"{r.absent_corrections:.2f}, {r.on_corrections:.2f}",
        )
        for r in rows
    ]
    return [r._asdict() | {"off": r.off, "on": r.on} for r in rows], markdown_table([head, *lines])
