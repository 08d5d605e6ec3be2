"""The mesh of a scene: what was chosen and why, what error is promised, and what finer meshes and steps show."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import RunError
from ..files import finite
from ..io.scenes.load import SceneError, load_scene
from ..io.sources.motion_table import sine_heave
from ..physics.heave_compensation import SetpointLaw
from ..sim.layout import layout_of
from ..sim.mesh.mesh_kinds import Expected, FeedMesh, MeshPlan
from ..sim.mesh.mesh_sheave import heave_amplitude
from ..sim.scene import Scene
from ..sim.simulator import Simulator
from .message_run import MessageRun, Progress, silent

HEAVE_PERIOD = 8.0  # s
MIN_FALL = 2.0  # of what a halving changes to what the next does: that of an error of the first order
SECONDS, SKIP = 60.0, 20.0  # s of the check, and what of it is left out of the statistics


class CheckError(RunError):
    """The check of a mesh did not run to its end."""


class MeshChange(NamedTuple):
    """Error of a mesh as three of them show it, see extrapolated()."""

    what: str
    tension: float  # relative, of the static tension or of its mean
    deviation: float  # relative, of the standard deviation of the tension; nan: static
    position: float  # m, of the towbody, the largest


def plan_of(scene: Scene | str | os.PathLike) -> tuple[Scene, MeshPlan]:
    """A scene and its mesh. Raises SceneError, also for a mesh that is fixed to the material."""
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    plan = layout_of(scene).plan
    if plan is None:
        raise SceneError(
            [
                f"{scene.name}: winch.drum = contact has its mesh written in cable.sections.*.elements; no mesh is "
                "made. Leave winch.drum and the elements out for a mesh from accuracy"
            ]
        )
    return scene, plan


def heave_of(scene: Scene) -> tuple[float, float]:
    """Amplitude [m] and period [s] of the heave of the check."""
    return heave_amplitude(layout_of(scene).route.scope), HEAVE_PERIOD


def check(scene: Scene, plan: MeshPlan, progress: Progress = silent, seconds: float = SECONDS) -> list[MeshChange]:
    """Error of statics, and of a heave with the winch held: the mesh against two and four times as many elements, both
    with half the step, and what would be left with any number.

    seconds: of the heave, 0: statics alone. Raises StartError, CheckError.
    """
    scene = scene.model_copy(update={"setpoint": scene.setpoint.model_copy(update={"algorithm": SetpointLaw.HOLD})})
    meshes = (plan.mesh, plan.mesh.doubled, plan.mesh.doubled.doubled)
    progress("static start", 0.0, 2.0)
    found = [_static(scene, meshes)]
    if seconds > 0.0:
        solver = scene.solver
        half = scene.model_copy(update={"solver": solver.model_copy(update={"tick": 0.5 * solver.tick})})
        progress("heave", 1.0, 2.0)
        found.append(_heave(scene, half, meshes, seconds))
    progress("done", 2.0, 2.0)
    return found


def extrapolated(coarse: float, fine: float) -> float:
    """Error of a mesh from what halving its elements changes, and halving them again: a size in any unit.

    What is left after the second is taken to fall on by the same factor, Richardson, by MIN_FALL at the least: of
    the first order, as at a corner within an element, one halving shows half of an error. Where the second changes as
    much as the first or more nothing is known of what is left: it is taken as once more as much.
    """
    fall = max(coarse / fine, MIN_FALL) if fine > 0.0 else np.inf
    return coarse + fine + fine / (fall - 1.0)


def _signed(a: float, b: float, c: float) -> float:
    """Relative error of a by those of the two finer meshes; its sign is that of the whole change."""
    size = extrapolated(abs(a / b - 1.0), abs(b / c - 1.0))
    if (a - b) * (b - c) < 0.0:  # to and fro: the changes do not add up
        size = max(abs(a / c - 1.0), abs(b / c - 1.0)) + abs(b / c - 1.0) / (MIN_FALL - 1.0)
    return float(np.copysign(size, a - c))


def _static(scene: Scene, meshes: Sequence[FeedMesh]) -> MeshChange:
    frames = []
    for one in meshes:
        sim = Simulator(scene, one)
        sim.start()
        frames.append(sim.frame.copy())
    a, b, c = frames
    return MeshChange(
        "static",
        _signed(float(a.tension), float(b.tension), float(c.tension)),
        float("nan"),
        _apart(a.body_position, b.body_position, c.body_position),
    )


def _apart(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Error [m] of the places a [..., 3] by those of the two finer meshes: the largest."""
    first, second = a - b, b - c
    coarse, fine = (float(np.sqrt((x**2).sum(-1)).max()) for x in (first, second))
    whole = float(np.sqrt(((a - c) ** 2).sum(-1)).max())
    return whole + extrapolated(coarse, fine) - coarse - fine


