"""What an export holds, in no format yet: tick outputs, tables, and where they come from.

Fields, units and meanings are those of physics/tick_output.py; a column more says the seconds from the first tick.
"""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import CableSimError
from ...files import read_text
from ...io.recordings.recorded_run import RecordedRun, load_run
from ...io.scenes.document import find_bag
from ...io.scenes.load import scene_from_text
from ...physics.tick_output import CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, STRUM_COLUMNS
from ...runs.summary import tick_length
from ...runs.verdict import judge
from ...sim.scene import Scene
from ...version import __version__

TABLES = {"shape": SHAPE_COLUMNS, "contact": CONTACT_COLUMNS, "strum": STRUM_COLUMNS}
TABLE_MEANING = {
    "shape": "cable in odom, one row a node from the drum or the fixed end to the towbody",
    "contact": "contact points of the sheave in axes of sheave_link, inboard to outboard",
    "strum": "strumming of the element that begins at the node, in odom",
}
AXES = {(3,): ("x", "y", "z"), (4,): ("x", "y", "z", "w")}
ELAPSED = ("elapsed", (), "f8", "s", "seconds from the first tick output of this file")
SUMMARY = "summary.json"
NEAR = 1e-6  # of a period: stamps are whole nanoseconds


class ExportError(CableSimError, ValueError):
    """What was asked for cannot be exported or written; the text is one line."""


