"""Tables of numbers in CSV files: names of columns in the first line, # before comments, one finite number a cell."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import CableSimError

CONSEQUENCE = "nothing was simulated"
Line = tuple[int, str]  # number in the file, text


class MotionError(CableSimError, ValueError):
    """Ship motion that cannot be used; the text names file, line, column, value, unit, bound and remedy."""


def head_of(path: Path, example: str) -> tuple[list[str], list[Line]]:
    """Names of the columns, and the lines below them; example: of the first line. Raises MotionError."""
    try:
        text = path.read_text("utf-8-sig")
    except FileNotFoundError:
        raise MotionError(f"{path}: no such file; {CONSEQUENCE}. Give the path of a CSV file") from None
    except (OSError, UnicodeDecodeError, ValueError) as error:  # ValueError: a NUL in the name
        raise MotionError(f"{path}: cannot be read as UTF-8 text ({error}); {CONSEQUENCE}. Save it as CSV") from None
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not kept:
        raise MotionError(f"{path}: is empty; {CONSEQUENCE}. The first line names the columns, such as {example}")
    return [name.strip() for name in kept[0][1].split(",")], kept[1:]


def numbers_of(path: Path, names: Sequence[str], below: Sequence[Line]) -> tuple[list[int], np.ndarray]:
    """Line numbers of the rows, and their numbers [rows, columns]. Raises MotionError."""
    rows = []
    for i, line in below:
        try:
            (cells,) = csv.reader([line])
        except (csv.Error, ValueError) as error:
            raise MotionError(
                f"{path}:{i}: is no row of a table ({error}); {CONSEQUENCE}. Commas separate cells, points decimals"
            ) from None
        if len(cells) != len(names):
            raise MotionError(
                f"{path}:{i}: {len(cells)} cells under {len(names)} columns; {CONSEQUENCE}. Commas separate cells, "
                f"points decimals"
            )
        rows.append([_cell(path, i, name, cell) for name, cell in zip(names, cells)])
    return [i for i, _ in below], np.array(rows, float).reshape(-1, len(names))


def _cell(path: Path, line: int, name: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = float("nan")
    if not np.isfinite(number):
        raise MotionError(
            f"{path}:{line}: {name} = {cell.strip() or 'nothing'} is no finite number; {CONSEQUENCE}. "
            f"Leave the whole row out, or fill it"
        )
    return number
