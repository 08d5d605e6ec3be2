"""Tables of text: a line of names, then rows of numbers, with the delimiters and decimal signs that loggers use.

The source is `table`. A column of dates or of an epoch is the logger's clock, one of seconds from a start or of
the time of day the device's. Rows are read in blocks, so that a large file costs its numbers only.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from ....files import open_file
from ....io.sources.csv_table import COMMA, PLAIN, decimal_comma, grouped, pointed
from ..log import Log, LogError, Losses, Source
from .table_times import Clock, clocks_of

DELIMITERS = (";", "\t", ",", "|")
COMMENTS = ("#", "%", "//")
BLOCK = 20_000  # rows
SAMPLE = 200  # rows that tell the kinds of the columns
TOP = 60  # lines above which the names stand, after comments
COMMENTED = 20_000  # lines of comment at most before the names
MAX_COLUMNS = 2000
NOTHING = {"", "nan", "na", "n/a", "null", "none", "-", "--", "#n/a", "inf", "-inf"}
WORDS = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0, "yes": 1.0, "no": 0.0}
KNOWN = (
    "m mm cm km ft fm nmi s ms us ns min h hz rpm deg rad degc c k n kn kt kts lb lbf lbs kg t te kgf pa kpa mpa bar"
)
KNOWN += " dbar psi v mv a ma w kw nm knm g mps mmps mpmin kmh degps radps mps2 degs rads percent pct cpm ppm"
UNITS = set(KNOWN.split())
BRACKETS = re.compile(r"(.*?)([\s_]*)[\[(]([^\[\]()]{1,16})[\])]\s*")


class Layout(NamedTuple):
    """Of a table: delimiter, decimal comma, names as they stand, units, lines up to the first row."""

    delimiter: str
    comma: bool
    names: list[str]
    units: dict[str, str]
    above: int


def recognise(head: bytes, path: Path) -> bool:
    """A line of names over rows of numbers; last of all formats, as telegrams have commas too."""
    if not head or path.is_dir():
        return False
    encoding = _encoding(head)
    if b"\0" in head and encoding != "utf-16":
        return False
    lines = head.decode(encoding, "replace").splitlines()
    return _layout(list(_first(lines))) is not None


def read(path: Path) -> Log:
    """Read a table. LogError where it has no names, no rows or no time."""
    log = Log(str(path), "csv", {}, 0)
    try:
        with open_file(path, "rb") as binary:
            encoding = _encoding(binary.read(65_536))
        with open_file(path, encoding=encoding, errors="replace", newline=None) as file:
            first = [line.rstrip("\n") for line in _first(file)]
            layout = _layout(first)
            if layout is None:
                raise LogError(
                    f"{path}: is no table: no line of names with rows of as many cells below it, apart by comma, "
                    f"semicolon or tab; nothing was read. Give such a line"
                )
            file.seek(0)
            table = _Table(path, layout, [_cells(line, layout.delimiter) for line in first[layout.above :]], log)
            table.read(file)
    except (OSError, UnicodeError, ValueError) as error:
        if isinstance(error, LogError):
            raise
        why = getattr(error, "strerror", None) or " ".join(str(error).split())[:200]
        raise LogError(f"{path}: cannot be read as text ({why}); nothing was read. Save it as UTF-8") from None
    if encoding == "cp1252":
        log.notices.append("the text is not UTF-8 and is read as Windows-1252")
    log.sources["table"] = table.source()
    log.records = len(log.sources["table"])
    return log


def split_name(name: str) -> tuple[str, str]:
    """Name and unit of a heading: `heave [m]` is heave in m, `tension_lb` keeps its name; "" where none is told."""
    name = name.strip()
    found = BRACKETS.fullmatch(name)
    if found and found[1].strip() and not found[3].isdigit() and (found[2] or _is_unit(found[3])):
        return found[1].strip(), found[3].strip()
    stem, _, last = name.rpartition("_")
    return name, last if stem and _is_unit(last) else ""


def _is_unit(text: str) -> bool:
    plain = text.strip().lower().replace("/", "p").replace("°", "deg").replace("^", "").replace("·", "")
    return plain in UNITS or plain.rstrip("0123456789-") in UNITS


def _encoding(head: bytes) -> str:
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        head[:-3].decode("utf-8")  # the last letter may be cut
    except UnicodeDecodeError as error:
        return "cp1252" if error.start < len(head) - 8 else "utf-8-sig"
    return "utf-8-sig"


def _cells(line: str, delimiter: str) -> list[str]:
    if '"' in line:
        try:
            (cells,) = csv.reader([line], delimiter=delimiter)
            return cells
        except (csv.Error, ValueError):
            return []
    return line.split(delimiter)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def _first(lines: Iterable[str]) -> Iterator[str]:
    """The comment at the top and what tells the layout below it."""
    below = 0
    for line in islice(lines, COMMENTED + SAMPLE + TOP):
        below += below > 0 or not _is_comment(line)
        yield line
        if below >= SAMPLE + TOP:
            return


def _is_number(cell: str) -> bool:
    return bool(PLAIN.fullmatch(cell) or COMMA.fullmatch(cell))


def _layout(lines: Sequence[str]) -> Layout | None:
    """Of the first line that names what stands below it, of a comment only where no other line does; None if there is
    none."""
    best: tuple[bool, int, int, str] | None = None  # comment, lines above, - cells, delimiter
    begun = next((k for k, line in enumerate(lines) if not _is_comment(line)), 0)
    top = range(max(begun - TOP, 0), min(begun + TOP, len(lines)))
    for delimiter in DELIMITERS:
        for k in top:
            line = lines[k]
            if line.count(delimiter) and _names(line, delimiter) and _rows_below(lines[k + 1 :], line, delimiter):
                key = (_is_comment(line), k, -len(_names(line, delimiter)), delimiter)
                best = key if best is None else min(best, key)
                if not key[0]:
                    break
    if best is None:
        return None
    _, at, _, delimiter = best
    headings = _names(lines[at], delimiter)
    rows = [(k, _cells(line, delimiter)) for k, line in enumerate(lines) if k > at and line.strip()]
    rows = [(k, cells) for k, cells in rows if not _is_comment(lines[k])]
    above, second = rows[0][0], {}
    if not any(_is_number(cell) or any(map(str.isdigit, cell)) for cell in rows[0][1]):  # units
        second = dict(zip(headings, (cell.strip().strip("[]()") for cell in rows[0][1])))
        above += 1
    cells = [cell for k, row in rows if k >= above for cell in row]
    comma = delimiter != "," and decimal_comma(cells)
    names, units = _named(headings, second)
    return Layout(delimiter, comma, names, units, above)


def _names(line: str, delimiter: str) -> list[str]:
    """Cells of a line that could name columns; none if it cannot."""
    text = line.strip().lstrip("#%/ \t") if _is_comment(line) else line
    cells = [cell.strip() for cell in _cells(text, delimiter)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    sound = 2 <= len(cells) <= MAX_COLUMNS and not any(
        _is_number(cell) or cell.startswith(("$", "!")) for cell in cells
    )
    filled = [cell for cell in cells if cell]
    return cells if sound and len(filled) > len(cells) // 2 and len(set(filled)) == len(filled) else []


def _rows_below(lines: Sequence[str], heading: str, delimiter: str) -> bool:
    """Most of the next lines have as many cells, some of them numbers; the first of them may tell units."""
    width = len(_names(heading, delimiter))
    rows = [_cells(line, delimiter) for line in lines[:40] if line.strip() and not _is_comment(line)][:20]
    if len(rows) > 1 and len(rows[0]) >= width and not any(any(map(str.isdigit, cell)) for cell in rows[0]):
        rows = rows[1:]
    good = [row for row in rows if width <= len(row) <= width + 1 and any(any(map(str.isdigit, cell)) for cell in row)]
    first = bool(rows) and width <= len(rows[0]) <= width + 1 and any(map(_is_number, rows[0]))
    return first and len(good) >= 0.7 * len(rows)


def _named(headings: list[str], second: dict[str, str]) -> tuple[list[str], dict[str, str]]:
    pairs = [split_name(heading) for heading in headings]
    plain = [name for name, _ in pairs]
    names, units = [], {}
    for k, (heading, (name, unit)) in enumerate(zip(headings, pairs)):
        name = (heading if plain.count(name) > 1 else name) or f"column_{k + 1}"
        names.append(name)
        if unit or second.get(heading):
            units[name] = unit or second[heading]
    return names, units


class _Table:
    """Takes in the rows of a table, block by block."""

    def __init__(self, path: Path, layout: Layout, sample: list[list[str]], log: Log) -> None:
        self._layout, self._log = layout, log
        width = len(layout.names)
        sample = [row[:width] for row in sample if len(row) >= width and any(cell.strip() for cell in row)][:SAMPLE]
        if layout.comma:
            sample = [[pointed(cell, True) for cell in row] for row in sample]
        self._clocks: list[Clock] = clocks_of(layout.names, layout.units, list(zip(*sample)), log.notices)
        if not self._clocks:
            raise LogError(
                f"{path}: has no column of time among {', '.join(layout.names[:12])}; nothing was read. Name one time, "
                f"with seconds from a start or since 1970, or ISO 8601"
            )
        taken = {k for clock in self._clocks for k in clock.columns}
        self._numbers = [k for k in range(width) if k not in taken]
        self._blocks: dict[int, list[np.ndarray]] = {k: [] for k in self._numbers}
        self._times: list[list[np.ndarray]] = [[] for _ in self._clocks]
        self._filled, self._bad = dict.fromkeys(self._numbers, 0), dict.fromkeys(self._numbers, 0)
        self._thousands = dict.fromkeys(self._numbers, False)
        self._first_bad: dict[int, str] = {}

    def read(self, file: TextIO) -> None:
        """All rows of the file."""
        rows: list[list[str]] = []
        lines: list[int] = []
        width = len(self._layout.names)
        for line, cells in self._rows(file):
            if len(cells) == width + 1 and not cells[-1].strip():
                cells.pop()
            if len(cells) != width:
                self._log.losses.add("row with another number of cells", f"line {line}")
                continue
            rows.append(cells)
            lines.append(line)
            if len(rows) == BLOCK:
                self._take(rows, lines, self._log.losses)
                rows, lines = [], []
        if rows:
            self._take(rows, lines, self._log.losses)

    def _rows(self, file: TextIO) -> Iterator[tuple[int, list[str]]]:
        for number, line in enumerate(file, 1):
            line = line.rstrip("\n")
            if number > self._layout.above and line.strip() and not _is_comment(line):
                yield number, _cells(line, self._layout.delimiter)

    def _take(self, rows: list[list[str]], lines: list[int], losses: Losses) -> None:
        columns = list(zip(*rows))
        if self._layout.comma:
            columns = [tuple(pointed(cell, True) for cell in column) for column in columns]
        good = np.ones(len(rows), bool)
        times = []
        for clock in self._clocks:
            stamps, told = clock.read([columns[k] for k in clock.columns])
            times.append(stamps)
            good &= told
        if not good.all():
            losses.add("row without a time", f"line {lines[int(np.argmin(good))]}", int(len(good) - good.sum()))
        for kept, stamps in zip(self._times, times):
            kept.append(stamps[good])
        for k in self._numbers:
            self._blocks[k].append(self._values(k, columns[k], lines)[good])

    def _values(self, k: int, cells: Sequence[str], lines: list[int]) -> np.ndarray:
        try:
            values = np.array(cells, np.float64)
            self._filled[k] += len(cells)
            return values
        except ValueError:
            pass
        values = np.full(len(cells), np.nan)
        self._thousands[k] = self._thousands[k] or grouped(cells, self._layout.comma)
        for i, cell in enumerate(cells):
            try:
                values[i] = float(pointed(cell, self._layout.comma, self._thousands[k]))
                self._filled[k] += 1
            except ValueError:
                word = cell.strip().lower()
                if word in NOTHING:
                    continue
                self._filled[k] += 1
                if word in WORDS:
                    values[i] = WORDS[word]
                else:
                    self._bad[k] += 1
                    self._first_bad.setdefault(k, f"line {lines[i]}: {cell.strip()[:20]}")
        return values

    def source(self) -> Source:
        """The table; what is no column of numbers is named in a notice."""
        names, columns, texts = self._layout.names, {}, []
        for k in self._numbers:
            if not self._filled[k] or self._bad[k] > 0.5 * self._filled[k]:
                texts.append(names[k])
                continue
            columns[names[k]] = np.concatenate(self._blocks[k])
            if self._bad[k]:
                self._log.notices.append(
                    f"{names[k]}: {self._bad[k]} cells are no numbers and count as missing, "
                    f"first at {self._first_bad[k]}"
                )
        if texts:
            more = f" and {len(texts) - 12} more" if len(texts) > 12 else ""
            self._log.notices.append(f"columns without numbers are left out: {', '.join(texts[:12])}{more}")
        clocks: dict[bool, np.ndarray] = {}
        for clock, times in zip(self._clocks, self._times):
            clocks[clock.absolute] = np.concatenate(times) if times else np.zeros(0, np.int64)
        units = {name: unit for name, unit in self._layout.units.items() if name in columns}
        return Source("table", "csv", clocks.get(True), clocks.get(False), columns, units)
