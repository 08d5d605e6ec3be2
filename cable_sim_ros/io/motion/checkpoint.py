"""What the objects that take inputs in remember, as plain JSON, and set back into fresh objects of the same settings.

An object of this package becomes its attributes, by name. What its settings made it of (parameter blocks, rings of
inputs, callbacks, records of the model) is left out: the fresh object has its own. Nothing is executed and no class is
made from a name but the three records of messages. The JSON may be anybody's: it is looked at whole, by the kinds of
the fresh object and the declarations of `checkpoint_values.py`, before anything is set back.
"""

from __future__ import annotations

import base64
import math
import zlib
from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np

from ...physics.inputs import Inputs
from ...physics.parameter import Block
from ..messages.messages import Command, Odometry
from . import checkpoint_values
from .time_sequencer import Held

RECORDS = {kind.__name__: kind for kind in (Command, Held, Odometry)}
PLAIN = (type(None), bool, int, float, str)
CONTAINERS = (list, tuple, dict, set, deque, bytes)
MAX_ARRAY, MAX_MESSAGE = 1_000_000, 2_000_000  # bytes of an array, of a message that is held
OWN = {"own": None}  # stands for what the fresh object has of its own


def taken(value: Any) -> Any:
    """A value as JSON; tagged where JSON has no such kind."""
    if isinstance(value, Enum):
        return {"enum": value.value}
    if isinstance(value, PLAIN):
        return value
    if isinstance(value, np.ndarray):
        return {"array": [value.dtype.str, list(value.shape), _packed(value)]}
    if _is_own(value):
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

    Nothing is changed before all of it has been looked at. Raises ValueError where the two do not fit, or a value is
    none that the attribute may have (`checkpoint_values.py`).
    """
    value, changes = check(fresh, tree)
    for owner, name, new in changes:
        setattr(owner, name, new)
    return value


def check(fresh: Any, tree: Any) -> tuple[Any, Changes]:
    """The answer of `set_back`, or its ValueError, and what it is going to change; nothing is changed."""
    changes: Changes = []
    try:
        return _back(fresh, tree, changes), changes
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


Changes = list[tuple[Any, str, Any]]  # of an object the attribute and its new value


def _back(fresh: Any, tree: Any, changes: Changes) -> Any:
    if isinstance(tree, PLAIN):
        return tree
    if not isinstance(tree, dict) or len(tree) != 1:
        raise ValueError(f"{tree!r:.60} is not what was taken")
    ((kind, inner),) = tree.items()
    try:
        return _KINDS[kind](fresh, inner, changes)
    except ValueError:
        raise
    except Exception as error:  # whatever a tree of the wrong form leads to
        raise ValueError(f"'{kind!s:.20}' does not fit ({type(error).__name__}: {error!s:.100})") from None


def _object(fresh: Any, attributes: dict[str, Any], changes: Changes) -> Any:
    kind = type(fresh).__name__
    if fresh is None or isinstance(fresh, (*PLAIN, *CONTAINERS, np.ndarray)) or set(attributes) != set(vars(fresh)):
        raise ValueError(f"a {kind} has other attributes")
    for name, tree in attributes.items():
        before = getattr(fresh, name)
        own, is_own = _is_own(before), tree == OWN
        if own != is_own:
            raise ValueError(f"{kind}.{name} is {'of' if own else 'not of'} the settings")
        if own:
            continue
        value = _back(before, tree, changes)
        if problem := checkpoint_values.problem(kind, name, before, value):
            raise ValueError(problem)
        changes.append((fresh, name, value))
    return fresh


def _own(fresh: Any, inner: Any, changes: Changes) -> Any:
    if not _is_own(fresh):
        raise ValueError("what is of the settings does not stand there")
    return fresh


def _array(fresh: Any, parts: list[Any], changes: Changes) -> np.ndarray:
    code, shape, packed = parts
    kind = fresh.dtype if isinstance(fresh, np.ndarray) and code == fresh.dtype.str else np.dtype(code)
    if kind.hasobject or (kind.kind == "V" and not kind.names):
        raise ValueError(f"an array of {code!s:.20} does not stand there")
    count = math.prod(shape)
    if not 0 <= count * kind.itemsize <= MAX_ARRAY or any(type(n) is not int or n < 0 for n in shape):
        raise ValueError(f"an array of {shape!s:.40} does not stand there")
    array = np.frombuffer(_unpacked(packed, count * kind.itemsize), kind).reshape(shape).copy()
    return array.view(type(fresh)) if isinstance(fresh, np.recarray) else array


def _unpacked(packed: str, maximum: int) -> bytes:
    """Back from zlib in base64, of at most so many bytes."""
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(base64.b64decode(packed, validate=True), maximum + 1)
    if len(data) > maximum or not unpacker.eof:
        raise ValueError(f"there are more than {maximum} bytes, or they are cut off")
    return data


def _enum(fresh: Any, inner: Any, changes: Changes) -> Enum:
    if not isinstance(fresh, Enum):
        raise ValueError(f"an enum does not stand there ({inner!r:.20})")
    return type(fresh)(inner)


def _sequence(fresh: Any, trees: list[Any], changes: Changes) -> list[Any]:
    if not isinstance(trees, list):
        raise ValueError(f"{trees!r:.20} is no list")
    before = (
        list(fresh) if isinstance(fresh, (list, tuple, deque)) and len(fresh) == len(trees) else [None] * len(trees)
    )
    return [_back(part, tree, changes) for part, tree in zip(before, trees)]


def _dict(fresh: Any, pairs: list[Any], changes: Changes) -> Any:
    if not isinstance(fresh, dict):
        raise ValueError("a table does not stand there")
    found = {}
    for key, tree in pairs:
        key = _back(None, key, changes)
        found[key] = _back(fresh.get(key), tree, changes)
    return type(fresh)(found)


def _record(fresh: Any, parts: list[Any], changes: Changes) -> Any:
    name, trees = parts
    return RECORDS[name](*(_back(None, tree, changes) for tree in trees))


_KINDS: dict[str, Callable[[Any, Any, Changes], Any]] = {
    "own": _own,
    "enum": _enum,
    "array": _array,
    "bytes": lambda fresh, inner, changes: _unpacked(inner, MAX_MESSAGE),
    "record": _record,
    "dict": _dict,
    "list": _sequence,
    "tuple": lambda fresh, inner, changes: tuple(_sequence(fresh, inner, changes)),
    "deque": lambda fresh, inner, changes: deque(_sequence(fresh, inner, changes), fresh.maxlen),
    "set": lambda fresh, inner, changes: set(_sequence(None, inner, changes)),
    "object": _object,
}


def _is_own(value: Any) -> bool:
    """Is it of the settings, and left out?"""
    return not isinstance(value, Enum) and (isinstance(value, (Block, Inputs, np.void)) or callable(value))


def _packed(array: np.ndarray) -> str:
    return base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 1)).decode()
