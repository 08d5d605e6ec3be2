"""Journal of a recording: what the simulation was given and which tick took it, so that a replay needs no guess.

Topic ``sim/journal`` of the bag (recorded only, not published), std_msgs/String, one JSON object a message:

* ``n``: number of the entry, from 0 on without a gap; ``tick``: ticks the program had done; the next one is the first
  that has what the entry says.
* ``start``: the simulation begins here, why (``cause``: start, reset, jump, behind, recording, restore), ``time``
  [ns], ``position`` [m], ``heading`` [rad], ``parameters`` that are not as in the scene, and ``state``: a snapshot, as
  a compressed .npz in base64. Of a start from the static equilibrium it has the rings of inputs only.
* ``motion``: samples as the ticks see them from here on, each a stamp [ns] and the 14 numbers of `physics.inputs`.
* ``commands``: to the winch, each the time [ns] from which it counts, pay-out [m] and rate [m/s], null = none.
* ``set``: parameters that were changed; ``lost``: samples and commands that are not known any more; ``end``: why the
  recording or the simulation ended.
"""

from __future__ import annotations

import base64
import io
import json
import zipfile
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..physics.inputs import COMMAND_ROWS, MOTION_ROWS, Inputs, push_command, push_motion
from ..sim.savefile import LAYOUT
from .typestore import STORE

TOPIC, MSGTYPE = "sim/journal", "std_msgs/msg/String"
SPARE = 8  # rows of a ring that may be overwritten while it is read
STATIC = ("start", "reset")  # causes of a start from the static equilibrium


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
        self._notes: deque[tuple[int, Callable[[], dict[str, Any]], tuple[int, int] | None]] = deque()
        self._count = 0
        self._motion = self._commands = 0  # heads that stand in the journal
        self._begun = False
        self.first: int | None = None  # the first tick that it covers

    def start(self, done: int, start: Start, parameters: Mapping[str, Any], snapshot: Mapping[str, np.ndarray]) -> None:
        """The simulation begins at ``start``; done: ticks the program has done; snapshot: of the simulator.

        parameters: live ones that were changed.
        """
        heads = int(snapshot["inputs_motion_head"][0]), int(snapshot["inputs_command_head"][0])

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

    def tick(self, index: int, motion_head: int, command_head: int) -> None:
        """Tick ``index``, counted from 0, saw so many motion samples and commands since the rings were empty."""
        self._settle(index)
        if not self._begun:
            return
        entry: dict[str, Any] = {}
        lost = 0
        if motion_head > self._motion:
            first = max(self._motion, int(self.inputs.motion_head[0]) - MOTION_ROWS + SPARE)
            lost += first - self._motion
            entry["motion"] = [self._sample(k) for k in range(first, motion_head)]
        if command_head > self._commands:
            first = max(self._commands, int(self.inputs.command_head[0]) - COMMAND_ROWS + SPARE)
            lost += first - self._commands
            entry["commands"] = [self._command(k) for k in range(first, command_head)]
        if entry:
            self._motion, self._commands = motion_head, command_head
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
                self._motion, self._commands = heads
                self._begun = True
            self._write(done, entry())

    def _write(self, done: int, entry: Mapping[str, Any]) -> None:
        self.put(encoded({"n": self._count, "tick": done, **entry}))
        self._count += 1

    def _sample(self, index: int) -> list[float]:
        row = index % MOTION_ROWS
        return [int(self.inputs.motion_time[row]), *self.inputs.motion[row].tolist()]

    def _command(self, index: int) -> list[float | None]:
        row = index % COMMAND_ROWS
        return [
            int(self.inputs.command_time[row]),
            *(None if value != value else value for value in self.inputs.command[row].tolist()),
        ]


def encoded(entry: Mapping[str, Any]) -> bytes:
    """CDR bytes of an entry."""
    return bytes(STORE.serialize_cdr(STORE.types[MSGTYPE](json.dumps(entry, separators=(",", ":"))), MSGTYPE))


def packed(arrays: Mapping[str, np.ndarray]) -> str:
    """Arrays as base64 of a compressed .npz."""
    memory = io.BytesIO()
    np.savez_compressed(memory, **arrays)  # type: ignore[arg-type]
    return base64.b64encode(memory.getvalue()).decode()


def unpacked(text: str) -> dict[str, np.ndarray]:
    """Back from `packed`. ValueError where it is damaged."""
    try:
        with np.load(io.BytesIO(base64.b64decode(text)), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, OSError, KeyError, EOFError) as error:
        raise ValueError(f"the state in the journal cannot be read ({type(error).__name__}: {error})") from None