def _heave(scene: Scene, half: Scene, meshes: Sequence[FeedMesh], seconds: float) -> MeshChange:
    amplitude, period = heave_of(scene)
    skip, driven = seconds * SKIP / SECONDS, []
    for one, with_mesh in zip((scene, half, half), meshes, strict=True):
        motion = sine_heave(amplitude, period, seconds, one.ship)
        run = MessageRun(one, motion, mesh=with_mesh).run(seconds, None)
        if run.problem:
            raise CheckError(
                f"{scene.name}: the check stopped with {with_mesh.nodes - 1} elements and steps of "
                f"{one.solver.tick:g} s: {run.problem}; nothing was compared. Remedy: --seconds 0 compares the statics"
            )
        driven.append(run.frames if one is scene else run.frames[1::2].view(np.recarray))  # at the same times
    count = min(map(len, driven))
    a, b, c = (frames[:count].view(np.recarray) for frames in driven)
    late = slice(round(skip / scene.solver.tick), count)
    pulls = [frames.tension[late] for frames in (a, b, c)]
    means, deviations = [float(pull.mean()) for pull in pulls], [float(pull.std()) for pull in pulls]
    return MeshChange(
        f"heave of {amplitude:.3g} m, {period:g} s",
        _signed(*means),
        _signed(*deviations),
        _apart(a.body_position, b.body_position, c.body_position),
    )


def as_json(scene: Scene, plan: MeshPlan, changes: list[MeshChange]) -> dict[str, Any]:
    """Plain figures of `cable-sim mesh`."""
    start, names = layout_of(scene).route.scope, scene.cable.sections
    report: dict[str, Any] = {
        "scene": scene.name,
        "elements": plan.mesh.nodes - 1,
        "scope_m": start,
        "parts": [part._asdict() for part in plan.parts],
        "expected": [finite(row._asdict()) for row in plan.expected],
        "tick_s": scene.solver.tick,
        "tick_that_would_do_s": plan.tick,
        "tolerance": plan.tolerance,
        "aboard_m": plan.mesh.aboard.tolist(),
        "shares": {name: fraction.tolist() for name, fraction in zip(names, plan.mesh.section_fractions, strict=True)},
    }
    if changes:
        report["change"] = [finite(change._asdict()) for change in changes]
        report["kept"] = kept(plan, start, changes)
    return report


def at_scope(plan: MeshPlan, scope: float) -> Expected:
    """What is promised at a scope [m]."""
    return min(plan.expected, key=lambda row: abs(row.scope - scope))


def kept(plan: MeshPlan, scope: float, changes: list[MeshChange]) -> bool:
    """Is every change within what is promised at that scope?"""
    promised = at_scope(plan, scope)
    return all(
        abs(c.tension) <= promised.tension
        and not abs(c.deviation) > promised.tension  # nan: statics have none
        and c.position <= promised.position
        for c in changes
    )


__all__ = ["MeshChange", "as_json", "at_scope", "check", "heave_of", "kept", "plan_of"]
