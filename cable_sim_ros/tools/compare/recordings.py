"""What is compared, read: a recording of a run, an imported bag, or a foreign log with a mapping."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...io.bags.bag import BagError, BagReader
from ...io.scenes.document import find_bag
from ...io.sources.recorded_tow import LOST as MARK
from ...io.sources.recorded_tow import RecordedTow, provenance, read_tow, recorded_frames
from ...runs.sources import notes_of, sea_motion_kept
from ..logs.own_signals import Signal, signals_of_frames
from ..logs.read_signals import read

LOST = 0.01  # share of the records: a log that lost more counts as damaged


@dataclass
class Recording:
    """Signals of a recording; frames: its tick outputs where it is a run; damage: what of it could not be read.

    notes: how a log was read or imported, what its mapping names and it does not have; records, lost: of the log, None
    of a run under no imported motion.
    """

    name: str
    signals: list[Signal]
    frames: np.recarray | None = None
    damage: str = ""
    about: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    records: int | None = None
    lost: int | None = None

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {"records": self.records, "lost": self.lost, "damage": self.damage, "notes": self.notes}


def read_recording(path: str | os.PathLike, mapping: str | os.PathLike | None = None) -> Recording:
    """Read it. A folder that `run --out` made stands for the bag in it. Raises LogError, BagError."""
    place = find_bag(path) if Path(path).exists() else Path(path)
    name = os.fspath(path)
    if mapping is None and (place.is_dir() or place.suffix.lower() == ".mcap" or not place.exists()):
        bag = place if place.exists() else Path(find_bag(path))
        try:
            tow = read_tow(bag)
        except BagError:
            if not place.exists():
                raise
            about, damage = _measured_alone(bag)
        else:
            frames = recorded_frames(tow)
            if frames is not None and len(frames):
                return _run(name, bag, tow, frames)
            about, damage = tow.about, tow.damage
        if imported := provenance(about):
            return _imported(name, bag, imported, damage)
        place = bag
    reading = read(place, mapping)
    notes = [*reading.said, *(f"missing: {text}" for text in reading.missing)]
    lost = sum(one.total for one in reading.losses)
    damage, told = _losses(name, lost, reading.records, [str(one) for one in reading.losses])
    return Recording(name, reading.signals, damage=damage, notes=[*notes, *told], records=reading.records, lost=lost)


def _run(name: str, bag: Path, tow: RecordedTow, frames: np.recarray) -> Recording:
    """A run, with what was chosen for the motion of its ship."""
    imported = provenance(tow.about)
    notes = list(notes_of({"rao": sea_motion_kept(tow), "imported": imported}))
    found = Recording(name, signals_of_frames(frames, str(bag)), frames, tow.damage, tow.about, notes)
    found.records, found.lost = _count(imported, "records"), _count(imported, "lost")
    return found


def _measured_alone(path: Path) -> tuple[Mapping[str, str], str]:
    """Custom data and damage of a bag without motion; nothing of what is no bag."""
    try:
        with BagReader(path) as bag:
            for _ in bag:
                pass
            return dict(bag.custom_data), str(bag.damage) if bag.damage else ""
    except BagError:
        return {}, ""


def _imported(name: str, bag: Path, imported: Mapping[str, Any], damage: str) -> Recording:
    """An imported bag: what it assumed of its signals stands in the notes, once."""
    reading = read(bag)
    for one in reading.signals:
        one.assumed.clear()
    records, lost = _count(imported, "records"), _count(imported, "lost") or 0
    many, _ = _losses(name, lost, records or 0, [note for note in imported["notes"] if note.startswith(MARK)])
    damage = "; ".join(text for text in (damage, many) if text)
    return Recording(name, reading.signals, damage=damage, notes=list(imported["notes"]), records=records, lost=lost)


def _losses(name: str, lost: int, records: int, texts: list[str]) -> tuple[str, list[str]]:
    """What is said of records that were lost: as damage where they are many, else as notes."""
    told = f"{lost} records could not be read beside {records}: {'; '.join(texts)}"
    return (f"{name}: {told}", []) if lost > LOST * records else ("", [told] if lost else [])


def _count(about: Mapping[str, Any], key: str) -> int | None:
    value = about.get(key)
    return value if isinstance(value, int) else None
