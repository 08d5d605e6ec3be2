"""The added mass of a body from a file: six rows of six in CSV or JSON, or a result of capytaine in NetCDF.

Axes are those of the body, x forward, y to port, z up, as capytaine has them. What is read stands in the scene from
then on, so that a recording does not need the file.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...files import open_file, read_text, regular
from ...physics.water import Water
from .document import FileOfKey

KEY = "added_matrix"
LARGEST_TEXT, LARGEST_RESULT = 1_000_000, 200_000_000  # bytes
CLASSIC, HDF5 = (b"CDF\x01", b"CDF\x02", b"CDF\x05"), b"\x89HDF\r\n\x1a\n"
MOST_PERIODS = 100_000
DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
DIMS = ("omega", "radiating_dof", "influenced_dof")
ALIKE = 0.01  # of the largest: frequencies whose added mass differs by less are those of a body far below the surface
ROWS = "Give six rows of six numbers, or a NetCDF file of capytaine"


class MatrixError(FileOfKey):
    """A file that gives no added mass."""

    def __init__(self, what: str, remedy: str = ROWS) -> None:
        super().__init__(what, remedy)


def with_matrices(data: Mapping[str, Any], origin: str) -> Mapping[str, Any]:
    """A scene as plain data, its added masses that are names of files read; origin: its file, whose folder they are
    from, where it is one. Raises MatrixError."""
    changed = dict(data)
    density = _density(data)
    for path in _places(data):
        *way, last = path
        block: Any = changed
        for part in way:
            block[part] = dict(block[part])
            block = block[part]
        try:
            block[last] = matrix_of(
                Path(os.path.dirname(origin) if os.path.isfile(origin) else "", block[last]), density
            )
        except MatrixError as error:
            error.path = path
            raise
    return changed


def _places(data: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    bodies = data.get("bodies")
    ways = [("towbody",), *(("bodies", name) for name in (bodies if isinstance(bodies, Mapping) else ()))]
    for way in ways:
        block: Any = data
        for part in way:
            block = block.get(part) if isinstance(block, Mapping) else None
        if isinstance(block, Mapping) and isinstance(block.get(KEY), str):
            yield (*way, KEY)


def _density(data: Mapping[str, Any]) -> float:
    water = data.get("water")
    given = water.get("density") if isinstance(water, Mapping) else None
    return float(given) if isinstance(given, (int, float)) else float(Water().density)


def matrix_of(path: Path, density: float) -> list[float]:
    """The 36 numbers of a file, row by row; a result of capytaine made that of water of this density [kg/m^3]."""
    try:
        size = regular(path).stat().st_size
        with open_file(path, "rb") as file:
            head = file.read(8)
        if head.startswith((*CLASSIC, HDF5)):
            _bounded(path, size, LARGEST_RESULT)
            return _of_capytaine(path, head == HDF5, density)
        _bounded(path, size, LARGEST_TEXT)
        text = read_text(path)
    except UnicodeDecodeError:
        raise MatrixError(f"= {path} is neither text in UTF-8 nor NetCDF") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise MatrixError(f"= {path}, a file that cannot be read ({why})", "Check name and permissions") from None
    return _of_json(path, text) if text.lstrip()[:1] in ("[", "{") else _of_rows(path, text)


def _bounded(path: Path, size: int, largest: int) -> None:
    if size > largest:
        raise MatrixError(f"= {path} has {size} bytes, above {largest}: no file of one added mass")


def _of_json(path: Path, text: str) -> list[float]:
    try:
        rows = json.loads(text)
    except (ValueError, RecursionError):
        raise MatrixError(f"= {path} is no JSON") from None
    rows = rows.get("added_mass") if isinstance(rows, dict) else rows
    if not isinstance(rows, list) or len(rows) != 6:
        raise MatrixError(f"= {path} has no six rows", "Give a list of six lists of six, alone or as added_mass")
    return _numbers(path, [(k + 1, row if isinstance(row, list) else [row]) for k, row in enumerate(rows)], "row ")


def _of_rows(path: Path, text: str) -> list[float]:
    lines = [(k, line.partition("#")[0].strip()) for k, line in enumerate(text.splitlines(), 1)]
    rows = [(k, re.split(r"\s*[,;]\s*|\s+", line)) for k, line in lines if line]
    if len(rows) != 6:
        raise MatrixError(f"= {path} has {len(rows)} rows of numbers, not six")
    return _numbers(path, rows, "line ")


def _numbers(path: Path, rows: list[tuple[int, list[Any]]], what: str) -> list[float]:
    found = list[float]()
    for k, row in rows:
        if len(row) != 6:
            raise MatrixError(f"= {path} has {len(row)} numbers in {what}{k}, not six", ROWS + ", with decimal points")
        for cell in row:
            try:
                number = float("nan") if isinstance(cell, bool) else float(cell)
            except (TypeError, ValueError):
                number = float("nan")
            if not np.isfinite(number):
                raise MatrixError(f"= {path} has {str(cell)[:40]!r} in {what}{k}, no finite number")
            found.append(number)
    return found


def _of_capytaine(path: Path, hdf5: bool, density: float) -> list[float]:
    """Of infinite frequency where it is there, else of the highest, where they are all alike."""
    try:
        xarray = import_module("xarray")
        import_module("h5netcdf" if hdf5 else "scipy")
    except ImportError as error:
        raise MatrixError(
            f"= {path} is NetCDF, read with {error.name}, which is not installed", "pip install 'cable_sim_ros[import]'"
        ) from None
    try:
        engine = "h5netcdf" if hdf5 else "scipy"
        with xarray.open_dataset(path, engine=engine, decode_times=False, cache=False) as data:
            return _of_result(path, data, density)
    except MatrixError:
        raise
    except Exception as error:  # of a damaged file a library raises what it likes
        raise MatrixError(f"= {path} is damaged NetCDF ({str(error)[:80]})", "Write it again") from None


def _of_result(path: Path, data: Any, density: float) -> list[float]:
    if "added_mass" not in data.variables:
        _no_result(path, "has no added_mass")
    added = data["added_mass"]
    missing = [name for name in DIMS[1:] if name not in added.dims or name not in data.variables]
    if missing or added.ndim > 3 or added.dtype.kind not in "iuf":
        _no_result(path, f"has added_mass of {', '.join(map(str, added.dims)) or 'no dimensions'}")
    if added.ndim == 2:
        added = added.expand_dims("omega")
    if "omega" not in added.dims or added.sizes["omega"] > MOST_PERIODS or max(added.shape[1:]) > 600:
        _no_result(path, f"has added_mass of {', '.join(f'{name}: {n}' for name, n in added.sizes.items())}")
    added = added.transpose(*DIMS)
    order = [_order(path, name, data[name].values) for name in DIMS[1:]]
    values = np.asarray(added.values, float)[:, order[0]][:, :, order[1]]
    omega = (
        np.asarray(data["omega"].values, float).reshape(-1)
        if "omega" in data.variables
        else np.full(len(values), np.inf)
    )
    use = ~np.isnan(omega) & np.isfinite(values).all(axis=(1, 2))
    if not use.any():
        _no_result(path, "has no frequency with 36 finite numbers")
    highest = int(np.argmax(np.where(use, omega, -np.inf)))
    chosen = values[highest]
    if np.isfinite(omega[highest]):
        apart = float(np.abs(values[use] - chosen).max() / max(np.abs(chosen).max(), 1e-300))
        if apart > ALIKE:
            raise MatrixError(
                f"= {path}: added mass differs by {apart:.2g} of its largest between {omega[use].min():.3g} and "
                f"{omega[use].max():.3g} rad/s (limit {ALIKE:g}): that is near the surface, and a body has one here",
                "Compute it with omega=inf, or with free_surface=inf",
            )
    rho = data["rho"].values if "rho" in data.variables else data.attrs.get("rho", density)
    rho = np.asarray(rho, float).reshape(-1)
    if rho.size != 1 or not 1.0 <= rho[0] <= 20000.0:
        _no_result(path, "has no one density rho in kg/m^3")
    return [float(x) for x in (density / rho[0] * chosen).reshape(-1)]


def _order(path: Path, name: str, labels: np.ndarray) -> list[int]:
    """Where the six degrees of freedom of one body stand."""
    texts = [x.decode("utf-8", "replace") if isinstance(x, bytes) else str(x) for x in np.asarray(labels).reshape(-1)]
    short = [text.strip().rpartition("__")[2].lower() for text in texts]
    if sorted(short) != sorted(DOFS):
        _no_result(path, f"has {name} {', '.join(texts[:13])[:120]}: not {', '.join(DOFS)} of one body")
    return [short.index(dof) for dof in DOFS]


def _no_result(path: Path, what: str) -> NoReturn:
    raise MatrixError(
        f"= {path} {what}", "Give a result of capytaine of one body with all six of its degrees of freedom, real"
    )
