"""Saved simulations: one .npz file with the scene as JSON, the version, the layout of the state, and every array of a
snapshot. Same machine and version: a run continued from a file equals the run that was not interrupted bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from pydantic import ValidationError

from .. import __version__
from ..physics.frame import CONTACT_COLUMNS, FRAME, SHAPE_COLUMNS, SLOPE_COLUMNS
from ..physics.state import MEMORY, NODE_ROWS
from .scene import Scene

FORMAT = "cable_sim_ros saved simulation"
ABOUT, SCENE = "about", "scene"  # members of the file beside the arrays
LAYOUT = hashlib.sha256(
    repr((MEMORY.descr, NODE_ROWS, FRAME.descr, SHAPE_COLUMNS, SLOPE_COLUMNS, CONTACT_COLUMNS)).encode()
).hexdigest()[:12]
BROKEN = (zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, KeyError, NotImplementedError)


class SaveError(ValueError):
    """A simulation that could not be saved or loaded; the text names the file, the reason and the remedy."""


def write(path: str | os.PathLike, scene: Scene, snapshot: dict[str, np.ndarray]) -> None:
    """Save a scene and a snapshot at ``path``, whole or not at all. Raises SaveError."""
    path = Path(path)
    part = path.with_name(path.name + ".part")
    about = json.dumps({"format": FORMAT, "version": __version__, "layout": LAYOUT})
    members: dict[str, Any] = {ABOUT: np.array(about), SCENE: np.array(scene.model_dump_json()), **snapshot}
    try:
        with open(part, "wb") as file:  # by name, numpy would add its suffix
            np.savez(file, **members)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise SaveError(
            f"{path}: cannot be written ({error.strerror}); nothing was saved. Check the folder, its permissions and "
            f"the space left"
        ) from None


def read(path: str | os.PathLike) -> tuple[Scene, dict[str, np.ndarray]]:
    """Scene and snapshot of a file of write(). Raises SaveError."""
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
    return scene, members


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
