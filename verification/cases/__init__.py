"""Verification cases: ``cable-sim case FILE``, on the product's own element, water, contact and integrator.

A family knows its cases by the inputs they give, never by their name. ``verification`` doubles the mesh and halves the
step until every output moves by less than a fifth of its tolerance; ``realtime`` takes one mesh a real-time run could
carry and the shipped step.
"""

from __future__ import annotations

import json
import math
import time
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from cable_sim_ros.files import read_text
from cable_sim_ros.sim.rig.rig import SHIPPED, RigError, warm_up

from . import contact, frames, hydro, jumper, modes, pulley, sheave, slack, statics, tow, waves
from .family import Case, CaseError, Family, Level, Output, Values

FAMILIES: tuple[Family, ...] = (  # of two that ask for as many inputs the earlier one counts
    contact.bounce,
    contact.climb,
    frames.ship_point,
    hydro.through_the_surface,
    hydro.sinking_cable,
    hydro.sinking_sphere,
    hydro.submerged_pendulum,
    jumper.jumper,
    modes.hanging_chain,
    modes.submerged_cable,
    modes.linear_tension,
    modes.spinning_cable,
    modes.pendulum,
    pulley.atwood,
    pulley.lift_off,
    pulley.wrapping,
    sheave.static_wrap,
    sheave.bending_boundary,
    sheave.heavy_static,
    sheave.running,
    slack.falling_chain,
    slack.drop_snap,
    statics.catenary,
    statics.tip_force,
    statics.tip_moment,
    statics.flume_line,
    statics.vertical,
    tow.straight_tow,
    tow.circle_tow,
    waves.step_force,
    waves.emergency_stop,
    waves.pluck,
)
SETTLED = 0.2  # share of its tolerance by which an output may still move between the last two levels
MAX_LEVELS = 6
CPU_BUDGET = 240.0  # s of one case, beyond which no finer level is begun


class Fidelity(str, Enum):
    VERIFICATION = "verification"
    REALTIME = "realtime"


class Metrics(NamedTuple):
    """What ``cable-sim case --json`` prints; value None where there is no honest one."""

    id: str
    outputs: list[dict]
    elements: int
    dt_s: float
    cpu_s: float
    notes: list[str]


def load_case(path: str | Path) -> Case:
    """Read a case file. Raises CaseError."""
    try:
        data = json.loads(read_text(path))
    except RecursionError:
        raise CaseError(f"{path}: is nested deeper than Python reads; nothing was run. A case has two levels") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise CaseError(f"{path}: this is no JSON ({error}); nothing was run") from None
    for key, kind in (("id", str), ("inputs", dict), ("outputs", list)):
        if not isinstance(data, dict) or not isinstance(data.get(key), kind):
            raise CaseError(
                f"{path}: the key '{key}' is missing or no {kind.__name__}; nothing was run. "
                f"See the cases' contract in docs/cases.md"
            )
    try:
        outputs = [Output(o["name"], o.get("unit", ""), o.get("tol_rel"), o.get("tol_abs")) for o in data["outputs"]]
    except (TypeError, KeyError):
        raise CaseError(f"{path}: outputs: every entry needs a 'name'; nothing was run") from None
    return Case(data["id"], data["inputs"], outputs, list(data.get("idealisations", [])), str(path))


def family_of(case: Case) -> Family | None:
    """The family whose keys the case gives; of several the one that asks for most."""
    fitting = [f for f in FAMILIES if f.keys <= case.inputs.keys()]
    return max(fitting, key=lambda f: len(f.keys), default=None)


def run_case(case: Case, fidelity: Fidelity = Fidelity.VERIFICATION) -> Metrics:
    """Values of one case. A case without a family, or one that cannot be solved, says so in its notes."""
    family = family_of(case)
    if family is None:
        return _without(case, f"no family of cases takes the inputs {', '.join(sorted(case.inputs))}")
    warm_up()
    begin = time.process_time()
    try:
        if fidelity is Fidelity.REALTIME:
            values, notes = family.solve(case, Level(0, SHIPPED.tick)), []
        else:
            values, notes = _refined(family, case)
    except RigError as error:
        return _without(case, f"not solved: {error}", time.process_time() - begin)
    outputs = [{"name": o.name, "value": values.of.get(o.name)} for o in case.outputs]
    missing = [o["name"] for o in outputs if o["value"] is None]
    if missing:
        notes.append(f"no value for: {'; '.join(missing)}")
    return Metrics(
        case.id,
        outputs,
        values.elements,
        values.dt,
        time.process_time() - begin,
        [f"{family.name}: {family.how}", *values.notes, *notes],
    )


def _refined(family: Family, case: Case) -> tuple[Values, list[str]]:
    """Refine until every output moves by less than SETTLED of its tolerance; the values, and how they were reached."""
    begin, values, moved = time.process_time(), None, math.inf
    for level in range(MAX_LEVELS):
        before, spent = values, time.process_time()
        try:
            values = family.solve(case, Level(level, None))
        except RigError as error:
            if before is None:
                raise
            return before, [f"level {level} was not solved ({error}); the values are of level {level - 1}"]
        spent = time.process_time() - spent
        if before is not None:
            changes = (fraction_moved(o, before.of.get(o.name), values.of.get(o.name)) for o in case.outputs)
            moved = max(changes, default=0.0)
            if moved <= SETTLED:
                how = f"the last refinement moved the outputs by at most {moved:.2g} of their tolerances"
                return values, [f"settled at level {level}: {how}"]
        if time.process_time() - begin + family.growth * spent > CPU_BUDGET:
            break
    return values, [f"not settled: the last refinement still moved an output by {moved:.2g} of its tolerance"]


def fraction_moved(output: Output, before, after) -> float:
    """Change of an output (a number or a vector) over its tolerance."""
    if before is None or after is None:
        return 0.0 if before is after else math.inf
    b, a = (x if isinstance(x, (list, tuple)) else (x,) for x in (before, after))
    change = max(abs(x - y) for x, y in zip(b, a, strict=True))
    size = max(abs(x) for x in a)
    allowed = max((output.tol_rel or 0.0) * size, output.tol_abs or 0.0) or 1e-3 * size or 1e-12
    return change / allowed


def _without(case: Case, why: str, cpu: float = 0.0) -> Metrics:
    return Metrics(case.id, [{"name": o.name, "value": None} for o in case.outputs], 0, 0.0, cpu, [why])


__all__ = ["FAMILIES", "Case", "CaseError", "Family", "Fidelity", "Metrics", "Output", "load_case", "run_case"]
