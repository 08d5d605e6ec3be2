"""Journal of a recording: what the simulation was given and which tick took it, so that a replay needs no guess.

Topic ``sim/journal`` of the bag (recorded only, not published), std_msgs/String, one JSON object a message:

* ``n``: number of the entry, from 0 on without a gap; ``tick``: ticks the program had done; the next one is the first
  that has what the entry says.
* ``start``: the simulation begins here, why (``cause``: start, reset, jump, behind, recording, restore), ``time``
  [ns], ``position`` [m], ``heading`` [rad], ``parameters`` that are not as in the scene, and ``state``: a snapshot, as
  a compressed .npz in base64. Of a start from the static equilibrium it has the rings of inputs only.
* ``motion``: samples as the ticks see them from here on, each a stamp [ns] and the 14 numbers of `physics.inputs`.
* ``vehicle``: the same of the vehicle at the far end of the cable.
* ``commands``: to the winch, each the time [ns] from which it counts, pay-out [m] and rate [m/s], null = none.
* ``flaps``: each the time [ns] and a list of the angles [rad] of the wings in their order, null = not commanded.
* ``set``: parameters that were changed; ``lost``: samples and commands that are not known any more; ``end``: why the
  recording or the simulation ended.

As they are read the bag may be anybody's, so each entry is checked before anything is made of it. What one may be is
declared here once, beside its writer `Journal`. Bounds are those of what a session
can have pushed (sim/inputs.py), and of the work that a replay may be made to do.
"""

from __future__ import annotations

import base64
import json
import re
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...physics.inputs import (
    COMMAND_ROWS,
    FLAP_ROWS,
    MAX_WINGS,
    MOTION_ROWS,
    Inputs,
    make_inputs,
    of_vehicle,
    push_command,
    push_flaps,
    push_motion,
)
from ...sim.saved.npz_bytes import Unfit, npz, parts
from ...sim.saved.savefile import ARRAYS, LAYOUT, exact
from ...sim.saved.state_values import MAX_COUNT, MAX_TIME, rings_problem
from ..bags.typestore import STORE

MSGTYPE = "std_msgs/msg/String"
MAX_ENTRY = 64_000_000  # bytes of one entry
MAX_STATE, MAX_STATES = 64_000_000, 1_000_000_000  # bytes of a state, and of all of them, unpacked
MAX_NUMBER = 1e9  # of any number of a sample, m and m/s and rad of a start and a command
# rings that an older recording has not
LATER = {f"inputs_{name}{part}" for name in ("vehicle", "flap") for part in ("", "_time", "_head", "_seen")}
NUMBER = re.compile(r'"n" *: *(\d{1,16})')  # of an entry that cannot be read as a whole
CAUSES = Literal["start", "reset", "jump", "behind", "recording", "restore"]

Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER, allow_inf_nan=False)]
Time = Annotated[int, Field(ge=-MAX_TIME, le=MAX_TIME)]
Count = Annotated[int, Field(ge=0, le=MAX_COUNT)]
Commanded = Number | None
Name = Annotated[str, Field(max_length=100)]
Value = bool | Annotated[float, Field(allow_inf_nan=False)] | Name | None
N = Number
Sample = tuple[Time, N, N, N, N, N, N, N, N, N, N, N, N, N, N]  # stamp, and the columns of `physics.inputs`
Command = tuple[Time, Commanded, Commanded]
Flaps = tuple[Time, Annotated[list[Commanded], Field(min_length=MAX_WINGS, max_length=MAX_WINGS)]]

TOPIC = "sim/journal"
MAX_FAULTS = 20  # told as texts; the others are counted
MAX_STARTS = 1000  # a static start takes some tenths of a second
SPARE = 8  # rows of a ring that may be overwritten while it is read
STATIC = ("start", "reset")  # causes of a start from the static equilibrium
Heads = tuple[int, ...]  # Inputs.heads
# list of an entry -> ring of inputs, in the order of their heads
RINGS = {"motion": "motion", "commands": "command", "vehicle": "vehicle", "flaps": "flap"}


class _Strict(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)  # keys of later versions are left aside


class Begin(_Strict):
    """The simulation begins here."""

    cause: CAUSES
    time: Time
    position: tuple[Number, Number]
    heading: Number | None
    parameters: Annotated[dict[Name, Value], Field(max_length=1000)]
    layout: Name
    state: str


