"""What a report is about: the run, its recording, and what was asked for."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...io.bags.bag import BagReader
from ...io.recordings.recorded_run import RecordedRun, load_run
from ...io.scenes.load import dump_scene
from ...plots.run import seconds
from ...runs.result import Run
from ...runs.summary import after_start, tick_length
from ...sim.scene import Scene

TAKEN_IN = ("imu/data", "odom", "winch/command", "joint_command/position", "joint_command/velocity")
LEFT_OUT = ("--out", "--report")  # where files go says nothing of the run


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
