"""What an imported bag keeps of how it came about: into the JSON and the verdict of a run under its motion."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, isfinite, nan, sin
from typing import Any

import numpy as np

from ..messages.messages import Event
from ..messages.mounting import heading_of, moved_on
from .motion_curves import Given, Rounding, judged
from .recorded_tow import RecordedTow, odometry_of

KEY = "import"  # of the custom data of a bag
ALONG = "speed_of_scene"  # of that: its log has no speed; {"heading": rad, null: along the yaw of each message}
OF_A_RUN = "imported"  # of the custom data of a run under its motion
KEPT = ("files", "records", "lost", "mappings", "motion", "given", "track")
LOST = "imported: lost records, "  # notes that begin so
MOST = 100  # notes of a run
LONGEST = 400  # characters of one


@dataclass
class _Moving:
    time: np.ndarray
    value: np.ndarray
    rate: np.ndarray


def take_provenance(tow: RecordedTow, sheave: tuple[float, float, float]) -> None:
    """Put assumptions, losses and what rounding left of an import into `imported`, `notices`, `rounded`, `doubts`."""
    tow.imported = provenance(tow.about)
    about = _kept(tow.about, KEY)
    if about is None:
        return
    tow.notices += [f"{tow.path}: {line}"[:LONGEST] for line in _lines(about, "said")[:MOST]]
    found = _roundings(about)
    motion = _moving(tow) if found else None
    if motion is not None:
        rounded, notices, doubts = judged(tow.path, found, motion, sheave)
        tow.rounded = [*tow.rounded, *rounded]
        tow.notices += notices
        tow.doubts = [*tow.doubts, *doubts]


def provenance(custom_data: Mapping[str, str]) -> dict[str, Any]:
    """Figures of an import with `notes` of what it assumed, lacks and lost; empty for any other bag.

    custom_data: of an imported bag, or of the recording of a run under its motion.
    """
    about = _kept(custom_data, KEY)
    if about is None:
        about = _kept(custom_data, OF_A_RUN)
        if about is None:
            return {}
        notes = _lines(about, "notes")
    else:
        notes = [f"imported: {line}" for line in _lines(about, "assumed") + _lines(about, "missing")]
        notes += [f"{LOST}{line}" for line in _lines(about, "losses")]
    figures = {name: about[name] for name in KEPT if name in about}
    return figures | {"notes": [note[:LONGEST] for note in notes[:MOST]]}


def needs_speed(custom_data: Mapping[str, str]) -> bool:
    """Is it an imported bag whose log has no speed?"""
    return isinstance((_kept(custom_data, KEY) or {}).get(ALONG), dict)


def at_speed(events: list[Event], custom_data: Mapping[str, str], speed: float) -> list[Event]:
    """Motion of an imported bag whose log has no speed, at one ahead [m/s]; of any other bag as it is."""
    about = (_kept(custom_data, KEY) or {}).get(ALONG)
    if not isinstance(about, dict):
        return events
    heading = about.get("heading")
    out, last, east, north = list[Event](), None, 0.0, 0.0
    for event in events:
        yaw = heading_of(event.data) if event.kind == "odometry" else nan
        if isfinite(yaw):
            yaw = heading if isinstance(heading, float) and isfinite(heading) else yaw
            now = event.time, speed * cos(yaw), speed * sin(yaw)
            if last is not None:
                half = 0.5e-9 * (event.time - last[0])
                east, north = east + half * (last[1] + now[1]), north + half * (last[2] + now[2])
            last = now
            event = event._replace(data=moved_on(event.data, (east, north), now[1:]))
        out.append(event)
    return out


def _kept(custom_data: Mapping[str, str], key: str) -> dict[str, Any] | None:
    try:
        found = json.loads(custom_data.get(key, ""))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _lines(about: dict[str, Any], key: str) -> list[str]:
    found = about.get(key)
    return [str(line) for line in found] if isinstance(found, list) else []


def _roundings(about: dict[str, Any]) -> dict[int, Rounding]:
    """Of each coordinate, as `Rounding` was kept: name, unit, scale, angle, five numbers."""
    out = {}
    try:
        for key, (name, unit, scale, angle, *rest) in about.get("rounding", {}).items():
            numbers = [float(one) for one in rest]
            if int(key) in range(6) and len(numbers) == 5 and np.isfinite(numbers).all():
                out[int(key)] = Rounding(Given(str(name), str(unit), float(scale), bool(angle)), *numbers)
    except (TypeError, ValueError, AttributeError):
        return {}
    return out


def _moving(tow: RecordedTow) -> _Moving | None:
    time, value = odometry_of(tow)
    if len(time) < 3:
        return None
    t = (time - time[0]) * 1e-9
    if not (np.diff(t) > 0.0).all():
        return None
    return _Moving(time, value, np.gradient(value, t, axis=0))
