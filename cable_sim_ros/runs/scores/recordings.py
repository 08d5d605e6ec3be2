"""What is compared, read: a recording of a run, an imported bag, or a foreign log with a mapping."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...io.bags.bag import BagError
from ...io.logs.own_signals import signals_of_frames
from ...io.logs.read_signals import read
from ...io.logs.signals import Signal
from ...io.scenes.resources import find_bag
from ...io.sources.recorded_tow import read_tow, recorded_frames

LOST = 0.01  # share of the records: a log that lost more counts as damaged


@dataclass
class Recording:
    """Signals of a recording; frames: its tick outputs where it is a run; damage: what of it could not be read.

    notes: how a log was read, what its mapping names and it does not have.
    """

    name: str
    signals: list[Signal]
    frames: np.recarray | None = None
    damage: str = ""
    about: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def read_recording(path: str | os.PathLike, mapping: str | os.PathLike | None = None) -> Recording:
    """Read it. A folder that `run --out` made stands for the bag in it. Raises LogError, BagError."""
    place = find_bag(path) if Path(path).exists() else Path(path)
    if mapping is None and (place.is_dir() or place.suffix.lower() == ".mcap" or not place.exists()):
        bag = place if place.exists() else Path(find_bag(path))
        try:
            tow = read_tow(bag)
        except BagError:
            if not place.exists():
                raise
        else:
            frames = recorded_frames(tow)
            if frames is not None and len(frames):
                return Recording(os.fspath(path), signals_of_frames(frames, str(bag)), frames, tow.damage, tow.about)
            place = bag
    reading = read(place, mapping)
    notes = [*reading.said, *(f"missing: {text}" for text in reading.missing)]
    lost = sum(one.total for one in reading.losses)
    told = f"{lost} records could not be read beside {reading.records}: {'; '.join(map(str, reading.losses))}"
    damage = f"{os.fspath(path)}: {told}" if lost > LOST * reading.records else ""
    if lost and not damage:
        notes.append(told)
    return Recording(os.fspath(path), reading.signals, damage=damage, notes=notes)
