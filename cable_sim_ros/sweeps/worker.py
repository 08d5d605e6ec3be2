"""One case of a sweep, run in a process of its own: in comes a case, out comes a row of plain values.

A run that fails is a row with its reason. The same case gives the same row on the same machine, but for the columns of
COSTS.
"""

from __future__ import annotations

import time
import warnings
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from ..errors import CableSimError
from ..sim.flag_rules import FAILED
from .cases import Case
from .figures import OWN, RULE, numbers_of
from .sweep_file import seeds_of

if TYPE_CHECKING:
    from ..runs.result import Run

CUT = 2.5  # ticks; a motion that is shorter than duration by more ended the run
COSTS = ("cpu_s", "simulated_s")  # cpu_s: of the machine; left out of comparisons


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
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            row |= _run(case)
        except CableSimError as error:
            row["error"] = f"{type(error).__name__}: {error}"
        except (ArithmeticError, MemoryError, OSError) as error:
            row["error"] = f"{type(error).__name__}: {error}"
    row["warnings"] = "; ".join(
        dict.fromkeys(str(one.message) for one in warned if issubclass(one.category, UserWarning))
    )
    row["cpu_s"] = time.process_time() - begun
    return row


def _run(case: Case) -> dict[str, Any]:
    from ..runs import offline
    from ..runs.settings import apply_to_scene
    from ..runs.sources import in_the_sea
    from ..runs.summary import after_start

    with in_the_sea(case.motion.rao is not None):
        scene = apply_to_scene(_scene(case.scene), case.settings)
        if case.seed is not None:
            scene = apply_to_scene(scene, {key: case.seed for key in seeds_of(scene)})
    result = offline.run(
        scene,
        case.motion.bag,
        heave=case.motion.heave,
        rao=case.motion.rao,
        duration=case.duration,
        winch=case.winch,
        algorithm=case.setpoint,
        step=case.step,
    )
    numbers = numbers_of(result.metrics)
    if len(result.frames):
        numbers[OWN[0]] = float(after_start(result.frames, result.metrics["skip_s"])[0]["contact_resultant"].min())
    lasted = float(result.metrics.get("duration_s") or 0.0)
    if case.duration and not result.problem and case.duration - lasted > CUT * _tick(result):
        warnings.warn(
            f"duration = {case.duration:g} s is longer than the motion: {lasted:.4g} s were simulated, and the figures "
            "are of these",
            stacklevel=2,
        )
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


def _tick(result: Run) -> float:
    return 0.0 if result.scene is None else result.scene.solver.tick


@lru_cache(maxsize=8)
def _scene(name: str) -> Any:
    from ..io.scenes.load import load_scene

    return load_scene(name)