@dataclass
class Segment:
    """Ticks from one start to the next, with all that they saw."""

    start: Start
    parameters: dict[str, Any]
    layout: str
    arrays: dict[str, np.ndarray]  # of the snapshot
    first: int  # number of the first tick
    ticks: int = 0
    halted: bool = False  # the tick after the last one could not be solved
    motion: list[list[float]] = field(default_factory=list)
    commands: list[list[float | None]] = field(default_factory=list)
    seen: list[tuple[int, int, int]] = field(default_factory=list)  # tick of the segment, motion, commands from it on
    sets: list[tuple[int, str, Any]] = field(default_factory=list)  # tick of the segment, parameter, value

    @property
    def ticks_before(self) -> int:
        """The Frame's `tick` at the start."""
        return int(self.arrays["memory"]["time"]["ticks"]) if "memory" in self.arrays else 0

    def heads(self) -> np.ndarray:
        """What each tick sees of the rings, int64 [ticks, 2], counted as their heads."""
        table = np.zeros((self.ticks, 2), np.int64)
        for tick, motion, commands in self.seen:
            table[tick:] = motion, commands
        return table + self.base

    @property
    def base(self) -> tuple[int, int]:
        """Heads of the rings at the start."""
        return int(self.arrays["inputs_motion_head"][0]), int(self.arrays["inputs_command_head"][0])

    def load(self, inputs: Inputs) -> None:
        """The rings of inputs as they were at the start."""
        for name, array in inputs._asdict().items():
            array[...] = self.arrays[f"inputs_{name}"]

    def push(self, inputs: Inputs, motion_head: int, command_head: int) -> None:
        """Push the samples and commands up to these heads of the rings."""
        motion, command = self.base
        for stamp, *row in self.motion[int(inputs.motion_head[0]) - motion : motion_head - motion]:
            push_motion(inputs, int(stamp), row)
        for at, payout, rate in self.commands[int(inputs.command_head[0]) - command : command_head - command]:
            push_command(inputs, int(at or 0), *(np.nan if v is None else v for v in (payout, rate)))


class Told(NamedTuple):
    """A journal read: its segments, and what is wrong with it, as texts."""

    segments: list[Segment]
    faults: list[str]


def read_journal(messages: list[bytes]) -> Told:
    """Segments of the journal's messages, in whatever order they come."""
    entries: list[dict[str, Any]] = []
    faults: list[str] = []
    for data in messages:
        try:
            message: Any = STORE.deserialize_cdr(data, MSGTYPE)
            entry = json.loads(message.data)
            entry["n"], entry["tick"] = int(entry["n"]), int(entry["tick"])
            entries.append(entry)
        except Exception as error:  # the reader of bytes fails in many ways
            faults.append(f"an entry cannot be read ({type(error).__name__})")
    entries.sort(key=lambda entry: entry["n"])
    numbers = {entry["n"] for entry in entries}
    missing = (max(numbers) + 1 - len(numbers)) if numbers else 0
    if missing:
        faults.append(f"{missing} of {max(numbers) + 1} entries are missing")
    segments: list[Segment] = []
    for entry in entries:
        try:
            _take(entry, segments, faults)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            faults.append(f"entry {entry['n']} cannot be used ({type(error).__name__}: {error})")
    return Told(segments, faults)


def _take(entry: dict[str, Any], segments: list[Segment], faults: list[str]) -> None:
    tick = entry["tick"]
    if "start" in entry:
        begun = entry["start"]
        if segments and not segments[-1].halted:
            segments[-1].ticks = tick - segments[-1].first
        x, y = begun["position"]
        heading = None if begun["heading"] is None else float(begun["heading"])
        start = Start(int(begun["time"]), (float(x), float(y)), heading, str(begun["cause"]))
        arrays = unpacked(begun["state"])
        segment = Segment(start, dict(begun["parameters"]), str(begun["layout"]), arrays, tick)
        segments.append(segment)
        segment.seen.append((0, len(segment.motion), len(segment.commands)))
        return
    if "lost" in entry:
        faults.append(f"{entry['lost']} samples or ticks before tick {tick} are not known")
    if not segments:
        return
    segment = segments[-1]
    segment.motion += entry.get("motion", ())
    segment.commands += entry.get("commands", ())
    segment.seen.append((tick - segment.first, len(segment.motion), len(segment.commands)))
    segment.sets += [(tick - segment.first, name, value) for name, value in entry.get("set", {}).items()]
    segment.ticks = max(segment.ticks, tick - segment.first + ("end" not in entry))
    if "end" in entry:
        segment.ticks = tick - segment.first
        segment.halted = entry["end"] == "halted"
