"""A table of measured tows, a row each, and the map that says what its columns mean: YAML, checked as scenes are.

A row that cannot be a tow (shorter wire than depth, an angle beyond 90 deg) is left out with its reason; the others are
judged.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from enum import StrEnum
from math import inf, isfinite, nan, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import CableSimError
from ...io.scenes.document import Document, SceneError, find_tow_map, find_tow_table, shipped_tows
from ...io.sources.csv_table import Line, head_of
from ...physics.parameter import REQUIRED, Block, choice, quantity
from ...sim.problem import Problem
from ..logs.mapping.units import UNITS, named, nearest
from .series import LONGEST_WIRE, SHORTEST, SPEEDS, Series, SeriesError, Signal, read_series

EXAMPLE = "tows: my cruises"
CONSEQUENCE = "nothing was simulated"
MOST = 5000  # rows
RATES = (0.005, 5.0)  # m/s, of a winch
BESIDE = 0.05  # share of wire and depth by a series, by which the row's own may be another
DEEPER = 1.02  # depth over wire at most: counters and recorders have errors
NOTHING = {"", "nan", "na", "n/a", "null", "none", "-", "--"}


class TowsError(CableSimError, ValueError):
    """A table of tows that cannot be used: what, why, remedy."""


class TowsMapError(SceneError):
    """A map of a table of tows that cannot be used; every problem in one text each."""


class WireFrom(StrEnum):
    """Where the counter of the wire is zero."""

    WATER = "water"  # with the towbody at the water surface
    SHEAVE = "sheave"  # with the towbody at the sheave


class Column(Block):
    field: str | tuple[str, ...] = choice(
        REQUIRED, "column of the table, or several that measure the same: their mean counts"
    )
    unit: str = choice(REQUIRED, "of the column, a name of docs/mapping_keys.md#units")
    factor: float = quantity(1.0, "1", -1e9, 1e9, "on the values, in the unit; not 0")
    over: str = choice("", "column of seconds that the value is divided by: counts of a flow meter")
    scaled: bool = choice(False, "a speed whose scale is fitted too: a flow meter within a net")
    error: float | None = quantity(
        None, "1", None, 1e6, "standard deviation of a speed, in the unit; none: found from the tows", above=0.0
    )


class SeriesColumns(Block):
    field: str = choice(REQUIRED, "column of the table: CSV file in its folder; empty: no series")
    wire: Column = choice(REQUIRED, "m: wire out, a column of the file, as the others")
    speed: Column | None = choice(None, "m/s: of the ship, in place of the first that is not scaled")
    depth: Column | None = choice(None, "m: its largest value in place of that of the table")


class TowsMap(Block):
    tows: str = choice(REQUIRED, "name of the map")
    about: str = choice("", "what the table is, and where its conventions come from")
    wire_from: WireFrom = choice(REQUIRED, "where the counter of the wire is zero: water or sheave")
    name: str = choice("", "column that names a tow; empty: the line of the file")
    group: str = choice("", "column of what tows have in common, a cruise; empty: none")
    begin: float = quantity(4.0, "m", 0.5, 1000.0, "wire in the water where the simulated pay-out begins")
    stays: float = quantity(5.0, "s", 0.0, 3600.0, "time between pay-out and haul, where no column hold is")
    wire: Column | None = choice(None, "m: largest wire out; needed without series")
    rate_out: Column | None = choice(None, "m/s: of the pay-out; needed without series")
    rate_in: Column | None = choice(None, "m/s: of the haul; none: that of the pay-out")
    hold: Column | None = choice(None, "s: time at the largest wire out")
    speeds: dict[str, Column] = choice(
        {}, "m/s, by any name: ship or net through the water, each with an error of its own"
    )
    angle: Column | None = choice(None, "rad: of the wire at the sheave, from the vertical")
    depth: Column | None = choice(None, "m: largest depth reached")
    bottom: Column | None = choice(None, "m: depth of the water")
    series: SeriesColumns | None = choice(None, "tows over time, a file each")

    @property
    def readings(self) -> dict[str, Column]:
        """Speeds by name; that of the series, where it is the only one that is not scaled."""
        own = None if self.series is None else self.series.speed
        return self.speeds if own is None or self.steady else {**self.speeds, "series": own}

    @property
    def steady(self) -> str:
        """Name of the first speed that is not scaled; "": none."""
        return next((name for name, column in self.speeds.items() if not column.scaled), "")


WORDS = {"wire": "m", "rate_out": "m/s", "rate_in": "m/s", "hold": "s", "angle": "rad", "depth": "m", "bottom": "m"}


class Tow(NamedTuple):
    """A row: name, group ("": none), wire [m] from the water surface, rates and hold [m/s, s], speeds [m/s] by name,
    angle [rad], depth and bottom [m]; NaN where the table has nothing; series: None: the row's own numbers."""

    name: str
    group: str
    wire: float
    rate_out: float
    rate_in: float
    hold: float
    speeds: dict[str, float]
    angle: float
    depth: float
    bottom: float
    series: Series | None = None


