"""Live keys of a scene that change at times of a run: what may change and when, and which tick it meets.

A change acts from the tick on that holds its time, offline and in the node; the journal of a recording has it, so that
a replay repeats it.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from itertools import groupby
from math import isfinite
from typing import Any, NamedTuple

from pydantic import ValidationError

from ...errors import CableSimError
from ...limits import LONGEST_RUN
from ...physics.parameter import declared
from ...physics.sensor_models import DEVICES, FaultKind
from ...sim.checks.instrument_checks import DEVICE_OF
from ...sim.live_parameters import changed, unfit, value_of, ways
from ...sim.scene import Scene
from .scene_errors import texts_of

CONSEQUENCE = "nothing was simulated"
EXAMPLE = '[(30.0, "drive.mode", "brake")]'
SECOND = 1_000_000_000
NEVER = 2**62  # ticks


class ChangeError(CableSimError, ValueError):
    """A change that cannot be made; the text names where it stands, key, value, unit, bound and remedy."""


class Change(NamedTuple):
    """From ``time`` [s] of the run on a live key has ``value``; where: the change in words, for errors."""

    time: float
    key: str
    value: Any
    where: str

    def __str__(self) -> str:
        return f"{self.time:g} {self.key} {self.value}"


def changes_of(given: Iterable[Sequence[Any]], where: str = "changes") -> tuple[Change, ...]:
    """Changes from rows (seconds, key, value), or from changes, in order of time; where: what the rows stand in.

    Raises ChangeError.
    """
    found: list[Change] = []
    for k, row in enumerate(given, 1):
        what = f"{where}, item {k}"
        if not isinstance(row, Change) and (not isinstance(row, (tuple, list)) or len(row) != 3):
            raise ChangeError(f"{what}: {row!r:.60} is no (seconds, key, value); {CONSEQUENCE}. Write {EXAMPLE}")
        time, key, value = row[:3]
        what = row.where if isinstance(row, Change) else f"{what} '{time!s:.20} {key!s:.60} {value!s:.40}'"
        number = isinstance(time, (int, float)) and not isinstance(time, bool) and isfinite(time)
        if not number or not 0.0 <= time < LONGEST_RUN:
            raise ChangeError(
                f"{what}: time = {time!r:.40} is no number in [0, {LONGEST_RUN:g}) s; {CONSEQUENCE}. Give seconds from "
                f"the start of the run"
            )
        if found and time < found[-1].time:
            raise ChangeError(
                f"{what}: time = {time:g} s is before that of the item before, {found[-1].time:g} s; {CONSEQUENCE}. "
                f"Put the items in order of time"
            )
        found.append(Change(float(time), str(key), value, what))
    return tuple(found)


def fit(scene: Scene, changes: Iterable[Change]) -> tuple[Change, ...]:
    """Changes as they act on a scene one after the other, in order of time, their values as a recording keeps them.

    Those of the same time are judged together. Raises ChangeError for a key that is not live, for a value out of its
    range, and for one that does not serve with the others.
    """
    found: list[Change] = []
    for _, group in groupby(sorted(changes, key=lambda one: one.time), lambda one: one.time):
        together = list(group)
        for one in together:
            _look(scene, one)
            scene = changed(scene, one.key, one.value)
            found.append(one._replace(value=_plain(value_of(scene, one.key))))
        if text := unfit(scene):
            raise ChangeError(f"{together[-1].where}: {text.replace('nothing was changed', CONSEQUENCE)}")
    return tuple(found)


def _look(scene: Scene, one: Change) -> None:
    """Is it a live key of the scene, within its bounds? Raises ChangeError."""
    live = ways(scene)
    if one.key not in live:
        near = difflib.get_close_matches(one.key, live, 1)
        if any(item.key == one.key for item in declared(Scene)):
            why = f"{one.key} is fixed while the tow runs"
            hint = f"Set it before the run; live are {', '.join(sorted(live))}"
        else:
            why = f"there is no live key {one.key:.60}"
            hint = f"Did you mean {near[0]}?" if near else f"Live are {', '.join(sorted(live))}"
        raise ChangeError(f"{one.where}: {why}; {CONSEQUENCE}. {hint}")
    data: Any = scene.model_dump(mode="json")
    *way, last = one.key.split(".")
    block = data
    for part in way:
        block = block[part]
    block[last] = one.value
    try:
        type(scene).model_validate(data)
    except ValidationError as error:
        text = texts_of(error, data, one.where, {}, type(scene))[0]
        raise ChangeError(text.replace("nothing was started", CONSEQUENCE)) from None


def refuse_beyond(changes: Iterable[Change], seconds: float) -> None:
    """Raise ChangeError for a change at or after the end of a run of so many seconds."""
    for one in changes:
        if one.time >= seconds:
            raise ChangeError(
                f"{one.where}: time = {one.time:g} s is not before the end of the run after {seconds:g} s; "
                f"{CONSEQUENCE}. Give an earlier time, or a longer run (duration, and motion for it)"
            )


def refuse_unacting(
    scene: Scene, rows: Iterable[tuple[int, Change]], total: int | None = None, before: int = 0
) -> None:
    """Raise ChangeError for a value that ends before it can act: before the next tick, or reading of a device with a
    rate.

    rows: tick that each meets, and the change, in order of time; total: ticks of the run, None: no end; before: ticks
    of the simulation before its first.
    """
    last: dict[str, tuple[int, Change]] = {}
    for at, one in rows:
        begun, held = last.get(one.key, (at, one))
        if held.time < one.time:
            _refuse_short(scene, begun, held, at, f"{one.time:g} s", before)
        last[one.key] = at, one
    for at, one in last.values() if total is not None else ():
        _refuse_short(scene, at, one, total or at, "the end of the run", before)


def _refuse_short(scene: Scene, begun: int, one: Change, end: int, until: str, before: int) -> None:
    ticks, what, device = 1, "the next tick output", DEVICE_OF.get(one.key.split(".")[1], "")
    if one.key.startswith("faults.") and device in DEVICES and (rate := getattr(scene.instruments, device).rate):
        ticks, what = round(1.0 / (rate * scene.solver.tick)), f"the next reading of {device} ({rate:g} Hz)"
    acts = ((max(begun, 0) + before) // ticks + 1) * ticks - before
    if end >= acts or one.value == FaultKind.NONE.value:
        return
    raise ChangeError(
        f"{one.where}: {one.key} = {one.value} at {one.time:g} s ends at {until}, before {what}, that at "
        f"{acts * scene.solver.tick:.10g} s: it would never act; {CONSEQUENCE}. Let it last until then or longer"
    )


class Timetable:
    """Changes by the tick that each meets, counted from the first of a pass."""

    def __init__(self, rows: Iterable[tuple[int, Change]] = (), scene: Scene | None = None) -> None:
        """rows: tick and change; a tick before the first: with the first. scene: before all of them, for `go_to`."""
        self._rows = sorted(((max(0, at), one) for at, one in rows), key=lambda row: row[0])
        self._next = 0
        self._first = {} if scene is None else {one.key: _plain(value_of(scene, one.key)) for _, one in self._rows}

    def left(self, done: int) -> int:
        """Ticks to simulate, of a pass that has done so many, before the next change."""
        return self._rows[self._next][0] - done if self._next < len(self._rows) else NEVER

    def due(self, done: int) -> list[Change]:
        """Changes that meet the next tick of a pass that has done so many; each is given once."""
        begin = self._next
        while self._next < len(self._rows) and self._rows[self._next][0] <= done:
            self._next += 1
        return [one for _, one in self._rows[begin : self._next]]

    def go_to(self, done: int) -> dict[str, Any]:
        """Go on, or back, to where a pass has done so many ticks; returns the values that its keys have there."""
        self._next = 0
        return self._first | {one.key: one.value for one in self.due(done - 1)}


def _plain(value: Any) -> Any:
    """As a recording keeps it."""
    return getattr(value, "value", value)


def tick_of(change: Change, tick: int, begun: int = 0) -> int:
    """Tick [of ``tick`` ns] that holds the time of a change, counted from ``begun`` ns after the zero of its time."""
    return (round(change.time * SECOND) - begun) // tick
