"""NMEA 2000 as canboat and candump write it, decoded by the library nmea2000 (the PGN database of canboat).

    2026-08-03T03:19:45.803Z,3,127257,27,255,8,00,ff,7f,91,00,91,fd,ff      stamp, priority, PGN, source, destination,
    2026-08-03T03:19:45.843Z,7,130842,52,255,29,3f,9f,...                   length, bytes; fast packets joined or not
    (1502979132.106111) can0 09F1120A#FFD0C2FF7FFF7FFD                       candump -l

A source is a PGN of one device: "127257/src 27". Columns have the names and units of canboat's database.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ..formats import extra
from ..log import NO_ZONE, Builder, Log, Losses, stamp_of
from .lines import lines_of, text_of, with_records

FRAME = 8  # bytes of a frame on the bus; more were joined by the gateway or by canboat
MOST_BYTES = 1785  # of an ISO transport message, the longest that NMEA 2000 knows
MOST_COLUMNS = 128
BODY = re.compile(rb"(\d),(\d{1,6}),(\d{1,3}),(\d{1,3}),(\d{1,4})((?:,[0-9A-Fa-f]{2})+)\s*$")
CANDUMP = re.compile(rb"(\w{1,16}) ([0-9A-Fa-f]{8})#((?:[0-9A-Fa-f]{2}){0,8})(?: [RT])?\s*$")
SKIPPED = re.compile(r"reserved|spare")


class Frame(NamedTuple):
    """A frame or a joined message."""

    logged: int
    priority: int
    pgn: int
    source: int
    destination: int
    data: bytes
    unzoned: bool


def recognise(head: bytes, path: Path) -> bool:
    """Whether one of the first lines is a frame."""
    return any(_frame(line) for line in text_of(head).splitlines()[:50])


def read(path: Path) -> Log:
    """All frames whose PGN the library knows."""
    extra("nmea2000", path)
    losses, reader = Losses(), _Reader()
    joined = False
    for line in lines_of(path, losses):
        if line.text.lstrip().startswith(b"#"):
            joined = joined or b"format=FAST" in line.text
            continue
        frame = _frame(line.text)
        if frame is None:
            losses.add("line that is no frame" if line.whole else "frame cut off", f"line {line.number}")
        else:
            reader.add(frame, joined, f"line {line.number}", losses)
    reader.end(losses)
    log = Log(str(path), "nmea2000", reader.build.sources(), reader.build.records, losses, reader.said())
    return with_records(log, "frame of NMEA 2000")


def _frame(text: bytes) -> Frame | None:
    stamp = stamp_of(text)
    if stamp is None:
        return None
    body = BODY.match(text, stamp.end)
    if body:
        priority, pgn, source, destination, length = (int(part) for part in body.groups()[:5])
        data = bytes.fromhex(body[6].replace(b",", b"").decode("ascii"))
        if len(data) != length or length > MOST_BYTES or source > 255 or destination > 255 or pgn >= 1 << 18:
            return None
        return Frame(stamp.time, priority, pgn, source, destination, data, stamp.form == NO_ZONE)
    dumped = CANDUMP.match(text, stamp.end)
    if not dumped:
        return None
    word = int(dumped[2], 16)
    source, group, page = word & 0xFF, word >> 8 & 0xFFFF, word >> 24 & 3
    spoken = group >> 8 < 240  # addressed to one device: the lower byte is its address
    pgn = page << 16 | (group & 0xFF00 if spoken else group)
    data = bytes.fromhex(dumped[3].decode("ascii"))
    return Frame(stamp.time, word >> 26 & 7, pgn, source, group & 0xFF if spoken else 255, data, False)


class _Reader:
    def __init__(self) -> None:
        from nmea2000 import backend  # slow to import, and only here needed
        from nmea2000.decoder import NMEA2000Decoder

        self.build = Builder()
        self._decode = partial(backend.decode, units="si")
        self._is_fast = NMEA2000Decoder.is_fast_pgn
        self._open: dict[tuple[int, int, int], tuple[str, Frame, int, bytearray]] = {}  # fast packets not yet whole
        self._unknown: dict[int, int] = {}
        self._columns: dict[str, set[str]] = {}
        self._unzoned = False

    def add(self, frame: Frame, joined: bool, place: str, losses: Losses) -> None:
        fast = self._is_fast(frame.pgn)
        if fast is None:
            self._unknown[frame.pgn] = self._unknown.get(frame.pgn, 0) + 1
        elif fast and not joined and len(frame.data) <= FRAME:
            self._part(frame, place, losses)
        else:
            self._message(frame, place, losses)

    def _part(self, frame: Frame, place: str, losses: Losses) -> None:
        """A frame of a fast packet: sequence and number of the frame in the first byte, length in the first frame."""
        if len(frame.data) < 2:
            losses.add("frame of a fast packet that is too short", place)
            return
        key, number = (frame.pgn, frame.source, frame.data[0] >> 5), frame.data[0] & 31
        if number == 0:
            if key in self._open:
                losses.add("fast packet not complete", self._open[key][0])
            self._open[key] = (place, frame, 1, bytearray(frame.data[2:]))
        elif key not in self._open:
            losses.add("frame of a fast packet whose start is lost", place)
            return
        else:
            start, first, count, data = self._open[key]
            if number != count:
                losses.add("fast packet not complete", start)
                del self._open[key]
                return
            self._open[key] = (start, first, count + 1, data + frame.data[1:])
        start, first, _, data = self._open[key]
        length = first.data[1]
        if len(data) >= length:
            del self._open[key]
            self._message(frame._replace(data=bytes(data[:length])), start, losses)

    def end(self, losses: Losses) -> None:
        for start, *_ in self._open.values():
            losses.add("fast packet not complete", start)

    def _message(self, frame: Frame, place: str, losses: Losses) -> None:
        try:
            found = self._decode(frame.pgn, frame.data, frame.source, frame.destination, frame.priority)
        except Exception:  # of the library, whatever its kind, for a message that it cannot read
            found = None
        if found is None:
            losses.add("message that does not fit its PGN", place)
            return
        values, units = _numbers(found.fields)
        name = f"{frame.pgn}/src {frame.source}"
        columns = self._columns.setdefault(name, set())
        if len(columns | values.keys()) > MOST_COLUMNS:
            losses.add(f"message beyond {MOST_COLUMNS} columns of its PGN", place)
            return
        columns.update(values)
        self._unzoned = self._unzoned or frame.unzoned
        self.build.add(name, f"NMEA 2000 {found.description or found.id}", values, logged=frame.logged, units=units)

    def said(self) -> list[str]:
        """Notices."""
        said = ["stamps are of the arrival at the gateway"]
        if self._unzoned:
            said.append("the stamps tell no zone and are taken as UTC")
        for pgn, count in sorted(self._unknown.items())[:20]:
            said.append(f"{count} messages of PGN {pgn}, which the library nmea2000 does not know, are not read")
        return said


def _numbers(fields: list[Any]) -> tuple[dict[str, float], dict[str, str]]:
    values: dict[str, float] = {}
    units: dict[str, str] = {}
    for field in fields:
        number = field.value if isinstance(field.value, (int, float)) else field.raw_value
        if SKIPPED.match(field.id) or not isinstance(number, (int, float)) or isinstance(field.value, list):
            continue
        values[field.id] = float(number)
        if field.unit_of_measurement:
            units[field.id] = field.unit_of_measurement
    return values, units
