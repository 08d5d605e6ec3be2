"""Ship motion of one's own without a bag: a CSV table with units in its column names, or a sinusoidal heave.

Both become odometry messages, so that a run takes them in, records them and replays them like those of a bag. The
columns are explained in docs/motion.md.
"""

from __future__ import annotations

import difflib
import os
import warnings
from collections.abc import Iterator, Sequence
from math import atan2, cos, degrees, floor, radians, remainder, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...physics.heave_filter import Heave
from ...physics.ship import Ship
from ...sim.inputs import MAX_PITCH, MAX_POSITION, MAX_RATE, MAX_SPEED, MAX_TURNS
from ...sim.tables.attitude import body_rates, quaternion, rotation
from ..messages.message_classes import odometry_bytes
from ..messages.messages import Event
from ..scenes.ship_plan import ShipPlan
from .csv_table import CONSEQUENCE as CONSEQUENCE
from .csv_table import MotionError as MotionError
from .csv_table import check_times, head_of, numbers_of
from .motion_curves import Curve, Given, Samples, through
from .recorded_tow import RecordedTow
from .rounding import even

TIME = "time_s"
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
SECOND = 1_000_000_000
STEP = SECOND // 50  # ns between messages where the table is coarser
UNEVEN = 0.05  # of the period: a step further from a whole number of periods is irregular
CRAB = 10.0  # deg between where a ship points and where it goes: more than a current makes
FEWEST = 4  # rows between gaps, for a cubic
BLOCK = 10_000  # messages whose numbers are taken at a time
LONGEST = 86_400.0  # s of a table or a sinusoidal heave
HEAVE_PERIODS = (1.0, 600.0)  # s


class MotionWarning(UserWarning):
    """Ship motion that can be used, with something that will show in the results."""


class Column(NamedTuple):
    """What a column means: coordinate 0 to 5, its rate instead of its value, factor to SI, unit."""

    coordinate: int
    rate: bool
    scale: float
    unit: str


def _columns() -> dict[str, Column]:
    table = {}
    for name, k in (("x", 0), ("y", 1), ("z", 2), ("heave", 2)):
        table[f"{name}_m"] = Column(k, False, 1.0, "m")
        table[f"{name}_mps"] = Column(k, True, 1.0, "m/s")
    for k in (3, 4, 5):
        for unit, scale in (("rad", 1.0), ("deg", radians(1.0))):
            table[f"{COORDINATES[k]}_{unit}"] = Column(k, False, scale, unit)
            table[f"{COORDINATES[k]}_{unit}ps"] = Column(k, True, scale, f"{unit}/s")
    return table


COLUMNS = _columns()


def read_table(
    path: str | os.PathLike,
    ship: Ship,
    sheave: tuple[float, float, float] = (0.0, 0.0, 0.0),
    at: tuple[float, float, float] | None = None,
    height: float = Heave().max_displacement,
) -> RecordedTow:
    """Ship motion of a CSV file as odometry messages; columns that are missing follow the mean track of ``ship``.

    Rounded columns are smoothed (`motion_curves.py`); `rounded`, `notices` and `doubts` of the answer tell of it.
    sheave: its place in base_link [m], where the acceleration that rounding leaves is judged; at: x, y [m] and yaw
    [rad] at the beginning of what follows the track, None: those of the ship; height: z beyond that is refused [m].
    Raises MotionError; warns of gaps with MotionWarning.
    """
    path = Path(path)
    names, below = head_of(path, f"{TIME},heave_m")
    given = _given(path, names)
    lines, data = numbers_of(path, names, below)
    time = even(data[:, names.index(TIME)])
    parts = _stretches(path, lines, time, ship)
    values = np.full((2, 6, len(time)), np.nan)  # value and rate, NaN: not given
    for (coordinate, rate), name in given.items():
        column = COLUMNS[name]
        values[int(rate), coordinate] = column.scale * data[:, names.index(name)]
        if name.startswith("heave") and not rate:
            values[0, 2] += ship.reference_height
        if not rate:
            _within(path, lines, name, values[0, coordinate], data[:, names.index(name)], (ship, height))
    values[0, 5] = np.unwrap(values[0, 5])
    if (5, False) in given and (0, False) not in given and at is None:
        _ahead(path, given[5, False], values[0, 5], ship)
    moved = time - time[0]
    begin = round((time[0] if time[0] > 0.0 else time[0] + floor(-time[0]) + 1.0) * SECOND)  # stamp 0 means: none
    columns = {k: (COLUMNS[name], name) for (k, rate), name in given.items() if not rate}
    found = {
        k: through(
            Given(name, column.unit, column.scale, angle=k > 2),
            [
                (moved[part], values[0, k, part], None if (k, True) not in given else values[1, k, part])
                for part in parts
            ],
        )
        for k, (column, name) in columns.items()
    }
    pieces = [
        _sampled(moved[part], {k: curves[i] for k, (curves, _) in found.items()}, begin, ship, at)
        for i, part in enumerate(parts)
    ]
    whole = Samples(*(np.concatenate(arrays) for arrays in zip(*pieces)))
    tow = RecordedTow(os.fspath(path), odometry_events(whole, str(path)))
    tow.judge({k: report for k, (_, report) in found.items() if report}, whole, sheave)
    return tow


