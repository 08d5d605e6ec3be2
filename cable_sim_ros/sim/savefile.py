"""Saved simulations: one .npz file with the scene as JSON, the version, the layout of the state, and every array of a
snapshot. Same machine and version: a run continued from a file equals the run that was not interrupted bit for bit.

Whoever feeds the simulation may add notes, a JSON object: where its motion and commands stand (runs, node).
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from collections.abc import Container, Iterator, Mapping
from enum import Enum
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from pydantic import ValidationError

from .. import __version__
from ..physics.frame import CONTACT_COLUMNS, FRAME, SHAPE_COLUMNS, SLOPE_COLUMNS
from ..physics.quantity import Block
from ..physics.state import MEMORY, NODE_ROWS
from .scene import Scene

FORMAT = "cable_sim_ros saved simulation"
ABOUT, SCENE, NOTES = "about", "scene", "notes"  # members of the file beside the arrays
MOST_SHOWN = 5  # keys that differ, named in a refusal
LAYOUT = hashlib.sha256(
    repr((MEMORY.descr, NODE_ROWS, FRAME.descr, SHAPE_COLUMNS, SLOPE_COLUMNS, CONTACT_COLUMNS)).encode()
).hexdigest()[:12]
BROKEN = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, KeyError, NotImplementedError)


class SaveError(ValueError):
    """A simulation that could not be saved or loaded; the text names the file, the reason and the remedy."""


class Saved(NamedTuple):
    """What a file holds: the scene, the arrays of a snapshot, notes of whoever fed the simulation."""

    scene: Scene
    arrays: dict[str, np.ndarray]
    notes: dict[str, Any]


def write(
    path: str | os.PathLike, scene: Scene, snapshot: dict[str, np.ndarray], notes: Mapping[str, Any] | None = None
) -> None:
    """Save a scene and a snapshot at ``path``, whole or not at all. Raises SaveError."""
    path = Path(path)
    part = path.with_name(path.name + ".part")
    about = json.dumps({"format": FORMAT, "version": __version__, "layout": LAYOUT})
    members: dict[str, Any] = {ABOUT: np.array(about), SCENE: np.array(scene.model_dump_json()), **snapshot}
    members[NOTES] = np.array(json.dumps(dict(notes or {})))
    try:
        with open(part, "wb") as file:  # by name, numpy would add its suffix
            np.savez(file, **members)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise _unwritable(path, error) from None


def check_place(path: str | os.PathLike) -> None:
    """Raise the SaveError of write() now, for a place where nothing can be written."""
    part = Path(f"{os.fspath(path)}.part")
    try:
        if Path(path).is_dir():
            raise IsADirectoryError(0, "Is a directory")
        part.touch()
        part.unlink()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise _unwritable(path, error) from None


def _unwritable(path: str | os.PathLike, error: OSError | ValueError) -> SaveError:
    why = error.strerror if isinstance(error, OSError) else error
    return SaveError(
        f"{path}: cannot be written ({why}); nothing was saved. Check the folder, its permissions and the space left"
    )


def read(path: str | os.PathLike) -> Saved:
    """What a file of write() holds. Raises SaveError."""
    try:
        with open(path, "rb") as file:
            members = _members(path, file)
    except OSError as error:
        raise SaveError(
            f"{path}: cannot be read ({error.strerror}); nothing was loaded. Check the path and its permissions"
        ) from None
    about = _about(path, members)
    if about["layout"] != LAYOUT:
        raise SaveError(
            f"{path}: was saved by version {about['version']} with the state layout {about['layout']}, this is version "
            f"{__version__} with {LAYOUT}: its numbers would stand for others; nothing was loaded. Load it with "
            f"version {about['version']}, or start its scene again with this one"
        )
    try:
        scene = Scene.model_validate_json(str(members.pop(SCENE)))
    except (KeyError, ValidationError) as error:
        raise damaged(path, f"its scene cannot be read, {type(error).__name__}") from None
    try:
        notes = json.loads(str(members.pop(NOTES, "{}")))
        return Saved(scene, members, dict(notes))
    except (TypeError, ValueError) as error:
        raise damaged(path, f"its notes cannot be read, {type(error).__name__}") from None


def same_scene(path: str | os.PathLike, saved: Scene, here: Scene, but: Container[str] = ()) -> None:
    """Raise SaveError with what differs where ``here`` is not the scene of a file; but: keys that may differ."""
    found = [text for key, text in differences(saved, here) if key not in but]
    if found:
        more = f"; and {len(found) - MOST_SHOWN} more" if len(found) > MOST_SHOWN else ""
        remedy = f"Take the scene it was saved with ('{saved.name}'), or start this one ('{here.name}') anew"
        if saved.name == here.name:  # parameters or options made them differ
            remedy = f"Start '{here.name}' with the values of the file, or save it anew with those of here"
        shown = "; ".join(found[:MOST_SHOWN]) + more
        raise SaveError(f"{path}: is the state of another scene: {shown}; nothing was loaded. {remedy}")


def differences(saved: Scene, here: Scene) -> list[tuple[str, str]]:
    """Keys whose values differ between two scenes, in their order, each with both values and unit; names may differ."""
    return [(key, text) for key, text in _differences(saved, here, "") if key != "name"]


def _differences(saved: Block, here: Block, prefix: str) -> Iterator[tuple[str, str]]:
    for name, field in type(saved).model_fields.items():
        there, ours, key = getattr(saved, name), getattr(here, name), prefix + name
        pairs = [(key, there, ours)]
        if isinstance(there, dict) and isinstance(ours, dict):
            pairs = [(f"{key}.{k}", there.get(k), ours.get(k)) for k in {**there, **ours}]
        for inner, a, b in pairs:
            if isinstance(a, Block) and type(a) is type(b):
                yield from _differences(a, b, f"{inner}.")
            elif a != b:
                extra = field.json_schema_extra
                unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
                yield inner, f"{inner} is {_shown(a, unit)} in the file, {_shown(b, unit)} here"


def _shown(value: Any, unit: str) -> str:
    """A value of a scene, short, with its unit."""
    if value is None or isinstance(value, Block):
        return "absent" if value is None else "present"
    value = value.value if isinstance(value, Enum) else value
    text = f"{value:.10g}" if isinstance(value, float) else f"{value!s:.60}"
    return f"{text} {unit}".strip() if unit != "1" else text


def fitting(path: str | os.PathLike, arrays: dict[str, np.ndarray], wanted: dict[str, np.ndarray]) -> dict:
    """The arrays as a snapshot like ``wanted``, that of a simulator of their scene. Raises SaveError."""
    for name, like in wanted.items():
        found = arrays.get(name)
        if found is None or found.shape != like.shape or found.dtype != like.dtype:
            what = "is missing" if found is None else f"is {found.dtype.kind}{list(found.shape)}"
            raise damaged(path, f"'{name}' {what}, expected {like.dtype.kind}{list(like.shape)}")
    return {name: arrays[name].view(np.recarray)[()] if "memory" in name else arrays[name] for name in wanted}


def damaged(path: str | os.PathLike, what: str) -> SaveError:
    """A SaveError for a file that was a saved simulation once."""
    return SaveError(f"{path}: is damaged ({what}); nothing was loaded. Take another copy, or start its scene again")


def _about(path: str | os.PathLike, members: dict) -> dict:
    """What a file says of itself; SaveError where it is no saved simulation."""
    try:
        about = json.loads(str(members.pop(ABOUT)))
        if about["format"] == FORMAT:
            return {key: str(about[key]) for key in ("version", "layout")}
    except (KeyError, TypeError, json.JSONDecodeError):
        pass
    raise _foreign(path)


def _foreign(path: str | os.PathLike) -> SaveError:
    return SaveError(
        f"{path}: is no saved simulation; nothing was loaded. Simulator.load takes a file of Simulator.save"
    )


def _members(path: str | os.PathLike, file: BinaryIO) -> dict[str, np.ndarray]:
    """Every array of an .npz file; their check sums are looked at on the way."""
    if not zipfile.is_zipfile(file):  # its directory stands at the end: a file cut short has none
        file.seek(0)
        raise damaged(path, "its end is missing") if file.read(4) == b"PK\x03\x04" else _foreign(path)
    file.seek(0)
    try:
        with np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except BROKEN as error:
        raise damaged(path, f"{error}") from None
