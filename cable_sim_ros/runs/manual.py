"""The parameter manual, made from the declarations: every number with default, unit, range, meaning and source."""

from __future__ import annotations

import enum
import types
from collections.abc import Sequence
from typing import Any, Union, get_args, get_origin

from ..physics.parameter import REQUIRED, Block, Declared, declared
from ..sim.scene import Scene
from ..terminal import markdown_table

TITLE = """# Parameters

Made by `cable-sim manual --out docs/parameters.md` from the declarations in the code; do not edit.
SI units; degrees only where a name says `_deg`. A value outside its range, an unknown key or a
wrong type stops the start. **fixed**: a change needs a new start; **live**: may be changed while
the node runs.
"""

SCENE = """## Scene

Keys of a scene file. The same dotted names are ROS parameters of the node, where they stand above
the file. `<name>` is the free name of a section or of a body on the line. Where the default is
none, a file leaves the key out or gives `null`; in a ROS parameter file a list is then `[.nan]`.
"""


def text(more: Sequence[tuple[str, type[Block]]] = ()) -> str:
    """Manual in Markdown: the scene, then further (introduction with its heading, Block) pairs."""
    parts = [TITLE]
    pairs: list[tuple[str, type[Block]]] = [(SCENE, Scene), *more]
    for introduction, block in pairs:
        parts.append(introduction)
        parts += tables(block)
    return "\n".join(parts)


def tables(block: type[Block]) -> list[str]:
    """A table in Markdown for each group of keys of a Block."""
    groups: dict[str, list[Declared]] = {}
    for item in declared(block):
        group = item.key.rpartition(".")[0]
        groups.setdefault(group, []).append(item)
    out = []
    for group, items in groups.items():
        name = f"`{group}`" if "<" in group else group  # <name> by itself would be taken for a tag
        head = ("key", "default", "unit", "range", "changes", "meaning", "source")
        out.append((f"### {name}\n\n" if group else "") + markdown_table([head, *map(_row, items)]) + "\n")
    return out


def _row(item: Declared) -> tuple[str, ...]:
    return (
        f"`{item.key}`",
        _default(item.default),
        "-" if item.unit == "1" else item.unit,
        item.interval or _words(item.annotation),
        "fixed" if item.configure else "live",
        item.doc,
        item.source,
    )


def _default(value: object) -> str:
    if value is REQUIRED:
        return "**required**"
    if value is None:
        return "none"
    if isinstance(value, enum.Enum):
        return f"`{value.value}`"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(f'{part:g}' for part in value)}]"
    if isinstance(value, str):
        return f"`{value}`" if value else "empty"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _words(annotation: Any) -> str:
    for part in get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,):
        if isinstance(part, type) and issubclass(part, enum.Enum):
            return ", ".join(f"`{member.value}`" for member in part)
    return {bool: "true, false", str: "text"}.get(annotation, "")
