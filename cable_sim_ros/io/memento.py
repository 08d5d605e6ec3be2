"""What the objects that take inputs in remember, as plain JSON, and set back into fresh objects of the same settings.

An object of this package becomes its attributes, by name. What its settings made it of (parameter blocks, rings of
inputs, callbacks, records of the model) is left out: the fresh object has its own. Nothing is executed and no class is
made from a name but the three records of messages.
"""

from __future__ import annotations

import base64
import zlib
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np

from ..physics.inputs import Inputs
from ..physics.quantity import Block
from .gate import Held
from .messages import Command, Odometry

RECORDS = {kind.__name__: kind for kind in (Command, Held, Odometry)}
PLAIN = (type(None), bool, int, float, str)
OWN = {"own": None}  # stands for what the fresh object has of its own


def taken(value: Any) -> Any:
    """A value as JSON; tagged where JSON has no such kind."""
    if isinstance(value, Enum):
        return {"enum": value.value}
    if isinstance(value, PLAIN):
        return value
    if isinstance(value, np.ndarray):
        return {"array": [value.dtype.str, list(value.shape), _packed(value)]}
    if isinstance(value, (Block, Inputs, np.void)) or callable(value):
        return OWN
    if isinstance(value, bytes):
        return {"bytes": base64.b64encode(zlib.compress(value, 1)).decode()}
    if type(value).__name__ in RECORDS:
        return {"record": [type(value).__name__, [taken(part) for part in value]]}
    if isinstance(value, dict):
        return {"dict": [[taken(key), taken(part)] for key, part in value.items()]}
    if isinstance(value, (list, tuple, deque, set)):
        kind = next(kind for kind in (list, tuple, deque, set) if isinstance(value, kind))
        return {kind.__name__: [taken(part) for part in (sorted(value) if kind is set else value)]}
    return {"object": {name: taken(part) for name, part in vars(value).items()}}


def set_back(fresh: Any, tree: Any) -> Any:
    """The value of ``taken``, in the place of ``fresh``; an object is changed and is itself the answer.

    Raises ValueError where the two do not fit.
    """
    if isinstance(tree, PLAIN):
        return tree
    if not isinstance(tree, dict) or len(tree) != 1:
        raise ValueError(f"{tree!r:.60} is not what was taken")
    ((kind, inner),) = tree.items()
    try:
        return _KINDS[kind](fresh, inner)
    except (AttributeError, KeyError, IndexError, TypeError, zlib.error) as error:
        raise ValueError(f"'{kind}' does not fit ({type(error).__name__}: {error})") from None


def _object(fresh: Any, attributes: dict[str, Any]) -> Any:
    if set(attributes) != set(vars(fresh)):
        raise ValueError(f"a {type(fresh).__name__} has other attributes")
    for name, tree in attributes.items():
        setattr(fresh, name, set_back(getattr(fresh, name), tree))
    return fresh


def _array(fresh: Any, parts: list[Any]) -> np.ndarray:
    code, shape, text = parts
    kind = fresh.dtype if code.startswith("|V") else np.dtype(code)
    array = np.frombuffer(zlib.decompress(base64.b64decode(text)), kind).reshape(shape).copy()
    return array.view(type(fresh)) if isinstance(fresh, np.recarray) else array


def _sequence(fresh: Any, trees: list[Any]) -> list[Any]:
    before = (
        list(fresh) if isinstance(fresh, (list, tuple, deque)) and len(fresh) == len(trees) else [None] * len(trees)
    )
    return [set_back(part, tree) for part, tree in zip(before, trees)]


def _dict(fresh: Any, pairs: list[Any]) -> Any:
    found = {}
    for key, tree in pairs:
        key = set_back(None, key)
        found[key] = set_back(fresh.get(key), tree)
    return type(fresh)(found)


def _record(fresh: Any, parts: list[Any]) -> Any:
    name, trees = parts
    return RECORDS[name](*(set_back(None, tree) for tree in trees))


_KINDS: dict[str, Callable[[Any, Any], Any]] = {
    "own": lambda fresh, inner: fresh,
    "enum": lambda fresh, inner: type(fresh)(inner),
    "array": _array,
    "bytes": lambda fresh, inner: zlib.decompress(base64.b64decode(inner)),
    "record": _record,
    "dict": _dict,
    "list": _sequence,
    "tuple": lambda fresh, inner: tuple(_sequence(fresh, inner)),
    "deque": lambda fresh, inner: deque(_sequence(fresh, inner), fresh.maxlen),
    "set": lambda fresh, inner: set(_sequence(None, inner)),
    "object": _object,
}


def _packed(array: np.ndarray) -> str:
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 1)).decode()
