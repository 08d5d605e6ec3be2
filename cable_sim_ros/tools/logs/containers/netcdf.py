"""NetCDF 3 and 4 files: each dimension of time a source of its name, with the variables along it.

Times are those of CF (`seconds since 2014-08-01`), or of a variable named as a time; units are the units attributes.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from ....files import open_file
from ..formats import extra
from ..log import Log, LogError, Source
from .bounded import read_bounded
from .leaves import MAX_COLUMNS, MAX_ELEMENTS
from .table_times import numeric_clock

CLASSIC, HDF5 = (b"CDF\x01", b"CDF\x02"), b"\x89HDF\r\n\x1a\n"


def recognise(head: bytes, path: Path) -> bool:
    """By the first bytes of NetCDF 3, or of HDF5."""
    return head.startswith((*CLASSIC, HDF5))


def read(path: Path) -> Log:
    """Read a NetCDF file. LogError if xarray or h5netcdf is not there, or cannot read it."""
    return read_bounded(__name__, path)


def prepare() -> None:
    """Import the libraries, where they are there, and what they import when they read."""
    try:
        import xarray

        tiny = xarray.Dataset({"time": ("time", [0.0], {"units": "s"})})
        xarray.open_dataset(BytesIO(tiny.to_netcdf(engine="scipy")), engine="scipy", decode_times=False).close()
        import h5netcdf.legacyapi  # noqa: F401
        import h5py._hl.dims  # noqa: F401
    except ImportError:
        return


def read_here(path: Path) -> Log:
    """Read in this process, without bounds."""
    with open_file(path, "rb") as file:
        classic = file.read(4) in CLASSIC
    for module in ("xarray",) if classic else ("xarray", "h5netcdf", "h5py"):
        extra(module, path)
    import xarray

    log = Log(str(path), "netcdf", {}, 0)
    engine: Any = "scipy" if classic else "h5netcdf"
    with xarray.open_dataset(path, engine=engine, decode_times=False, cache=False) as data:
        times = {str(name): data.variables[name] for name in data.variables if data.variables[name].ndim == 1}
        for dimension in data.sizes:
            source = _source(log, data, str(dimension), times)
            if source is not None:
                log.sources[source.name] = source
                log.records += len(source)
        along = {str(d) for d in log.sources}
        rest = [str(n) for n, v in data.variables.items() if v.ndim and not along & set(map(str, v.dims))]
    if not log.sources:
        names = ", ".join(map(str, list(data.variables)[:12])) or "no variables"
        raise LogError(f"{path}: has no variable of time ({names}); nothing was read. Name one time, with CF units")
    if rest:
        log.notices.append(f"variables along no dimension of time are left out: {', '.join(rest[:12])}")
    return log


def _source(log: Log, data: Any, dimension: str, times: dict[str, Any]) -> Source | None:
    """The variables along a dimension that has a time; None for another one."""
    clocks: dict[bool, np.ndarray] = {}
    used = set()
    for name in sorted(times, key=lambda name: name != dimension):  # the coordinate first
        variable = times[name]
        if variable.dims != (dimension,) or variable.dtype.kind not in "iuf" or not variable.size:
            continue
        unit = str(variable.attrs.get("units", ""))
        clock = _since(variable, unit) if " since " in unit else numeric_clock(name, unit, variable.values)
        if clock is not None and clock[0] not in clocks:
            clocks[clock[0]] = clock[1]
            used.add(name)
    if not clocks:
        return None
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    left_out = []
    for key, variable in data.variables.items():
        name = str(key)
        if dimension not in variable.dims or name in used:
            continue
        others = variable.size // max(1, data.sizes[dimension])
        if variable.dtype.kind not in "iufb" or others > MAX_ELEMENTS or len(columns) + others > MAX_COLUMNS:
            left_out.append(name)
            continue
        rows = np.moveaxis(variable.values, variable.dims.index(dimension), 0)
        rows = rows.astype(np.float64).reshape(data.sizes[dimension], others)
        for k in range(others):
            column = name if others == 1 else f"{name}[{k}]"
            columns[column] = np.ascontiguousarray(rows[:, k])
            if variable.attrs.get("units"):
                units[column] = str(variable.attrs["units"])
    if left_out:
        log.notices.append(
            f"{dimension}: left out, without numbers or above {MAX_ELEMENTS} elements: {', '.join(left_out[:12])}"
        )
    return Source(dimension, "netcdf", clocks.get(True), clocks.get(False), columns, units)


def _since(variable: Any, unit: str) -> tuple[bool, np.ndarray] | None:
    """CF times as ns since 1970; None where they are none."""
    from xarray.coding.times import decode_cf_datetime

    try:
        times = decode_cf_datetime(variable.values, unit, variable.attrs.get("calendar"))
        if np.asarray(times).dtype.kind != "M" or np.isnat(times).any():
            return None
        micro = np.asarray(times, "datetime64[us]").astype(np.int64)
    except (ValueError, OverflowError, TypeError):
        return None
    if (np.abs(micro) > 7_200_000_000_000_000).any():  # beyond 2198
        return None
    return True, np.asarray(times, "datetime64[ns]").astype(np.int64)