class Field(NamedTuple):
    """Values of one field of the tick output [ticks] or [ticks, 3 or 4], with unit and meaning."""

    name: str
    unit: str
    meaning: str
    values: np.ndarray

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the components; of a number none."""
        return AXES.get(self.values.shape[1:], ())

    def columns(self) -> Iterable[tuple[str, str, np.ndarray, str]]:
        """The field as columns of one number, itself, or name.x and so on: name, unit, values, meaning."""
        if not self.axes:
            yield self.name, self.unit, self.values, self.meaning
        for k, axis in enumerate(self.axes):
            yield f"{self.name}.{axis}", self.unit, self.values[:, k], self.meaning


class Table(NamedTuple):
    """Tables over time, ragged: rows of instant k are rows[begin[k]:begin[k + 1]]; columns: (name, unit)."""

    name: str
    columns: tuple[tuple[str, str], ...]
    times: np.ndarray  # int64 [instants], ns
    begin: np.ndarray  # int64 [instants + 1]
    rows: np.ndarray  # float64 [rows, columns]

    def padded(self) -> np.ndarray:
        """[instants, most rows of one, columns], nan where an instant has fewer rows."""
        counts = np.diff(self.begin)
        most = int(counts.max()) if len(counts) else 0
        out = np.full((len(self.times), most, len(self.columns)), np.nan)
        out[np.arange(most) < counts[:, None]] = self.rows
        return out

    def long(self) -> tuple[np.ndarray, np.ndarray]:
        """Of each row its time [ns] and its number within its instant."""
        counts = np.diff(self.begin)
        return np.repeat(self.times, counts), np.arange(len(self.rows)) - np.repeat(self.begin[:-1], counts)


class Content(NamedTuple):
    """What is exported: fields of equal length, tables, and provenance as texts by key."""

    fields: list[Field]
    tables: list[Table]
    provenance: dict[str, str]

    @property
    def ticks(self) -> int:
        """Tick outputs in it."""
        return len(self.fields[0].values)


def gather(
    run: str | os.PathLike, fields: Sequence[str] = (), every: float | None = None, tables: Sequence[str] = ()
) -> Content:
    """Content of a recording, or of the folder of a run that has one; fields: names, none: all; every: s.

    Raises ExportError, BagError, ResourceError.
    """
    chosen = _chosen(fields)
    path = find_bag(run)
    recorded = load_run(path, bool(tables))
    frames = recorded.frames
    period = None if every is None else _period(frames, every, path)
    kept = slice(None) if period is None else _thinned(frames["time"], int(frames["time"][0]), period)
    found = []
    times = frames["time"][kept]
    for name, _, _, unit, meaning in (*FIELDS[:1], ELAPSED, *FIELDS[1:]):
        if name == ELAPSED[0]:
            found.append(Field(name, unit, meaning, (times - times[0]) * 1e-9))
        elif name in chosen:
            found.append(Field(name, unit, meaning, np.ascontiguousarray(frames[name][kept])))
    said = [_table(name, recorded, period, path) for name in tables]
    return Content(found, said, provenance(recorded, path, every))


def provenance(recorded: RecordedRun, path: Path, every: float | None) -> dict[str, str]:
    """What a reader has to know of the run: all that the recording says of itself, its verdict, who wrote the file."""
    said = {str(key): str(value) for key, value in recorded.custom_data.items()}
    state, text = _verdict(recorded, path)
    spacing = tick_length(recorded.frames)
    said.setdefault("scene", "not kept in the recording")
    said |= {"recording": str(path), "exported_by": f"cable_sim_ros {__version__}", "verdict": state}
    said |= {"verdict_text": text, "tick_outputs_in_recording": str(len(recorded.frames))}
    said |= {"seconds_between_tick_outputs": f"{spacing:.9g}", "axes": "odom: ENU, z up, z = 0 mean water surface"}
    if every is not None:
        said["thinned"] = f"one tick output each {every:g} s was kept, without a filter"
    return said


def _chosen(names: Sequence[str]) -> set[str]:
    known = [name for name, *_ in FIELDS]
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"Did you mean {near[0]}?" if near else "cable-sim manual fields lists them"
            raise ExportError(f"--fields {name}: there is no such field of a tick; nothing was written. {hint}")
    return {"time", *names} if names else set(known)


def _period(frames: np.recarray, every: float, path: Path) -> int:
    spacing = tick_length(frames)
    steps = every / spacing if spacing else 0.0
    if steps < 1.0 - NEAR or abs(steps - round(steps)) > NEAR * steps:
        raise ExportError(
            f"--every {every:g} s is no whole multiple of the {spacing:g} s between the tick outputs of {path}; "
            f"nothing was written. Give for example {max(round(steps), 1) * spacing:g}"
        )
    return round(every * 1e9)


def _thinned(times: np.ndarray, first: int, period: int) -> np.ndarray:
    """Places of the first time of each period; stamps may be off by half a step of rounding."""
    cell = (times - first + round(period * NEAR)) // period
    return np.flatnonzero(np.concatenate(([True], cell[1:] != cell[:-1])))


def _table(name: str, recorded: RecordedRun, period: int | None, path: Path) -> Table:
    parts = {"shape": recorded.shapes, "contact": recorded.contacts, "strum": recorded.strums}[name]
    if not parts:
        why = "viv was off" if name == "strum" else "its topic was not recorded"
        raise ExportError(f"--tables {name}: {path} has none ({why}); nothing was written. Leave it out")
    times = np.array([time for time, _ in parts], np.int64)
    kept = list(range(len(parts)))
    if period is not None:
        kept = list(map(int, _thinned(times, int(recorded.frames["time"][0]), period)))
    columns = TABLES[name]
    rows = [np.asarray(parts[k][1], float)[:, : len(columns)] for k in kept]
    begin = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
    return Table(name, columns, times[kept], begin, np.concatenate(rows))


def _verdict(recorded: RecordedRun, path: Path) -> tuple[str, str]:
    """State and text: that of the run's own summary where it is of this recording, else of the tick outputs alone."""
    said = _summary(path.parent / SUMMARY)
    if said.get("ticks") == len(recorded.frames) and isinstance(said.get("verdict"), dict):
        found: dict[str, Any] = said["verdict"]
        reasons = [f"{r.get('flag')}: {r.get('text')}" for r in found.get("reasons", []) if isinstance(r, dict)]
        return str(found.get("state")), "; ".join(["of the run's summary", *reasons])
    scene: Scene | None = None
    text = recorded.custom_data.get("scene_yaml")
    if text:
        try:
            scene = scene_from_text(str(text), f"scene kept in {path}")
        except CableSimError:  # of another version: the flags still count
            scene = None
    verdict = judge(recorded.frames, scene)
    return verdict.state, "; ".join(["of the tick outputs alone", *map(str, verdict.reasons)])


def _summary(path: Path) -> dict[str, Any]:
    try:
        said = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}
