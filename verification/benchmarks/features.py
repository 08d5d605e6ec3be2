"""What each feature of a scene costs: the same line with it switched on and off, runs taking turns, medians.
``cable-sim bench --features``.

``absent``: the time of a step without the feature; ``off``: with it in the scene but switched off or out of reach (rows
of zero, surfaces far away, no current gradient); ``on``: at work.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.contact_surface import surface_row
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.physics.water import Water
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.sim.rig.rig import Rig, load_of
from cable_sim_ros.terminal import markdown_table

from ..cables import uniform
from .turns import in_turn

ELEMENTS, LENGTH, STEP, STEPS, TURNS = 64, 64.0, 0.01, 400, 15
FAR = (0.0, 500.0, 0.0)
CROSSFLOW = {"drag_law": DragLaw.CROSSFLOW}


class Cost(NamedTuple):
    """One feature: microseconds a step, and what off and on add to absent [%]."""

    feature: str
    absent_us: float
    off_us: float
    on_us: float

    @property
    def off(self) -> float:
        return 100.0 * (self.off_us / self.absent_us - 1.0)

    @property
    def on(self) -> float:
        return 100.0 * (self.on_us / self.absent_us - 1.0)


def hung(
    water: bool = False,
    depth: float = -10.0,
    ei: float = 0.0,
    ca: float = 0.0,
    gradient: float = 0.0,
    section: dict | None = None,
    **more,
) -> Rig:
    """A cable of 64 elements hanging in air or water, swaying a little; section: its drag, more: of Rig."""
    drag = {"drag_coefficient": 1.2} | (section or {})
    cable = uniform(LENGTH, ELEMENTS, 0.389, 6.8e6, drag, bending_stiffness=ei, axial_damping=ca)
    stream = Water(current=(0.5, 0.0), current_gradient=(gradient, 0.0)) if water else None
    rig = Rig(cable, held={0: "r"}, tension=500.0, bodies={-1: 50.0}, water=stream, **more)
    rig.straight((0.0, 0.0, depth), (0.05, 0.0, -1.0))
    rig.balance()
    return rig


def drum(position) -> np.ndarray:
    """A cylinder of 0.3 m radius."""
    return surface_row(position, 0.3, None, 0.0, 0.0, 1e9, 0.3)


FEATURES: dict[str, tuple[Callable, Callable, Callable]] = {
    # name: without, switched off, at work
    "water: drag, added mass, buoyancy": (
        lambda: hung(),
        lambda: hung(True, depth=80.0, section=CROSSFLOW),
        lambda: hung(True, section=CROSSFLOW),
    ),
    "second drag evaluation (G)": (
        lambda: hung(True, section=CROSSFLOW),
        lambda: hung(True, section=CROSSFLOW | {"drag_amplification": 1.0}),
        lambda: hung(True, section=CROSSFLOW | {"drag_amplification": 2.0}),
    ),
    "current profile": (
        lambda: hung(True, section=CROSSFLOW),
        lambda: hung(True, section=CROSSFLOW, gradient=0.0),
        lambda: hung(True, section=CROSSFLOW, gradient=0.002),
    ),
    "bending stiffness": (lambda: hung(), lambda: hung(ei=0.0), lambda: hung(ei=1.4)),
    "axial damping": (lambda: hung(), lambda: hung(ca=0.0), lambda: hung(ca=310.0)),
    "one contact surface": (
        lambda: hung(),
        lambda: hung(surfaces=[drum(FAR)]),
        lambda: hung(surfaces=[drum((-0.25, 0.0, -20.0))]),
    ),
    "nodal load": (
        lambda: hung(),
        lambda: hung(loads=[load_of(-1)]),
        lambda: hung(loads=[load_of(-1, (5.0, 0.0, 0.0))]),
    ),
}


def costs(turns: int = TURNS, progress: Progress = silent) -> list[Cost]:
    """Medians over ``turns`` runs of each feature, the three of a feature in turn within the same minute."""
    report = []
    for k, (name, variants) in enumerate(FEATURES.items()):
        progress(name, k, len(FEATURES))
        times, _ = in_turn([partial(_stepped, build) for build in variants], turns)
        report.append(Cost(name, *(statistics.median(t) for t in times)))
    return report


def _stepped(build: Callable[[], Rig]) -> tuple[float, None]:
    """Microseconds per Newton iteration: contact takes more of them, which is not the cost of looking at it."""
    rig = build()
    begin = time.process_time()
    rig.run(STEP * STEPS, STEP, every=STEPS)
    return 1e6 * (time.process_time() - begin) / max(rig.iterations, 1), None


def study(repeats: int | None, progress: Progress) -> tuple[list[dict], str]:
    """Costs as data, and the table of docs/benchmarks.md."""
    rows = costs(repeats or TURNS, progress)
    lines = [(r.feature, f"{r.absent_us:.1f}", f"{r.off:+.1f} %", f"{r.on:+.0f} %") for r in rows]
    return [r._asdict() for r in rows], markdown_table([("feature", "absent [us]", "switched off", "at work"), *lines])
