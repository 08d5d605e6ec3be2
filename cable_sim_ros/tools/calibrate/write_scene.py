"""A scene file with other numbers: its comments, its order and its other lines stay."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from ...files import read_text, write_text
from ...io.scenes.document import find_scene
from ...io.scenes.load import scene_from_text
from ...sim.scene import Scene
from .free import CalibrateError

DIGITS = 7  # of a number that was fitted


def rounded(value: Any) -> Any:
    """A fitted number with as many digits as mean something; whole lists too."""
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def text_with(source: str, values: Mapping[str, Any], head: Sequence[str]) -> str:
    """YAML text of a scene with other values by dotted key; head: lines of a comment at its top."""
    yaml = YAML()  # round trip: comments and quotes are kept
    yaml.version = None
    yaml.preserve_quotes = True
    yaml.width = sys.maxsize
    data = yaml.load(source)
    for key, value in values.items():
        *way, last = key.split(".")
        block = data
        for part in way:
            if not isinstance(block.get(part), CommentedMap):
                block[part] = CommentedMap()  # with defaults until now
            block = block[part]
        old = block.get(last)
        if isinstance(old, CommentedSeq) and isinstance(value, list) and len(old) == len(value):
            for k, one in enumerate(value):
                if old[k] != one:
                    old[k] = one
        elif old != value:
            block[last] = value
    out = StringIO()
    yaml.dump(data, out)
    return "".join(f"# {line}\n" for line in head) + re.sub(r"[ \t]+\n", "\n", out.getvalue())


def write_scene(
    scene: str | os.PathLike, expected: Scene, values: Mapping[str, Any], head: Sequence[str], path: Path
) -> None:
    """Write the file of a scene, or of a shipped one, with other values. CalibrateError where it cannot be written, or
    would not be read back as expected."""
    text = text_with(read_text(find_scene(scene)), values, head)
    read = scene_from_text(text, str(path))
    if read.model_dump(mode="json") != expected.model_dump(mode="json"):
        raise CalibrateError(f"{path}: would not be read back as the calibrated scene; it was not written. Use --json")
    try:
        write_text(path, text)
    except OSError as error:
        raise CalibrateError(
            f"{path}: cannot be written ({error.strerror}). The figures are above: put them in the scene by hand"
        ) from None
