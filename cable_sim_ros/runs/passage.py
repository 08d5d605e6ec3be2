"""What happened to a load on its way through the water surface, on slack cable and on the seabed: peaks with times.

What a tow did over a run: its time, whether the winch hauled or the ship turned, and figures of the phases of a plan
that the ship went by.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..io.scenes.ship_plan import ShipPlan
from ..physics.ship import Ship
from ..physics.tick_output import Flag
from ..sim.tables.elementary import arctan2
from .mean_track import angles_along

HAUL_OVER = 20.0  # s of the mean of the scope: a compensation is no haul
TURNED = 20.0  # deg, range of the mean heading over HAUL_OVER from which a run is a turn
HAULED = 2.0, 0.02  # m, and of the largest scope: what it moves by beyond is a haul
UNITS = {"tension": "n", "body_depth": "m", "layback": "m"}

STATISTICS: dict[str, Callable[[np.ndarray], float]] = {"min": np.min, "mean": np.mean, "max": np.max}

SNAPS = 2.0  # s from slack to the peak of a snap
EVENTS = (  # name, unit, meaning
    ("slam", "N", "largest slam, of the added mass or the slam_coefficient of a body that goes under"),
    ("splash_tension", "N", "largest tension at the sheave while a body was in the water surface"),
    ("splash_tension_least", "N", "least tension at the sheave then"),
    ("snap", "N", "largest tension at the sheave within 2 s after cable was slack"),
    ("landing_speed", "m/s", "speed downward of the towbody in the tick before the seabed is first met"),
)
MEANING = {name: (unit, meaning) for name, unit, meaning in EVENTS}


def since_first(frames: np.recarray) -> np.ndarray:
    """Simulated time from the first tick output on [ns]; a tick more where the clock goes back, as by ~/restore."""
    steps = np.diff(frames["time"])
    if (steps > 0).all():
        return frames["time"] - frames["time"][0]
    forward = steps[steps > 0]
    steps[steps <= 0] = int(np.median(forward)) if len(forward) else 1
    return np.concatenate(([0], np.cumsum(steps)))


def tick_length(frames: np.recarray) -> float:
    """Seconds between tick outputs; 0 for a single one."""
    return float(np.median(np.diff(frames["time"]))) * 1e-9 if len(frames) > 1 else 0.0


def haul_of(frames: np.recarray) -> tuple[float | None, bool]:
    """Range [m] of the mean scope over HAUL_OVER seconds, None where the tick outputs do not have the scope; is it a
    haul?"""
    scope = np.asarray(frames["scope"], float)
    if not np.isfinite(scope).all():
        return None, False
    travel = _range_of_mean(frames, scope)
    return travel, travel > max(HAULED[0], HAULED[1] * float(scope.max()))


def turns(frames: np.recarray) -> bool:
    """Is it a turn, so that there is no mean tow?"""
    return turned(frames) > TURNED


def turned(frames: np.recarray) -> float:
    """Range [deg] of the mean heading over HAUL_OVER seconds."""
    return _range_of_mean(frames, np.degrees(np.unwrap(angles_along(frames["ship_quaternion"])[2])))


def _range_of_mean(frames: np.recarray, values: np.ndarray) -> float:
    tick = tick_length(frames)
    count = min(len(values), max(1, round(HAUL_OVER / tick))) if tick > 0.0 else 1
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    return float(np.ptp(sums[count:] - sums[:-count])) / count


def phase_figures(plan: ShipPlan, ship: Ship, frames: np.recarray, before: float = 0.0) -> list[dict[str, Any]]:
    """A row for each phase that the tick outputs have; before: s of the plan that went before them."""
    if not len(frames):
        return []
    time, found = np.round(before + since_first(frames) * 1e-9 + tick_length(frames), 9), []
    aft, port = -frames["tension_vector"][:, 0], frames["tension_vector"][:, 1]
    columns = {"tension": frames["tension"], "body_depth": -frames["body_position"][:, 2], "layback": frames["layback"]}
    lead = np.degrees(arctan2(port, aft))
    for begin, end, text in plan.phases(float(time[-1]), ship):
        of = (time > begin) & (time <= end)
        if not of.any():
            continue
        row: dict[str, Any] = {"begin_s": begin, "end_s": end, "phase": text}
        for name, unit in UNITS.items():
            values = columns[name][of]
            row |= {f"{name}_{what}_{unit}": float(by(values)) for what, by in STATISTICS.items()}
        row |= {"lead_min_deg": float(lead[of].min()), "lead_max_deg": float(lead[of].max())}
        found.append(row | {"groove_margin_min_m": float(frames["groove_margin"][of].min())})
    return found


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
