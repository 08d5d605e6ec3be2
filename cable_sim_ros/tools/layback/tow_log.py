"""A log of pay-out, speed, heading and depth as even samples: columns of a CSV file, or signals of any other log.

Columns: time_s and payout_m, and of speed_mps, heading_deg (from north, clockwise), depth_m (positive down), latitude,
longitude (deg, WGS 84) or x_m, y_m (east, north) those that there are: the way of the ship must follow from positions
or from speed and heading.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import degrees
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...io.geodesy import FARTHEST, on_plane
from ...io.sources.csv_table import CONSEQUENCE, check_times, head_of, numbers_of
from ...limits import MAX_TOW_SPEED
from ..logs.log import LogError
from ..logs.read_signals import read

STEP = 1.0  # s between samples
SMOOTH = 5.0  # s, of the Gaussian that smooths the way of the ship
LONGEST_GAP = 30.0  # s, bridged
LONGEST = 86_400.0  # s
FEWEST = 4  # rows
EPOCH = 1e8  # s: a time above is since 1970
JUMPS = 0.1  # of the positions may be left out
RESET = 20.0  # m: the pay-out falls by more than this, or rises, faster than any winch
FASTEST = 10.0  # m/s, of pay-out
MOVING = 0.2  # m/s, under which a course says nothing


class Column(NamedTuple):
    """Bounds of a column, its unit, and the quantity of tools/logs/own_signals.py with the factor to the column."""

    low: float
    high: float
    unit: str
    quantity: str
    factor: float = 1.0


COLUMNS = {
    "payout_m": Column(-100.0, 20_000.0, "m", "payout"),
    "speed_mps": Column(-MAX_TOW_SPEED, MAX_TOW_SPEED, "m/s", "speed"),
    "heading_deg": Column(-360.0, 720.0, "deg", ""),
    "depth_m": Column(-12_000.0, 12_000.0, "m", "body_depth"),
    "latitude": Column(-FARTHEST, FARTHEST, "deg", "latitude", degrees(1.0)),
    "longitude": Column(-180.0, 360.0, "deg", "longitude", degrees(1.0)),
    "x_m": Column(-1e7, 1e7, "m", "x"),
    "y_m": Column(-1e7, 1e7, "m", "y"),
}
EXAMPLE = "time_s,payout_m,speed_mps,heading_deg,depth_m"


@dataclass
class TowLog:
    """Even samples, every STEP s: seconds from the first; cable [m] as the counter shows it; track [n, 2] of the
    antenna, m east and north of origin; yaw [n] rad of the bow; depth [n] m, None: not logged.

    origin: latitude, longitude [deg], None: not known; began: s since 1970, None: not known; assumed, notes: lines.
    """

    path: str
    seconds: np.ndarray
    cable: np.ndarray
    track: np.ndarray
    yaw: np.ndarray
    depth: np.ndarray | None
    origin: tuple[float, float] | None
    began: float | None
    assumed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_log(path: str | os.PathLike, mapping: str | os.PathLike | None = None) -> TowLog:
    """The log of a file. Raises MotionError and LogError."""
    path = Path(path)
    if mapping is None and path.suffix.lower() == ".csv":
        return _even(path, *_of_table(path), [])
    return _even(path, *_of_signals(path, mapping))


def _of_table(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray], list[str]]:
    """Times, columns and what an error calls each row."""
    names, below = head_of(path, EXAMPLE)
    for name in names:
        if name != "time_s" and name not in COLUMNS:
            raise LogError(
                f"{path}: there is no column '{name}'; {CONSEQUENCE}. Known: time_s, {', '.join(COLUMNS)}; a log with "
                f"other names is read with --mapping FILE"
            )
    for name in ("time_s", "payout_m"):
        if names.count(name) != 1:
            raise LogError(f"{path}: {name} must be there once; {CONSEQUENCE}. The first line is such as {EXAMPLE}")
    if len(set(names)) < len(names):
        raise LogError(f"{path}: a column is there twice; {CONSEQUENCE}. Keep one of each of {', '.join(names)}")
    lines, data = numbers_of(path, names, below)
    columns = {name: data[:, names.index(name)] for name in names}
    return columns.pop("time_s"), columns, [f"{path}:{line}" for line in lines]


def _of_signals(
    path: Path, mapping: str | os.PathLike | None
) -> tuple[np.ndarray, dict[str, np.ndarray], list[str], list[str]]:
    """The same from the signals of any log that is known, at the times of the pay-out; and what was assumed."""
    found = {one.quantity: one for one in read(path, mapping).signals}
    if "payout" not in found or not len(found["payout"].time):
        raise LogError(
            f"{path}: has no pay-out (found: {', '.join(found) or 'nothing'}); {CONSEQUENCE}. Map the counter of the "
            f"winch to payout"
        )
    stamps = found["payout"].time
    time, columns, assumed = stamps * 1e-9, {}, [*found["payout"].assumed]
    for name, column in COLUMNS.items():
        signal = found.get(column.quantity)
        if signal is not None and len(signal.time):
            columns[name] = column.factor * np.interp(stamps, signal.time, signal.value)
            assumed += [line for line in signal.assumed if line not in assumed]
    for name in ("yaw", "course"):
        signal = found.get(name)
        if signal is not None and len(signal.time) and "heading_deg" not in columns:
            turned = np.degrees(np.interp(stamps, signal.time, np.unwrap(signal.value)))
            columns["heading_deg"] = (90.0 - turned) % 360.0
            assumed += [line for line in signal.assumed if line not in assumed]
            assumed += ["assumed: the ship points along its course (no heading was logged)"] * (name == "course")
    return time, columns, [f"{path}: sample {k + 1}" for k in range(len(time))], assumed


def _even(path: Path, time: np.ndarray, columns: dict[str, np.ndarray], lines: list[str], assumed: list[str]) -> TowLog:
    """The log of what was read, checked."""
    _checked(path, time, columns, lines)
    notes = _gaps(path, time)
    began = float(time[0]) if time[0] > EPOCH else None
    at = np.arange(0.0, time[-1] - time[0] + 1e-9, STEP)
    moved = time - time[0]

    def even(values: np.ndarray) -> np.ndarray:
        return np.interp(at, moved, values)

    cable = columns["payout_m"]
    _no_reset(time, cable, lines)
    heading = columns.get("heading_deg")
    yaw = None if heading is None else _smooth(even(np.unwrap(np.radians(90.0 - heading))))
    speed, origin = columns.get("speed_mps"), None
    for one, other in (("latitude", "longitude"), ("x_m", "y_m")):
        if (one in columns) != (other in columns):
            raise LogError(f"{path}: has one of {one} and {other} without the other; {CONSEQUENCE}. Give both")
    if "latitude" in columns or "x_m" in columns:
        if "latitude" in columns:
            latitude, longitude = columns["latitude"], columns["longitude"]
            middle = float(np.median(latitude)), float(np.median(longitude))
            kept = _without_jumps(moved, on_plane(middle, latitude, longitude), lines, notes)
            latitude, longitude = latitude[kept], longitude[kept]
            origin = float(latitude[0]), float((longitude[0] + 180.0) % 360.0 - 180.0)
            places = on_plane(origin, latitude, longitude)
        else:
            places = np.column_stack([columns["x_m"], columns["y_m"]])
            kept = _without_jumps(moved, places, lines, notes)
            places = places[kept]
        raw = np.column_stack([np.interp(at, moved[kept], places[:, k]) for k in (0, 1)])
        track = np.column_stack([_smooth(raw[:, k]) for k in (0, 1)])
        off = float(np.sqrt(np.mean(np.sum((track - raw) ** 2, axis=1))))
        notes.append(f"positions smoothed over {SMOOTH:g} s, rms of what was taken away {off:.2g} m")
        if speed is not None:
            made = np.hypot(*np.gradient(track, STEP, axis=0).T)
            gap = float(np.sqrt(np.mean((made - even(speed)) ** 2)))
            notes.append(
                f"the way of the ship is that of the positions; speed_mps differs from it by {gap:.2g} m/s rms"
            )
    elif yaw is None or speed is None:
        lacks = " and ".join(n for n, there in (("speed_mps", speed), ("heading_deg", yaw)) if there is None)
        raise LogError(
            f"{path}: has no {lacks}, and no latitude and longitude, so where the ship went is not known; "
            f"{CONSEQUENCE}. Add them, or positions"
        )
    else:
        smooth = _smooth(even(speed))
        rate = smooth[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)])
        track = np.vstack([np.zeros(2), np.cumsum(0.5 * STEP * (rate[1:] + rate[:-1]), axis=0)])
        assumed.append("assumed: the ship goes where it points, at speed_mps over ground (no positions were logged)")
    if yaw is None:
        yaw = _course(path, track)
        assumed.append("assumed: the ship points along its track (no heading_deg was logged)")
    depth = columns.get("depth_m")
    if depth is not None:
        depth = even(_down(depth, lines, assumed))
    still = float(np.mean(np.hypot(*np.gradient(track, STEP, axis=0).T) < MOVING))
    if still > 0.0:
        notes.append(f"the ship lies still (below {MOVING:g} m/s) in {100.0 * still:.3g} % of the log: no course there")
    return TowLog(os.fspath(path), at, even(cable), track, yaw, depth, origin, began, assumed, notes)


def _checked(path: Path, time: np.ndarray, columns: dict[str, np.ndarray], lines: list[str]) -> None:
    """Raise MotionError for time that does not advance, LogError for values that no tow has."""
    check_times(path, time, lines.__getitem__, FEWEST, LONGEST)
    if time[-1] - time[0] < FEWEST * STEP:
        raise LogError(
            f"{path}: {time[-1] - time[0]:g} s are fewer than {FEWEST * STEP:g} s; {CONSEQUENCE}. Give a longer log"
        )
    for name, values in columns.items():
        column = COLUMNS[name]
        bad = ~((values >= column.low) & (values <= column.high))
        if bad.any():
            k = int(np.argmax(bad))
            raise LogError(
                f"{lines[k]}: {name} = {values[k]:g} {column.unit} is outside [{column.low:g}, {column.high:g}] "
                f"{column.unit}; {CONSEQUENCE}. Check its unit, or leave the row out"
            )


def _gaps(path: Path, time: np.ndarray) -> list[str]:
    """A note on gaps that are bridged; LogError for one that is too long."""
    steps = np.diff(time)
    k = int(np.argmax(steps))
    if steps[k] > LONGEST_GAP:
        raise LogError(
            f"{path}: nothing was logged for {steps[k]:g} s after {time[k] - time[0]:g} s of the log, more than "
            f"{LONGEST_GAP:g} s: where ship and winch were is not known; {CONSEQUENCE}. Cut the log there into two"
        )
    usual = max(float(np.median(steps)), STEP)
    gaps = int(np.sum(steps > 1.5 * usual))
    return [f"{gaps} gaps bridged by straight lines, the longest of {steps[k]:g} s"] if gaps else []


def _no_reset(time: np.ndarray, cable: np.ndarray, lines: list[str]) -> None:
    steps, jumps = np.diff(time), np.diff(cable)
    bad = (np.abs(jumps) > RESET) & (np.abs(jumps) > FASTEST * steps)
    if bad.any():
        k = int(np.argmax(bad))
        raise LogError(
            f"{lines[k + 1]}: payout_m goes from {cable[k]:g} to {cable[k + 1]:g} m within {steps[k]:g} s, faster than "
            f"{FASTEST:g} m/s: the counter was set anew, or a row is wrong; {CONSEQUENCE}. Add what it lost to the "
            f"rows behind it, or cut the log there into two"
        )


def _without_jumps(time: np.ndarray, places: np.ndarray, lines: list[str], notes: list[str]) -> np.ndarray:
    """Which positions are kept: one that no ship could have come to since the one before is left out."""
    slack = 5.0  # m, noise of positions
    begin = np.hypot(*(places[:FEWEST] - np.median(places[:FEWEST], axis=0)).T)
    first = int(np.argmax(begin <= max(slack + MAX_TOW_SPEED * (time[FEWEST - 1] - time[0]), float(begin.min()))))
    kept, last, worst, at = np.zeros(len(time), bool), first, 0.0, 0
    for k in range(first, len(time)):
        away = float(np.hypot(*(places[k] - places[last])))
        if away <= slack + MAX_TOW_SPEED * (time[k] - time[last]):
            kept[k], last = True, k
        elif away > worst:
            worst, at = away, k
    left = int(np.sum(~kept))
    if left > max(JUMPS * len(time), FEWEST - 1) or kept.sum() < FEWEST:
        raise LogError(
            f"{lines[at]}: the position jumps by {worst:.4g} m, and {left} of {len(time)} positions do not follow the "
            f"ones before at {MAX_TOW_SPEED:g} m/s or less, more than {100.0 * JUMPS:g} %; {CONSEQUENCE}. Check "
            f"their units, or leave the wrong rows out"
        )
    if left:
        notes.append(f"{left} positions that jump were left out, the farthest by {worst:.4g} m ({lines[at]})")
    return kept


def _down(depth: np.ndarray, lines: list[str], assumed: list[str]) -> np.ndarray:
    """Depth positive down."""
    if depth.min() >= -2.0:
        return depth
    if depth.max() <= 2.0:
        assumed.append(
            f"assumed: depth_m is negative down ({depth.min():.4g} to {depth.max():.4g} m): its sign was turned"
        )
        return -depth
    k = int(np.argmin(depth))
    raise LogError(
        f"{lines[k]}: depth_m = {depth[k]:g} m, and {depth.max():g} m elsewhere: below and above the water; "
        f"{CONSEQUENCE}. Give depth positive down, rows without a depth left out"
    )


def _course(path: Path, track: np.ndarray) -> np.ndarray:
    """Yaw along a track; where the ship lies still that before it, or the first there is."""
    velocity = np.gradient(track, STEP, axis=0)
    moves = np.hypot(*velocity.T) >= MOVING
    if not moves.any():
        raise LogError(
            f"{path}: has no heading_deg, and the ship never moves at {MOVING:g} m/s, so where it points is not "
            f"known; {CONSEQUENCE}. Add heading_deg"
        )
    last = np.maximum.accumulate(np.where(moves, np.arange(len(track)), -1))
    last[last < 0] = int(np.argmax(moves))
    return _smooth(np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])[last]))


def _smooth(values: np.ndarray) -> np.ndarray:
    """Smoothed by a Gaussian of SMOOTH; at the ends as if turned about them, so that a straight way stays."""
    pad = min(len(values) - 1, round(4.0 * SMOOTH / STEP))
    before = 2.0 * values[0] - values[pad:0:-1]
    after = 2.0 * values[-1] - values[-2 : -2 - pad : -1]
    return gaussian_filter1d(np.concatenate([before, values, after]), SMOOTH / STEP)[pad : len(values) + pad]


def moment_of(text: str) -> float:
    """Seconds since 1970 of an ISO time; UTC where it says none. Raises LogError."""
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        raise LogError(f"'{text}' is no time; {CONSEQUENCE}. Give it as 2026-03-01T12:00:00Z") from None
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()