class Table(NamedTuple):
    """Tows of a table in its order; left: rows that are none of them, a line each; notes: of readings left out."""

    path: str
    tows: list[Tow]
    left: list[str]
    notes: list[str]


def _columns(made: TowsMap) -> Iterator[tuple[str, str, Column]]:
    """(key, SI unit, column) of all columns of a map."""
    for word, unit in WORDS.items():
        column = getattr(made, word)
        if column is not None:
            yield word, unit, column
    for name, column in made.speeds.items():
        yield f"speeds.{name}", "m/s", column


def _problems(made: TowsMap) -> Iterator[Problem]:
    for key in ("wire", "rate_out"):
        if getattr(made, key) is None and made.series is None:
            yield Problem(key, "is missing, and so is series: no row would be a tow", "Give one, docs/tows.md")
    if not made.readings:
        yield Problem("speeds", "is empty: a tow without a speed cannot be simulated", "Give one, docs/tows.md")
    for key, dimension, column in _columns(made):
        yield from _of_column(key, dimension, column)
    if made.readings and all(column.scaled for column in made.readings.values()):
        text = "are all scaled: no speed says how fast the tow was"
        yield Problem("speeds", text, "Give one without `scaled`, such as the ship's")
    if made.hold is not None and "stays" in made.model_fields_set:
        yield Problem("stays", "has no effect beside the column hold", "Leave one of the two out")
    if made.series is not None and not made.series.field:
        yield Problem("series.field", "names no column", "Give that of the files' names in the table")
    for key, dimension, column in _of_series(made):
        yield from _of_column(f"series.{key}", dimension, column)
        for name in sorted(column.model_fields_set - {"field", "unit", "factor"}):
            yield Problem(f"series.{key}.{name}", "is of columns of the table, not of a series", "Leave it out")
        if not isinstance(column.field, str):
            yield Problem(f"series.{key}.field", "names several columns, and a series is of one", "Give one name")


def _of_series(made: TowsMap) -> Iterator[tuple[str, str, Column]]:
    """(key, SI unit, column) of the files of series."""
    for word, unit in (("wire", "m"), ("speed", "m/s"), ("depth", "m")):
        column = None if made.series is None else getattr(made.series, word)
        if column is not None:
            yield word, unit, column


def _of_column(key: str, dimension: str, column: Column) -> Iterator[Problem]:
    speed, unit = dimension == "m/s", named(column.unit)
    wanted = "m" if column.over else dimension
    has = "s" if column.unit == "s" else None if unit is None else UNITS[unit].dimension
    if has is None:
        yield Problem(f"{key}.unit", f"= {column.unit!r:.20} is no unit that is known", nearest(column.unit, wanted))
    elif has != wanted:
        text = f"= {column.unit} does not fit: {key} is in {wanted}, {column.unit} in {has}"
        yield Problem(f"{key}.unit", text, nearest(column.unit, wanted))
    if column.over and not speed:
        yield Problem(f"{key}.over", "divides by a time what is no speed", "Leave it out")
    if column.factor == 0.0:
        yield Problem(f"{key}.factor", "= 0 would make every value the same", "Give another number")
    if column.scaled and not speed and not key.endswith("depth"):
        yield Problem(f"{key}.scaled", "is of speeds and the depth alone", "Leave it out")
    if column.error is not None and (column.scaled or not speed):
        yield Problem(f"{key}.error", "is of a speed that is not scaled: others are found", "Leave it out")
    if not column.field or any(not one for one in fields_of(column)):
        yield Problem(f"{key}.field", "names no column", "Give its name in the table")


def fields_of(column: Column) -> tuple[str, ...]:
    """Names of the columns of the table that a column of a map is made of."""
    return (column.field,) if isinstance(column.field, str) else column.field


