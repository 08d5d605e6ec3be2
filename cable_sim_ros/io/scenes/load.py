"""Scenes from YAML and back. Every problem of a file is reported in one text each; nothing half-right loads."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from ...physics.parameter import declared
from ...sim.checks import checks
from ...sim.scene import Scene
from . import resources, yaml12
from .document import Document, SceneError
from .document import SceneWarning as SceneWarning
from .scene_errors import ASKED, unknown_key

SCENES = Document(
    Scene,
    "a scene of a tow",
    "scene",
    "name: my_tow",
    resources.find_scene,
    resources.shipped_scenes,
    checks.problems,
    checks.warnings,
)


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
    keys = []
    for item in declared(Scene):
        names = scene.bodies if item.key.startswith("bodies.") else scene.cable.sections
        keys += [item.key.replace("<name>", name) for name in names] if "<name>" in item.key else [item.key]
    return keys
