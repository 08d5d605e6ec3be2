"""A recorded run into a file of another program, whole or not at all, in four formats.

Each writer puts a Content into one file, every value as it is, to the bit.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import NO_PLACE, told_as
from ...files import open_file, whole
from ...physics.tick_output import Flag
from ...runs.field_manual import MEANING
from .content import AXES, TABLE_MEANING, TABLES, Content, ExportError, Table, gather

CF = "CF-1.11"
SINCE = "nanoseconds since 1970-01-01T00:00:00Z"
STANDARD_NAME = {  # of the CF table, where it has the quantity with this sign
    "time": "time",
    "surface_elevation": "sea_surface_height_above_mean_sea_level",
    "depth_reading": "depth",
    "altitude_reading": "height_above_sea_floor",
    "mru_surge": "platform_surge_fore",
    "mru_sway": "platform_sway_port",
    "mru_heave": "platform_heave_up",
    "mru_surge_rate": "platform_surge_rate_fore",
    "mru_sway_rate": "platform_sway_rate_port",
    "mru_heave_rate": "platform_heave_rate_up",
    "mru_roll": "platform_roll_starboard_down",
    "mru_pitch": "platform_pitch_fore_down",
    "mru_roll_rate": "platform_roll_rate_starboard_down",
    "mru_pitch_rate": "platform_pitch_rate_fore_down",
}
UDUNITS = {"m/s": "m s-1", "m/s^2": "m s-2", "rad/s": "rad s-1", "N m": "N m", "N/m": "N m-1"}
MATLAB_NAME = 63  # characters
MATLAB_BYTES = 2**31 - 2**20  # of one variable in a MAT file of level 5
ROWS = 65536  # of a CSV file or a group of Parquet at a time

NEEDS = {"nc": ("xarray", "h5netcdf"), "parquet": ("pyarrow",)}


def write_csv(content: Content, path: Path, table: Table | None = None) -> None:
    """Comment lines with #, one header line `name [unit]`, then numbers that read back to the same bits.

    table: in place of the ticks, in long form: a row for each point of each instant.
    """
    notes = [f"{key}: {line}" for key, text in content.provenance.items() for line in text.splitlines() or [""]]
    if table is not None:
        of = f"of the recording {content.provenance['recording']}, scene {content.provenance['scene']}"
        notes = [f"{table.name}: {TABLE_MEANING[table.name]}", of]
    columns = _columns(content, table)
    with open_file(path, "w", encoding="utf-8", newline="\n") as file:
        for note in notes:
            file.write(f"# {note}\n")
        file.writelines(f"# column {name} [{unit}]: {meaning}\n" for name, unit, _, meaning in columns)
        file.write(",".join(f"{name} [{unit}]" for name, unit, _, _ in columns) + "\n")
        for begin in range(0, len(columns[0][2]), ROWS):
            parts = [map(repr, values[begin : begin + ROWS].tolist()) for _, _, values, _ in columns]
            file.writelines(",".join(row) + "\n" for row in zip(*parts))


def write_parquet(content: Content, path: Path, table: Table | None = None) -> None:
    """One column a number, with unit and meaning in its metadata, provenance in that of the file; table: as in CSV."""
    columns, said = _columns(content, table), content.provenance
    said = said if table is None else said | {"table": TABLE_MEANING[table.name]}
    arrow, parquet = need("pyarrow", "parquet"), need("pyarrow.parquet", "parquet")
    schema = arrow.schema(
        [
            arrow.field(name, arrow.from_numpy_dtype(values.dtype), False, {"unit": unit, "meaning": meaning})
            for name, unit, values, meaning in columns
        ],
        said,
    )
    with parquet.ParquetWriter(path, schema) as writer:
        for begin in range(0, max(len(columns[0][2]), 1), ROWS):
            parts = [np.ascontiguousarray(values[begin : begin + ROWS]) for _, _, values, _ in columns]
            writer.write_table(arrow.Table.from_arrays([arrow.array(part) for part in parts], schema=schema))


def write_netcdf(content: Content, path: Path) -> None:
    """NetCDF-4 after CF: time with units and calendar, vectors along xyz, tables padded with nan along their points."""
    xarray = need("xarray", "nc")
    need("h5netcdf", "nc")
    values: dict[str, Any] = {}
    for field in content.fields:
        axes = ("".join(field.axes),) if field.axes else ()
        values[field.name] = (("time", *axes), field.values, _cf(field.name, field.unit, field.meaning))
    if "status" in values:
        masks = np.array([int(flag) for flag in Flag if flag], np.int64)
        values["status"][2].update(flag_masks=masks, flag_meanings=" ".join(str(flag.name) for flag in Flag if flag))
    for components in AXES.values():
        name = "".join(components)
        if any(name in dims for dims, _, _ in values.values()):
            values[name] = ((name,), np.array(components), {"long_name": "component"})
    for table in content.tables:
        values |= _cf_table(table)
    said = {"Conventions": CF, "title": f"Simulated cable tow, scene {content.provenance['scene']}"}
    said |= {"source": content.provenance["exported_by"], "history": "cable-sim export"}
    said |= {_name(key): text for key, text in content.provenance.items()}
    coords: dict[str, Any] = {name: values.pop(name) for name in ("time", "xyz", "xyzw") if name in values}
    coords |= {name: values.pop(name) for name in list(values) if name.endswith("_time") and name[:-5] in TABLE_MEANING}
    dataset = xarray.Dataset(values, coords, said)
    encoding: dict[str, Any] = {name: {"_FillValue": None} for name in dataset.variables}
    for table in content.tables:
        for column, _ in table.columns:
            encoding[f"{table.name}_{column}"] = {"_FillValue": np.nan}
    dataset.to_netcdf(path, engine="h5netcdf", encoding=encoding)


def write_matlab(content: Content, path: Path) -> None:
    """Structs: ticks, units and meanings with the same fields, provenance, and one for each table."""
    from scipy.io import savemat

    groups: dict[str, Any] = {"ticks": {field.name: field.values for field in content.fields}}
    groups["units"] = {field.name: field.unit for field in content.fields}
    groups["meanings"] = {field.name: field.meaning for field in content.fields}
    groups["provenance"] = {_name(key): text for key, text in content.provenance.items()}
    for table in content.tables:
        padded = table.padded()
        own: dict[str, Any] = {"time": table.times, "points": np.diff(table.begin)}
        own |= {name: padded[:, :, k] for k, (name, _) in enumerate(table.columns)}
        groups[table.name] = own | {"units": dict((("time", "ns"), ("points", "1"), *table.columns))}
    for name, group in groups.items():
        size = sum(v.nbytes for v in group.values() if isinstance(v, np.ndarray))
        if size > MATLAB_BYTES:
            raise ExportError(
                f"{path.name}: the struct {name} takes {size / 1e9:.3g} GB, and a MAT file holds at most "
                f"{MATLAB_BYTES / 1e9:.3g} GB a variable; nothing was written. Take fewer --fields, a longer --every, "
                f"or --format nc"
            )
    with open_file(path, "wb") as file:
        savemat(file, groups, long_field_names=True, oned_as="column")


WRITERS: dict[str, Callable[..., None]] = {
    "csv": write_csv,
    "nc": write_netcdf,
    "parquet": write_parquet,
    "mat": write_matlab,
}
APART = ("csv", "parquet")  # a table has a file of its own


def need(module: str, form: str) -> Any:
    """The module of the extra `export`. ExportError where it cannot be imported."""
    after = "; nothing was written. pip install 'cable_sim_ros[export]', or take --format csv or mat"
    with told_as(ExportError, f"--format {form} needs {module}, which cannot be imported", after, ImportError):
        return import_module(module)


def _columns(content: Content, table: Table | None) -> list[tuple[str, str, np.ndarray, str]]:
    """Name, unit, values and meaning of each column of the ticks, or of a table in long form."""
    if table is None:
        return [column for field in content.fields for column in field.columns()]
    times, points = table.long()
    return [
        ("time", "ns", times, "simulation time"),
        ("point", "1", points, "number of the row within its instant"),
        *((name, unit, table.rows[:, k], MEANING[name]) for k, (name, unit) in enumerate(table.columns)),
    ]


def _cf(name: str, unit: str, meaning: str) -> dict[str, Any]:
    if name == "time":
        return {"standard_name": "time", "units": SINCE, "calendar": "proleptic_gregorian", "long_name": meaning}
    said = {"units": UDUNITS.get(unit, unit), "long_name": meaning}
    return said | ({"standard_name": STANDARD_NAME[name]} if name in STANDARD_NAME else {})


def _cf_table(table: Table) -> dict[str, Any]:
    when, point, padded = f"{table.name}_time", f"{table.name}_point", table.padded()
    said: dict[str, Any] = {when: ((when,), table.times, _cf("time", "", f"time of the {table.name}"))}
    count = {"units": "1", "long_name": f"rows that are filled: {TABLE_MEANING[table.name]}"}
    said[f"{table.name}_points"] = ((when,), np.diff(table.begin), count)
    for k, (name, unit) in enumerate(table.columns):
        said[f"{table.name}_{name}"] = ((when, point), padded[:, :, k], _cf("", unit, MEANING[name]))
    return said


def _name(key: str) -> str:
    """A key as a name that NetCDF and MATLAB take."""
    plain = re.sub(r"\W", "_", key, flags=re.ASCII)
    return (plain if plain[:1].isalpha() else f"k_{plain}")[:MATLAB_NAME]


class Exported(NamedTuple):
    """What was written: files, tick outputs, columns of one number, verdict of the run."""

    files: tuple[Path, ...]
    ticks: int
    columns: int
    verdict: str


def export(
    run: str | os.PathLike,
    out: str | os.PathLike,
    form: str | None = None,
    fields: Sequence[str] = (),
    every: float | None = None,
    tables: Sequence[str] = (),
    force: bool = False,
) -> Exported:
    """Write a recording, or the folder of a run, to `out`. form: csv, nc, parquet, mat; none: by the suffix.

    Raises ExportError, BagError, ResourceError.
    """
    out = Path(out)
    form = form or out.suffix.lower().removeprefix(".")
    if form not in WRITERS:
        raise ExportError(
            f"--out {out}: its ending says no format; nothing was written. Give a file that ends in "
            f"{', '.join(f'.{name}' for name in WRITERS)}, or --format"
        )
    for name in tables:
        if name not in TABLES:
            known = ", ".join(TABLES)
            raise ExportError(f"--tables {name}: there is no such table; nothing was written. Known: {known}")
    for module in NEEDS.get(form, ()):
        need(module, form)
    tables = list(dict.fromkeys(tables))
    write = WRITERS[form]
    beside = {name: out.with_name(f"{out.stem}.{name}{out.suffix}") for name in tables if form in APART}
    for path in (out, *beside.values()):
        _free(path, force)
    content = gather(run, fields, every, tables)
    _whole(out, partial(write, content))
    for table in content.tables if beside else ():
        _whole(beside[table.name], partial(write, content, table=table))
    columns = sum(len(field.axes) or 1 for field in content.fields)
    return Exported((out, *beside.values()), content.ticks, columns, content.provenance["verdict"])


def _free(path: Path, force: bool) -> None:
    if path.is_dir():
        raise ExportError(f"--out {path}: is a folder; nothing was written. Give the name of a file in it")
    if path.exists() and not force:
        raise ExportError(
            f"--out {path}: is there already; nothing was written. Give another name, or --force to replace it"
        )


def _whole(path: Path, write: Callable[[Path], None]) -> None:
    """Write it, so that a full disk leaves no half of it."""
    after = "; what was there before is as it was. Give a file in a folder that is there, on a disk with room"
    with told_as(ExportError, f"--out {path}: cannot be written", after, NO_PLACE), whole(path) as part:
        write(part)
