"""What is wrong with a scene, in words: one text for each problem, with place, key, value, bound and remedy."""

from __future__ import annotations

import difflib
import enum
import math
import re
import types
from collections.abc import Mapping
from typing import Union, get_args, get_origin

from pydantic import ValidationError

from ...physics.parameter import REQUIRED, Block, block_of, declared, interval
from .yaml12 import dotted

CONSEQUENCE = "nothing was started"
ASKED = object()  # in place of the value of a key: it was only asked for
LONGEST_SYMBOL = 2  # letters
ENTRIES = {  # of tables by free names, as examples
    "sections": "{length: 10.0}",
    "bodies": "{at: first, mass: 50.0, net_weight: 300.0}",
    "wings": "{place: [-1.5, 0.0, 0.0], span: 0.6, chord: 0.3}",
    "mesh": "{elements: 4}",
    "signals": "{source: PSXN23, field: heave}",
    "cases": "{length: 2.0, tension: 200.0, wind: 0.3}",
    "quantities": "{bias: 10.0}",
    "ranges": "{low: 1.0, high: 2.0}",
}
WORDS = {float: "a number", int: "a whole number", str: "text", bool: "true or false", type(None): "null"}
LISTS = {"motions": "[{heave: [1, 8]}]"}  # of blocks, as examples
VALUES = {  # of keys whose default or range is no example
    "heave": "[1, 8]",
    "plans": "['0 hold, 60 rate -0.5']",
    "setpoints": "[hold]",
    "figures": "[tension_max_n]",
    "grid": "{winch.scope: [100, 200]}",
}


class Told(str):
    """Text of one problem of a file, and its parts: ``where`` (``file:line``), ``key``, ``what`` is wrong, with value,
    unit and bound, and ``remedy``; of a limit also its numbers."""

    where: str
    key: str
    what: str
    remedy: str
    value: float | None = None
    bound: float | None = None
    unit: str = ""

    @classmethod
    def of(cls, where: str, key: str, what: str, remedy: str, consequence: str = f"; {CONSEQUENCE}") -> Told:
        """Of its parts; ``what`` begins with the value, a verb, or a colon."""
        between = "" if what.startswith(":") else " "
        told = cls(f"{where}: {key}{between}{what}{consequence}{remedy and f'. {remedy}'}")
        told.where, told.key, told.what, told.remedy = where, key, what, remedy
        return told


def place(origin: str, line: int) -> str:
    """Where a problem stands: ``file:line``, or the file alone."""
    return f"{origin}:{line}" if line else origin


