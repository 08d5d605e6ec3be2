"""Numbers of a message by field path, from its definition: `pose.position.x`, `position[0]`, `position[payout]`.

Definitions come from files: their names and array lengths are checked before rosbags makes code of them.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ....io.bags.typestore import STORE

MAX_ELEMENTS = 64  # of an array that become columns; a longer one is an image, a cloud or a table
MAX_COLUMNS = 512  # of one source
MAX_TEXT = 200_000  # bytes of a definition
MAX_VISITS = 20_000  # fields of a message, those within fields included
MAX_UNROLLED = 1024  # elements of an array of fixed length of texts or messages: rosbags writes code for each
NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*){1,2}", re.ASCII)
LENGTH = re.compile(r"[\[<]\s*(?:<=)?\s*(\d+)|,\s*(\d+)\s*>|\[[^\]]*?(\d{4,})")
NAMES = ("name", "names", "joint_names")  # texts beside an array of the same length name its elements
STAMPS = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
SIZES = {"bool": 1, "byte": 1, "char": 1, "octet": 1, "float128": 16} | {
    f"{kind}{bits}": bits // 8
    for kind, widths in (("int", (8, 16, 32, 64)), ("uint", (8, 16, 32, 64)), ("float", (32, 64)))
    for bits in widths
}


class Values(NamedTuple):
    """Of one message.

    fixed: numbers in the order of `Codec.columns`; more: those of arrays, by column; long: lengths of arrays that are
    left out, by path; stamp: its own, ns, None where it has none.
    """

    fixed: list[float]
    more: dict[str, float]
    long: dict[str, int]
    stamp: int | None


class Codec(NamedTuple):
    """How messages of one definition are read: columns that each has, arrays that are too long by definition."""

    columns: list[str]
    read: Callable[[bytes], Values]
    left_out: list[str]


class Definition(ValueError):
    """A definition that is not known or not usable; the text is a clause that says why."""


@lru_cache(256)
def codec(msgtype: str, encoding: str, schema_encoding: str, schema: str) -> Codec:
    """How to read messages; encoding: cdr, ros1 or json; schema: "" for a type of the installed typestore.

    Raises Definition.
    """
    if encoding == "json":
        return Codec([], _json, [])
    if encoding not in ("cdr", "ros1"):
        raise Definition(f"messages are encoded as {encoding[:40] or 'nothing that is said'}, which is not read")
    if not NAME.fullmatch(msgtype):
        raise Definition("its type has no name that a type can have")
    parts = msgtype.split("/")
    msgtype = msgtype if len(parts) == 3 else f"{parts[0]}/msg/{parts[1]}"
    store = _store(msgtype, schema_encoding, schema) if schema.strip() or encoding == "ros1" else STORE
    try:
        shape = _Shape(store, msgtype, encoding == "ros1", [MAX_VISITS])
        store.get_msgdef(msgtype)
    except Definition:
        raise
    except KeyError as error:
        where = "the bag" if schema.strip() else f"the bag nor in the {len(STORE.types)} types that are installed"
        raise Definition(f"its type, or {str(error)[:80]} of it, is defined neither in {where}") from None
    except Exception as error:  # code that rosbags wrote for a definition that makes no sense
        raise Definition(f"its definition cannot be used ({type(error).__name__})") from None
    decode = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr

    def read(data: bytes) -> Values:
        message = decode(data, msgtype)
        long: dict[str, int] = {}
        fixed, more = shape.values(message, long)
        return Values(fixed, more, long, shape.stamp(message) if shape.stamp else None)

    return Codec(shape.columns, read, shape.left_out)


def _store(msgtype: str, schema_encoding: str, schema: str) -> Typestore:
    """A typestore of one definition and what it needs."""
    if len(schema) > MAX_TEXT:
        raise Definition(f"its definition has {len(schema)} letters, more than {MAX_TEXT}")
    if any(len(digits) > 8 for match in LENGTH.findall(schema) for digits in match):
        raise Definition("its definition has an array that no message can hold")
    try:
        if schema_encoding == "ros2idl" or schema.startswith("=" * 80 + "\nIDL: "):
            types: dict[str, Any] = {}
            parts = schema.split("=" * 80 + "\n")[1:] if schema.startswith("=" * 80) else ["\n" + schema]
            for part in parts:
                types |= get_types_from_idl(part.partition("\n")[2])
        else:
            types = dict(get_types_from_msg(schema, msgtype))
        for _, fields in types.values():
            for _, (node, what) in fields:
                if node == Nodetype.ARRAY and what[1] > MAX_UNROLLED and what[0][1][0] not in SIZES:
                    raise Definition(f"its definition has an array of {what[1]} messages or texts")
        store = get_typestore(Stores.EMPTY)
        store.register({name: known for name, known in types.items() if name not in store.fielddefs})
        return store
    except Definition:
        raise
    except Exception as error:  # the parser raises what it likes on damaged text
        raise Definition(f"its definition cannot be read ({type(error).__name__})") from None


class _Shape:
    """A type of messages, taken apart once; visits: fields that may still be looked at, shared by all within."""

    def __init__(self, store: Typestore, msgtype: str, ros1: bool, visits: list[int]) -> None:
        self.columns: list[str] = []
        self.left_out: list[str] = []
        self.size = 0  # least bytes of a message
        self.stamp: Callable[[Any], int] | None = None
        self._scalars: list[str] = []
        self._times: list[str] = []
        self._arrays: list[tuple[str, int]] = []  # path, length
        self._sequences: list[tuple[str, str]] = []  # path, path of the names
        self._lists: list[tuple[str, _Shape]] = []  # path, shape of an element
        self._store, self._ros1, self._visits = store, ros1, visits
        self._add(msgtype, "", 0)
        cut = [path for path, length in self._arrays if length > MAX_ELEMENTS]
        self.left_out += [f"{path} with {length} elements" for path, length in self._arrays if path in cut]
        self._arrays = [(path, length) for path, length in self._arrays if path not in cut]
        names = self._scalars + self._times
        names += [f"{path}[{i}]" for path, length in self._arrays for i in range(length)]
        if len(names) > MAX_COLUMNS:
            self.left_out.append(f"{len(names) - MAX_COLUMNS} fields behind the first {MAX_COLUMNS}")
        self.columns = names[:MAX_COLUMNS]
        self._get = _getter(self._scalars)
        self._get_times = [attrgetter(path) for path in self._times]
        self._get_arrays = [attrgetter(path) for path, _ in self._arrays]
        self._get_sequences = [(p, attrgetter(p), attrgetter(n) if n else None) for p, n in self._sequences]
        self._get_lists = [(path, attrgetter(path), shape) for path, shape in self._lists]

    def _add(self, msgtype: str, prefix: str, depth: int) -> None:
        fields = self._store.fielddefs[msgtype][1]
        texts = [name for name, (node, what) in fields if name in NAMES and _of_texts(node, what)]
        for name, (node, what) in fields:
            self._visits[0] -= 1
            if self._visits[0] < 0 or depth > 40:
                raise Definition(f"its definition has more than {MAX_VISITS} fields, or contains itself")
            path = prefix + name
            if node == Nodetype.BASE:
                kind = str(what[0])
                self.size += SIZES.get(kind, 4)
                if kind in SIZES and name != "structure_needs_at_least_one_member":
                    self._scalars.append(path)
                elif self._ros1 and name == "structure_needs_at_least_one_member":
                    self.size -= 1
            elif node == Nodetype.NAME:
                kind = str(what)
                if kind in STAMPS:
                    self.size += 8
                    if self.stamp is None and path in ("header.stamp", "stamp", "timestamp"):
                        self.stamp = _stamp(path)
                    else:
                        self._times.append(path)
                else:
                    self._add(kind, path + ".", depth + 1)
            else:
                self._add_array(path, prefix, node, what, texts)

    def _add_array(self, path: str, prefix: str, node: Nodetype, what: Any, texts: list[str]) -> None:
        (inner, kind), length = what
        known = node == Nodetype.ARRAY
        element = SIZES.get(str(kind[0]), 4) if inner == Nodetype.BASE else 0
        if inner == Nodetype.NAME:
            before = self._visits[0]
            shape = _Shape(self._store, str(kind), self._ros1, self._visits)
            element = shape.size
            self._visits[0] -= (before - self._visits[0]) * (length - 1 if known else 0)
            if not known and not element:
                raise Definition("its definition has a list of messages of no bytes")
            self._lists.append((path, shape))
        elif str(kind[0]) in SIZES:
            if known:
                self._arrays.append((path, length))
            else:
                self._sequences.append((path, prefix + texts[0] if texts else ""))
        self.size += element * length if known else 4

    def values(self, message: Any, long: dict[str, int]) -> tuple[list[float], dict[str, float]]:
        """Numbers of a message: fixed ones in the order of `columns`, those of arrays by column; arrays too long."""
        fixed: list[float] = list(self._get(message))
        for time in self._get_times:
            stamp = time(message)
            fixed.append(stamp.sec + 1e-9 * stamp.nanosec)
        for array in self._get_arrays:
            fixed.extend(array(message).tolist())
        more: dict[str, float] = {}
        for path, get, get_names in self._get_sequences:
            numbers = get(message)
            if len(numbers) > MAX_ELEMENTS:
                long[path] = len(numbers)
                continue
            names = get_names(message) if get_names else ()
            keys = names if len(names) == len(numbers) and len(set(names)) == len(names) else range(len(numbers))
            for key, number in zip(keys, numbers.tolist()):
                more[f"{path}[{key}]"] = number
        for path, get, shape in self._get_lists:
            elements = get(message)
            if len(elements) > MAX_ELEMENTS:
                long[path] = len(elements)
                continue
            for i, element in enumerate(elements):
                row, inner = shape.values(element, long)
                more.update((f"{path}[{i}].{name}", number) for name, number in zip(shape.columns, row))
                more.update((f"{path}[{i}].{name}", number) for name, number in inner.items())
        return fixed[:MAX_COLUMNS], more


def _of_texts(node: Nodetype, what: Any) -> bool:
    return node in (Nodetype.ARRAY, Nodetype.SEQUENCE) and what[0][0] == Nodetype.BASE and what[0][1][0] == "string"


def _stamp(path: str) -> Callable[[Any], int]:
    get = attrgetter(path)

    def stamp(message: Any) -> int:
        time = get(message)
        return time.sec * 1_000_000_000 + time.nanosec

    return stamp


def _getter(paths: list[str]) -> Callable[[Any], Any]:
    if len(paths) > 1:
        return attrgetter(*paths)
    if not paths:
        return lambda message: ()
    get = attrgetter(paths[0])
    return lambda message: (get(message),)


def _json(data: bytes) -> Values:
    """Numbers of a JSON message, in the form in which Foxglove's schemas have times."""
    try:
        message = json.loads(data)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    if not isinstance(message, dict):
        raise ValueError("it is no JSON object")
    more: dict[str, float] = {}
    long: dict[str, int] = {}
    _leaves("", message, more, long, 0)
    stamp = None
    for path in ("timestamp", "header.stamp", "stamp"):
        for sub in ("nsec", "nanosec"):
            sec, nsec = more.get(f"{path}.sec"), more.get(f"{path}.{sub}")
            if stamp is None and sec is not None and nsec is not None and abs(sec) < 2**32 and abs(nsec) < 2**32:
                stamp = int(sec) * 1_000_000_000 + int(nsec)
                del more[f"{path}.sec"], more[f"{path}.{sub}"]
    return Values([], more, long, stamp)


def _leaves(path: str, value: Any, into: dict[str, float], long: dict[str, int], depth: int) -> None:
    if len(into) > MAX_COLUMNS or depth > 40:
        return
    if isinstance(value, (bool, int, float)):
        try:
            into[path] = float(value)
        except OverflowError:
            return
    elif isinstance(value, dict):
        for key, inner in value.items():
            _leaves(f"{path}.{key}" if path else key, inner, into, long, depth + 1)
    elif isinstance(value, list) and len(value) > MAX_ELEMENTS:
        long[path] = len(value)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            _leaves(f"{path}[{i}]", inner, into, long, depth + 1)
