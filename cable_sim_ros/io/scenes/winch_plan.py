"""Winch plan: what the winch is to do and when, in a line of text or a file, and the commands that carry it out.

An item is a time in seconds from the start of the run, an order and its value: `0 hold`, `60 rate 0.5`,
`360 length 250`, `600 scope 300`. It lasts until the next. `400 mode brake` gives the drive another mode, beside what
is ordered. Commas or line ends separate items; # begins a comment.

Plans as text: items in the order of time, in a line or a file, and the errors of what cannot be one.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import CableSimError
from ...files import read_text
from ...physics.winch_drive import WinchMode
from ...sim.inputs import MAX_COMMAND, WinchCommand
from ...sim.live_parameters import changed, unfit
from ...sim.scene import Scene
from .live_changes import Change

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


WORDS = Words("winch plan", "'0 hold, 60 rate 0.5, 360 hold'")
UNITS = {"hold": "", "rate": "m/s", "length": "m", "scope": "m"}  # order -> unit of its value, "": it has none
MODE, MODE_KEY = "mode", "drive.mode"  # the item that is no order, and the live key that it sets
MODES = tuple(mode.value for mode in WinchMode)
KNOWN = *UNITS, MODE
SECOND = 1_000_000_000
NEVER = 2**62  # ticks
ROUND_OFF = 1e-6  # m; how far past an end a length may be asked for, that of printed figures
REPEAT = 0.5  # of winch.command_timeout: how often a plan gives its order again, as an operator's console does


class PlanItem(NamedTuple):
    """From ``time`` [s] on: order, a key of UNITS or MODE, and its value (hold: 0), of MODE in ``mode``."""

    time: float
    order: str
    value: float = 0.0
    mode: str = ""

    def __str__(self) -> str:
        value = self.mode if self.order == MODE else plain(self.value) if UNITS[self.order] else ""
        return " ".join(filter(None, (plain(self.time), self.order, value)))


@dataclass(frozen=True, init=False)
class WinchPlan:
    """Orders to the winch in the order of time: ``WinchPlan("0 hold, 60 rate 0.5, 360 hold")``.

    hold: stand still; rate: pay out so many m/s, hauling in negative; length, scope: go at ``winch.max_rate`` to so
    many metres off the drum, or outboard of the sheave, and hold; mode: ``drive.mode``, beside them. Before the first
    order the winch holds. ``str`` of a plan is its text. Raises PlanError.
    """

    items: tuple[PlanItem, ...]

    def __init__(self, text: str, where: str = "winch plan") -> None:
        parts = parts_of(text, where, WORDS)
        items = [_item(f"{where}, item {k} '{part}'", part) for k, part in enumerate(parts, 1)]
        for k in range(1, len(items)):  # a mode may come with an order
            (now, of), (before, other) = ((_ns(item.time), item.order == MODE) for item in (items[k], items[k - 1]))
            same = [_ns(item.time) for item in items[:k] if (item.order == MODE) == of]
            if now < before or now in same[-1:]:
                raise out_of_order(f"{where}, item {k + 1} '{parts[k]}'", items[k].time, items[k - 1].time)
        object.__setattr__(self, "items", tuple(items))

    @classmethod
    def read(cls, path: str | os.PathLike) -> WinchPlan:
        """The plan of a text file. Raises PlanError."""
        return cls(*read(path, WORDS))

    @classmethod
    def of(cls, given: WinchPlan | str | os.PathLike) -> WinchPlan:
        """A plan, its text, or its file. A string is a text where it begins with a number, else a path."""
        if isinstance(given, WinchPlan):
            return given
        return cls(*text_of(given, WORDS))

    def __str__(self) -> str:
        return ", ".join(map(str, self.items))

    @property
    def last(self) -> float:
        """Time of the last item [s]."""
        return self.items[-1].time

    def check(self, drum: np.record, scene: Scene | None = None) -> None:
        """Can this winch (record of physics.winch.DRUM), and the drive of the scene, do it? Raises PlanError."""
        low, high = drum.payout_0 + drum.min_reach, drum.payout_0 + drum.max_reach
        soft = drum.min_limit > drum.min_length or drum.max_limit < drum.max_length
        fixed = drum.min_reach > drum.min_limit or drum.max_reach < drum.max_limit
        ends = {"length": (low, high), "scope": (low - drum.inboard, high - drum.inboard)}
        for k, item in enumerate(self.items, 1):
            where = f"winch plan, item {k} '{item}'"
            if item.order == "rate" and abs(item.value) > drum.max_rate:
                raise PlanError(
                    f"{where}: rate = {item.value:g} m/s is beyond winch.max_rate = {drum.max_rate:g} m/s; "
                    f"{CONSEQUENCE}. Give a rate in [{-drum.max_rate:g}, {drum.max_rate:g}] m/s, or raise "
                    f"winch.max_rate"
                )
            if item.order in ends:
                minimum, maximum = ends[item.order]
                if not minimum - ROUND_OFF <= item.value <= maximum + ROUND_OFF:
                    raise PlanError(
                        f"{where}: {item.order} = {item.value:g} m is outside the winch's travel, [{minimum:.3f}, "
                        f"{maximum:.3f}] m; {CONSEQUENCE}. Give a {item.order} within it, {_more_travel(soft, fixed)}"
                    )
            if item.order == MODE and scene is not None and (text := unfit(changed(scene, MODE_KEY, item.mode))):
                raise PlanError(f"{where}: {text.replace('nothing was changed', CONSEQUENCE)}")

    def commands(self, drum: np.record, start: int, begin: int, end: int) -> Iterator[WinchCommand]:
        """Commands with stamps in [begin, end) ns of a run that started at ``start`` ns, the same however it is cut.

        A tick takes the newest command not after its end: stamped a nanosecond late, an order begins with the first
        tick that begins at its time or holds it. It is given again every half of the time-out.
        """
        period = max(1, int(REPEAT * drum.timeout * SECOND))
        orders = [item for item in self.items if item.order != MODE]
        first = [start + _ns(item.time) + 1 for item in orders]
        for item, since, until in zip(orders, first, [*first[1:], end]):
            repeats = max(0, -((since - begin) // period))
            for stamp in range(since + repeats * period, min(until, end), period):
                yield _command(item, stamp, float(drum.inboard))

    def mode_at(self, done: int, tick: int) -> tuple[int, str]:
        """Ticks [of ``tick`` ns] to the next change of the mode after so many, and the mode until then ("": none)."""
        at = [(_ns(item.time) // tick, item.mode) for item in self.items if item.order == MODE]
        later = [first - done for first, _ in at if first > done]
        return min(later, default=NEVER), next((mode for first, mode in reversed(at) if first <= done), "")

    def modes(self) -> Iterator[Change]:
        """Its changes of the mode."""
        for k, item in enumerate(self.items, 1):
            if item.order == MODE:
                yield Change(item.time, MODE_KEY, item.mode, f"winch plan, item {k} '{item}'")


def _more_travel(soft: bool, fixed: bool) -> str:
    """How to have more travel where soft limits, or a mesh fixed to the material, end it."""
    if fixed:
        return "or more fine elements on that side of the sheave (cable.sections.*.elements)"
    return "or other winch.least_scope and winch.most_scope" if soft else "or more cable"


def _command(item: PlanItem, stamp: int, inboard: float) -> WinchCommand:
    if item.order in ("hold", "rate"):
        return WinchCommand(rate=item.value, time_ns=stamp)
    return WinchCommand(payout=item.value + (inboard if item.order == "scope" else 0.0), time_ns=stamp)


def _item(where: str, text: str) -> PlanItem:
    """One item. Raises PlanError."""
    words = text.split()
    time = number(where, "time", words[0], "s", 0.0, LONGEST)
    if len(words) < 2:
        raise PlanError(f"{where}: has no order; {CONSEQUENCE}. Known: {', '.join(KNOWN)}; for example {WORDS.example}")
    order = words[1]
    if order == MODE:
        return PlanItem(time, MODE, mode=_mode(where, words[2:]))
    if order not in UNITS:
        raise PlanError(f"{where}: '{order}' is no order; {CONSEQUENCE}. {hint(order, KNOWN)}")
    unit = UNITS[order]
    if len(words) != (3 if unit else 2):
        needs = f"one value in {unit}" if unit else "no value"
        raise PlanError(
            f"{where}: {order} takes {needs}, here are {len(words) - 2}; {CONSEQUENCE}. Write 'TIME {order}"
            f"{' VALUE' if unit else ''}', with a comma or a line end between items"
        )
    if not unit:
        return PlanItem(time, order)
    minimum = -MAX_COMMAND if order == "rate" else 0.0
    return PlanItem(time, order, number(where, order, words[2], unit, minimum, MAX_COMMAND))


def _mode(where: str, words: list[str]) -> str:
    if len(words) != 1:
        raise PlanError(
            f"{where}: mode takes one word, here are {len(words)}; {CONSEQUENCE}. Write 'TIME mode WORD', with a comma "
            f"or a line end between items; known: {', '.join(MODES)}"
        )
    if words[0] not in MODES:
        raise PlanError(f"{where}: '{words[0]}' is no mode of the drive; {CONSEQUENCE}. {hint(words[0], MODES)}")
    return words[0]


def _ns(seconds: float) -> int:
    return round(seconds * SECOND)