def line_of(lines: Mapping[tuple, int], path: tuple) -> int:
    """Line of a path, or of the nearest block around it; 0 when unknown."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 0) if path else 0


def texts_of(error: ValidationError, data, origin: str, lines, root: type[Block]) -> list[Told]:
    """One text for each problem pydantic found in a file of kind root, in its order; a vector is reported once."""
    out: dict[tuple, Told] = {}
    for item in error.errors():
        path = item["loc"]
        field, owner = _field(path, root)
        if path and isinstance(path[-1], int) and field is not None:  # one text for a vector
            path = path[:-1]
        if path not in out:
            out[path] = _text(item, path, field, owner, data, origin, lines, root)
    return [out[path] for path in sorted(out, key=lambda p: (line_of(lines, p), dotted(p)))]


def _text(item, path, field, owner, data, origin, lines, root) -> Told:
    value = _value(data, path)
    key, kind = dotted(path), item["type"]
    where = place(origin, line_of(lines, path[:-1] if value is _ABSENT else path))
    if kind == "extra_forbidden":
        return unknown_key(where, path, value, [d.key for d in declared(root)], owner)
    if kind == "value_error":  # a validator of the scene: its text says what and how
        return Told.of(where, key, str(item["msg"]).removeprefix("Value error, "), "")
    if field is None and kind in ("model_type", "dict_type"):
        if path[0] in LISTS:
            example = f"{path[0]}: {LISTS[path[0]]}"
        else:  # a free name: of a section or a body
            example = f"{path[-1]}: {ENTRIES['mesh' if path[0] == 'mesh' else path[-2]]}"
        what = f"= {_show(value)} is {kind_of(value)}, expected a block of keys"
        return Told.of(where, key, what, f"Write for example `{example}`")
    if field is None:
        return Told.of(where, key, f"= {_show(value)}: {item['msg']}", "See the parameter manual")
    what, remedy = _wrong(item, path, field, value)
    return Told.of(where, dotted(item["loc"]) if kind == "enum" else key, what, remedy)


def _wrong(item, path, field, value) -> tuple[str, str]:
    """What is wrong with the value of a declared key, and the remedy."""
    kind, about, wanted, example = item["type"], field.description, _wanted(field), _example(path, field)
    if kind == "missing" and value is _ABSENT:
        return f"is missing ({about})", f"Give {wanted}, for example `{example}`"
    extra = field.json_schema_extra
    unit = f" {extra['unit']}" if extra["unit"] not in ("", "1") else ""
    if kind == "out_of_range":
        which, bounds = item["ctx"]["components"], f"{item['ctx']['interval']}{unit}"
        part = f", component {', '.join(str(i) for i in which)}," if isinstance(value, list | tuple) else ""
        return f"= {_show(value)}{unit}{part} is outside {bounds} ({about})", f"Give a value in {bounds}"
    if kind == "finite_number":
        return f"= {_show(value)}{unit} is not finite ({about})", f"Give {wanted}, for example `{example}`"
    if kind == "enum":
        words = [member.value for member in _enum(field.annotation)]
        bad = item["input"]  # of a list one entry
        near = difflib.get_close_matches(str(bad).lower(), words, 1)
        hint = f"Did you mean {near[0]}? " if near else ""
        return f"= {_show(bad)} is none of its values ({about})", f"{hint}Known: {', '.join(words)}"
    if str(value).lower() == "none" and type(None) in get_args(field.annotation):
        remedy = f"None is written `{path[-1]}: null`, or the key is left out"
        return f"= {_show(value)} is text, expected {wanted} ({about})", remedy
    one = not any(get_origin(part) is tuple for part in (field.annotation, *get_args(field.annotation)))
    text = (_looks_like_number(value) if one else "") or _odd_entry(value)
    hint = f"{text}. " if text else ""
    what = f"= {_show(value)} is {kind_of(value)}, expected {wanted} ({about})"
    return what, f"{hint}Write for example `{example}`"


def unknown_key(where: str, path: tuple, value, known: list[str], owner: type[Block] | None = None) -> Told:
    """A key that does not exist, with the nearest known one; value: ASKED where nobody gave one."""
    key = dotted(path)
    siblings = list(owner.model_fields) if owner else []
    near = _of_symbol(str(path[-1]), owner) or difflib.get_close_matches(str(path[-1]), siblings, 1, 0.6)
    if near and str(path[-1]).endswith("_deg") and not near[0].endswith("_deg"):
        near = []  # no angle
    if near:
        nearest = dotted((*path[:-1], near[0]))
    else:  # the whole key, then the right name in the wrong block
        same = [k for k in known if k.split(".")[-1] == path[-1]]
        beside = {dotted((*path[:-1], name)) for name in siblings}  # only the block is alike
        whole = [k for k in difflib.get_close_matches(key, known, 1, 0.6) if k not in beside]
        nearest = (whole or same or [""])[0]
    remedy = f"Known here: {', '.join(siblings)}" if siblings else "See the parameter manual"
    given = "" if value is ASKED else f"= {_show(value)}"
    return Told.of(where, key, f"{given}: there is no such key", f"Did you mean {nearest}?" if nearest else remedy)


def _of_symbol(name: str, owner: type[Block] | None) -> list[str]:
    """Keys of a block whose description has this symbol, as Hs has that of water.waves.height."""
    fields = owner.model_fields if owner else {}
    word = re.compile(rf"\b{re.escape(name.capitalize())}\b")
    return [
        key for key, field in fields.items() if len(name) <= LONGEST_SYMBOL and word.search(field.description or "")
    ]


_ABSENT = object()


def _value(data, path: tuple):
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return _ABSENT
    return data


def _field(path: tuple, root: type[Block]):
    """Declaration at a path of the file, and the Block that should hold its last key; None where there is none."""
    block: type[Block] | None = root
    owner, field, table = None, None, False
    for part in path:
        if isinstance(part, int) and not table:  # component of a vector: the vector's own declaration
            break
        if table:  # entry of a list of blocks, or a free name
            owner, field, table = None, None, False
            continue
        owner, field = block, (block.model_fields.get(part) if block else None)
        block, table = block_of(field.annotation) if field else (None, False)
    return field, owner


def _enum(annotation):
    """The enum of an annotation, however deep: that of a list of words or nothing too."""
    if isinstance(annotation, type) and issubclass(annotation, enum.Enum):
        return annotation
    return next((found for part in get_args(annotation) if (found := _enum(part))), None)


def _wanted(field) -> str:
    """What a key expects, in words: ``a number in [900, 1100] kg/m^3``."""
    annotation, extra = field.annotation, field.json_schema_extra
    inner, table = block_of(annotation)
    if inner:
        if get_origin(annotation) is list:
            return "a list of blocks"
        return "a table of blocks by name" if table else "a block of keys"
    parts = get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else (annotation,)
    kinds = []
    for part in parts:
        if get_origin(part) is tuple:
            texts = str in get_args(part)
            many = "a list of texts" if texts else "a list of numbers"
            kinds.append(many if ... in get_args(part) else f"{len(get_args(part))} numbers")
        elif get_origin(part) in (list, dict):
            kinds.append("a list" if get_origin(part) is list else "a block of keys")
        elif isinstance(part, type) and issubclass(part, enum.Enum):
            kinds.append("one of " + ", ".join(member.value for member in part))
        else:
            kinds.append(WORDS.get(part, str(part)))
    bounds = interval(extra["low"], extra["high"], extra["above"])
    unit = f" {extra['unit']}" if extra["unit"] not in ("", "1") else ""
    return " or ".join(kinds) + (f" in {bounds}{unit}" if bounds else "")


def _example(path: tuple, field) -> str:
    inner, table = block_of(field.annotation)
    name = next(part for part in reversed(path) if isinstance(part, str))
    if inner:
        needed = (key for key, part in inner.model_fields.items() if part.is_required())
        first = next(needed, next(iter(inner.model_fields)))
        body = f"{{{first}: {_plain(_sample(inner.model_fields[first]))}, ...}}"
        if name in LISTS:
            return f"{name}: {LISTS[name]}"
        return f"{name}: {{first: {body}}}" if table else f"{name}: {body}"
    if name in VALUES:
        return f"{name}: {VALUES[name]}"
    return f"{name}: {_plain(_sample(field))}"


def _sample(field):
    """A value that would be accepted: the default, else the middle of the range on the scale it spans."""
    default, extra = field.default, field.json_schema_extra
    if not field.is_required() and default is not REQUIRED and default is not None and default != ():
        return default.value if isinstance(default, enum.Enum) else default
    if not extra["unit"]:
        return "my_tow"
    low, high = extra["low"] if extra["low"] is not None else extra["above"], extra["high"]
    number = 1.0
    if low is not None and high is not None:
        number = float(f"{math.sqrt(low * high):.1g}") if low > 0 else 1.0 if low <= 1.0 <= high else low
    if int in (field.annotation, *get_args(field.annotation)):
        return round(number)
    for part in (field.annotation, *get_args(field.annotation)):
        if get_origin(part) is tuple:
            return [number] * len(get_args(part))
    return number


def _plain(value) -> str:
    return f"[{', '.join(str(v) for v in value)}]" if isinstance(value, list | tuple) else str(value)


def _show(value) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    text = "nothing" if value is _ABSENT else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def kind_of(value) -> str:
    """What a value is, in words: ``text``, ``a list of 3``."""
    words = ((bool, "true or false"), (str, "text"), (int | float, "a number"), (Mapping, "a block of keys"))
    for kind, word in words:
        if isinstance(value, kind):
            return word
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return "empty" if value is None else f"a {type(value).__name__}"


def _odd_entry(value) -> str:
    """The first entry of a list that is no number, and what is wrong with it."""
    for i, part in enumerate(value if isinstance(value, list | tuple) else ()):
        if isinstance(part, bool) or not isinstance(part, int | float):
            text = _looks_like_number(part)
            return f"Entry {i + 1} is {_show(part)}, {kind_of(part)}{': ' + text[0].lower() + text[1:] if text else ''}"
    return ""


def _looks_like_number(value) -> str:
    if not isinstance(value, str):
        return ""
    try:
        float(value.replace(",", "."))
    except ValueError:
        return "A number is written without its unit" if value[:1].isdigit() else ""
    if "_" in value:
        return "YAML numbers have no _"
    return "The decimal sign is a point" if "," in value else "A number is written without quotes"