class Entry(_Strict):
    """One message of the journal; absent: None."""

    n: Count
    tick: Count
    start: Begin | None = None
    motion: Annotated[list[Sample], Field(max_length=MOTION_ROWS)] = []
    vehicle: Annotated[list[Sample], Field(max_length=MOTION_ROWS)] = []
    commands: Annotated[list[Command], Field(max_length=COMMAND_ROWS)] = []
    flaps: Annotated[list[Flaps], Field(max_length=FLAP_ROWS)] = []
    set: Annotated[dict[Name, Value], Field(max_length=1000)] = {}
    lost: Count = 0
    end: Name | None = None


class BadEntry(ValueError):
    """An entry that is left out; the text says which and why."""


def entry_of(data: bytes) -> Entry:
    """The entry of a message. Raises BadEntry."""
    if len(data) > MAX_ENTRY:
        raise BadEntry(f"an entry has {len(data)} bytes, at most {MAX_ENTRY} are read")
    try:
        message: Any = STORE.deserialize_cdr(data, MSGTYPE)
        text = str(message.data)
    except Exception as error:  # the reader of bytes fails in many ways
        raise BadEntry(f"an entry cannot be read ({type(error).__name__})") from None
    try:
        return Entry.model_validate_json(text)
    except ValidationError as error:
        number = NUMBER.search(text[:100])
        name = f"entry {number[1]}" if number else "an entry"
        raise BadEntry(f"{name} cannot be used ({_why(error)})") from None


def _why(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_context=False)[0]
    return f"{'.'.join(map(str, first['loc'][:4]))}: {first['msg']:.100}, got {first.get('input')!r:.40}"


class State(NamedTuple):
    """The state in a `start` entry: its arrays as bytes for `savefile.fitting`, and its rings of inputs."""

    arrays: dict[str, bytes]
    rings: dict[str, np.ndarray]


def state_of(text: str) -> State:
    """Back from the text of a `start` entry; the rings have been looked at. Raises ValueError."""
    try:
        if len(text) > MAX_STATE:
            raise Unfit(f"it has {len(text)} bytes, at most {MAX_STATE} are read")
        arrays = parts(base64.b64decode(text, validate=True), ARRAYS, MAX_STATE, packed=True)
        known = {f"inputs_{name}": like for name, like in make_inputs()._asdict().items()}
        older = {name: known.pop(name) for name in list(known) if name in LATER and name not in arrays}
        rings = exact(arrays, known) | older
        if problem := rings_problem(rings):
            raise Unfit(problem)
        return State(arrays, rings)
    except ValueError as error:  # Unfit, and of base64
        raise ValueError(f"the state in the journal cannot be read ({error})") from None


class Start(NamedTuple):
    """Where and when a simulation begins: ns, m in odom, rad (None: the scene's heading); cause as in the journal."""

    time: int
    position: tuple[float, float]
    heading: float | None
    cause: str = "start"


class Journal:
    """Writes the entries of one recording, in the order of the ticks.

    put(bytes): records one message. Of two threads one may say `start` and `set` between two ticks, while the other
    goes through the `tick`s that are done: what was said waits for its tick.
    """

    def __init__(self, put: Callable[[bytes], None], inputs: Inputs) -> None:
        self.put, self.inputs = put, inputs
        self._rings = [(name, getattr(inputs, f"{ring}_time"), getattr(inputs, ring)) for name, ring in RINGS.items()]
        self._notes: deque[tuple[int, Callable[[], dict[str, Any]], Heads | None]] = deque()
        self._count = 0
        self._heads: Heads = (0, 0, 0, 0)  # that stand in the journal
        self._begun = False
        self.first: int | None = None  # the first tick that it covers

    def start(self, done: int, start: Start, parameters: Mapping[str, Any], snapshot: Mapping[str, np.ndarray]) -> None:
        """The simulation begins at ``start``; done: ticks the program has done; snapshot: of the simulator.

        parameters: live ones that were changed.
        """
        heads = heads_of(snapshot)

        def entry() -> dict[str, Any]:  # packed by the thread that writes it, not between two ticks
            kept = {k: v for k, v in snapshot.items() if k.startswith("inputs_") or start.cause not in STATIC}
            return {
                "start": {
                    "cause": start.cause,
                    "time": start.time,
                    "position": list(start.position),
                    "heading": start.heading,
                    "parameters": given,
                    "layout": LAYOUT,
                    "state": packed(kept),
                }
            }

        given = dict(parameters)
        self._notes.append((done, entry, heads))
        self.first = done if self.first is None else self.first

    def set(self, done: int, name: str, value: Any) -> None:
        """A parameter has another value from the next tick on."""
        self._notes.append((done, lambda: {"set": {name: value}}, None))

    def covers(self, index: int) -> bool:
        """Is this tick part of what is recorded?"""
        return self.first is not None and index >= self.first

    def tick(self, index: int, *heads: int) -> None:
        """Tick ``index``, counted from 0, saw so much of each ring since it was empty: `Inputs.heads`."""
        self._settle(index)
        if not self._begun:
            return
        entry: dict[str, Any] = {}
        lost, rows = 0, zip(self._rings, self._heads, heads, self.inputs.heads, strict=True)
        for (name, times, values), before, head, written in rows:
            if head > before:
                first = max(before, written - len(times) + SPARE)
                lost += first - before
                entry[name] = [_row(times, values, k % len(times)) for k in range(first, head)]
        if "flaps" in entry:
            entry["flaps"] = [(time, angles) for time, *angles in entry["flaps"]]
        if entry:
            self._heads = heads
            self._write(index, entry | ({"lost": lost} if lost else {}))

    def lose(self, index: int, count: int) -> None:
        """What ``count`` ticks from ``index`` on saw is not known."""
        self._settle(index)
        self._write(index, {"lost": count})

    def end(self, done: int, why: str) -> None:
        """The recording, or the simulation, ended after ``done`` ticks."""
        self._settle(done)
        self._write(done, {"end": why})

    def _settle(self, index: int) -> None:
        while self._notes and self._notes[0][0] <= index:
            done, entry, heads = self._notes.popleft()
            if heads is not None:
                self._heads = heads
                self._begun = True
            self._write(done, entry())

    def _write(self, done: int, entry: Mapping[str, Any]) -> None:
        self.put(encoded({"n": self._count, "tick": done, **entry}))
        self._count += 1


