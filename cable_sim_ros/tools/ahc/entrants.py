"""Who competes: a set-point law of the product, a callable in a file, or a program of rclpy."""

from __future__ import annotations

import shlex
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ...files import read_text, regular
from ...io.scenes.yaml12 import YamlError, parse
from ...physics.heave_compensation import SetpointLaw
from .definition import MRU, VERSION
from .remote import AhcError, Remote

LAW, CALLABLE, PROGRAM = "law", "callable", "program"
BUILT_IN, EXTERNAL = "built-in", "external"
ENTRY, ENTRY_KEYS = "entry.yaml", ("name", "file", "author", "source")
TRACKS = {"truth": VERSION, "mru": MRU}


class Entrant(NamedTuple):
    """A row of the leaderboard: its name, what kind it is, the law, ``file.py:make`` or command line; tracks for it."""

    name: str
    kind: str
    what: str
    tracks: tuple[str, ...] = tuple(TRACKS.values())

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
        Remote(controller).close()
        return Entrant(_named(name or Path(controller.rpartition(":")[0]).stem), CALLABLE, controller)
    words = words_of(command or "")
    scripts = [word for word in words if word.endswith(".py")]
    return Entrant(_named(name or Path((scripts or words)[0]).stem), PROGRAM, command or "")


def _named(name: str, where: str = "--name") -> str:
    known = [law.value for law in SetpointLaw]
    if name in known or not name.isprintable() or not name.strip() or "," in name or '"' in name:
        raise AhcError(
            f"{where} {name!r}: is a law of the product, empty, or has a comma, a quote or a control character; "
            f"nothing was run. Give the name that your rows shall have on the leaderboard"
        )
    return name


def words_of(command: str) -> list[str]:
    """Program and arguments of a command line. Raises AhcError."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise AhcError(f"--command {command!r}: {error}; nothing was run. Quote it as in a shell") from None
    if not words:
        raise AhcError("--command is empty; nothing was run. Give for example --command 'python3 my_node.py'")
    return words


def entries(folder: Path) -> list[Entrant]:
    """The entrants of a folder: its entry.yaml has for each a mapping of name, file (FILE.py, with make), author,
    source and, where it is not for both, tracks. Raises AhcError."""
    path = folder / ENTRY
    remedy = "Give a line such as {name: ours, file: ours.py, author: A. Person, source: where the law is described}"
    try:
        found, _ = parse(read_text(path))
    except OSError as error:
        raise AhcError(f"{path}: cannot be read ({error.strerror}); nothing was run. {remedy}") from None
    except YamlError as error:
        raise AhcError(f"{path}: {error}; nothing was run. {remedy}") from None
    entrants = []
    for one in found if isinstance(found, list) else [found]:
        given = one if isinstance(one, dict) else {}
        wrong = [key for key in ENTRY_KEYS if not isinstance(given.get(key), str)]
        wrong += [str(key) for key in given if key not in (*ENTRY_KEYS, "tracks")]
        tracks = given.get("tracks", [*TRACKS])
        if wrong or not isinstance(tracks, list) or not tracks or not {*map(str, tracks)} <= {*TRACKS}:
            what = f"{wrong[0]} is missing, or no key of it" if wrong else f"tracks = {tracks}, of truth and mru"
            raise AhcError(f"{path}: {what}; nothing was run. {remedy}")
        text = f"{folder / given['file']}:make"
        Remote(text).close()
        name = _named(given["name"], f"{path}: name")
        entrants.append(Entrant(name, CALLABLE, text, tuple(TRACKS[track] for track in tracks)))
    if not entrants or len({one.name for one in entrants}) < len(entrants):
        raise AhcError(f"{path}: has no entrant, or two of one name; nothing was run. {remedy}")
    return entrants


@cache
def source_of(entrant: Entrant) -> str:
    """Text of the Python files that a controller is made of: its own and those beside it; else what it is."""
    if entrant.kind != CALLABLE:
        return entrant.what
    folder = regular(entrant.what.rpartition(":")[0]).parent
    return "".join(read_text(path) for path in sorted(folder.glob("*.py")))
