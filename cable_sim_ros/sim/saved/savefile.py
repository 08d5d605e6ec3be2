"""Saved simulations: one .npz file with the scene as JSON, the version, the layout of the state, and every array of a
snapshot. Same machine and version: a run continued from a file equals the run that was not interrupted bit for bit.

Whoever feeds the simulation may add notes, a JSON object: where its motion and commands stand (runs, node). A file may
be anybody's: `npz_bytes` judges its bytes, `fitting` its arrays, `Simulator.taken` tries a tick of it; only what has
passed all of that is applied.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Container, Iterator, Mapping
from contextlib import AbstractContextManager
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from ...errors import NO_PLACE, CableSimError, told_as
from ...physics.attitude import ATTITUDE
from ...physics.inputs import Inputs
from ...physics.output import Output
from ...physics.parameter import Block
from ...physics.sensor_models import SENSED, SENSING, Sensors
from ...physics.state import CARRIED, MEMORY, NODE_ROWS, PLAN
from ...physics.tick_output import CONTACT_COLUMNS, SHAPE_COLUMNS, SLOPE_COLUMNS, TICK_OUTPUT
from ...version import __version__
from ..checks import checks
from ..scene import Scene
from . import state_values
from .npz_bytes import (
    MAX_FILE,
    Foreign,
    Unfit,
    array,
    is_sealed,
    npz,
    open_part,
    part_of,
    parts,
    read_file,
    sealed,
    text,
    text_of,
    write_file,
)

FORMAT = "cable_sim_ros saved simulation"
ABOUT, SCENE, NOTES = "about", "scene", "notes"  # members of the file beside the arrays
MAX_ABOUT, MAX_SCENE = 10_000, 1_000_000  # bytes
MAX_SHOWN = 5  # keys that differ, named in a refusal
LAYOUT = hashlib.sha256(
    repr(
        (
            MEMORY.descr,
            NODE_ROWS,
            PLAN.descr,
            ATTITUDE.descr,
            SENSED.descr,
            SENSING.descr,
            TICK_OUTPUT.descr,
            SHAPE_COLUMNS,
            SLOPE_COLUMNS,
        )
        + (CONTACT_COLUMNS,)
    ).encode()
).hexdigest()[:12]
RINGS = tuple(f"inputs_{name}" for name in Inputs._fields)
ARRAYS = (  # of a snapshot
    *CARRIED,
    *(f"step_{name}" for name in CARRIED),
    "delayed",
    "plan",
    *(f"tangent_{name}" for name in ("next", "lower", "factor", "facing")),
    *(f"sensors_{name}" for name in Sensors._fields),
    *(f"frame_{name}" for name in Output._fields),
    *RINGS,
)


class SaveError(CableSimError, ValueError):
    """A simulation that could not be saved or loaded; the text names the file, the reason and the remedy."""


class Saved(NamedTuple):
    """What a file holds: the scene, the arrays of a snapshot as bytes for `fitting`, notes of whoever fed the
    simulation."""

    scene: Scene
    arrays: dict[str, bytes]
    notes: dict[str, Any]


def write(
    path: str | os.PathLike, scene: Scene, snapshot: dict[str, np.ndarray], notes: Mapping[str, Any] | None = None
) -> None:
    """Save a scene and a snapshot at ``path``, whole or not at all, and through no link. Raises SaveError."""
    about = json.dumps({"format": FORMAT, "version": __version__, "layout": LAYOUT})
    members: dict[str, np.ndarray] = {ABOUT: text(about), SCENE: text(scene.model_dump_json()), **snapshot}
    members[NOTES] = text(json.dumps(dict(notes or {})))
    data = sealed(npz(members))
    if len(data) > MAX_FILE:
        raise SaveError(
            f"{path}: would have {len(data)} bytes, more than the {MAX_FILE} that are read again; nothing was saved. "
            f"Save when less motion is held ahead of the clock"
        )
    with _writing(path):
        write_file(path, data)


def check_place(path: str | os.PathLike) -> None:
    """Raise the SaveError of write() now, for a place where nothing can be written."""
    with _writing(path):
        if Path(path).is_dir():
            raise IsADirectoryError(0, "Is a directory")
        os.close(open_part(Path(path)))
        part_of(Path(path)).unlink()


def _writing(path: str | os.PathLike) -> AbstractContextManager[None]:
    after = "; nothing was saved. Check the folder, its permissions and the space left"
    return told_as(SaveError, f"{path}: cannot be written", after, NO_PLACE)


def read(path: str | os.PathLike) -> Saved:
    """What a file of write() holds; nothing of it has been taken yet. Raises SaveError."""
    before, check = f"{path}: cannot be read", "; nothing was loaded. Check the path and its permissions"
    give = "; nothing was loaded. Give a file of Simulator.save, --save or ~/save"
    with told_as(SaveError, before, check), told_as(SaveError, before, give, ValueError):  # Unfit, or a NUL in the name
        data = read_file(path)
    if not data.startswith(b"PK\x03\x04"):
        raise _foreign(path)
    try:
        whole = is_sealed(data)
        members = parts(data, (ABOUT, SCENE, NOTES, *ARRAYS))
        about = _about(path, members)
        if about["layout"] != LAYOUT:
            raise SaveError(
                f"{path}: was saved by version {about['version']} with the state layout {about['layout']}, this is "
                f"version {__version__} with {LAYOUT}: its numbers would stand for others; nothing was loaded. Load it "
                f"with version {about['version']}, or start its scene again with this one"
            )
        if not whole:
            raise SaveError(
                f"{path}: has no checksum at its end: it is damaged, or of a version {about['version']} that wrote "
                f"none; nothing was loaded. Load it with that version, or start its scene again with this one"
            )
        return Saved(_scene(path, members.pop(SCENE, b"")), members, _notes(members.pop(NOTES, b"")))
    except Foreign:
        raise _foreign(path) from None
    except Unfit as error:
        raise damaged(path, str(error)) from None


def _scene(path: str | os.PathLike, data: bytes) -> Scene:
    try:
        scene = Scene.model_validate_json(text_of(SCENE, data, MAX_SCENE))
        found = checks.problems(scene)
    except (ValidationError, ValueError, ArithmeticError) as error:
        raise damaged(path, f"its scene cannot be read, {type(error).__name__}") from None
    if found:
        raise damaged(path, f"its scene cannot be started: {found[0].key} {found[0].text}")
    return scene


def _notes(data: bytes) -> dict[str, Any]:
    try:
        return dict(json.loads(text_of(NOTES, data, MAX_FILE)))
    except (TypeError, ValueError, RecursionError) as error:
        raise Unfit(f"its notes cannot be read, {type(error).__name__}") from None


def same_scene(path: str | os.PathLike, saved: Scene, here: Scene, but: Container[str] = ()) -> None:
    """Raise SaveError with what differs where ``here`` is not the scene of a file; but: keys that may differ."""
    found = [text for key, text in differences(saved, here) if key not in but]
    if found:
        more = f"; and {len(found) - MAX_SHOWN} more" if len(found) > MAX_SHOWN else ""
        remedy = f"Take the scene it was saved with ('{saved.name}'), or start this one ('{here.name}') anew"
        if saved.name == here.name:  # parameters or options made them differ
            remedy = f"Start '{here.name}' with the values of the file, or save it anew with those of here"
        shown = "; ".join(found[:MAX_SHOWN]) + more
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


def fitting(path: str | os.PathLike, found: Mapping[str, bytes], wanted: Mapping[str, np.ndarray]) -> dict:
    """Arrays of a file as a snapshot like ``wanted``, that of a simulator of their scene; their numbers are bounded.

    Raises SaveError.
    """
    try:
        arrays = exact(found, wanted)
    except Unfit as error:
        raise damaged(path, str(error)) from None
    if problem := state_values.problem(arrays):
        raise damaged(path, problem)
    return arrays


def exact(found: Mapping[str, bytes], wanted: Mapping[str, np.ndarray]) -> dict:
    """Arrays of the dtypes and shapes of ``wanted``. Raises Unfit."""
    arrays = {}
    for name, like in wanted.items():
        if name not in found:
            raise Unfit(f"'{name}' is missing, expected {like.dtype.kind}{list(like.shape)}")
        arrays[name] = array(name, found[name], like)
    return {name: found.view(np.recarray)[()] if "memory" in name else found for name, found in arrays.items()}


def damaged(path: str | os.PathLike, what: str) -> SaveError:
    """A SaveError for a file that was a saved simulation once."""
    return SaveError(f"{path}: is damaged ({what}); nothing was loaded. Take another copy, or start its scene again")


def _about(path: str | os.PathLike, members: dict[str, bytes]) -> dict[str, str]:
    """What a file says of itself; SaveError where it is no saved simulation."""
    try:
        about = json.loads(text_of(ABOUT, members.pop(ABOUT), MAX_ABOUT))
        if about["format"] == FORMAT:
            return {key: f"{about[key]!s:.40}" for key in ("version", "layout")}
    except (KeyError, TypeError, ValueError, RecursionError):
        pass
    raise _foreign(path)


def _foreign(path: str | os.PathLike) -> SaveError:
    return SaveError(
        f"{path}: is no saved simulation; nothing was loaded. Simulator.load takes a file of Simulator.save"
    )
