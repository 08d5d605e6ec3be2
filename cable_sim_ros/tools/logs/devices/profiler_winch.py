"""Text of the winch of a surface-piercing profiler (WC_WM) and of the pressure of its body (WC_SBE).

    Source File: D:\\...\\11079364.WC
    Device: WM
    Timestamp (s)<TAB>Depth (dbar)<TAB>Suspect Timestamp<TAB>Encoder Counts<TAB>...<TAB>Rope On Drum(m)
    1397773523.183<TAB>0.560<TAB>n<TAB>-1494303<TAB>...<TAB>9.55

Columns are those of the heading, without the unit in brackets; y and n are 1 and 0, Status is hexadecimal. Times are
of the winch. Source: logs of the Ocean Observatories Initiative (CSPP), mi-instrument project.
"""

from __future__ import annotations

import re
from pathlib import Path

from ..log import SECOND, Builder, Log, LogError, Losses, nanoseconds, within
from .lines import lines_of, text_of, with_records

HEADING = re.compile(rb"^Timestamp \(s\)\t", re.MULTILINE)
DEVICE = re.compile(rb"^Device: *([\w-]{1,16})\s*$", re.MULTILINE)
FIELD = re.compile(r"([^(]*?) *(?:\(([^()]*)\))?")
TIME = re.compile(r"(\d{1,10})(?:\.(\d{1,9}))?")
NUMBER = re.compile(r"[+-]?\d{1,18}(?:\.\d{0,18})?(?:[eE][+-]?\d{1,2})?")
MOST_COLUMNS = 64
HEADER_LINES = 50


def recognise(head: bytes, path: Path) -> bool:
    """Whether the head names its device and has the heading of the table."""
    text = text_of(head)[:4096].replace(b"\r", b"")
    return bool(HEADING.search(text) and DEVICE.search(text))


def read(path: Path) -> Log:
    """All rows."""
    losses, build, device = Losses(), Builder(), ""
    columns: list[tuple[str, str]] = []
    for line in lines_of(path, losses):
        if columns:
            _row(build, device, columns, line.text, line.whole, f"line {line.number}", losses)
        elif HEADING.match(line.text):
            columns = _columns(line.text, path, line.number)
        elif found := DEVICE.match(line.text):
            device = found[1].decode("ascii")
        elif line.number > HEADER_LINES:
            break
    log = Log(str(path), "profiler-winch", build.sources(), build.records, losses)
    log.notices.append("times are those of the winch; rows without a checksum: a wrong digit is not seen")
    return with_records(log, "row under a heading that starts with Timestamp (s)")


def _columns(heading: bytes, path: Path, number: int) -> list[tuple[str, str]]:
    """Name and unit of each."""
    texts = heading.decode("latin-1").strip().split("\t")
    fields = [found.groups("") for text in texts if (found := FIELD.fullmatch(text.strip()))]
    if len(fields) != len(texts) or len(fields) > MOST_COLUMNS or len({name for name, _ in fields}) != len(fields):
        raise LogError(
            f"{path}: line {number}: heading with {len(texts)} columns, of which some have no name or one that is "
            f"taken, or more than {MOST_COLUMNS}; nothing was read. Correct the heading, or save the table as CSV"
        )
    return [(name, unit) for name, unit in fields]


def _row(
    build: Builder, device: str, columns: list[tuple[str, str]], text: bytes, whole: bool, place: str, losses: Losses
) -> None:
    fields = text.decode("latin-1").strip().split("\t")
    time = TIME.fullmatch(fields[0])
    if len(fields) != len(columns) or not whole:
        losses.add("row with another count of columns than the heading" if whole else "row cut off", place)
        return
    try:
        values = {name: _number(name, field) for (name, _), field in zip(columns[1:], fields[1:])}
        stamp = within(int(time[1]) * SECOND + nanoseconds((time[2] or "").encode())) if time else 0
    except ValueError:
        time = None
    if time is None:
        losses.add("field that is no number", place)
        return
    units = {name: unit for name, unit in columns[1:] if unit}
    build.add(device or "winch", f"profiler {device}".strip(), values, device=stamp, units=units)


def _number(name: str, field: str) -> float:
    if field in ("y", "n"):
        return float(field == "y")
    if name == "Status" and len(field) <= 8:
        return float(int(field, 16))
    if not NUMBER.fullmatch(field):
        raise ValueError
    return float(field)
