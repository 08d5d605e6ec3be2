"""Who competes: a set-point law of the product, a callable in a file, or a program of rclpy."""

from __future__ import annotations

import importlib.util
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ...errors import CableSimError
from ...files import regular
from ...physics.heave_compensation import SetpointLaw
from ...runs.controller import Controller
from ...sim.scene import Scene

LAW, CALLABLE, PROGRAM = "law", "callable", "program"
BUILT_IN, EXTERNAL = "built-in", "external"
Maker = Callable[[Scene, float], Controller]


class AhcError(CableSimError, ValueError):
    """What the benchmark cannot be run, merged or checked with."""


class Entrant(NamedTuple):
    """A row of the leaderboard: its name, what kind it is, and the law, ``file.py:make`` or command line."""

    name: str
    kind: str
    what: str

    @property
    def rank(self) -> str:
        """Of the two ranks: built-in or external."""
        return BUILT_IN if self.kind == LAW else EXTERNAL


def laws(names: tuple[str, ...] = ()) -> list[Entrant]:
    """Set-point laws of the product by their names, all by default. Raises AhcError."""
    known = [law.value for law in SetpointLaw]
    for name in names:
        if name not in known:
            raise AhcError(f"{name}: is no set-point law; nothing was run. Known: {', '.join(known)}")
    return [Entrant(name, LAW, name) for name in names or known]


def external(name: str | None, controller: str | None, command: str | None) -> Entrant:
    """The entrant of --controller or --command. Raises AhcError where it cannot be started."""
    if controller is not None:
        maker_of(controller)
        return Entrant(_named(name or Path(controller.rpartition(":")[0]).stem), CALLABLE, controller)
    words = _words(command or "")
    scripts = [word for word in words if word.endswith(".py")]
    return Entrant(_named(name or Path((scripts or words)[0]).stem), PROGRAM, command or "")


def _named(name: str) -> str:
    known = [law.value for law in SetpointLaw]
    if name in known or not name.isprintable() or not name.strip() or "," in name or '"' in name:
        raise AhcError(
            f"--name {name!r}: is a law of the product, empty, or has a comma, a quote or a control character; nothing "
            f"was run. Give the name that your rows shall have on the leaderboard"
        )
    return name


def _words(command: str) -> list[str]:
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise AhcError(f"--command {command!r}: {error}; nothing was run. Quote it as in a shell") from None
    if not words:
        raise AhcError("--command is empty; nothing was run. Give for example --command 'python3 my_node.py'")
    return words


def words_of(entrant: Entrant) -> list[str]:
    """Program and arguments of an entrant that is one."""
    return _words(entrant.what)


def maker_of(text: str) -> Maker:
    """The function ``make(scene, period)`` of ``my_file.py:make``. Raises AhcError."""
    file, colon, name = text.rpartition(":")
    remedy = "Give FILE.py:NAME of a function make(scene, period) that returns a controller(row)"
    if not colon or not file or not name.isidentifier():
        raise AhcError(f"--controller {text}: is no FILE.py:NAME; nothing was run. {remedy}")
    try:
        path = regular(file)
    except FileNotFoundError:
        raise AhcError(f"--controller {text}: there is no file {file}; nothing was run. {remedy}") from None
    spec = importlib.util.spec_from_file_location(f"ahc_controller_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise AhcError(f"--controller {text}: {file} is no Python file; nothing was run. {remedy}")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever the file of the user does
        raise AhcError(
            f"--controller {text}: {file} raised {type(error).__name__}: {error}; nothing was run. Correct it"
        ) from error
    made: Any = getattr(module, name, None)
    if not callable(made):
        what = "has no" if made is None else f"has no function but a {type(made).__name__}"
        raise AhcError(f"--controller {text}: {file} {what} {name}; nothing was run. {remedy}")
    return made


def controller_of(text: str, scene: Scene, period: float) -> Controller:
    """A new controller for a run of a scene, asked every ``period`` [s]. Raises AhcError."""
    try:
        made = maker_of(text)(scene, period)
    except AhcError:
        raise
    except Exception as error:  # whatever the function of the user does
        raise AhcError(
            f"--controller {text}: for {scene.name} it raised {type(error).__name__}: {error}. It is called with the "
            f"scene and the control period [s]"
        ) from error
    if not callable(made):
        raise AhcError(
            f"--controller {text}: for {scene.name} it returned a {type(made).__name__}, no callable. Return a "
            f"controller(row) that returns a WinchCommand or None"
        )
    return made
