"""Scenes from YAML and back. Every problem of a file is reported in one text each; nothing half-right loads."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from ...files import read_text
from ...physics.parameter import declared
from ...physics.section import material_of
from ...sim.checks import checks
from ...sim.problem import Problem
from ...sim.scene import Scene
from . import document, yaml12
from .added_mass_file import with_matrices
from .document import Document, SceneError
from .document import SceneWarning as SceneWarning
from .scene_errors import ASKED, unknown_key

CABLE = re.compile(r"^cable:.*\n(?:[ #].*\n|\n)*", re.M)
SCENES = Document(
    Scene,
    "a scene of a tow",
    "scene",
    "name: my_tow",
    document.find_scene,
    document.shipped_scenes,
    checks.problems,
    lambda scene: [*checks.warnings(scene), *_borrowed(scene)],
    read_files=with_matrices,
)


def _borrowed(scene: Scene) -> Iterator[Problem]:
    """Drag factors of a shipped scene on cable of another diameter: they are of that cable in its flow."""
    for name, section in scene.cable.sections.items():
        factor, own = section.drag_amplification, material_of(scene.cable, section).diameter
        for shipped, diameter in _shipped_factors().get(factor, [])[:1] if factor != 1.0 else ():
            if diameter != own:
                text = (
                    f"= {factor:g} is that of {shipped}, whose cable is {diameter:g} m thick, this one {own:g} m: a "
                    "drag factor is of one cable and how it strums, and depth and tension hang on it"
                )
                remedy = "Give that of this cable, or 1 with viv.law, which computes it (docs/own_cable.md)"
                yield Problem(f"cable.sections.{name}.drag_amplification", text, remedy)


@cache
def _shipped_factors() -> dict[float, list[tuple[str, float]]]:
    """Scenes and diameters [m] by the drag factor of their sections."""
    found: dict[float, list[tuple[str, float]]] = {}
    for name in document.shipped_scenes():
        text = read_text(document.find_scene(name))
        cable = yaml12.parse(CABLE.findall(text)[0])[0]["cable"]  # the whole of them takes a tenth of a start
        for section in cable["sections"].values():
            diameter = float(section.get("diameter", cable["diameter"]))
            found.setdefault(section.get("drag_amplification", 1.0), []).append((name, diameter))
    return found


def load_scene(path_or_name: str | os.PathLike) -> Scene:
    """Scene of a YAML file, or of the name of a shipped one (``full_scale``).

    Raises SceneError with every problem of the file; warns with SceneWarning.
    """
    return SCENES.load(path_or_name)


def scene_from_text(text: str, origin: str) -> Scene:
    """Scene of YAML text; origin names it in errors."""
    return SCENES.read(text, origin)


def scene_from_dict(data: Mapping[str, Any], origin: str) -> Scene:
    """Scene of plain data; origin names it in errors. Raises SceneError with every problem; warns with SceneWarning."""
    return SCENES.check(data, origin)


def override(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """The scene with other values by dotted key, ``{"water.density": 1000.0}``; checked like a file."""
    data = scene.model_dump(mode="json")
    problems = []
    for key, value in values.items():
        *way, last = key.split(".")
        block: Any = data
        for part in way:
            block = block.get(part) if isinstance(block, dict) else None
        if isinstance(block, dict) and last in block:
            block[last] = value
        else:
            problems.append(unknown_key(f"override of {scene.name}", tuple(key.split(".")), value, _known_keys(scene)))
    if problems:
        raise SceneError(problems)
    return scene_from_dict(data, f"override of {scene.name}")


def check_key(scene: Scene, key: str, where: str) -> None:
    """Raise SceneError where a scene has no such dotted key; where: names the question in the text."""
    block: Any = scene.model_dump(mode="json")
    for part in key.split("."):
        if not isinstance(block, dict) or part not in block:
            raise SceneError([unknown_key(where, tuple(key.split(".")), ASKED, _known_keys(scene))])
        block = block[part]


def dump_scene(scene: Scene) -> str:
    """YAML text of the whole scene, defaults written out; load_scene reads the same scene back."""
    return yaml12.dump(scene.model_dump(mode="json"))


def _known_keys(scene: Scene) -> list[str]:
    """Dotted keys of one scene, the names of its own sections and bodies in place of ``<name>``."""
    keys = list[str]()
    for item in declared(Scene):
        found: list[tuple[str, Any]] = [("", scene)]
        for part in item.key.split("."):
            if part == "<name>":
                found = [(f"{key}.{name}", value) for key, table in found for name, value in table.items()]
            else:
                found = [(f"{key}.{part}", getattr(value, part)) for key, value in found]
        keys += [key[1:] for key, _ in found]
    return keys
