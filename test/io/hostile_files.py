"""State files as somebody would make them who means harm, each with a checksum that is right.

The tests take a sample; all of it, and as many flips as one likes: python test/ros/hostile_run.py 10000 2500
"""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cable_sim_ros.sim.saved.npz_bytes import npz, sealed, text

END = 22  # bytes of the end of the directory of a zip file
TEXTS = ("about", "scene", "notes")
HEADERS = {  # of an array of float64, in place of the right one
    "giant shape": "{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000, 100000), }",
    "shape beyond int64": "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999999,), }",
    "negative shape": "{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 32, 6), }",
    "shape of floats": "{'descr': '<f8', 'fortran_order': False, 'shape': (10.0, 32.0), }",
    "no shape": "{'descr': '<f8', 'fortran_order': False, }",
    "order of Fortran": "{'descr': '<f8', 'fortran_order': True, 'shape': (10, 32, 6), }",
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (10, 32, 6), }",
    "unknown dtype": "{'descr': '<q9', 'fortran_order': False, 'shape': (10, 32, 6), }",
    "giant dtype": "{'descr': '|V2147483647', 'fortran_order': False, 'shape': (1, ), }",
    "nested dtype": "{'descr': " + "[('a', " * 200 + "'<f8'" + ")]" * 200 + ", 'fortran_order': False, 'shape': ()}",
    "nested brackets": "(" * 5000,
    "nested signs": "-" * 9000 + "1",
    "open text": "{'descr': '''",
    "a call": "__import__('os').system('true')",
    "no table": "[1, 2, 3]",
    "zero bytes": "\0" * 64,
    "no text": "\xff\xfe\x80" * 20,
    "empty": "",
}
ENTRY = {  # fields of an entry of the directory: offset, format, values
    "needs a later version": (6, "<H", (99,)),
    "encrypted": (8, "<H", (1, 0x41, 0xFFFF)),
    "patched": (8, "<H", (0x20,)),
    "another method": (10, "<H", (8, 9, 12, 14, 93, 99, 0xFFFF)),
    "another checksum": (16, "<I", (0, 0xFFFFFFFF)),
    "another packed size": (20, "<I", (0, 1, 0xFFFFFFFE, 0xFFFFFFFF)),
    "another size": (24, "<I", (0, 1, 3_200_000_000, 0xFFFFFFFF)),
    "a longer name": (28, "<H", (1, 0xFFFF)),
    "a longer extra": (30, "<H", (1, 0xFFFF)),
    "another place": (42, "<I", (1, 0x7FFFFFFF, 0xFFFFFFFF)),
}
AT_END = {"members": (10, "<H", (0, 1, 0xFFFF)), "size": (12, "<I", (0, 1, 0xFFFFFFFF)), "place": (16, "<I", (0, 1))}


def members_of(data: bytes) -> dict[str, np.ndarray]:
    """Arrays of a state file, texts as arrays of bytes."""
    with np.load(io.BytesIO(data)) as archive:
        return {name: archive[name].copy() for name in archive.files}


def rebuilt(members: dict[str, np.ndarray], **others: np.ndarray | str) -> bytes:
    """A state file of these members, some of them others."""
    return sealed(npz(members | {name: text(v) if isinstance(v, str) else v for name, v in others.items()}))


def crafted(data: bytes) -> list[tuple[str, Callable[[], bytes]]]:
    """What is wrong with a file, and how to make it from a good one."""
    members = members_of(data)
    headers = [(f"header: {what}", partial(_with_header, members, head)) for what, head in HEADERS.items()]
    return [*_archives(members), *headers, *_numbers(members), *_notes(members)]


def _archives(members: dict[str, np.ndarray]) -> Iterator[tuple[str, Callable[[], bytes]]]:
    whole = npz(members)
    directory = whole.index(b"PK\x01\x02")
    for what, (offset, form, values) in ENTRY.items():
        for value in values:
            yield f"directory: {what} {value}", partial(_patched, whole, directory + offset, form, value)
    for what, (offset, form, values) in AT_END.items():
        for value in values:
            yield f"end: {what} {value}", partial(_patched, whole, len(whole) - END + offset, form, value)
    yield "compressed", lambda: sealed(npz(members, compressed=True))
    yield "bomb", lambda: sealed(npz(members | {"nodes": np.zeros(6_000_000)}, compressed=True))
    yield "too many members", partial(rebuilt, members | {f"x{k}": np.zeros(1) for k in range(70)})
    yield "another member", partial(rebuilt, members | {"../../outside": np.zeros(1)})
    yield "nothing in it", lambda: sealed(npz({}))
    memory = io.BytesIO(whole)
    with zipfile.ZipFile(memory, "a") as archive:
        archive.writestr(zipfile.ZipInfo("nodes.npy"), b"again")
    yield "a member twice", partial(sealed, memory.getvalue())
    for name in members:
        yield f"without {name}", partial(rebuilt, {k: v for k, v in members.items() if k != name})


def _patched(data: bytes, at: int, form: str, value: int) -> bytes:
    changed = bytearray(data)
    struct.pack_into(form, changed, at, value)
    return sealed(bytes(changed))


