"""The reference of the mapping file, made from the declarations: keys, words, units, ready mappings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum

from ....io.scenes.document import shipped_mappings
from ....physics.parameter import Block, interval
from ....terminal import markdown_table
from ..mapping.mapping_file import Entry, Mapping, dimension_of, load_mapping
from ..mapping.units import FACTORS
from ..mapping.words import VECTORS, WORDS

TITLE = """# Keys of a mapping

Made by `cable-sim manual mapping_keys --out docs/mapping_keys.md` from the declarations in the
code; do not edit. How to write one: [mapping](mapping.md).
"""


def text() -> str:
    """The page."""
    ready = {name: load_mapping(name) for name in shipped_mappings()}
    parts = [
        TITLE,
        "## Top\n",
        _keys(Mapping, leave=("signals",)),
        "## Entries\n\n`signals` is a table of entries, each under its word.\n",
        _keys(Entry),
        "## Words\n",
        _table(
            ("word", "gives", "unit", "meaning"),
            (
                (f"`{name}`", "" if name == word.quantity else f"`{word.quantity}`", word.unit, word.meaning)
                for name, word in WORDS.items()
            ),
        ),
        "## Vectors\n",
        _table(
            ("word", "fields", "frames", "unit", "meaning"),
            (
                (f"`{name}`", str(one.fields), ", ".join(one.words), dimension_of(name), one.meaning)
                for name, one in VECTORS.items()
            ),
        ),
        "## Units\n",
        _table(("SI", "names"), ((si, ", ".join(f"`{n}`" for n in names)) for si, names in FACTORS.items())),
        "## Ready mappings\n",
        _table(
            ("name", "entries", "about"),
            ((f"`{name}`", str(len(one.signals)), one.about) for name, one in ready.items()),
        ),
    ]
    return "\n".join(parts)


def _keys(block: type[Block], leave: Sequence[str] = ()) -> str:
    rows = []
    for name, field in block.model_fields.items():
        if name in leave:
            continue
        extra = field.json_schema_extra or {}
        assert isinstance(extra, dict)
        default = field.default
        shown = "required" if field.is_required() else default.value if isinstance(default, Enum) else default
        if isinstance(shown, bool):
            shown = "true" if shown else "false"
        elif shown is None or shown in ("", ()):
            shown = "empty" if shown == "" else "none"
        unit = str(extra["unit"])
        bounds = interval(extra["low"], extra["high"], extra["above"])  # type: ignore[arg-type]
        meaning = str(field.description)
        rows.append((f"`{name}`", str(shown), "" if unit == "1" else unit, bounds, meaning))
    return _table(("key", "default", "unit", "range", "meaning"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return markdown_table([head, *rows]) + "\n"
