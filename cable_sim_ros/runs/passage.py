"""What happened to a load on its way through the water surface, on slack cable and on the seabed: peaks with times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..physics.tick_output import Flag
from .travel import since_first, tick_length

SNAPS = 2.0  # s from slack to the peak of a snap
EVENTS = (  # name, unit, meaning
    ("slam", "N", "largest slam, of the added mass or the slam_coefficient of a body that goes under"),
    ("splash_tension", "N", "largest tension at the sheave while a body was in the water surface"),
    ("splash_tension_least", "N", "least tension at the sheave then"),
    ("snap", "N", "largest tension at the sheave within 2 s after cable was slack"),
    ("landing_speed", "m/s", "speed downward of the towbody in the tick before the seabed is first met"),
)
MEANING = {name: (unit, meaning) for name, unit, meaning in EVENTS}


class Event(NamedTuple):
    """One of EVENTS: its value, s after the first tick, and its line there."""

    name: str
    unit: str
    value: float
    at_s: float
    meaning: str


def events(frames: np.recarray) -> dict[str, Event]:
    """The events of a run by name, those that there were, in their order."""
    status, low = frames["status"], np.fmin(frames["tension"], frames["tension_tick_min"])
    high = np.fmax(frames["tension"], frames["tension_tick_max"])
    crossed, aground = status & Flag.SURFACE_CROSSED != 0, status & Flag.SEABED != 0
    landed = np.zeros(len(frames), bool)
    if (first := np.flatnonzero(aground[1:] & ~aground[:-1])).size:
        landed[first[0]] = True
    every = {
        "slam": (frames["slam"], crossed, np.nanargmax),
        "splash_tension": (high, crossed, np.nanargmax),
        "splash_tension_least": (low, crossed, np.nanargmin),
        "snap": (high, after_slack(frames), np.nanargmax),
        "landing_speed": (-frames["body_velocity"][:, 2], landed, np.nanargmax),
    }
    times, found = since_first(frames) * 1e-9 + tick_length(frames), dict[str, Event]()
    for name, (values, there, extreme) in every.items():
        if (there & np.isfinite(values)).any():
            at = int(extreme(np.where(there, values, np.nan)))
            unit, meaning = MEANING[name]
            found[name] = Event(name, unit, float(values[at]), round(float(times[at]), 9), meaning)
    return found


def after_slack(frames: np.recarray) -> np.ndarray:
    """Ticks within SNAPS seconds after one in which cable was slack, and that one."""
    ticks = np.arange(len(frames))
    last = np.maximum.accumulate(np.where(frames["status"] & Flag.SLACK != 0, ticks, -1))
    return (last >= 0) & ((ticks - last) * tick_length(frames) <= SNAPS)
