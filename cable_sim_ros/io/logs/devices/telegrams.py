"""A text log line by line: stamps of its logger and every telegram in it, of whatever device, several in one file.

A sentence that a line end cut in two is joined where its checksum fits then. One without checksum counts only where no
other of its kind has one, and has as many fields as the others.
"""

from __future__ import annotations

import re
from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from ...telegrams import lci90i, tss1
from ...telegrams.fields import exclusive_or
from ...telegrams.fields import nanoseconds as since_1970
from ..formats import extra
from ..log import Log, Losses
from ..stamps import Stamp, stamp_of, within
from . import wave_buoy
from .assemble import Row, assemble
from .lines import Line, lines_of
from .sentences import IDENTITY, MOST_COLUMNS, Unfit, decode

CHECKED = re.compile(rb"([^*]*)\*([0-9A-Fa-f]{2})")
STARTS = re.compile(rb"[$!]")
LCI90I = re.compile(rb"\d\dRD,")
TELLING = frozenset(b"0123456789,")
LONGEST_NUMBER = 32  # characters
MANY = 8  # such characters make a line without a telegram a loss, fewer a remark of the logger
LCI_UNITS = {"speed": "m/min", "payout": "m"}  # the display sets the unit of the tension
TSS_UNITS = {"horizontal": "m/s^2", "vertical": "m/s^2", "heave": "m", "roll": "deg", "pitch": "deg"}


class Cut(NamedTuple):
    """A sentence without a whole checksum at the end of a line: its text from behind $, where it stands, its stamp."""

    text: bytes
    line: Line
    stamp: Stamp | None


