"""Scenes from YAML and back. Every problem of a file is reported in one text each; nothing half-right loads."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ...errors import CableSimError
from ...physics.parameter import declared
from ...sim.checks import checks
from ...sim.scene import Scene
from . import resources, yaml12
from .scene_errors import CONSEQUENCE, kind_of, line_of, place, texts_of, unknown_key


class SceneError(CableSimError, ValueError):
    """A scene that cannot be used. ``problems``: one text each, with file, line, key, value, bound and remedy."""

    def __init__(self, problems: list[str]):
        self.problems = problems
        super().__init__("\n".join(problems))


class SceneWarning(UserWarning):
    """A scene that can be run, with a number that will show in the results."""


def load_scene(path_or_name: str | os.PathLike) -> Scene:
    """Scene of a YAML file, or of the name of a shipped one (``full_scale``).

    Raises SceneError with every problem of the file; warns with SceneWarning.
    """
    try:
        path = resources.find_scene(path_or_name)
        text = Path(path).read_text(encoding="utf-8")
    except resources.ResourceError as error:
        raise SceneError([str(error)]) from None
    except UnicodeDecodeError as error:
        raise SceneError(
            [f"{path_or_name}: is not UTF-8 text (byte {error.start}); {CONSEQUENCE}. Save the scene as UTF-8"]
        ) from None
    except OSError as error:
        raise SceneError(
            [f"{path_or_name}: cannot be read ({error.strerror}); {CONSEQUENCE}. Check the path and its permissions"]
        ) from None
    return scene_from_text(text, str(path))


def scene_from_text(text: str, origin: str) -> Scene:
    """Scene of YAML text; origin names it in errors."""
    try:
        data, lines = yaml12.parse(text)
    except yaml12.YamlError as error:
        raise SceneError(
            [f"{place(origin, line)}: {what}; {CONSEQUENCE}. Correct the YAML" for line, what in error.problems]
        ) from None
    if data is None:
        raise SceneError(
            [
                f"{origin}: is empty; {CONSEQUENCE}. Begin with a copy of a shipped scene: "
                f"{', '.join(resources.shipped_scenes())}"
            ]
        )
    return scene_from_dict(data, origin, lines)


def scene_from_dict(data: Mapping[str, Any], origin: str, lines: Mapping[tuple, int] | None = None) -> Scene:
    """Scene of plain data; origin names it in errors, lines (path -> line) come from the YAML reader.

    Raises SceneError with every problem; warns with SceneWarning.
    """
    lines = lines or {}
    if not isinstance(data, Mapping):
        raise SceneError(
            [
                f"{place(origin, lines.get((), 0))}: is {kind_of(data)}, expected keys and values such as "
                f"`name: my_tow`; {CONSEQUENCE}. Begin with a copy of a shipped scene: "
                f"{', '.join(resources.shipped_scenes())}"
            ]
        )
    if "span" in data:
        raise SceneError(
            [
                f"{place(origin, lines.get(('span',), 0))}: span stands at the top: this is a span in a wind, not a "
                f"scene of a tow; {CONSEQUENCE}. Run it with `cable-sim span`, or give a scene: "
                f"{', '.join(resources.shipped_scenes())}"
            ]
        )
    try:
        scene = Scene.model_validate(data)
    except ValidationError as error:
        if "flow" in data and "winch" not in data:
            what = "is a span for `cable-sim viv`, not a scene of a tow"
            raise SceneError([f"{origin}: {what}; {CONSEQUENCE}. Give it to `cable-sim viv`"]) from None
        raise SceneError(texts_of(error, data, origin, lines)) from None
    found = checks.problems(scene)
    if found:
        raise SceneError([_checked(p, origin, lines, f"; {CONSEQUENCE}") for p in found])
    for warning in checks.warnings(scene):
        warnings.warn(_checked(warning, origin, lines, ""), SceneWarning, stacklevel=4)
    return scene


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


def _checked(problem: checks.Problem, origin: str, lines, consequence: str) -> str:
    line = line_of(lines, tuple(problem.key.split(".")))
    return f"{place(origin, line)}: {problem.key} {problem.text}{consequence}. {problem.remedy}"
