"""Tables of numbers in CSV files: names of columns in the first line, # before comments, one finite number a cell.

Cells are apart by commas, semicolons or tabs; decimals by points, or by commas where these separate no cells. Numbers
are also those of Fortran (1.0D+00) and with thousands apart (1,234.5), where both signs show which is which.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from ...errors import CableSimError
from ...files import read_text

CONSEQUENCE = "nothing was simulated"
CELLS = "Commas separate cells, points decimals; or semicolons or tabs cells, points or commas decimals"
Line = tuple[int, list[str]]  # number in the file, cells with decimal points
DELIMITERS = (";", "\t", ",")
_EXPONENT = r"([eEdD][+-]?\d+)?\s*"
PLAIN = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)" + _EXPONENT, re.ASCII)
COMMA = re.compile(r"\s*[+-]?\d*,\d+" + _EXPONENT, re.ASCII)
# thousands apart, by decimal sign: such a number, and one that no decimal can be
GROUPED = {
    s: re.compile(rf"\s*[+-]?\d{{1,3}}({t}\d{{3}})+({s}\d*)?\s*", re.ASCII) for s, t in ((r"\.", ","), (",", r"\."))
}
PROOF = {s: re.compile(rf".*{t}\d{{3}}({t}|{s}).*") for s, t in ((r"\.", ","), (",", r"\."))}


class MotionError(CableSimError, ValueError):
    """Ship motion that cannot be used; the text names file, line, column, value, unit, bound and remedy."""


def head_of(path: Path, example: str) -> tuple[list[str], list[Line]]:
    """Names of the columns, and the lines below them; example: of the first line. Raises MotionError."""
    try:
        text = read_text(path, "utf-8-sig")
    except FileNotFoundError:
        raise MotionError(f"{path}: no such file; {CONSEQUENCE}. Give the path of a CSV file") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:  # ValueError: a NUL in the name
        raise MotionError(f"{path}: cannot be read as UTF-8 text ({error}); {CONSEQUENCE}. Save it as CSV") from None
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not kept:
        raise MotionError(f"{path}: is empty; {CONSEQUENCE}. The first line names the columns, such as {example}")
    heading = kept[0][1]
    delimiter = next((one for one in DELIMITERS if one in re.sub(r'"[^"]*"', "", heading)), ",")
    cells = [(i, _split(path, i, line, delimiter)) for i, line in kept]
    flat = [cell for _, row in cells[1:] for cell in row]
    comma = delimiter != "," and decimal_comma(flat)
    columns = [grouped((row[k] for _, row in cells[1:] if k < len(row)), comma) for k in range(len(cells[0][1]))]
    columns += [False] * max((len(row) for _, row in cells), default=0)
    below = [(i, [pointed(cell, comma, columns[k]) for k, cell in enumerate(row)]) for i, row in cells[1:]]
    return [_named(name) for name in cells[0][1]], below


def _split(path: Path, line: int, text: str, delimiter: str) -> list[str]:
    try:
        (cells,) = csv.reader([text], delimiter=delimiter)
    except (csv.Error, ValueError) as error:
        raise MotionError(f"{path}:{line}: is no row of a table ({error}); {CONSEQUENCE}. {CELLS}") from None
    return cells


def _named(name: str) -> str:
    """Name with its unit behind it: `heave [m]`, `heave (m)` and `heave, m` are heave_m."""
    found = re.fullmatch(r"\s*(\w+)\s*[,\[(]\s*([\w/°]+)\s*[\])]?\s*", name)
    return f"{found[1]}_{found[2].replace('/', 'p').replace('°', 'deg')}" if found else name.strip()


def decimal_comma(cells: Iterable[str]) -> bool:
    """Do more numbers have a decimal comma than a point?"""
    cells = list(cells)
    return sum(bool(COMMA.fullmatch(cell)) for cell in cells) > sum(
        "." in cell and bool(PLAIN.fullmatch(cell)) for cell in cells
    )


def grouped(cells: Iterable[str], comma: bool) -> bool:
    """Has a column numbers that can only be read with their thousands apart?"""
    sign = "," if comma else r"\."
    return any(GROUPED[sign].fullmatch(cell) and PROOF[sign].fullmatch(cell) for cell in cells)


def pointed(cell: str, comma: bool, thousands: bool = False) -> str:
    """A cell as `float` takes it, where it is a number; thousands: its column has them apart."""
    if thousands and GROUPED["," if comma else r"\."].fullmatch(cell):
        cell = cell.replace("." if comma else ",", "")
    if comma and COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    return re.sub("[dD]", "e", cell) if PLAIN.fullmatch(cell) else cell


def numbers_of(path: Path, names: Sequence[str], below: Sequence[Line]) -> tuple[list[int], np.ndarray]:
    """Line numbers of the rows, and their numbers [rows, columns]. Raises MotionError."""
    rows = []
    for i, cells in below:
        if len(cells) != len(names):
            raise MotionError(f"{path}:{i}: {len(cells)} cells under {len(names)} columns; {CONSEQUENCE}. {CELLS}")
        rows.append([_cell(path, i, name, cell) for name, cell in zip(names, cells)])
    return [i for i, _ in below], np.array(rows, float).reshape(-1, len(names))


def _cell(path: Path, line: int, name: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = float("nan")
    if not np.isfinite(number):
        if GROUPED[r"\."].fullmatch(cell):
            raise MotionError(
                f"{path}:{line}: {name} = {cell.strip()} may be thousands or decimals; {CONSEQUENCE}. Write it without "
                f"the comma, or separate cells by semicolons"
            )
        raise MotionError(
            f"{path}:{line}: {name} = {cell.strip() or 'nothing'} is no finite number; {CONSEQUENCE}. "
            f"Leave the whole row out, or fill it"
        )
    return number


def check_times(path: Path, time: np.ndarray, row: Callable[[int], str], fewest: int, longest: float) -> None:
    """Raise MotionError for too few times [s], for one that does not advance and for too long a span; row: what errors
    call the row of a number."""
    if len(time) < fewest:
        raise MotionError(
            f"{path}: has {len(time)} rows, at least {fewest} are needed; {CONSEQUENCE}. Give more of them"
        )
    good = np.diff(time) > 0.0
    if not good.all():
        k = int(np.argmin(good))
        raise MotionError(
            f"{row(k + 1)}: time_s = {time[k + 1]:.9g} s does not advance past {time[k]:.9g} s; {CONSEQUENCE}. Put the "
            f"rows in order of time, each time once"
        )
    if time[-1] - time[0] > longest:
        raise MotionError(
            f"{path}: {time[-1] - time[0]:g} s are more than {longest:g} s; {CONSEQUENCE}. Is time_s in seconds? Cut "
            f"the table into parts"
        )