def _row(times: np.ndarray, values: np.ndarray, row: int) -> list[float | None]:
    """Stamp and numbers of a ring's row, null for NaN."""
    return [int(times[row]), *(None if value != value else value for value in values[row].tolist())]


def heads_of(arrays: Mapping[str, np.ndarray]) -> Heads:
    """Heads of the rings in a snapshot."""
    return tuple(int(arrays[f"inputs_{ring}_head"][0]) for ring in RINGS.values())


def encoded(entry: Mapping[str, Any]) -> bytes:
    """CDR bytes of an entry."""
    return bytes(STORE.serialize_cdr(STORE.types[MSGTYPE](json.dumps(entry, separators=(",", ":"))), MSGTYPE))


def packed(arrays: Mapping[str, np.ndarray]) -> str:
    """Arrays as base64 of a compressed .npz; back: `state_of`."""
    return base64.b64encode(npz(arrays, compressed=True)).decode()


@dataclass
class Segment:
    """Ticks from one start to the next, with all that they saw."""

    start: Start
    parameters: dict[str, Any]
    layout: str
    arrays: dict[str, bytes]  # of the snapshot, for `savefile.fitting`
    rings: dict[str, np.ndarray]  # of inputs, as they were
    first: int  # number of the first tick, in the count of the program
    message: int = 0  # place of its start among the messages of the journal, as the bag has them
    ticks: int = 0
    halted: bool = False  # the tick after the last one could not be solved
    ended: bool = False  # the journal says where it ends
    motion: list[Sample] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    vehicle: list[Sample] = field(default_factory=list)
    flaps: list[Flaps] = field(default_factory=list)
    seen: list[tuple[int, ...]] = field(default_factory=list)  # tick of the segment, heads of the rings from it on
    sets: list[tuple[int, str, Any]] = field(default_factory=list)  # tick of the segment, parameter, value

    def heads(self) -> np.ndarray:
        """What each tick sees of the rings, int64 [ticks, 4], counted as their heads."""
        seen = np.array(self.seen, np.int64)  # its ticks go up
        return seen[np.searchsorted(seen[:, 0], np.arange(self.ticks), "right") - 1, 1:] + self.base

    @property
    def base(self) -> Heads:
        """Heads of the rings at the start."""
        return heads_of(self.rings)

    def newest(self, ring: str) -> int | None:
        """Stamp of the newest sample so far of the motion or the vehicle, ns."""
        if samples := getattr(self, ring):
            return int(samples[-1][0])
        head = int(self.rings[f"inputs_{ring}_head"][0])
        return int(self.rings[f"inputs_{ring}_time"][(head - 1) % MOTION_ROWS]) if head else None

    def number(self, stamp: np.ndarray, period: int) -> np.ndarray:
        """Ticks of the program's count by their stamps in this segment [ns], -1: none; period: of a tick [ns]."""
        since = np.asarray(stamp, np.int64) - self.start.time
        k = since // period
        return np.where((since > 0) & (since % period == 0), self.first + k - 1, -1)

    def load(self, inputs: Inputs) -> None:
        """The rings of inputs as they were at the start."""
        for name, array in inputs._asdict().items():
            array[...] = self.rings[f"inputs_{name}"]

    def push(self, inputs: Inputs, *heads: int) -> None:
        """Push what is up to these heads of the rings."""
        motion, command, vehicle, flap = (
            slice(now - base, head - base) for now, base, head in zip(inputs.heads, self.base, heads, strict=True)
        )
        for stamp, *row in self.motion[motion]:
            push_motion(inputs, int(stamp), row)
        for stamp, *row in self.vehicle[vehicle]:
            push_motion(of_vehicle(inputs), int(stamp), row)
        for when, payout, rate in self.commands[command]:
            push_command(inputs, int(when), *(np.nan if v is None else v for v in (payout, rate)))
        for when, angles in self.flaps[flap]:
            push_flaps(inputs, int(when), [np.nan if v is None else v for v in angles])


