"""A YAML file to a checked Block: found, read, parsed, validated, checked. Nothing half-right loads.

Where scenes and recorded bags lie: with pip, with colcon, in a source checkout.

The folder nearest above the running code wins, so that code and data are of the same version: the checkout itself,
or ``share/cable_sim_ros`` of the prefix the code is installed in. Only then the ament index is asked.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from ...errors import CableSimError
from ...files import read_text
from ...physics.parameter import Block
from ...sim.problem import Problem
from ...terminal import clean
from .scene_errors import CONSEQUENCE, Told, kind_of, line_of, place, texts_of
from .yaml12 import YamlError, parse

PACKAGE = "cable_sim_ros"
CODE = Path(__file__).resolve().parents[2]
RUN_BAG = "tow"  # in the folder of a run

FILES = {  # what a file is: the keys at its top that no other kind has, and where it goes
    "a scene of a tow": (("ship", "winch", "towbody"), "`cable-sim run`"),
    "a scenario of faults": (("scenario",), "`cable-sim run --faults`"),
    "a mapping of a log": (("mapping", "signals"), "`cable-sim import --mapping`"),
    "a file of limits": (("limits",), "`cable-sim compare --limits`"),
    "a map of a table of tows": (("tows",), "`cable-sim tows --map`"),
    "a sweep": (("sweep",), "`cable-sim sweep`"),
    "an ensemble": (("ensemble",), "`cable-sim ensemble --file`"),
    "a span in a wind": (("span",), "`cable-sim span` or `cable-sim viv`, in Python to load_cases"),
    "a span in a flow": (("flow",), "`cable-sim viv`: it has no wake, viscosity or axial stiffness"),
}
Lines = Mapping[tuple, int]  # path of a value -> its line, from the YAML reader
NO_LINES: Lines = MappingProxyType({})
B = TypeVar("B", bound=Block)
ACCEPTED = re.compile(r"\s# accepted: \S")  # its author has read what is said of this line, and says why it stays


class ResourceError(CableSimError, ValueError):
    """No file of that name; the text lists what there is."""


def share_folder(code: Path = CODE, environ=os.environ) -> Path:
    """Folder with ``config/`` and ``bags/``; raises ResourceError when the installation has none."""
    candidates = [code.parent]
    candidates += [parent / "share" / PACKAGE for parent in code.parents]
    prefixes = [*filter(None, environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    candidates += [Path(prefix) / "share" / PACKAGE for prefix in prefixes]
    for folder in candidates:
        if (folder / "package.xml").is_file() and (folder / "config").is_dir():
            return folder
    raise ResourceError(
        f"no folder share/{PACKAGE} with config/ beside the code in {code}; nothing was started. "
        "Install the package again, or give full paths of files"
    )


def shipped_scenes() -> list[str]:
    """Names of the scenes in ``config/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "config").glob("*.yaml") if not is_span(path))


def shipped_spans() -> list[str]:
    """Names of the spans in ``config/``, sorted."""
    return sorted(path.stem for path in (share_folder() / "config").glob("*.yaml") if is_span(path))


def is_span(path: Path) -> bool:
    """Is a file in ``config/`` one of a span, by its key at the top?"""
    return any(line.startswith("span:") for line in read_text(path).splitlines())


def shipped_bags() -> list[str]:
    """Names of the recorded bags in ``bags/`` (directories with a metadata.yaml), sorted."""
    return sorted(path.parent.name for path in (share_folder() / "bags").glob("*/metadata.yaml"))


def _shipped(folder: str, ending: str = ".yaml") -> list[str]:
    """Names of the files of a kind in a folder of ours, sorted."""
    return sorted(path.stem for path in (share_folder() / folder).glob(f"*{ending}"))


def _no_folder(path: Path) -> bool:
    """Is anything there that is no folder? Whether it can be read says the one who opens it."""
    return path.exists() and not path.is_dir()


def _find(
    what: str,
    folder: str,
    shipped: Callable[[], list[str]],
    path_or_name: str | os.PathLike,
    ending: str = ".yaml",
    test: Callable[[Path], bool] = _no_folder,
) -> Path:
    """Path of a file that is named by its path, or, of a shipped one, by its name with or without the ending."""
    given = Path(path_or_name)
    if test(given):
        return given
    if given.parent == Path("."):
        for suffix in dict.fromkeys((ending, "")):
            candidate = share_folder() / folder / (given.name + suffix)
            if test(candidate):
                return candidate
    names = ", ".join(shipped()) or "none"
    raise ResourceError(
        f"{given}: no such {what} file; nothing was started. "
        f"Give the path of a {what}, or the name of a shipped one: {names}"
    )


shipped_viv = partial(_shipped, "config/viv")  # spans whose vibration `cable-sim viv` computes
shipped_mappings = partial(_shipped, "config/mappings")  # ready mappings of logs
shipped_tows = partial(_shipped, "bags/tows", ".csv")  # tables of measured tows, each with a map in config/tows
find_scene = partial(_find, "scene", "config", shipped_scenes)
find_viv = partial(_find, "span", "config/viv", shipped_viv)
find_span = partial(_find, "span", "config", shipped_spans)  # in a wind
find_mapping = partial(_find, "mapping", "config/mappings", shipped_mappings)
find_tow_table = partial(_find, "table of tows", "bags/tows", shipped_tows, ending=".csv")
find_tow_map = partial(_find, "map of tows", "config/tows", shipped_tows)


