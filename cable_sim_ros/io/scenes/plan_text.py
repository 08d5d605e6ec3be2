"""Plans as text: items in the order of time, in a line or a file, and the errors of what cannot be one."""

from __future__ import annotations

import difflib
import os
import re
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from ...errors import CableSimError
from ...files import read_text

CONSEQUENCE = "nothing was simulated"
LONGEST = 1e6  # s


class PlanError(CableSimError, ValueError):
    """A plan that cannot be carried out; the text names item, value, unit, bound and remedy."""


class Words(NamedTuple):
    """What errors call a plan, and an example of one."""

    name: str
    example: str


def parts_of(text: str, where: str, words: Words) -> list[str]:
    """The items of a text: commas or line ends separate them, # begins a comment. Raises PlanError."""
    lines = [line.partition("#")[0] for line in text.splitlines()]
    parts = [part.strip() for line in lines for part in line.split(",") if part.strip()]
    if not parts:
        raise PlanError(f"{where}: has no item; {CONSEQUENCE}. Write for example {words.example}")
    return parts


def read(path: str | os.PathLike, words: Words) -> tuple[str, str]:
    """The text of a file, and what errors call it. Raises PlanError."""
    try:
        return read_text(path), f"{words.name} {path}"
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is no UTF-8 text"
        raise PlanError(
            f"{words.name} {path}: cannot be read ({why}); {CONSEQUENCE}. Give a text file with a line for each "
            f"item, or the plan itself, for example {words.example}"
        ) from None


def text_of(given: str | os.PathLike, words: Words) -> tuple[str, str]:
    """A text, or that of a file, and what errors call it. A string is a text where it begins with a number."""
    if isinstance(given, str) and (not given.strip() or re.match(r"\s*[-+.\d]\S*\s", given + " ")):
        try:
            there = Path(given or " ").exists()
        except OSError:  # longer than a name can be
            there = False
        if not there:
            return given, words.name
    return read(given, words)


def hint(word: str, known: tuple[str, ...]) -> str:
    """What was meant."""
    near = difflib.get_close_matches(word, known, 1)
    return f"Did you mean {near[0]}?" if near else f"Known: {', '.join(known)}"


def number(where: str, key: str, word: str, unit: str, minimum: float, maximum: float) -> float:
    """A number of an item. Raises PlanError."""
    try:
        found = float(word)
    except ValueError:
        found = float("nan")
    if not isfinite(found):
        raise PlanError(
            f"{where}: {key} = {word} is no finite number; {CONSEQUENCE}. Give one in [{minimum:g}, {maximum:g}] "
            f"{unit}, without its unit"
        )
    if not minimum <= found <= maximum:
        raise PlanError(
            f"{where}: {key} = {found:g} {unit} is outside [{minimum:g}, {maximum:g}] {unit}; {CONSEQUENCE}. "
            f"Check its sign and unit"
        )
    return found + 0.0  # no -0


def out_of_order(where: str, time: float, before: float) -> PlanError:
    """The error of an item that is not after the one before; times in s."""
    return PlanError(
        f"{where}: time = {time:g} s is not after that of the item before, {before:g} s; {CONSEQUENCE}. Put the items "
        f"in order of time, each time once"
    )


def plain(number: float) -> str:
    """A number as it is written in a plan."""
    return repr(float(number)).removesuffix(".0")