class Telegrams:
    """Rows of the telegrams of a log, in its order."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.losses = Losses()
        self.rows: list[Row] = []
        self.notes: Counter[str] = Counter()  # what is said of the log, with how often
        self._columns: dict[str, set[str]] = {}
        self._cut: Cut | None = None

    def read(self) -> None:
        """All lines."""
        for line in lines_of(self.path, self.losses):
            stamp = None if line.text[:1] in (b"$", b"!", b":", b"\x01") else stamp_of(line.text)
            if stamp is not None:
                self.notes[f"stamp: {stamp.form}"] += 1
            self._line(line, stamp)
        self._settle()

    def _line(self, line: Line, stamp: Stamp | None) -> None:
        text = line.text[stamp.end :] if stamp else line.text
        starts = [found.start() for found in STARTS.finditer(text)]
        head = text[: starts[0]] if starts else text
        joined = self._join(head.strip(b"\r\n"))
        if not joined and head.strip():
            self._other(head, line, stamp, alone=not starts)
        for start, end in zip(starts, [*starts[1:], len(text)]):
            part = text[start + 1 : end]
            found = CHECKED.match(part)
            if found:
                self._sentence(found[1], int(found[2], 16), text[start : start + 1], line, stamp)
            elif end == len(text) and line.whole:
                self._cut = Cut(part, line, stamp)
            else:
                self._bare(Cut(part, line, stamp))

    def _join(self, head: bytes) -> bool:
        """Try the sentence that the line before cut off with the start of this line."""
        cut, whole = self._cut, None
        if cut is not None and head:
            whole = CHECKED.match(cut.text.rstrip(b"\r\n") + head)
        if cut is None or whole is None or exclusive_or(whole[1]) != int(whole[2], 16):
            self._settle()
            return False
        self._cut = None
        self.notes["joined"] += 1
        self._sentence(whole[1], int(whole[2], 16), b"$", cut.line, cut.stamp)
        return True

    def _settle(self) -> None:
        cut, self._cut = self._cut, None
        if cut is not None:
            self._bare(cut)

    def _bare(self, cut: Cut) -> None:
        """A sentence that ends without a checksum."""
        if b"*" in cut.text or not cut.line.whole:
            self.losses.add("sentence cut off", f"line {cut.line.number}")
        else:
            self._decode(cut.text.strip(), cut.line, cut.stamp, bare=True)

    def _sentence(self, body: bytes, check: int, start: bytes, line: Line, stamp: Stamp | None) -> None:
        if exclusive_or(body) != check:
            self.losses.add("wrong checksum", f"line {line.number}")
        elif start == b"!":
            self.notes[f"not decoded: !{body[:5].decode('latin-1')}"] += 1
        else:
            self._decode(body, line, stamp, bare=False)

    def _decode(self, body: bytes, line: Line, stamp: Stamp | None, bare: bool) -> None:
        identity, *fields = body.decode("latin-1").split(",")
        if not fields or not IDENTITY.fullmatch(identity):
            self.losses.add("sentence of no known form", f"line {line.number}")
        elif identity in wave_buoy.WAVE_BUOY:
            if bare:
                self.losses.add("sentence cut off", f"line {line.number}")
            else:
                self._buoy(identity, fields, line, stamp)
        else:
            extra("pynmeagps", self.path)
            try:
                found = decode(identity, fields)
            except Unfit as error:
                self.losses.add(str(error), f"line {line.number}")
                return
            if found is None:
                self.notes[f"without numbers: {identity}"] += 1
                return
            kind = "NMEA 0183 " + (identity if identity.startswith("P") else identity[2:])
            row = Row(found.source, kind, found.values, found.units, line.number, stamp and stamp.time)
            if found.clock is not None:
                row.clock, row.told = found.clock.time, "date" if found.clock.dated else "time"
            row.bare, row.fields = bare, len(fields)
            self._add(row)

    def _buoy(self, identity: str, fields: list[str], line: Line, stamp: Stamp | None) -> None:
        if identity in wave_buoy.SPECTRA:
            self.notes[f"not decoded: {identity}, spectrum"] += 1
            return
        try:
            burst = wave_buoy.decode(identity, fields)
        except wave_buoy.Unreadable as error:
            self.losses.add(str(error), f"line {line.number}")
            return
        series = identity == "TSPHA"
        for k, (time, values) in enumerate(zip(burst.time.tolist(), burst.values.tolist())):
            logged = None if series or stamp is None else stamp.time  # the stamp is of the whole series
            row = Row(identity, f"TRIAXYS {identity}", dict(zip(burst.units, values)), burst.units, line.number, logged)
            row.clock, row.told, row.follows = time, "own", k > 0
            self._add(row)
        if series:
            self.notes["series"] += 1

    def _other(self, text: bytes, line: Line, stamp: Stamp | None, alone: bool) -> None:
        """What stands outside of sentences: telegrams of winch displays and TSS1, ends of sentences, remarks."""
        found = LCI90I.search(text)
        if found:
            self._winch(text[found.start() :], line, stamp)
            return
        motion = tss1.LINE.search(text)
        if motion and not text[motion.end() : motion.end() + 1].isdigit():
            self._motion(motion[0].strip(b"\r\n"), line, stamp)
        elif re.search(rb"\*[0-9A-Fa-f]{2}\s*$", text):
            self.losses.add("end of a sentence whose start is lost", f"line {line.number}")
        elif not alone:
            self.notes["before"] += 1
        elif sum(byte in TELLING for byte in text) >= MANY and not text.lstrip().startswith(b"#"):
            self.losses.add("line without a telegram", f"line {line.number}")
        else:
            self.notes["remark"] += 1

    def _winch(self, text: bytes, line: Line, stamp: Stamp | None) -> None:
        found = lci90i.LINE.match(text)
        if found is None:
            self.losses.add("telegram of an LCI-90i that does not fit", f"line {line.number}")
            return
        body, number, at, name, *texts, check = found.groups()
        if sum(body) % 10_000 != int(check):
            self.losses.add("wrong checksum", f"line {line.number}")
            return
        try:
            time = within(since_1970(datetime.strptime(at.decode(), "%Y-%m-%dT%H:%M:%S.%f")))
            if max(map(len, texts)) > LONGEST_NUMBER:
                raise ValueError
            values = {key: float(part) for key, part in zip(("tension", "speed", "payout"), texts)}
        except (ValueError, OverflowError):
            self.losses.add("telegram of an LCI-90i that does not fit", f"line {line.number}")
            return
        source = f"lci90i/{(name or number).decode('ascii').strip()}"
        row = Row(source, "LCI-90i", values, LCI_UNITS, line.number, stamp and stamp.time)
        row.clock, row.told = time, "own"
        self.notes["tension"] += 1
        self._add(row)

    def _motion(self, text: bytes, line: Line, stamp: Stamp | None) -> None:
        found = tss1.LINE.fullmatch(text)
        across, along, heave, status, roll, pitch = found.groups()  # type: ignore[union-attr]
        vertical = int(along, 16)
        centi = [int(part.replace(b" ", b"")) / 100 for part in (heave, roll, pitch)]
        if max(abs(centi[1]), abs(centi[2])) > 90.0:
            self.losses.add("telegram of TSS1 with an angle beyond 90 deg", f"line {line.number}")
            return
        values = {
            "horizontal": int(across, 16) * tss1.HORIZONTAL,
            "vertical": (vertical - (vertical >> 15 << 16)) * tss1.VERTICAL,
            "heave": centi[0],
            "roll": centi[1],
            "pitch": centi[2],
            "settled": float(status.isupper()),
        }
        self.notes["tss1"] += 1
        self._add(Row("tss1", "TSS1", values, TSS_UNITS, line.number, stamp and stamp.time))

    def _add(self, row: Row) -> None:
        columns = self._columns.setdefault(row.source, set())
        if not columns >= row.values.keys():
            if len(columns | row.values.keys()) > MOST_COLUMNS:
                self.losses.add(f"sentence beyond {MOST_COLUMNS} columns of its kind", f"line {row.line}")
                return
            columns.update(row.values)
        self.rows.append(row)


def read_telegrams(path: Path, name: str) -> Log:
    """The log; name: of its format."""
    telegrams = Telegrams(path)
    telegrams.read()
    return assemble(path, name, telegrams.rows, telegrams.losses, telegrams.notes)
