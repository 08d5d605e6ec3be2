"""Writes the FMU: scene and script packed by pythonfmu (FMI 2) or pythonfmu3 (FMI 3)."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import re
import shutil
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from ...errors import told_as
from ...files import whole
from ...io.scenes.load import dump_scene, load_scene
from ...physics.towbody import BodyModel
from ...runs.settings import apply_to_scene, refuse_without_bag
from ...version import __version__
from .slave import rows
from .tow import ABOUT_FILE, SCENE_FILE, FmuError, number_of

SCRIPTS = Path(__file__).with_name("scripts")
EXPORTERS = {2: "pythonfmu", 3: "pythonfmu3"}
OPTIONS = {
    2: {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True},
    3: {"canGetAndSetFMUState": True, "canSerializeFMUState": True},
}
PLATFORMS = {2: ("linux64", "win64"), 3: ("x86_64-linux", "x86_64-windows")}


class Built(NamedTuple):
    """What was written: file, version of FMI, name of the model, tick [s], number of inputs, outputs, parameters."""

    file: Path
    fmi: int
    model: str
    tick: float
    inputs: int
    outputs: int
    parameters: int


def build(
    scene: str | os.PathLike,
    out: str | os.PathLike,
    fmi: int = 2,
    settings: Mapping[str, Any] | None = None,
    parameters: Sequence[str] = (),
    force: bool = False,
) -> Built:
    """Write an FMU of a scene. settings: values by key, fixed in it; parameters: keys that the importing tool may set.

    Raises SceneError, FmuError.
    """
    out = Path(out)
    if out.suffix != ".fmu":
        raise FmuError(f"--out {out}: is no name of an FMU; nothing was written. Give one that ends in .fmu")
    if out.is_dir() or (out.exists() and not force):
        what, remedy = (
            ("is a folder", "another name") if out.is_dir() else ("is there already", "--force to replace it")
        )
        raise FmuError(f"--out {out}: {what}; nothing was written. Give {remedy}")
    exporter = _exporter(fmi)
    tow = load_scene(scene)
    settings = settings or {}
    refuse_without_bag(settings, {}, "that of the inputs ship.*")
    tow = apply_to_scene(tow, settings)
    name = re.sub(r"\W", "_", tow.name, flags=re.ASCII)
    text = dump_scene(tow)
    about: dict[str, Any] = {"name": name if name[:1].isalpha() else f"tow_{name}", "version": __version__}
    numbers = {key: number_of(tow, key) for key in dict.fromkeys(parameters)}
    about |= {"parameters": numbers, "scene_sha256": hashlib.sha256(text.encode()).hexdigest()}
    if tow.towbody.model is BodyModel.VEHICLE:
        about |= {"vehicle": True}
    after = "; what was there before is as it was. Give a file in a folder that is there, on a disk with room"
    writing = told_as(FmuError, f"--out {out}: cannot be written", after)
    with writing, tempfile.TemporaryDirectory(prefix="cable_sim_fmu_") as folder:
        work = Path(folder)
        script = work / f"cable_sim_fmi{fmi}.py"
        shutil.copy(SCRIPTS / script.name, script)
        (work / SCENE_FILE).write_text(text, "utf-8")
        (work / ABOUT_FILE).write_text(json.dumps(about, indent=1) + "\n", "utf-8")
        made = work / "out"
        made.mkdir()
        with _clean_imports(script.stem):
            built = exporter.FmuBuilder.build_FMU(
                script, made, project_files=[work / SCENE_FILE, work / ABOUT_FILE], **OPTIONS[fmi]
            )
        with whole(out) as part:
            _without_others(Path(built), part, fmi)
    roles = Counter(row.role for row in rows(about))
    return Built(out, fmi, about["name"], tow.solver.tick, roles["input"], roles["output"], roles["parameter"])


def _exporter(fmi: int) -> Any:
    after = "; nothing was written. pip install 'cable_sim_ros[fmu]'"
    with told_as(FmuError, f"--fmi {fmi} needs {EXPORTERS[fmi]}, which cannot be imported", after, ImportError):
        return import_module(EXPORTERS[fmi])


@contextmanager
def _clean_imports(module: str):
    """The exporters import the script by its name from sys.path: leave neither behind."""
    path, level = list(sys.path), logging.root.level
    sys.modules.pop(module, None)
    try:
        yield
    finally:
        sys.path[:] = path
        sys.modules.pop(module, None)
        logging.root.setLevel(level)


def _without_others(source: Path, target: Path, fmi: int) -> None:
    """Copy the archive without binaries of platforms on which cable_sim_ros does not run."""
    kept = PLATFORMS[fmi][0]
    with zipfile.ZipFile(source) as read, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as write:
        for item in read.infolist():
            parts = item.filename.split("/")
            if parts[0] == "binaries" and parts[1] != kept:
                continue
            write.writestr(item.filename, read.read(item))