def find_bag(path_or_name: str | os.PathLike) -> Path:
    """Path of a bag: a bag directory or MCAP file, the folder of a run with its bag in it, or the name of a shipped
    one."""
    found = _find("bag", "bags", shipped_bags, path_or_name, "", Path.exists)
    inside = found / RUN_BAG
    return inside if inside.is_dir() and not (found / "metadata.yaml").exists() else found


class SceneError(CableSimError, ValueError):
    """A file that cannot be used. ``problems``: one text each, with file, line, key, value, bound and remedy; of what
    is wrong with a key, a Told with these as attributes."""

    lines = True

    def __init__(self, problems: Sequence[str]):
        self.problems = problems
        super().__init__("\n".join(map(clean, problems)))


class SceneWarning(UserWarning):
    """A scene that can be run, with a number that will show in the results."""


class FileOfKey(Exception):
    """A file that a value names and that cannot be used. path: of the key, set where it is known; what, remedy: see
    Problem."""

    path: tuple[str, ...] = ()

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what)
        self.what, self.remedy = what, remedy


@dataclass(frozen=True)
class Document(Generic[B]):
    """A kind of file. Its methods raise ``error`` with every problem, and warn with SceneWarning."""

    block: type[B]
    what: str  # of FILES
    noun: str  # in its errors
    example: str  # of its first lines
    find: Callable[[str | os.PathLike], Path]
    shipped: Callable[[], list[str]]
    problems: Callable[[B], Iterable[Problem]]
    warnings: Callable[[B], Iterable[Problem]] = lambda _: ()
    error: type[SceneError] = SceneError
    read_files: Callable[[Mapping[str, Any], str], Mapping[str, Any]] = lambda data, _: data  # that its values name

    def load(self, path_or_name: str | os.PathLike) -> B:
        """Of a file, or of the name of a shipped one."""
        try:
            path = self.find(path_or_name)
            text = read_text(path)
        except ResourceError as error:
            raise self.error([str(error)]) from None
        except UnicodeDecodeError as error:
            why = f"is not UTF-8 text (byte {error.start}); {CONSEQUENCE}. Save the {self.noun} as UTF-8"
            raise self.error([f"{path_or_name}: {why}"]) from None
        except OSError as error:
            why = f"cannot be read ({error.strerror}); {CONSEQUENCE}. Check the path and its permissions"
            raise self.error([f"{path_or_name}: {why}"]) from None
        return self.read(text, str(path))

    def read(self, text: str, origin: str) -> B:
        """Of YAML text; origin names it in errors. A line that ends in `# accepted: why` is not warned of."""
        try:
            data, lines = parse(text)
        except YamlError as error:
            told = [f"{place(origin, line)}: {what}; {CONSEQUENCE}. Correct the YAML" for line, what in error.problems]
            raise self.error(told) from None
        accepted = {number for number, line in enumerate(text.splitlines(), 1) if ACCEPTED.search(line)}
        return self.check(data, origin, lines, accepted)

    def check(self, data: Any, origin: str, lines: Lines = NO_LINES, accepted: Collection[int] = ()) -> B:
        """Of plain data; accepted: lines that are not warned of."""
        if not isinstance(data, Mapping):
            what = f"is {kind_of(data)}, expected keys and values such as `{self.example}`"
            raise self._refused(place(origin, lines.get((), 0)), what, "Begin")
        top = [(key, what) for what, (keys, _) in FILES.items() for key in keys if key in data]
        key, what = top[0] if top else ("", self.what)
        if what != self.what:
            why = f"{key} stands at the top: this is {what}, not {self.what}"
            raise self._refused(place(origin, lines.get((key,), 0)), why, f"Give it to {FILES[what][1]}. Or begin")
        try:
            data = self.read_files(data, origin)
        except FileOfKey as named:
            where = place(origin, line_of(lines, named.path))
            raise self.error([Told.of(where, ".".join(named.path), named.what, named.remedy)]) from None
        try:
            block = self.block.model_validate(data)
        except ValidationError as error:
            raise self.error(texts_of(error, data, origin, lines, self.block)) from None
        return self.checked(block, origin, lines, accepted)

    def checked(self, block: B, origin: str, lines: Lines = NO_LINES, accepted: Collection[int] = ()) -> B:
        """The block itself, where its values fit each other."""

        def told(problem: Problem, consequence: str) -> Told:
            where = place(origin, line_of(lines, tuple(problem.key.split("."))))
            text = Told.of(where, *problem[:3], consequence)
            text.value, text.bound, text.unit = problem[3:]
            return text

        if found := [told(problem, f"; {CONSEQUENCE}") for problem in self.problems(block)]:
            raise self.error(found)
        for warning in self.warnings(block):
            if line_of(lines, tuple(warning.key.split("."))) not in accepted:
                warnings.warn(told(warning, ""), SceneWarning, stacklevel=6)  # where load_scene is called
        return block

    def _refused(self, where: str, why: str, remedy: str) -> SceneError:
        shipped = ", ".join(self.shipped())
        copy = f"with a copy of a shipped {self.noun}: {shipped}" if shipped else f"with `{self.example}`"
        return self.error([f"{where}: {why}; {CONSEQUENCE}. {remedy} {copy}"])
