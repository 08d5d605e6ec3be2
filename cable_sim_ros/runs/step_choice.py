"""The time steps of an offline run: fixed or chosen by their error, and how the time was divided."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..io.scenes.load import override
from ..physics.heave_compensation import SetpointLaw
from ..physics.integrate import Solver
from ..physics.winch_drive import DriveModel
from ..sim.flag_rules import MIN_REFUSED, REFUSED_FRACTION
from ..sim.rule_blocks import slowest_tick
from ..sim.scene import Scene
from ..sim.tables.sensor_tables import aboard
from ..sim.verdict import Reason, check

EVERY = 0.1  # s between tick outputs of a run whose steps are chosen, where the scene does not say
TICKS = 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001  # s, of which a motor takes the longest it can follow


def stepped(scene: Scene, step: str | None, every: float | None) -> Scene:
    """The scene with other steps: "chosen" by their error, "fixed": one a tick, None: as the scene says.

    every: s between tick outputs; default: the scene's tick, of steps chosen that the scene did not choose EVERY, less
    where that is above `longest_tick`, and the scene's where instruments or constant tension read at ticks.
    Steps that the scene did not choose have the errors of its accuracy.
    """
    if step not in (None, "chosen", "fixed"):
        raise ValueError(f"step = {step!r} is not known: nothing was simulated; give 'chosen', 'fixed' or None")
    values = values_of_steps(scene, step, every)
    return override(scene, values) if values else scene


def longest_tick(scene: Scene) -> float:
    """Longest tick [s] with a tension for every reading of rules on watch, and that a motor's controller follows."""
    followed = 1.0 / scene.drive.bandwidth if scene.drive.model is DriveModel.MOTOR else TICKS[0]
    longest = next((tick for tick in TICKS if tick <= followed), followed)
    return min(slowest_tick(scene.rules), longest)


def values_of_steps(scene: Scene, step: str | None, every: float | None = None) -> dict[str, float | None]:
    """Values of the scene by key that the choice of the steps puts in place of its own."""
    solver = scene.solver
    values: dict[str, float | None] = {}
    if step == "fixed" and solver.tension_error is not None:
        values["solver.tension_error"] = None
    if step == "chosen" and solver.tension_error is None:
        values |= {"solver.tension_error": scene.accuracy.tension, "solver.tick": min(EVERY, longest_tick(scene))}
        if aboard(scene) or scene.setpoint.algorithm is SetpointLaw.CONSTANT_TENSION:  # these read at the ticks
            values["solver.tick"] = solver.tick
        if scene.accuracy.position is not None:
            values["solver.position_error"] = scene.accuracy.position
    if every is not None:
        values["solver.tick"] = every
    return values


def overwritten(scene: Scene, settings: Iterable[str], step: str | None, every: float | None = None) -> list[str]:
    """A text for each key of the settings whose value the choice of the steps would put aside; scene: with them."""
    found = []
    for key in sorted(values_of_steps(scene, step, every).keys() & set(settings)):
        if every is not None and key == "solver.tick":
            why, remedy = f"is set by every = {every:g} s", "Leave one of the two out"
        elif step == "fixed":
            why, remedy = "is a bound of chosen steps, and step = fixed has none", "Give step = chosen"
        else:
            why, remedy = "is set by step = chosen", "Give step = fixed, or --every where the command has it"
        found.append(f"{key} {why}: its own value would count for nothing; nothing was simulated. {remedy}")
    return found


def metrics_of_steps(steps: dict[float, int], control: np.record, solver: Solver) -> dict[str, Any]:
    """How the time was divided, for the JSON; steps: length [s] -> how many, longest first."""
    lengths = np.repeat(list(steps), list(steps.values()))[::-1]
    chosen = solver.tension_error is not None
    return {
        "steps_taken": len(lengths),
        "step_least_s": float(lengths[0]) if len(lengths) else None,
        "step_median_s": float(lengths[(len(lengths) - 1) // 2]) if len(lengths) else None,
        "step_largest_s": float(lengths[-1]) if len(lengths) else None,
        "steps_refused": int(control.refused),
        "steps_unsolved": int(control.unsolved),
        "step_tension_error": solver.tension_error,
        "step_position_error_m": solver.position_error if chosen else None,
    }


def doubts_of_steps(metrics: Mapping[str, Any]) -> tuple[Reason, ...]:
    """Reason where the choice of the step did not come to rest, from the figures of a run."""
    if metrics.get("step_tension_error") is None:
        return ()
    refused, unsolved = metrics["steps_refused"], metrics["steps_unsolved"]
    back = refused + unsolved
    tried = metrics["steps_taken"] + back
    if back <= max(MIN_REFUSED, REFUSED_FRACTION * tried):
        return ()
    return (
        check(
            "STEP_CONTROL",
            f"{back} of {tried} steps tried were taken back, {100.0 * back / tried:.2g} % (limit "
            f"{100.0 * REFUSED_FRACTION:g} %): {refused} for their error, {unsolved} without a solution; median "
            f"{1e3 * metrics['step_median_s']:.3g} ms, shortest {1e3 * metrics['step_least_s']:.3g} ms. Something in "
            "the loop of ship, set-point, winch and cable jumps, and shorter steps do not resolve it: peaks may be "
            "made by it. Remedy: compare with --step fixed --every 0.01",
        ),
    )