class Report(NamedTuple):
    """A journal read: its segments, and what is wrong with it, as texts."""

    segments: list[Segment]
    faults: list[str]


def read_journal(messages: list[bytes]) -> Report:
    """Segments of the journal's messages, in whatever order they come. An entry that is none is left out, and said."""
    found: dict[int, tuple[Entry, int]] = {}
    faults = _Faults()
    for place, data in enumerate(messages):
        try:
            entry = entry_of(data)
        except BadEntry as error:
            faults.add(str(error))
            continue
        if entry.n in found:
            faults.add(f"entry {entry.n} is there twice, the second is left out")
        else:
            found[entry.n] = entry, place
    missing = (max(found) + 1 - len(found)) if found else 0
    if missing:
        faults.add(f"{missing} of {max(found) + 1} entries are missing")
    segments: list[Segment] = []
    unpacked = reached = 0
    for number in sorted(found):
        entry, place = found[number]
        try:
            if entry.tick < reached:
                raise ValueError(f"it is of tick {entry.tick}, behind one of tick {reached}")
            if entry.start is not None:
                if len(segments) >= MAX_STARTS:
                    raise ValueError(f"it is more than the {MAX_STARTS}th start")
                segments.append(_begin(entry.start, entry.tick, place, unpacked))
                unpacked += sum(map(len, segments[-1].arrays.values()))
                _end(segments[:-1], entry.tick)
            elif segments:
                _take(entry, segments[-1])
            reached = entry.tick
        except ValueError as error:
            faults.add(f"entry {number} cannot be used ({error})")
        if entry.lost:
            faults.add(f"{entry.lost} samples or ticks before tick {entry.tick} are not known")
    return Report(segments, faults.texts())


class _Faults:
    """Texts, the first of them."""

    def __init__(self) -> None:
        self.kept: list[str] = []
        self.more = 0

    def add(self, text: str) -> None:
        if len(self.kept) < MAX_FAULTS:
            self.kept.append(text)
        else:
            self.more += 1

    def texts(self) -> list[str]:
        return [*self.kept, f"and {self.more} more"] if self.more else self.kept


def _begin(begun: Begin, tick: int, place: int, unpacked: int) -> Segment:
    """The segment that a `start` entry begins; unpacked: bytes of the states before it. Raises ValueError."""
    state = state_of(begun.state)
    if unpacked + sum(map(len, state.arrays.values())) > MAX_STATES:
        raise ValueError(f"the states of the journal have more than {MAX_STATES} bytes")
    start = Start(begun.time, begun.position, begun.heading, begun.cause)
    segment = Segment(start, dict(begun.parameters), begun.layout, state.arrays, state.rings, tick, place)
    segment.seen.append((0, 0, 0, 0, 0))
    return segment


def _end(before: list[Segment], tick: int) -> None:
    """The segment before a start ends there."""
    if before and not before[-1].halted:
        before[-1].ticks, before[-1].ended = tick - before[-1].first, True


def _take(entry: Entry, segment: Segment) -> None:
    """Take in an entry that is no start. Raises ValueError, and has taken nothing then."""
    for ring in ("motion", "vehicle"):
        newest = segment.newest(ring)
        for sample in getattr(entry, ring):
            if newest is not None and sample[0] <= newest:
                raise ValueError(f"the stamp of a sample, {sample[0]} ns, does not advance past {newest} ns")
            newest = sample[0]
    at = entry.tick - segment.first
    for name in RINGS:
        getattr(segment, name).extend(getattr(entry, name))
    segment.seen.append((at, *(len(getattr(segment, name)) for name in RINGS)))
    segment.sets += [(at, name, value) for name, value in entry.set.items()]
    segment.ticks = max(segment.ticks, at + (entry.end is None))
    if entry.end is not None:
        segment.ticks, segment.ended, segment.halted = at, True, entry.end == "halted"