MAPS = Document(
    TowsMap, "a map of a table of tows", "map", EXAMPLE, find_tow_map, shipped_tows, _problems, error=TowsMapError
)
load_map = MAPS.load  # of a YAML file or of the name of a shipped one; TowsMapError with every problem of the file


def factor_of(column: Column) -> float:
    """Factor of a column to SI."""
    unit = named(column.unit)
    return column.factor * (1.0 if unit is None else UNITS[unit].factor)


def error_of(column: Column) -> float | None:
    """Standard deviation of a reading in SI; None: not stated."""
    return None if column.error is None else column.error * abs(factor_of(column) / column.factor)


def read_tows(
    path_or_name: str | os.PathLike, made: TowsMap, height: float, group: str = "", max_rate: float = inf
) -> Table:
    """Tows of a CSV table. height: of the sheave over the water [m]; group: column in place of that of the map;
    max_rate: of the winch [m/s], which a series may not run beyond.

    Raises TowsError with file, column and remedy; MotionError (io/sources/csv_table.py) for a file that is no table.
    """
    path = find_tow_table(path_or_name)
    names, lines = head_of(path, "tow,wire_m,rate_m_min,speed_kn,angle_deg,depth_m")
    by = group or made.group
    wanted = {key: [*fields_of(column), *filter(None, [column.over])] for key, _, column in _columns(made)}
    own = "" if made.series is None else made.series.field
    wanted |= {key: [name] for key, name in (("name", made.name), ("group", by), ("series", own)) if name}
    for key, columns in wanted.items():
        for name in columns:
            if names.count(name) != 1:
                what = "stands twice" if name in names else "is none of its columns"
                raise TowsError(
                    f"{path}: {key} is read from {name!r:.60}, which {what}; {CONSEQUENCE}. Its columns are "
                    f"{', '.join(names[:40])}"
                )
    if not lines or len(lines) > MOST:
        raise TowsError(f"{path}: has {len(lines)} rows below its names; {CONSEQUENCE}. Give 1 to {MOST} tows")
    table = Table(str(path), [], [], [])
    for line in lines:
        _take(table, made, names, line, by, height, max_rate)
    if not table.tows:
        raise TowsError(f"{path}: none of its {len(lines)} rows is a tow ({table.left[0]}); {CONSEQUENCE}. See the map")
    return table


def _take(
    table: Table, made: TowsMap, names: Sequence[str], line: Line, by: str, height: float, max_rate: float
) -> None:
    """Put a row into the table, or the reason why it is no tow."""
    number, cells = line
    if len(cells) != len(names):
        table.left.append(f"line {number}: {len(cells)} cells under {len(names)} columns")
        return
    row = dict(zip(names, cells))
    name = row[made.name].strip()[:60] if made.name else ""
    where = f"line {number}, {name}" if name else f"line {number}"
    values = dict.fromkeys((*WORDS, *(f"speeds.{key}" for key in made.readings)), nan)
    for key, _, column in _columns(made):
        values[key], bad = _value(row, column)
        if bad:
            table.notes.append(f"{where}: {key} = {bad!r:.20} is no number, and counts as missing")
    zero = height if made.wire_from is WireFrom.SHEAVE else 0.0
    tow = Tow(
        name or f"line {number}",
        row[by].strip()[:60] if by else "",
        values["wire"] - zero,
        values["rate_out"],
        values["rate_in"] if isfinite(values["rate_in"]) else values["rate_out"],
        values["hold"] if isfinite(values["hold"]) else made.stays,
        {key: values[f"speeds.{key}"] for key in made.readings},
        values["angle"],
        values["depth"],
        values["bottom"],
    )
    if made.series is not None and (file := row[made.series.field].strip()).lower() not in NOTHING:
        path = _beside(table.path, file, where)
        signals = {
            key: Signal(str(column.field), named(column.unit) or "", factor_of(column), zero * (key == "wire"))
            for key, _, column in _of_series(made)
        }
        try:
            series = read_series(path, signals, made.begin, height, max_rate)
        except SeriesError as error:
            table.left.append(f"{where}: {file:.100}: {error}")
            return
        table.notes.extend(f"{where}: {file:.100}: {note}" for note in series.notes)
        tow = _over_time(tow, series, made.steady or "series", where, table.notes)
    why = _no_tow(tow, made)
    if why:
        table.left.append(f"{where}: {why}")
        return
    for key, value in tow.speeds.items():
        if made.readings[key].scaled and not (SPEEDS[0] <= value <= SPEEDS[1] or value != value):
            table.notes.append(f"{where}: speeds.{key} = {value:.4g} m/s is no speed of a tow, and counts as missing")
            tow.speeds[key] = nan
    if tow.depth > DEEPER * tow.bottom:
        table.notes.append(f"{where}: depth = {tow.depth:.4g} m is below the ground at {tow.bottom:.4g} m")
    table.tows.append(tow)