def sine_heave(
    amplitude: float, period: float, duration: float, ship: Ship, plan: ShipPlan | None = None
) -> RecordedTow:
    """A heave of ``amplitude`` [m] and ``period`` [s] about the mean track, or that of a plan, level, as odometry
    messages.

    duration: of the run, s. Raises MotionError.
    """
    where = f"heave of {amplitude:g} m in {period:g} s"
    if why := heave_problem(amplitude, period):
        raise MotionError(f"{where}: {why}; {CONSEQUENCE}. Give --heave AMPLITUDE,PERIOD in m and s")
    t, omega = times_of(duration, where), 2.0 * np.pi / period
    value, rate = mean_track(t, ship) if plan is None else plan.track(t, ship)
    value[:, 2] += amplitude * np.sin(omega * t)
    rate[:, 2] = amplitude * omega * np.cos(omega * t)
    return _by_plan(made(where, value, rate, f"heave {amplitude:g} m, {period:g} s"), ship, plan)


def heave_problem(amplitude: float, period: float) -> str:
    """Why a heave [m, s] is none that a ship makes, "" where it is."""
    most, (short, long) = Heave().max_displacement, HEAVE_PERIODS
    if not 0.0 < amplitude <= most:
        return f"the amplitude is outside (0, {most:g}] m"
    return "" if short <= period <= long else f"the period is outside [{short:g}, {long:g}] s"


def planned(plan: ShipPlan, duration: float, ship: Ship) -> RecordedTow:
    """The track of a plan of the ship, level, as odometry messages; duration: of the run, s. Raises MotionError."""
    step = round(plan.every * SECOND)
    track = plan.track(times_of(duration, "ship plan", step), ship)
    return _by_plan(made("ship plan", *track, step=step), ship, plan)


