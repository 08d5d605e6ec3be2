"""What the scripts of both versions of FMI share: rows of the description, its texts and its token."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any
from uuid import UUID, uuid5

from ...physics.parameter import declaration
from ...sim.scene import Scene
from .tow import Tow
from .variables import INPUTS, OUTPUTS, PARAMETERS, REAL, VEHICLE_INPUTS, VEHICLE_OUTPUTS, Variable

NAMESPACE = UUID("5b6f2f0e-7c58-4a7b-8f0c-0d6f1c8f6a11")


def rows(about: dict[str, Any]) -> list[Variable]:
    """Every variable of an FMU, those of its scene last."""
    found = [*INPUTS, *OUTPUTS, *PARAMETERS]
    if about.get("vehicle"):
        found += [*VEHICLE_INPUTS, *VEHICLE_OUTPUTS]
    for key in about["parameters"]:
        item = declaration(Scene, key)
        meaning = item.doc if item else "number of the scene"
        unit = f" [{item.unit}]" if item and item.unit else ""
        found.append(Variable(key, REAL, "parameter", "", f"{meaning}{unit}"))
    return found


def variables(
    tow: Tow, kinds: Mapping[str, Any], causality: Any, initial: Any, variability: Any, units: bool = False
) -> Iterator[Any]:
    """Every variable as a library of FMI has it: its classes by kind, its enums; units: a Real tells its own."""
    begins = {"output": initial.calculated, "parameter": initial.exact}
    for row in rows(tow.about):
        varies = variability.continuous if row.kind == REAL else variability.discrete
        read = (lambda name=row.name: tow.output(name)) if row.role == "output" else None
        yield kinds[row.kind](
            row.name,
            causality=getattr(causality, row.role),
            initial=begins.get(row.role),
            variability=variability.fixed if row.role == "parameter" else varies,
            description=row.meaning,
            getter=read or (lambda name=row.name: tow.values[name]),
            setter=None if read else (lambda value, name=row.name: tow.set(name, value)),
            **({"unit": row.unit} if units and row.kind == REAL and row.unit else {}),
        )


def limits_of(tow: Tow, name: str) -> dict[str, str]:
    """Attributes min and max of a number of the scene."""
    if name not in tow.about["parameters"]:
        return {}
    item = declaration(Scene, name)
    pairs = (("min", getattr(item, "low", None)), ("max", getattr(item, "high", None)))
    return {key: f"{value:.16g}" for key, value in pairs if value is not None}


def guid_of(about: dict[str, Any], fmi: int) -> UUID:
    """Token of the FMU: the same for the same scene, version and parameters."""
    return uuid5(NAMESPACE, json.dumps([about, fmi], sort_keys=True))


def described(tow: Tow) -> str:
    """One sentence for the importing tool."""
    return (
        f"Cable tow of the scene {tow.base.name}: ship motion and winch command in, pull of the cable on the ship and "
        f"towbody out; tick {tow.base.solver.tick:g} s; needs a Python with cable_sim_ros {tow.about['version']}"
    )