def _with_header(members: dict[str, np.ndarray], head: str) -> bytes:
    """The file with another header of `nodes`."""
    raw = head.encode("latin1")
    content = b"\x93NUMPY\x02\x00" + struct.pack("<I", len(raw)) + raw + members["nodes"].tobytes()
    memory = io.BytesIO(npz({k: v for k, v in members.items() if k != "nodes"}))
    with zipfile.ZipFile(memory, "a") as archive:
        archive.writestr(zipfile.ZipInfo("nodes.npy"), content)
    return sealed(memory.getvalue())


def _numbers(members: dict[str, np.ndarray]) -> Iterator[tuple[str, Callable[[], bytes]]]:
    for name, array in members.items():
        if name in TEXTS or name.startswith("step_"):
            continue
        for value in (np.nan, np.inf, 1e300):
            lacks = name in ("inputs_command", "inputs_flap") and np.isnan(value)  # not commanded
            if array.dtype.kind == "f" and array.size and not lacks:
                yield f"{name}: {value}", partial(rebuilt, members | {name: np.full_like(array, value)})
    memory = members["memory"]
    for field in _fields(memory.dtype):
        for value in (
            (np.iinfo(np.int64).min, np.iinfo(np.int64).max)
            if _of(memory, field).dtype.kind == "i"
            else (np.nan, -np.inf, 1e200)
        ):
            changed = memory.copy()
            _of(changed, field)[...] = value
            yield f"memory.{field} = {value}", partial(rebuilt, members | {"memory": changed})
    for name, value in (("motion_head", -1), ("motion_head", 2**62), ("command_seen", -5), ("motion_time", -(2**63))):
        key = f"inputs_{name}"
        yield f"{key} = {value}", partial(rebuilt, members | {key: np.full_like(members[key], value)})
    for what, nodes in (("backwards", members["nodes"][:, ::-1].copy()), ("all zero", 0.0 * members["nodes"])):
        yield f"nodes {what}", partial(rebuilt, members | {"nodes": nodes})
    yield "another shape", partial(rebuilt, members | {"nodes": members["nodes"][:, :-1].copy()})
    yield "another dtype", partial(rebuilt, members | {"nodes": members["nodes"].astype(np.float32)})


def _fields(kind: np.dtype, prefix: str = "") -> Iterator[str]:
    for name in kind.names or ():
        inner = kind[name]
        yield from _fields(inner, f"{prefix}{name}.") if inner.names else [prefix + name]


def _of(record: np.ndarray, field: str) -> np.ndarray:
    for part in field.split("."):
        record = record[part]
    return record


def _notes(members: dict[str, np.ndarray]) -> Iterator[tuple[str, Callable[[], bytes]]]:
    for what, notes in {"nested": "[" * 100_000, "nested tables": '{"a":' * 100_000, "a number": "3", "": ""}.items():
        yield f"notes: {what or 'empty'}", partial(rebuilt, members, notes=notes)
    notes = json.loads(bytes(members["notes"]))
    for path in _leaves(notes):
        for value in ("now", {"list": [1]}, {"object": {}}, {"array": ["<f8", [10**9], BOMB]}, [[]] * 3):
            yield f"notes: {'.'.join(map(str, path[-4:]))} = {value!s:.20}", partial(_noted, members, path, value)


def _noted(members: dict[str, np.ndarray], path: tuple, value: Any) -> bytes:
    """The file with another value in its notes."""
    notes = inner = json.loads(bytes(members["notes"]))
    for part in path[:-1]:
        inner = inner[part]
    inner[path[-1]] = value
    return rebuilt(members, notes=json.dumps(notes))


BOMB = base64.b64encode(zlib.compress(bytes(10_000_000), 9)).decode()
OBJECTS = ("clock", "gate", "commands", "ingest", "filter", "_watch", "_imu", "_fit", "cadence", "_state", "_rows")


def _leaves(tree: Any, path: tuple = ()) -> Iterator[tuple]:
    """Places in the notes where an object, an array or what is of the settings stands."""
    if isinstance(tree, dict):
        for name, inner in tree.items():
            here = (*path, name)
            if name in OBJECTS or inner == {"own": None}:
                yield here
            yield from _leaves(inner, here)


def flipped(data: bytes, bit: int) -> bytes:
    """The file with one bit changed."""
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << (bit % 8)
    return bytes(changed)


def flipped_inside(members: dict[str, np.ndarray], rng: np.random.Generator) -> bytes:
    """A file with one bit of one member changed, and every checksum right again."""
    name = str(rng.choice([name for name, array in members.items() if array.size]))
    array = members[name]
    raw = flipped(array.tobytes(), int(rng.integers(8 * array.nbytes)))
    return rebuilt(members | {name: np.frombuffer(raw, array.dtype).reshape(array.shape)})


def rewritten(source: Path, target: Path, **members) -> Path:
    """The file with some members replaced, by arrays or texts; None: left out."""
    kept = {k: v for k, v in members_of(source.read_bytes()).items() if members.get(k, v) is not None}
    target.write_bytes(rebuilt(kept, **{k: v for k, v in members.items() if v is not None}))
    return target


def with_notes(source: Path, target: Path, change) -> Path:
    """The file with its notes changed."""
    notes = json.loads(bytes(members_of(source.read_bytes())["notes"]))
    change(notes)
    return rewritten(source, target, notes=json.dumps(notes))
