"""`cable-sim gradients`: how tension, depth, layback and angle of a static tow change with the numbers of its scene."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click
from pydantic import BaseModel

from ...cli.options import Answer, answers, set_option
from ...errors import CODE_DOUBTFUL, CODE_OK, CableSimError
from ...sim.flag_rules import DOUBTFUL, FAILED
from ...terminal import print_table, say

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from ...sim.static_gradients import Gradient, Slope, StaticGradients

KEYS = (  # what is asked for where no key is given, as far as the scene gives a number
    "ship.tow_speed",
    "winch.scope",
    "cable.mass_per_length",
    "cable.axial_stiffness",
    "cable.bending_stiffness",
    *(
        f"cable.sections.*.{name}"
        for name in (
            "mass_per_length",
            "axial_stiffness",
            "bending_stiffness",
            "drag_coefficient",
            "drag_amplification",
            "tangential_coefficient",
            "friction_coefficient",
        )
    ),
    "towbody.net_weight",
    "towbody.drag_area[0]",
    "towbody.lift_area",
    "sheave.friction",
    "seabed.friction",
)
ONLY_WITH = {"seabed.friction": "seabed.depth"}  # what a number needs to have a part
MEANING = dict.fromkeys((DOUBTFUL, FAILED), "these are gradients of a tow that cannot be taken as it is")
CAPTION = "agreement: with the difference of the static tows 0.01 % to either side, of the larger of the two"


class GradientError(CableSimError, ValueError):
    """A gradient that cannot be asked for."""


@click.command()
@click.argument("scene")
@click.option(
    "--key",
    "keys",
    multiple=True,
    metavar="KEY",
    help="A number of the scene by its key, as towbody.drag_area[0]; may be repeated. Default: the usual ones.",
)
@set_option("A value of the scene by its key.")
@answers
def gradients(scene, keys, settings) -> Answer:
    """Gradients of the static tow of SCENE: what a unit, and 1 %, of each number changes.

    By the tangent of its balance, on its mesh; each is held against static tows to either side. Leaves with code 4
    where the tow itself is doubtful, or a key that was given has no gradient.
    """
    from ...io.scenes.load import load_scene
    from ...runs.settings import apply_to_scene, settings_of
    from ...runs.verdict import judge
    from ...sim.static_gradients import StaticGradients

    tow = apply_to_scene(load_scene(scene), settings_of(settings))
    asked = [checked(tow, key) for key in dict.fromkeys(keys)] or usual(tow)
    begun = time.process_time()
    static = StaticGradients(tow)
    found = [static(key) for key in asked]
    verdict = judge(static.frames, tow)
    still = tuple(reason._replace(seconds=0.0, fraction=0.0) for reason in verdict.reasons)
    verdict = verdict._replace(reasons=still)  # a tow at rest lasts no time
    figures = as_dict(static, found) | {"cpu_s": time.process_time() - begun, "verdict": verdict.as_dict()}
    refused = any(one.refused or any(slope.refused for slope in one.slopes) for one in found)
    code = verdict.code or (CODE_DOUBTFUL if keys and refused else CODE_OK)
    return Answer(figures, lambda: _tell(static, found), verdict=verdict.lines(what=MEANING), code=code)


def checked(scene: Scene, key: str) -> str:
    """The key. Raises GradientError where it is not one component, SceneError where the scene has no such key."""
    from ...io.scenes.load import check_key
    from ...sim.static_gradients import number_at, split

    plain, place = split(key)
    check_key(scene, plain, "--key")
    whole = number_at(scene, plain)
    if isinstance(whole, BaseModel | dict):
        raise GradientError(f"--key {key}: stands for several keys; nothing was computed. Give one of its own")
    count = len(whole) if isinstance(whole, tuple) else 0
    if place is not None and place >= count:
        raise GradientError(f"--key {key}: {plain} has {count} components; nothing was computed. Count from 0")
    if place is None and count:
        raise GradientError(f"--key {key}: has {count} components; nothing was computed. Give one, as {key}[0]")
    return key


def usual(scene: Scene) -> list[str]:
    """KEYS of the scene that have a number other than 0."""
    from ...sim.static_gradients import number_at

    found = [key.replace("*", name) for key in KEYS for name in (scene.cable.sections if "*" in key else [""])]
    found = [key for key in found if key not in ONLY_WITH or number_at(scene, ONLY_WITH[key]) is not None]
    return [key for key in found if number_at(scene, key)]


def as_dict(static: StaticGradients, found: list[Gradient]) -> dict[str, Any]:
    """For the JSON."""
    from ...sim.static_gradients import FIGURES

    values = zip(FIGURES, static.values.tolist(), strict=True)
    return {
        "scene": static.scene.name,
        "figures": {figure.name: {"value": value, "unit": figure.unit} for figure, value in values},
        "gradients": [
            {
                "key": one.key,
                "value": one.value,
                "unit": one.unit,
                "note": one.note,
                "refused": one.refused,
                "figures": {slope.figure: _slope_dict(slope, one.value) for slope in one.slopes},
            }
            for one in found
        ],
    }


def _slope_dict(slope: Slope, value: float | None) -> dict[str, Any]:
    if slope.refused:
        return {"per_unit": None, "per_percent": None, "difference_per_unit": None, "refused": slope.refused}
    return {
        "per_unit": slope.slope,
        "per_percent": None if value is None else 0.01 * slope.slope * abs(value),
        "difference_per_unit": slope.beside,
        "refused": "",
    }


def agreement(slope: Slope) -> str:
    """How far a gradient and the difference are apart, of the larger."""
    return "-" if slope.slope == slope.beside == 0.0 else f"{slope.apart:.0e}"


def _tell(static: StaticGradients, found: list[Gradient]) -> None:
    from ...sim.static_gradients import FIGURES

    there = any(one.slopes for one in found)
    for k, (figure, value) in enumerate(zip(FIGURES, static.values.tolist(), strict=True) if there else ()):
        title = f"{static.scene.name}: {figure.meaning}, {value:.6g} {figure.unit}"
        rows = []
        for one in (one for one in found if one.slopes):
            slope, held = one.slopes[k], one.value or 0.0
            row = (f"{slope.slope:.4g}", f"{0.01 * slope.slope * abs(held):.4g}", agreement(slope))
            rows.append((one.key, f"{held:g}", one.unit, *(("-", "-", "-") if slope.refused else row)))
        columns = ("key", "value", "unit", f"{figure.unit} per unit", f"{figure.unit} per 1 %", "agreement")
        print_table(title, columns, rows, left=("key", "unit"))
    if there:
        say(CAPTION)
    for one in found:
        for text in filter(None, (one.note, one.refused)):
            say(f"{one.key}: {text}")
        for slope in (slope for slope in one.slopes if slope.refused):
            say(f"{one.key}: {slope.figure} {slope.refused}")
