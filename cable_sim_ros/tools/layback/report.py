"""Figures of a layback, and the table that survey software reads."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...files import write_csv
from ...io.geodesy import on_earth
from ...sim.flag_rules import LAYBACK_WITHIN as WITHIN
from ...sim.flag_rules import PLACE
from ...sim.verdict import Verdict, check, verdict_of
from .laid import WAYS, Laid, courses

BEHIND = 3.0  # times the distance of a place from the end: so much of the track is looked at
LONGEST = 2000  # samples of it, at most
MEANING = {
    "pythagoras": "straight cable: sqrt(cable^2 - (depth + sheave height)^2), astern",
    "factor": "cable out times a factor, astern",
    "follow_dog": "the layback of Pythagoras, drawn along by the sheave as a dog on a leash",
    "along_track": "the layback of Pythagoras, behind on the way that the sheave went",
    "catenary": "chain of the cable's weight in water under the drag of the towbody alone, astern",
    "catenary_of_depth": "chain of the cable's length to the depth, level at the towbody, astern",
    "table": "layback of a table of static tows by cable out and speed, astern",
    "static": "static tow of the scene at the speed, course and cable out of the moment",
}


class Place(NamedTuple):
    """Where and when the axes of the samples begin: latitude and longitude [deg] and s since 1970, None: not known."""

    origin: tuple[float, float] | None = None
    began: float | None = None


def figures(one: Laid, measured: bool) -> dict[str, Any]:
    """For the JSON; measured: the depths of the samples are measured ones."""
    s = one.samples
    size = np.hypot(*(s.fish - s.sheave).T)
    behind, aside = along_track(s.sheave, s.fish, one.course)
    found: dict[str, Any] = {
        "samples": len(s.seconds),
        "duration_s": float(s.seconds[-1] - s.seconds[0]),
        "layback_m": _range(size),
        "along_track_m": _range(behind),
        "offset_m": _range(aside),
        "depth_m": _range(s.fish_depth),
        "interval_95_m": {
            name: _range(one.band[:, k]) for k, name in enumerate(("layback", "along", "across", "depth"))
        },
        "heading_95_deg": _range(np.degrees(one.band[:, 4])),
        "manoeuvre_share": float(one.moves.mean()),
        "copies_share": float(one.by_copies.mean()),
        "ways": [_way(one, name, size) for name in WAYS],
    }
    if measured:
        gap = s.fish_depth - s.depth
        found["depth_difference_m"] = {
            "mean": float(gap.mean()),
            "rms": float(np.sqrt(np.mean(gap**2))),
            "largest": float(np.abs(gap).max()),
            "share_within_interval": float(np.mean(np.abs(gap) <= one.band[:, 3])),
        }
    return found


def _way(one: Laid, name: str, size: np.ndarray) -> dict[str, Any]:
    s, places = one.samples, one.places[name]
    apart = np.hypot(*(places - s.fish).T)
    longer = np.hypot(*(places - s.sheave).T) - size
    known = np.isfinite(apart)
    row: dict[str, Any] = {"way": name, "meaning": MEANING[name], "no_solution": int(np.sum(~known))}
    row |= {"layback_difference_mean_m": None, "apart_mean_m": None, "apart_largest_m": None, "apart_largest_s": None}
    if known.any():
        worst = int(np.nanargmax(apart))
        row |= {
            "layback_difference_mean_m": float(longer[known].mean()),
            "apart_mean_m": float(apart[known].mean()),
            "apart_largest_m": float(apart[worst]),
            "apart_largest_s": float(s.seconds[worst]),
        }
    return row


def verdict_on(verdict: Verdict, found: Mapping[str, Any], notes: list[str]) -> Verdict:
    """What of the verdict on a run counts for its layback; reasons of other figures become notes."""
    kept = []
    for reason in verdict.reasons:
        if set(reason.metrics) & set(PLACE):
            kept.append(reason)
        else:
            notes.append(f"of the run, not of its layback: {reason}")
    share = found.get("depth_difference_m", {}).get("share_within_interval", 1.0)
    if share < WITHIN:
        kept.append(
            check(
                "LAYBACK_DEPTH",
                f"the simulated depth is within its 95 % interval of the measured one for {100.0 * share:.3g} % of the "
                f"time: drag, weights, flow or counter are not those of this tow, and the layback hangs on them too. "
                f"Check the scene and --counter-offset, widen --range, or --fit-drag",
                fraction=1.0 - share,
            )
        )
    return verdict_of(kept)._replace(notes=verdict.notes)


def _range(values: np.ndarray) -> dict[str, float | None]:
    known = values[np.isfinite(values)]
    if not len(known):
        return {"min": None, "mean": None, "max": None}
    return {"min": float(known.min()), "mean": float(known.mean()), "max": float(known.max())}


def table(one: Laid, place: Place, measured: bool, seabed: float | None = None) -> tuple[list[str], list[list[str]]]:
    """Names of the columns and their cells; what has no value is empty. seabed: its depth [m]."""
    s = one.samples
    behind, aside = along_track(s.sheave, s.fish, one.course)
    heads, columns = ["time_s" if place.began is None else "time_utc"], [_times(s.seconds, place.began)]
    known = place.origin is not None
    names = ("latitude", "longitude") if known else ("x_m", "y_m")
    places = {
        name: on_earth(place.origin, at) if place.origin else at.T for name, at in (("", s.fish), ("ship_", s.antenna))
    }
    heads += names
    columns += [_cells(values, 8 if known else 2) for values in places[""]]
    numbers: Mapping[str, np.ndarray] = {
        "heading_deg": _compass(s.fish_yaw),
        "course_deg": _compass(courses(np.gradient(s.fish, s.seconds, axis=0), s.fish_yaw)),
        "depth_m": s.fish_depth,
        "layback_m": np.hypot(*(s.fish - s.sheave).T),
        "layback_antenna_m": np.hypot(*(s.fish - s.antenna).T),
        "along_track_m": behind,
        "offset_m": aside,
        "altitude_m": (np.nan if seabed is None else seabed) - s.fish_depth,
        **{f"ship_{name}": values for name, values in zip(names, places["ship_"], strict=True)},
        "ship_heading_deg": _compass(s.yaw),
        "ship_course_deg": _compass(one.course),
        "layback_95_m": one.band[:, 0],
        "along_95_m": one.band[:, 1],
        "across_95_m": one.band[:, 2],
        "depth_95_m": one.band[:, 3],
        "heading_95_deg": np.degrees(one.band[:, 4]),
        "interval": one.by_copies,
        "cable_out_m": s.cable,
        "depth_measured_m": s.depth if measured else np.full(len(s.seconds), np.nan),
        **{f"layback_{name}_m": np.hypot(*(one.places[name] - s.sheave).T) for name in WAYS},
    }
    heads += list(numbers)
    columns += [
        ["copies" if yes else "steady" for yes in values]
        if name == "interval"
        else _cells(values, 8 if name in ("ship_latitude", "ship_longitude") else 2)
        for name, values in numbers.items()
    ]
    return heads, [list(row) for row in zip(*columns, strict=True)]


def write_table(path: Path, one: Laid, place: Place, measured: bool, seabed: float | None = None) -> None:
    """The table as CSV with points and commas."""
    write_csv(path, *table(one, place, measured, seabed), ends="\n")


def _times(seconds: np.ndarray, began: float | None) -> list[str]:
    if began is None:
        return [f"{value:.3f}" for value in seconds]
    at = (datetime.fromtimestamp(round(1000.0 * (began + value)) / 1000.0, UTC) for value in seconds)
    return [f"{one:%Y-%m-%dT%H:%M:%S}.{one.microsecond // 1000:03d}Z" for one in at]


def _compass(yaw: np.ndarray) -> np.ndarray:
    """Degrees from north, clockwise, 0 to 360."""
    return np.round(90.0 - np.degrees(yaw), 2) % 360.0


def _cells(values: np.ndarray, places: int) -> list[str]:
    return [f"{value:.{places}f}" if np.isfinite(value) else "" for value in np.asarray(values, float)]


def along_track(track: np.ndarray, places: np.ndarray, course: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each place [n, 2] the way [n] m behind the ship on its own track so far, and the distance [n] m from it, to
    starboard positive. track [n, 2]; course [n] rad: before its beginning the track goes straight on backwards.
    """
    steps = np.hypot(*np.diff(track, axis=0, prepend=track[:1]).T)
    chainage = np.cumsum(steps)
    reach = float(np.nanmax(np.hypot(*(places - track).T), initial=1.0)) * BEHIND
    first = track[0] - reach * np.array([np.cos(course[0]), np.sin(course[0])])
    way, marks = np.vstack([first, track]), np.concatenate([[-reach], chainage])
    behind, aside = np.full(len(track), np.nan), np.full(len(track), np.nan)
    for k, place in enumerate(places):
        if not np.isfinite(place).all():
            continue
        begin = max(0, int(np.searchsorted(marks, chainage[k] - reach)) - 1, k - LONGEST)
        a, b = way[begin : k + 1], way[begin + 1 : k + 2]
        leg = b - a
        square = np.maximum((leg * leg).sum(1), 1e-12)
        share = np.clip(((place - a) * leg).sum(1) / square, 0.0, 1.0)
        off = place - (a + share[:, None] * leg)
        near = int(np.argmin((off * off).sum(1)))
        size = float(np.hypot(*leg[near])) or 1.0
        port = (leg[near, 0] * off[near, 1] - leg[near, 1] * off[near, 0]) / size
        side = 1.0 if port <= 0.0 else -1.0
        aside[k] = side * float(np.hypot(*off[near]))
        behind[k] = chainage[k] - (marks[begin + near] + share[near] * (marks[begin + near + 1] - marks[begin + near]))
    return behind, aside
