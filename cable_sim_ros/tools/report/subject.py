"""What a report is about: the run, its recording, and what was asked for.

What a report is made of: sections of texts, tables and figures; and how its numbers are written.
"""

from __future__ import annotations

import math
import os
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...io.bags.bag import BagReader
from ...io.recordings.recorded_run import RecordedRun, load_run
from ...io.scenes.load import dump_scene
from ...plots.run import seconds
from ...runs.summary import Run, after_start, format_value, tick_length
from ...sim.scene import Scene

MOST = 1e9  # written without an exponent up to here
UNITS = {"1": "", "-": "", "deg": "°"}

TAKEN_IN = ("imu/data", "odom", "winch/command", "joint_command/position", "joint_command/velocity")
LEFT_OUT = ("--out", "--report")  # where files go says nothing of the run


@dataclass
class Table:
    """A table: caption, heads of its columns, rows of text; right: columns of numbers; names: of the rows, by which
    the figures of the JSON are found again; bad: numbers of the rows that are red, their state is a word in them."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: Sequence[int] = ()
    names: Sequence[str] = ()
    bad: Sequence[int] = ()
    kind: str = "table"


@dataclass
class Figure:
    """A drawing as SVG text, what it shows, and in words what a reader who does not see it would miss."""

    svg: str
    caption: str
    words: str
    kind: str = "figure"


@dataclass
class Picture:
    """A picture as PNG, with what it shows in words."""

    png: bytes
    caption: str
    kind: str = "picture"

    @property
    def uri(self) -> str:
        """The picture itself as an address: nothing is loaded."""
        return f"data:image/png;base64,{b64encode(self.png).decode('ascii')}"


@dataclass
class Text:
    """Sentences, a paragraph each; note: set apart."""

    lines: Sequence[str]
    note: bool = False
    kind: str = "text"


Part = Table | Figure | Picture | Text


@dataclass
class Section:
    """A part of the report with a title."""

    name: str
    title: str
    parts: list[Part] = field(default_factory=list)


class Card(NamedTuple):
    """A figure at the top of the report."""

    name: str
    label: str
    value: str
    unit: str


def unit(text: str) -> str:
    """A unit as it is printed: m^2 with a raised 2."""
    return UNITS.get(text, text.replace("^2", "²").replace("^3", "³"))


def number(value: Any, digits: int = 5) -> str:
    """A number in few digits, "-" where there is none; other things as text."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, str)):
        return str(value)
    if isinstance(value, float):
        text = f"{value + 0.0:.{digits}g}"
        return f"{float(text):.0f}" if 10.0**digits <= abs(value) < MOST else text
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {number(part, digits)}" for key, part in value.items()) or "none"
    if isinstance(value, Iterable):
        return ", ".join(number(part, digits) for part in value) or "none"
    return format_value(value)


def share(value: float) -> str:
    """A share in percent."""
    return f"{100.0 * value:.3g}\u00a0%"


def counted(count: int, one: str) -> str:
    """A number of things in words."""
    return f"{count} {one if count == 1 else one + 's'}"


@dataclass
class Subject:
    """A run with what is needed to report on it.

    recorded: its tick outputs, tables and what its recording says of itself; counts: messages of the ship and of the
    winch in the recording, by topic; plan: as of `runs.plan.plan_of`; scores: as dicts; command: as typed.
    """

    result: Run
    recorded: RecordedRun
    counts: Mapping[str, int] = field(default_factory=dict)
    plan: Mapping[str, Any] | None = None
    scores: Sequence[Mapping[str, Any]] = ()
    command: str = ""

    @property
    def metrics(self) -> dict[str, Any]:
        """Figures by JSON name."""
        return self.result.metrics

    @property
    def scene(self) -> Scene | None:
        """That was simulated, None where it is not known."""
        return self.result.scene

    @property
    def frames(self) -> np.recarray:
        """Tick outputs."""
        return self.recorded.frames

    @property
    def time(self) -> np.ndarray:
        """Of the tick outputs, from the first one [s]."""
        return seconds(self.recorded)

    @property
    def skip_s(self) -> float:
        """Start-up that statistics leave out [s]."""
        return float(self.metrics.get("skip_s") or 0.0)

    @property
    def kept(self) -> np.recarray:
        """Tick outputs after the start-up."""
        return after_start(self.frames, self.skip_s)[0]

    @property
    def tick(self) -> float:
        """Seconds between tick outputs."""
        return tick_length(self.frames)

    @property
    def live(self) -> bool:
        """In real time, by a node."""
        return "node" in self.metrics

    @property
    def hauled(self) -> bool:
        """The scope changed so much that nothing is about one place."""
        return bool(len(self.frames)) and self.metrics.get("tension_std_n") is None


def subject_of(
    result: Run,
    command: Sequence[str] = (),
    plan: Mapping[str, Any] | None = None,
    scores: Sequence[Mapping[str, Any]] = (),
) -> Subject:
    """The subject of a report on a run; its recording is read where it has one. Raises BagError."""
    counts: Counter[str] = Counter()
    if result.bag is not None and len(result.frames):
        recorded = load_run(result.bag)
        space = recorded.custom_data.get("namespace", "").rstrip("/")
        with BagReader(result.bag) as bag:
            for message in bag:
                topic = message.topic.removeprefix(f"{space}/")
                if topic in TAKEN_IN:
                    counts[topic] += 1
    else:
        about = {} if result.scene is None else {"scene": result.scene.name, "scene_yaml": dump_scene(result.scene)}
        recorded = RecordedRun(result.frames, [], [], about)
    return Subject(result, recorded, dict(counts), plan, tuple(scores), typed(command))


def typed(command: Sequence[str]) -> str:
    """A command line without what is of this machine: paths are their last name, files of the result are left out."""
    words, skip = [], False
    for word in command:
        option, equals, value = word.partition("=")
        if skip:
            skip = False
        elif option in LEFT_OUT:
            skip = not equals
        else:
            words.append(f"{option}={shortened(value)}" if option.startswith("--") and equals else shortened(word))
    return " ".join(f'"{word}"' if " " in word or not word else word for word in words)


def shortened(word: str) -> str:
    """A path by its last name, other text as it is."""
    is_path = os.path.isabs(word) or word.startswith(("~", "..")) or (os.sep in word and Path(word).exists())
    return Path(word).name if is_path and " " not in word else word


def without_paths(text: str, subject: Subject) -> str:
    """A text of the run without the folders of this machine."""
    bag = subject.result.bag
    for folder in {Path.cwd(), Path.home(), *([] if bag is None else [Path(bag).parent, Path(bag).absolute().parent])}:
        if len(folder.parts) > 1 or not folder.is_absolute():
            text = text.replace(f"{folder}{os.sep}", "") if folder.name else text
    return text
