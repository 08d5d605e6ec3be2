"""One case of a sweep, run in a process of its own: in comes a case, out comes a row of plain values.

A run that fails is a row with its reason. The same case gives the same row on the same machine, but for its CPU time.
"""

from __future__ import annotations

import time
import warnings
from functools import lru_cache
from typing import Any

import numpy as np

from ...errors import CableSimError
from ...io.scenes.document import SceneError
from ...io.scenes.ship_plan import ShipPlan
from ...sim.flag_rules import FAILED
from .cases import Case, contents
from .figures import DEEPEST, OWN, RULE, numbers_of, unwatched
from .sweep_file import seeds_of

CUT = 2.5  # ticks; a motion that is shorter than duration by more ended the run
AGAIN = "again"  # column of a row that failed by the machine: the next start runs its case again
MESSAGES = 0.1  # s between those of a ship's plan: five times those of a run, which are most of its cost


class FileChanged(CableSimError):
    """A file is not the one that the case was made of."""


def simulate(case: Case) -> dict[str, Any]:
    """The row of a case."""
    begun = time.process_time()
    row: dict[str, Any] = {
        "key": case.key,
        "verdict": FAILED,
        "reasons": "",
        "error": "",
        "simulated_s": 0.0,
        "flags": {},
    }
    with warnings.catch_warnings(record=True, action="always") as warned:
        try:
            _unchanged(case)
            try:
                found = _run(case)
            finally:  # also of a run that failed for it
                _unchanged(case)
            row |= found
        except (FileChanged, MemoryError, OSError) as error:
            row |= {"error": f"{type(error).__name__}: {error}", AGAIN: True}
        except (CableSimError, ArithmeticError) as error:
            row["error"] = f"{type(error).__name__}: {error}"
    row["warnings"] = "; ".join(
        dict.fromkeys(str(one.message) for one in warned if issubclass(one.category, UserWarning))
    )
    row["cpu_s"] = time.process_time() - begun
    return row


def _unchanged(case: Case) -> None:
    """Raise FileChanged where a file of the case is not what it was as the sweep began: its row would be of another
    file, and be found again for this one."""
    names = case.scene, case.motion.bag, case.motion.rao
    for name, then, now in zip(names, case.files, contents(case.scene, case.motion), strict=True):
        if now != then:
            raise FileChanged(
                f"{name}: is another file than when the sweep began, or is gone: this run is not kept. Leave files of "
                "a sweep alone while it runs, the same on every worker, and start it again: it goes on"
            )


def _run(case: Case) -> dict[str, Any]:
    from ...runs import offline
    from ...runs.settings import apply_to_scene
    from ...runs.sources import in_the_sea
    from ...runs.step_choice import overwritten
    from ...runs.summary import after_start

    with in_the_sea(case.motion.rao is not None):
        scene = apply_to_scene(_scene(case.scene, case.files[0]), case.settings)
        if case.seed is not None:
            scene = apply_to_scene(scene, {key: case.seed for key in seeds_of(scene)})
    if lost := overwritten(scene, case.settings, case.step):
        raise SceneError(lost)
    result = offline.run(
        scene,
        case.motion.bag,
        heave=case.motion.heave,
        rao=case.motion.rao,
        ship=None if case.ship is None else ShipPlan(case.ship, every=MESSAGES),
        duration=case.duration,
        winch=case.winch,
        algorithm=case.setpoint,
        step=case.step,
    )
    numbers = numbers_of(result.metrics)
    if len(result.frames):
        deepest = result.frames[int(np.argmin(result.frames["body_position"][:, 2]))]
        numbers[DEEPEST[0][0]] = -float(deepest["body_position"][2])
        numbers[DEEPEST[1][0]] = float(np.degrees(deepest["departure_angle"]))
        numbers[OWN[0]] = float(after_start(result.frames, result.metrics["skip_s"])[0]["contact_resultant"].min())
    lasted = float(result.metrics.get("duration_s") or 0.0)
    tick = 0.0 if result.scene is None else result.scene.solver.tick
    if case.duration and not result.problem and case.duration - lasted > CUT * tick:
        warnings.warn(
            f"duration = {case.duration:g} s is longer than the motion: {lasted:.4g} s were simulated, and the figures "
            "are of these",
            stacklevel=2,
        )
    for line in unwatched(result.metrics):
        warnings.warn(f"{line}: nothing is said of it", stacklevel=2)
    rules = {rule["rule"]: rule["unit"] for rule in (result.metrics.get("rules") or {}).get("rules", ())}
    kept = {
        name: numbers[name] for name in numbers if not case.figures or name in case.figures or name.startswith(RULE)
    }
    return kept | {
        "rule_units": rules,
        "flags": dict(result.metrics.get("flags") or {}),
        "verdict": result.verdict.state,
        "reasons": "; ".join(str(reason) for reason in result.verdict.reasons),
        "error": result.problem,
        "simulated_s": lasted,
    }


@lru_cache(maxsize=8)
def _scene(name: str, content: str) -> Any:
    """The scene of a file with this content."""
    from ...io.scenes.load import load_scene

    return load_scene(name)
