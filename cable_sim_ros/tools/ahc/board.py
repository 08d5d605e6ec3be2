"""The leaderboard: a CSV file, a line for each cell of each entrant, merged from results and checked by a re-run."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...files import open_file, read_text
from ...terminal import clean
from . import definition
from .benchmark import Row, twin_cell
from .definition import MRU, TOLERANCE, TWIN, VERSION, Cell
from .figures import NAMES
from .remote import AhcError

HEAD = ("entrant", "rank", "benchmark", "definition", "product", "commit")
PLACE = ("scene", "motion", "class", "seed", "state", "reason")
COLUMNS = (*HEAD, *PLACE, *NAMES)
ROUND_OFF = 1e-12  # of a figure that is 0
UNCHANGED = "the leaderboard was not changed"


class Difference(NamedTuple):
    """What a re-run has otherwise than the leaderboard."""

    entrant: str
    cell: Cell
    what: str
    board: object
    again: object


def cell_of(row: Row) -> Cell:
    """The cell of a row."""
    return Cell(row["scene"], row["motion"], row["class"])


def key_of(row: Row) -> tuple[str, Cell]:
    """What a leaderboard has once."""
    return row["entrant"], cell_of(row)


def rows_of(result: Mapping[str, Any]) -> list[Row]:
    """Rows of a result with what stands at its head, as a leaderboard has them."""
    head = {name: result[name] for name in HEAD if name in result}
    return [{**head, **{name: row[name] for name in row if name != "twin"}} for row in result["rows"]]


def read(path: Path) -> list[Row]:
    """Rows of a leaderboard; none where there is no file. Raises AhcError."""
    if not path.exists():
        return []
    rows = []
    with open_file(path, encoding="utf-8", newline="") as file:
        lines = csv.DictReader(file)
        if tuple(lines.fieldnames or ()) != COLUMNS:
            raise AhcError(f"{path}: its columns are not those of a leaderboard of {VERSION}; nothing was done")
        for number, line in enumerate(lines, 2):
            try:
                found = {name: float(line[name]) if line[name] else None for name in NAMES}
                seed = int(line["seed"]) if line["seed"] else None
            except (TypeError, ValueError):
                raise AhcError(f"{path}:{number}: is no row of a leaderboard; nothing was done") from None
            known = {name: line[name] for name in (*HEAD, *PLACE)}
            rows.append({**known, "seed": seed, "figures": found if found["decoupling"] is not None else None})
    doubled = {key_of(row) for row in rows}
    if len(doubled) < len(rows):
        raise AhcError(f"{path}: has a cell of an entrant twice; nothing was done. Take one of them out")
    return rows


def text_of(rows: Iterable[Row]) -> str:
    """A leaderboard as CSV: entrants in their order, cells in that of the definition."""
    order = {cell: k for k, cell in enumerate([*definition.cells(), *definition.cells(version=MRU)])}
    rows = list(rows)
    entrants = list(dict.fromkeys(row["entrant"] for row in rows))
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    lines.writerow(COLUMNS)
    for row in sorted(rows, key=lambda row: (entrants.index(row["entrant"]), order.get(cell_of(row), len(order)))):
        found = row["figures"] or dict.fromkeys(NAMES)
        figures = (None if found[name] is None else f"{found[name]:.{definition.DIGITS}g}" for name in NAMES)
        values = [*(row[name] for name in (*HEAD, *PLACE)), *figures]
        lines.writerow("" if value is None else value for value in values)
    return out.getvalue()


def load_result(path: Path) -> dict[str, Any]:
    """A result of ``cable-sim ahc --out``. Raises AhcError."""
    try:
        result = json.loads(read_text(path))
        rows = [(row["entrant"], cell_of(row), row["state"], row["figures"], row["twin"]) for row in result["rows"]]
        head = [str(result[name]) for name in ("benchmark", "definition", "product", "commit")]
    except OSError as error:
        raise AhcError(f"{path}: cannot be read ({error.strerror}); {UNCHANGED}. Give ahc.json of --out") from None
    except (ValueError, KeyError, TypeError) as error:
        raise AhcError(f"{path}: is no result of cable-sim ahc ({error!r}); {UNCHANGED}. Give its ahc.json") from None
    assert head is not None and rows is not None
    return result


def merge(board: Sequence[Row], result: Mapping[str, Any], origin: str, replace: bool = False) -> list[Row]:
    """The leaderboard with the rows of a result. Raises AhcError with every reason why not; origin: its file.

    replace: rows of an entrant that stands there already are taken out first.
    """
    rows = rows_of(result)
    problems = [*_other_definition(result), *_incomplete(rows, result["benchmark"]), *_other_seeds(rows)]
    names = dict.fromkeys(row["entrant"] for row in rows)
    mine = [row for row in board if row["entrant"] in names and row["benchmark"] == result["benchmark"]]
    there = [name for name in names if any(row["entrant"] == name for row in mine)]
    if there and not replace:
        problems.append(f"{', '.join(there)}: stands on the leaderboard already; give --replace, or another --name")
    kept = [row for row in board if row not in mine]
    if not problems:
        problems += _other_twin(kept, result["rows"])
    if problems:
        wrong = AhcError("\n".join(clean(f"{origin}: {problem}; {UNCHANGED}") for problem in problems))
        wrong.lines = True
        raise wrong
    return [*kept, *rows]


def _other_definition(result: Mapping[str, Any]) -> Iterator[str]:
    if result["benchmark"] not in (VERSION, MRU):
        yield f"benchmark = {result['benchmark']}, this is {VERSION}: run it with this version"
    elif result["definition"] != (known := definition.digest(result["benchmark"])):
        yield (
            f"definition = {result['definition']}, that of this version is {known}: run it with this version, unedited"
        )


def _incomplete(rows: Sequence[Row], version: str) -> Iterator[str]:
    wanted = {*definition.cells(version=version)}
    for name in dict.fromkeys(row["entrant"] for row in rows):
        cells = [cell_of(row) for row in rows if row["entrant"] == name]
        missing = sorted(wanted - set(cells))
        odd = sorted(set(cells) - wanted)
        if missing:
            yield f"{name} lacks {len(missing)} of {len(wanted)} cells, the first {missing[0]}: run all of them"
        if odd or len(cells) > len(set(cells)):
            yield f"{name} has a cell twice, or one that {version} does not have: run it again"


def _other_seeds(rows: Sequence[Row]) -> Iterator[str]:
    known = {one.name: definition.seed(one.name) for one in (*definition.MOTIONS, *definition.SECOND)}
    for row in rows:
        if row["motion"] in known and row["seed"] != known[row["motion"]]:
            yield f"seed of {row['motion']} = {row['seed']}, that of {VERSION} is {known[row['motion']]}"
            return


def _other_twin(board: Sequence[Row], rows: Sequence[Row]) -> Iterator[str]:
    """Held winches must be those of the leaderboard: else the physics was another."""
    held = {cell_of(row): row["figures"] for row in board if row["entrant"] == TWIN}
    for row in rows:
        mine, theirs = row["twin"], held.get(twin_cell(cell_of(row)))
        if mine is None or theirs is None:
            continue
        for name in NAMES:
            if not agree(mine[name], theirs[name]):
                yield (
                    f"{name} of the held winch in {twin_cell(cell_of(row))} = {mine[name]}, on the leaderboard "
                    f"{theirs[name]}, further apart than {100.0 * TOLERANCE:g} %: another version of the physics. Run "
                    "both with one version"
                )
                return


def agree(one: float | None, other: float | None) -> bool:
    """Are two figures the same within TOLERANCE?"""
    if one is None or other is None:
        return one is other
    return abs(one - other) <= TOLERANCE * max(abs(one), abs(other)) + ROUND_OFF


def compared(board: Sequence[Row], again: Sequence[Row]) -> list[Difference]:
    """Where rows that were run again are not those of the leaderboard."""
    known = {key_of(row): row for row in board}
    found = []
    for row in again:
        name, cell = key_of(row)
        mine = known.get(key_of(row))
        if mine is None:
            found.append(Difference(name, cell, "row", "none", row["state"]))
        elif mine["state"] != row["state"]:
            found.append(Difference(name, cell, "state", mine["state"], row["state"]))
        elif row["figures"] is not None:
            figures, ours = mine["figures"] or dict.fromkeys(NAMES), row["figures"]
            found += [
                Difference(name, cell, figure, figures[figure], ours[figure])
                for figure in NAMES
                if not agree(figures[figure], ours[figure])
            ]
    return found


def with_twins(board: Sequence[Row]) -> list[Row]:
    """Rows of a leaderboard with the figures of their twins beside them, as a result has them."""
    held = {cell_of(row): row["figures"] for row in board if row["entrant"] == TWIN}
    return [{**row, "twin": held.get(twin_cell(cell_of(row)))} for row in board]
