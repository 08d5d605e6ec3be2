"""Entry points: first whether what is installed is new enough, said in one line; only then the imports.

A distribution's own packages (Ubuntu 24.04: numba, pydantic) are older than what is needed, and without this the user
would get the traceback of an import. Standard library only, as everything else may be what is missing.
"""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

from .errors import CODE_INPUT, NEEDS_ROS, CableSimError
from .limits import GARBAGE
from .terminal import say

COMPILER, WAY = "CABLE_SIM_COMPILER", "numba"  # given, any newer numba will do: compiler/jit.py
KERNELS, HOST = "CABLE_SIM_KERNELS", "host"  # given, those of the package are left aside: compiler/packaged.py
REQUIREMENTS = Path(__file__).with_name("requirements.txt")


class NotInstalledError(CableSimError, ImportError):
    """A package is missing, too old or too new; the text names it, where it lies, what is needed and the remedy."""


def declared(text: str) -> Iterator[tuple[str, str]]:
    """(name, bounds) for each line of a requirements file: ("numba", ">=0.65,<0.70")."""
    for line in text.splitlines():
        if match := re.match(r"([A-Za-z0-9._-]+)\s*([^#]*)", line):
            yield match[1], match[2].strip()


def numbers(version: str) -> tuple[int, ...]:
    """The leading numbers of a version; (1, 26, 4) for "1.26.4+ds", without zeros at the end."""
    found = [int(part) for part in re.match(r"\d*(?:\.\d+)*", version)[0].split(".") if part]  # type: ignore[index]
    while found and not found[-1]:
        found.pop()
    return tuple(found)


def misfit(version: str, bounds: str) -> str:
    """ "too old", "too new", or "" for a version inside the bounds."""
    for bound in filter(None, bounds.split(",")):
        operator, limit = re.fullmatch(r"(>=|<)(.+)", bound.strip()).groups()  # type: ignore[union-attr]
        if operator == ">=" and numbers(version) < numbers(limit):
            return "too old"
        if operator == "<" and numbers(version) >= numbers(limit):
            return "too new"
    return ""


def faults(find: Callable[[str], metadata.Distribution] = metadata.distribution) -> list[tuple[str, str]]:
    """(requirement, what is wrong with it) for each that this interpreter does not meet."""
    wrong = []
    for name, bounds in declared(REQUIREMENTS.read_text("utf-8")):
        if name == "numba" and os.environ.get(COMPILER) == WAY:
            bounds = bounds.partition(",")[0]
        try:
            found = find(name)
        except metadata.PackageNotFoundError:
            wrong.append((name + bounds, f"{name} is not installed ({name}{bounds} is needed)"))
            continue
        if misfit_is := misfit(found.version, bounds):
            place = Path(str(found.locate_file("")))
            wrong.append((name + bounds, f"{name} {found.version} in {place} is {misfit_is} ({bounds} is needed)"))
    return wrong


def remedy(requirements: list[str]) -> str:
    """What to do about it: install into the environment in use, or make one beside the system's Python."""
    if sys.prefix != sys.base_prefix:
        return f"Install: {sys.executable} -m pip install " + " ".join(f"'{text}'" for text in requirements)
    return (
        "Leave the system's packages as they are and make an environment beside them, in the folder of the workspace: "
        f"{sys.executable} -m venv --system-site-packages .venv && touch .venv/COLCON_IGNORE && "
        f".venv/bin/python -m pip install -r {REQUIREMENTS}; then build again with .venv/bin/python -m colcon build, "
        "which makes the commands use it (docs/install.md)"
    )


@cache
def check() -> None:
    """Raise NotInstalledError unless this interpreter has what is needed."""
    if (way := os.environ.get(COMPILER, "")) not in ("", WAY):
        raise NotInstalledError(
            f"{COMPILER} = {way!r} is no way to compile; nothing was started. Give {WAY}, for compilation by "
            f"numba.njit alone, or leave it out"
        )
    if (where := os.environ.get(KERNELS, "")) not in ("", HOST):
        raise NotInstalledError(
            f"{KERNELS} = {where!r} names no kernels; nothing was started. Give {HOST}, to leave aside those that came "
            f"with the package, or leave it out"
        )
    wrong = faults()
    if wrong:
        raise NotInstalledError(
            f"{'; '.join(text for _, text in wrong)}; nothing was started by {sys.executable}. "
            + remedy([requirement for requirement, _ in wrong])
        )


def _run(load: Callable[[], Callable[[], object]]) -> int:
    gc.set_threshold(*GARBAGE)
    try:
        check()
        main = load()
    except CableSimError as error:
        say(f"error: {error}", err=True)
        return CODE_INPUT
    return main()  # type: ignore[return-value]


def cable_sim() -> int:
    """The command ``cable-sim``."""

    def load() -> Callable[[], object]:
        from .cli.commands import main

        return main

    return _run(load)


def node() -> int:
    """``ros2 run cable_sim_ros node``."""

    def load() -> Callable[[], object]:
        try:
            from .ros.node import main
        except ImportError as error:
            if (error.name or "").startswith("cable_sim_ros"):
                raise
            raise NotInstalledError(f"the node {NEEDS_ROS.format(error=error)}") from error
        return main

    return _run(load)