def _beside(table: str, name: str, where: str) -> Path:
    """Path of a file in the folder of a table. Raises TowsError for one elsewhere: a table may come from anybody."""
    folder = Path(table).parent.resolve()
    try:
        path = (folder / name).resolve()
    except (OSError, RuntimeError, ValueError):  # a loop of links, a NUL
        path = folder.parent
    if not path.is_relative_to(folder):
        raise TowsError(
            f"{table}: {where}: series = {name!r:.100} is outside the folder of the table; {CONSEQUENCE}. Put it there"
        )
    return path


def _over_time(tow: Tow, series: Series, speed: str, where: str, notes: list[str]) -> Tow:
    """The tow with what a series has in place of its own numbers; speed: name of the reading that is the ship's."""
    rate = float(np.abs(series.rates).max())
    own = {"wire": (tow.wire, float(series.wire.max())), "depth": (tow.depth, series.depth)}
    for key, (one, other) in own.items():
        if abs(one - other) > BESIDE * other:
            notes.append(f"{where}: {key} = {one:.4g} m, and {other:.4g} m by its series, which counts")
    if isfinite(series.mean):
        tow.speeds[speed] = series.mean
    depth = series.depth if isfinite(series.depth) else tow.depth
    return tow._replace(wire=own["wire"][1], rate_out=rate, rate_in=rate, depth=depth, series=series)


def _value(row: dict[str, str], column: Column) -> tuple[float, str]:
    """Value of a column in SI, NaN where there is none; and a cell that is no number."""
    found = []
    for name in (*fields_of(column), *filter(None, [column.over])):
        cell = row[name].strip()
        try:
            found.append(nan if cell.lower() in NOTHING else float(cell))
        except ValueError:
            return nan, cell
    if column.over:
        seconds = found.pop()
        found = [value / seconds if seconds > 0.0 else nan for value in found]
    kept = [value for value in found if isfinite(value)]
    return (factor_of(column) * float(np.mean(kept)) if kept else nan), ""


def _no_tow(tow: Tow, made: TowsMap) -> str:
    """Why a row cannot be simulated or judged; "" where it can."""
    if not isfinite(tow.wire):
        return "has no wire out"
    least = made.begin + SHORTEST
    if not least <= tow.wire <= LONGEST_WIRE:
        return f"wire = {tow.wire:.4g} m in the water is outside [{least:g}, {LONGEST_WIRE:g}] m, from `begin` on"
    for key, rate in (("rate_out", tow.rate_out), ("rate_in", tow.rate_in)):
        if tow.series is None and not RATES[0] <= rate <= RATES[1]:
            return f"{key} = {rate:.4g} m/s is outside [{RATES[0]:g}, {RATES[1]:g}] m/s: is its unit right?"
    known = {key: value for key, value in tow.speeds.items() if isfinite(value)}
    if not any(not made.readings[key].scaled for key in known):
        return "has no speed"
    for key, value in known.items():
        if not made.readings[key].scaled and not SPEEDS[0] <= value <= SPEEDS[1]:
            return f"speeds.{key} = {value:.4g} m/s is outside [{SPEEDS[0]:g}, {SPEEDS[1]:g}] m/s: is its unit right?"
    if isfinite(tow.hold) and not 0.0 <= tow.hold <= 86_400.0:
        return f"hold = {tow.hold:.4g} s is outside [0, 86400] s"
    if isfinite(tow.angle) and not 0.0 <= tow.angle < 0.5 * pi:
        return f"angle = {np.degrees(tow.angle):.4g} deg from the vertical is outside [0, 90)"
    if isfinite(tow.depth) and not 0.0 < tow.depth <= DEEPER * tow.wire:
        return f"depth = {tow.depth:.4g} m is not within the {tow.wire:.4g} m of wire in the water"
    return ""