def times_of(duration: float, where: str, step: int = STEP) -> np.ndarray:
    """Times [n] of the messages of a run of so many seconds, a second more than is run. Raises MotionError."""
    if not 0.0 < duration <= LONGEST:
        raise MotionError(
            f"{where}: a duration of {duration:g} s is outside (0, {LONGEST:g}] s; {CONSEQUENCE}. "
            f"Give a shorter --duration"
        )
    return np.arange(-(-round(duration * SECOND) // step) + SECOND // step) * (step / SECOND)


def made(where: str, value: np.ndarray, rate: np.ndarray, name: str = "", step: int = STEP) -> RecordedTow:
    """Motion at times as of `times_of`, beginning with the stamp of a second; name: of the source, else ``where``."""
    stamps = SECOND + np.arange(len(value)) * step
    return RecordedTow(name or where, odometry_events(Samples(stamps, value, rate), where))


def _by_plan(tow: RecordedTow, ship: Ship, plan: ShipPlan | None) -> RecordedTow:
    if plan is not None:
        tow.heading, tow.ship_plan = radians(ship.heading_deg), str(plan)
    return tow


def _given(path: Path, names: Sequence[str]) -> dict[tuple[int, bool], str]:
    """(coordinate, rate) -> column. Raises MotionError for what cannot be a table of motion."""
    given: dict[tuple[int, bool], str] = {}
    for name in names:
        if name == TIME:
            continue
        if name not in COLUMNS:
            near = [n for n, column in COLUMNS.items() if n.rpartition("_")[0] == name and not column.rate]
            near = near or difflib.get_close_matches(name, (TIME, *COLUMNS), 1)
            hint = f"Did you mean {' or '.join(near)}?" if near else f"Known: {', '.join((TIME, *COLUMNS))}"
            raise MotionError(f"{path}: there is no column '{name}'; {CONSEQUENCE}. {hint}")
        key = COLUMNS[name][:2]
        if key in given:
            raise MotionError(
                f"{path}: {given[key]} and {name} both give {COORDINATES[key[0]]}{' rates' if key[1] else ''}; "
                f"{CONSEQUENCE}. Keep one of them"
            )
        given[key] = name
    if list(names).count(TIME) != 1:
        raise MotionError(f"{path}: {TIME} must be there once; {CONSEQUENCE}. Name the column of the time {TIME}")
    for (coordinate, _), name in given.items():
        value = given.get((coordinate, False))
        stem = name.rpartition("_")[0]
        if value is None or value.rpartition("_")[0] != stem:
            unit = "m" if coordinate < 3 else "deg"
            raise MotionError(
                f"{path}: {name} has no {stem}_{unit} beside it; {CONSEQUENCE}. Add it, or leave {name} out"
            )
    for this, other in ((0, 1), (1, 0)):
        if (this, False) in given and (other, False) not in given:
            raise MotionError(
                f"{path}: {given[this, False]} has no {COORDINATES[other]}_m beside it; {CONSEQUENCE}. Give both, or "
                f"neither: the ship then follows ship.tow_speed and ship.heading_deg"
            )
    if not given:
        raise MotionError(f"{path}: has no column of motion beside {TIME}; {CONSEQUENCE}. Known: {', '.join(COLUMNS)}")
    return given


def _stretches(path: Path, lines: Sequence[int], time: np.ndarray, ship: Ship) -> list[slice]:
    """Rows between gaps. Raises MotionError for time that does not advance or not evenly, warns of gaps."""
    check_times(path, time, lambda k: f"{path}:{lines[k]}", FEWEST, LONGEST)
    steps = np.diff(time)
    period = float(np.median(steps))
    fraction = steps / period
    uneven = np.abs(fraction - np.maximum(1.0, np.round(fraction))) > UNEVEN
    if uneven.any():
        k = int(np.argmax(uneven))
        raise MotionError(
            f"{path}:{lines[k + 1]}: a step of {steps[k]:.6g} s is no whole number of periods of {period:.6g} s within "
            f"{100 * UNEVEN:g} %; {CONSEQUENCE}. Sample the motion evenly; rows may be left out"
        )
    ends = [*(np.flatnonzero(np.round(fraction) > 1.0) + 1).tolist(), len(time)]
    parts = [slice(a, b) for a, b in zip([0, *ends], ends)]
    for part in parts:
        if part.stop - part.start < FEWEST:
            raise MotionError(
                f"{path}:{lines[part.start]}: {part.stop - part.start} rows between two gaps, at least {FEWEST} are "
                f"needed; {CONSEQUENCE}. Fill the gaps, or leave these rows out"
            )
    if len(parts) > 1:
        k = int(np.argmax(steps))
        warnings.warn(
            f"{path}: {len(parts) - 1} gaps, the longest of {steps[k]:g} s after {time[k]:g} s (line {lines[k]}): gaps "
            f"above ship.max_gap = {ship.max_gap:g} s are taken up by a blend, shorter ones interpolated. Fill them "
            f"where the motion matters",
            MotionWarning,
            stacklevel=4,
        )
    return parts


def _within(
    path: Path, lines: Sequence[int], name: str, values: np.ndarray, shown: np.ndarray, of: tuple[Ship, float]
) -> None:
    """Raise MotionError where a coordinate is beyond what is taken of a ship."""
    (ship, height), k, column = of, COLUMNS[name].coordinate, COLUMNS[name]
    middle = ship.reference_height if k == 2 else 0.0
    maximum = (MAX_POSITION, MAX_POSITION, height, MAX_TURNS, MAX_PITCH, MAX_TURNS)[k]
    bad = np.abs(values - middle) > maximum
    if bad.any():
        i = int(np.argmax(bad))
        middle = 0.0 if name.startswith("heave") else middle
        low, high = (middle - maximum) / column.scale, (middle + maximum) / column.scale
        raise MotionError(
            f"{path}:{lines[i]}: {name} = {shown[i]:g} {column.unit} is outside [{low:g}, {high:g}] {column.unit}; "
            f"{CONSEQUENCE}. Check its unit{' and ship.reference_height' if k == 2 else ''}"
        )


def _ahead(path: Path, name: str, yaw: np.ndarray, ship: Ship) -> None:
    """Raise MotionError where the ship would go along ship.heading_deg and point elsewhere; yaw: rad."""
    mean = degrees(atan2(np.sin(yaw).mean(), np.cos(yaw).mean()))
    off = remainder(mean - ship.heading_deg, 360.0)
    if abs(off) > CRAB:
        raise MotionError(
            f"{path}: {name} has the mean {mean:.4g} deg and no x_m and y_m beside it: the ship would go along "
            f"ship.heading_deg = {ship.heading_deg:g} deg and point {abs(off):.3g} deg away from it, more than "
            f"{CRAB:g} deg; {CONSEQUENCE}. Set ship.heading_deg to {mean:.4g}, or give x_m and y_m too"
        )


def mean_track(t: np.ndarray, ship: Ship) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates [n, 6] and rates of the scene's mean track at times since its beginning."""
    yaw = radians(ship.heading_deg)
    value, rate = np.zeros((len(t), 6)), np.zeros((len(t), 6))
    rate[:, :2] = ship.tow_speed * cos(yaw), ship.tow_speed * sin(yaw)
    value[:, :2] = rate[:, :2] * t[:, None]
    value[:, 2], value[:, 5] = ship.reference_height, yaw
    return value, rate


def _sampled(
    t: np.ndarray, curves: dict[int, Curve], begin: int, ship: Ship, origin: tuple[float, float, float] | None
) -> Samples:
    """Rows without a gap, at their own times or every STEP where they are further apart; t: s since the beginning."""
    stamps = begin + np.round(t * SECOND).astype(np.int64)
    if np.median(np.diff(stamps)) > STEP:
        stamps = np.arange(stamps[0], stamps[-1] + 1, STEP)
    at = (stamps - begin) / SECOND
    value, rate = mean_track(at, ship)
    if origin is not None:
        value[:, :2] += origin[:2]
        value[:, 5] = origin[2]
    for k, curve in curves.items():
        value[:, k], rate[:, k] = curve(at), curve(at, 1)
    return Samples(stamps, value, rate)


def odometry_events(path: Samples, where: str) -> list[Event]:
    """Odometry messages; MotionError where speeds are beyond what is taken of a ship."""
    return list(stream_odometry(path, where))


def stream_odometry(path: Samples, where: str) -> Iterator[Event]:
    """The same, made one by one; MotionError before the first."""
    twist = np.column_stack(
        [
            np.einsum("nji,nj->ni", rotation(path.value[:, 3:]), path.rate[:, :3]),
            *body_rates(path.value[:, 3], path.value[:, 4], path.rate[:, 3:].T),
        ]
    )
    for what, values, maximum, unit in (
        ("speed", twist[:, :3], MAX_SPEED, "m/s"),
        ("angular rate", twist[:, 3:], MAX_RATE, "rad/s"),
    ):
        worst = np.abs(values).max(1)
        if worst.max() > maximum:
            i = int(np.argmax(worst > maximum))
            after = (path.time[i] - path.time[0]) / SECOND
            raise MotionError(
                f"{where}: {after:g} s after the beginning the {what} is {worst[i]:.4g} {unit} along an axis of the "
                f"ship, above {maximum:g} {unit}; {CONSEQUENCE}. Check units, and rows that jump"
            )
    turned = quaternion(path.value[:, 3:])
    for k in range(0, len(path.time), BLOCK):
        of = slice(k, k + BLOCK)
        rows = zip(path.time[of].tolist(), path.value[of, :3].tolist(), turned[of].tolist(), twist[of].tolist())
        for time, place, turn, rates in rows:
            yield Event(time, time, "odometry", odometry_bytes(time, place, turn, rates[:3], rates[3:]))
