"""Where recordings of the node go: a name under one root, and nothing else."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

from ..bags.bag_writer import shown
from .recorder import too_full

MAX_NAME = 64  # characters
NAME = re.compile(rf"[A-Za-z0-9_-]{{1,{MAX_NAME}}}")
NAMED = {"recording.path": ("a recording", "recorded"), "state_file": ("a state file", "saved or restored")}


def name_problem(key: str, value: str, done: str = "") -> str:
    """ "" or why a value of a parameter of NAMED is no name; recording.path may be empty: the default name.

    done: what was not done, for the text, where it is not that of NAMED.
    """
    if NAME.fullmatch(value) or (key == "recording.path" and not value):
        return ""
    what, usual = NAMED[key]
    return (
        f"parameter '{key}' = {shown(value)} is not a name for {what}: 1 to {MAX_NAME} of A-Z a-z 0-9 _ - are "
        f"allowed, no path; nothing was {done or usual}. Give a name, and its folder as recording.root"
    )


def root_problem(root: str, least_free: int, done: str = "recorded") -> str:
    """ "" or why no recording can be made under a root, now; least_free: bytes that must be left on its disk.

    done: what was not done, for the text.
    """
    why = ""
    try:
        place = Path(root).absolute()
        while not place.exists():  # made with the first recording
            place = place.parent
        if not place.is_dir():
            why = f"'{place}' is not a folder"
        elif not os.access(place, os.W_OK | os.X_OK):
            why = f"'{place}' cannot be written to"
        else:
            why = too_full(place, least_free)
    except (OSError, ValueError) as error:  # ValueError: a NUL in it
        why = str(error.strerror if isinstance(error, OSError) else error)
    given = f"parameter 'recording.root' = {shown(root)}"
    return f"{given}: {why}; nothing was {done}. Give a folder that can be written to" if why else ""


class Names:
    """Free places under a root: a name itself, then name_2, name_3, ... for further recordings of the same run."""

    def __init__(self, root: str) -> None:
        self.root = Path(root)
        self._made: dict[str, int] = {}  # wanted name -> number of the last one that was made
        self._asked = ("", 0)

    def next(self, wanted: str) -> Path:
        """Where the next recording goes; wanted: "" for tow_<date and time>.

        The first of a wanted name is that name even if it exists, and is refused then: it is not of this run.
        """
        base = wanted or time.strftime("tow_%Y%m%d_%H%M%S")
        number = self._made.get(base, 0)
        while True:
            number += 1
            suffix = "" if number == 1 else f"_{number}"
            path = self.root / (base[: MAX_NAME - len(suffix)] + suffix)
            if not os.path.lexists(path) or (number == 1 and wanted):
                self._asked = wanted, number
                return path

    def made(self) -> None:
        """The place given last is taken now."""
        wanted, number = self._asked
        if wanted:  # default names change every second
            self._made[wanted] = number
