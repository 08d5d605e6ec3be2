"""A text log line by line: stamps of its logger and every telegram in it, of whatever device, several in one file.

A sentence that a line end cut in two is joined where its checksum fits then. One without checksum counts only where no
other of its kind has one, and has as many fields as the others.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from ...telegrams import lci90i, tss1
from ...telegrams.fields import exclusive_or
from ...telegrams.fields import nanoseconds as since_1970
from ..formats import extra
from ..log import Log, Losses, stamp_of, within
from . import wave_buoy
from .assemble import Row, assemble
from .lines import lines_of, text_of
from .sentences import IDENTITY, MOST_COLUMNS, decode
from .wave_buoy import Unfit

CHECKED = re.compile(rb"([^*]*)\*([0-9A-Fa-f]{2})")
STARTS = re.compile(rb"[$!]|@(?=[A-Z]{4},)")  # @: of winches of Rapp
SENTENCE = re.compile(rb"[$@]([A-Z0-9]{4,8},[^*$!\r\n]*)\*([0-9A-Fa-f]{2})")
BARE = re.compile(rb"^[^$\r\n]{0,40}\$([A-Z0-9]{4,8}),[-+,.\w]*[\r\n]", re.MULTILINE)
LCI90I = re.compile(rb"\d\dRD,")
NAME = re.compile(rb"([A-Za-z][\w.-]{1,31})[ \t,:]+", re.ASCII)  # of a device, as the logger has it
TELLING = frozenset(b"0123456789,")
LONGEST_NUMBER = 32  # characters
MANY = 8  # such characters make a line without a telegram a loss, fewer a remark of the logger
LCI_UNITS = {"speed": "m/min", "payout": "m"}  # the display sets the unit of the tension
TSS_UNITS = {"horizontal": "m/s^2", "vertical": "m/s^2", "heave": "m", "roll": "deg", "pitch": "deg"}


class Place(NamedTuple):
    """Where a telegram stands: number of its line, does that have an end, stamp of the logger [ns], and the name that
    the logger gives the device, with a slash, or nothing."""

    line: int
    whole: bool
    logged: int | None
    device: str


class Cut(NamedTuple):
    """A sentence without a whole checksum at the end of a line: its text from behind $."""

    text: bytes
    at: Place


class Telegrams:
    """Rows of the telegrams of a log, in its order."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.losses = Losses()
        self.rows: list[Row] = []
        self.notes: Counter[str] = Counter()  # what is said of the log, with how often
        self._columns: dict[str, set[str]] = {}
        self._cut: Cut | None = None
        self._parser = False  # is it known to be installed?

    def read(self) -> None:
        """All lines."""
        for line in lines_of(self.path, self.losses):
            text, stamp, device = line.text, None, ""
            if text[:1] not in (b"$", b"!", b"@", b":", b"\x01"):
                stamp = stamp_of(text)
                name = NAME.match(text) if stamp is None else None
                if name and (stamp := stamp_of(text[name.end() :])):
                    text, device = text[name.end() :], _prefix(name[1])
            if stamp is not None:
                self.notes[f"stamp: {stamp.form}"] += 1
                text = text[stamp.end :]
            self._line(text, Place(line.number, line.whole, stamp and stamp.time, device))
        self._settle()

    def _line(self, text: bytes, at: Place) -> None:
        starts = [found.start() for found in STARTS.finditer(text)]
        head = text[: starts[0]] if starts else text
        if not self._join(head) and head.strip():
            name = NAME.fullmatch(head) if starts else None
            if name and not at.device:
                at = at._replace(device=_prefix(name[1]))
            else:
                self._other(head, at, alone=not starts)
        for start, end in zip(starts, [*starts[1:], len(text)]):
            part = text[start + 1 : end]
            found = CHECKED.match(part)
            if found:
                self._sentence(found[1], int(found[2], 16), text[start : start + 1], at)
            elif end == len(text) and at.whole:
                self._cut = Cut(part, at)
            else:
                self._bare(Cut(part, at))

    def _join(self, head: bytes) -> bool:
        """Try the sentence that the line before cut off with the start of this line."""
        cut, whole = self._cut, None
        if cut is not None and head:
            whole = CHECKED.match(cut.text + head)
        if cut is None or whole is None or exclusive_or(whole[1]) != int(whole[2], 16):
            self._settle()
            return False
        self._cut = None
        self.notes["joined"] += 1
        self._sentence(whole[1], int(whole[2], 16), b"$", cut.at)
        return True

    def _settle(self) -> None:
        cut, self._cut = self._cut, None
        if cut is not None:
            self._bare(cut)

    def _bare(self, cut: Cut) -> None:
        """A sentence that ends without a checksum."""
        if b"*" in cut.text or not cut.at.whole:
            self.losses.add("sentence cut off", f"line {cut.at.line}")
        else:
            self._decode(cut.text.strip(), cut.at, bare=True)

    def _sentence(self, body: bytes, check: int, start: bytes, at: Place) -> None:
        if exclusive_or(body) != check:
            self.losses.add("wrong checksum", f"line {at.line}")
        elif start == b"!":
            self.notes[f"not decoded: !{body[:5].decode('latin-1')}"] += 1
        else:
            self._decode(body, at, bare=False)

    def _decode(self, body: bytes, at: Place, bare: bool) -> None:
        identity, *fields = body.decode("latin-1").split(",")
        if not fields or not IDENTITY.fullmatch(identity):
            self.losses.add("sentence of no known form", f"line {at.line}")
        elif identity in wave_buoy.WAVE_BUOY:
            if bare:
                self.losses.add("sentence cut off", f"line {at.line}")
            else:
                self._buoy(identity, fields, at)
        else:
            if not self._parser:
                extra("pynmeagps", self.path)
                self._parser = True
            try:
                found = decode(identity, fields)
            except Unfit as error:
                self.losses.add(str(error), f"line {at.line}")
                return
            if found is None:
                self.notes[f"without numbers: {identity}"] += 1
                return
            for letter in found.letters:
                self.notes[f"letters: {found.source} {letter}"] += 1
            kind = "NMEA 0183 " + (identity if identity.startswith("P") or len(identity) < 5 else identity[2:])
            row = Row(at.device + found.source, kind, found.values, found.units, at.line, at.logged)
            if found.clock is not None:
                row.clock, row.told = found.clock.time, "date" if found.clock.dated else "time"
            row.bare, row.fields = bare, len(fields)
            self._add(row)

    def _buoy(self, identity: str, fields: list[str], at: Place) -> None:
        if identity in wave_buoy.SPECTRA:
            self.notes[f"not decoded: {identity}, spectrum"] += 1
            return
        try:
            burst = wave_buoy.decode(identity, fields)
        except Unfit as error:
            self.losses.add(str(error), f"line {at.line}")
            return
        series = identity == "TSPHA"
        kind, logged = f"TRIAXYS {identity}", None if series else at.logged  # the stamp is of the whole series
        for k, (time, values) in enumerate(zip(burst.time.tolist(), burst.values.tolist())):
            row = Row(at.device + identity, kind, dict(zip(burst.units, values)), burst.units, at.line, logged)
            row.clock, row.told, row.follows = time, "own", k > 0
            self._add(row)
        if series:
            self.notes["series"] += 1

    def _other(self, text: bytes, at: Place, alone: bool) -> None:
        """What stands outside of sentences: telegrams of winch displays and TSS1, ends of sentences, remarks."""
        winches = [found.start() for found in LCI90I.finditer(text)]
        motions = [found for found in tss1.LINE.finditer(text) if not text[found.end() : found.end() + 1].isdigit()]
        first = min([*winches, *(found.start() for found in motions)], default=0)
        name = NAME.fullmatch(text[:first].rstrip(b"\x01\x02 \t,:") + b" ")
        if name and not at.device:
            at = at._replace(device=_prefix(name[1]))
        for start, end in zip(winches, [*winches[1:], len(text)]):
            self._winch(text[start:end], at)
        for motion in motions:
            self._motion(motion, at)
        if winches or motions:
            return
        if re.search(rb"\*[0-9A-Fa-f]{2}\s*$", text):
            self.losses.add("end of a sentence whose start is lost", f"line {at.line}")
        elif not alone:
            self.notes["before"] += 1
        elif sum(byte in TELLING for byte in text) >= MANY and not text.lstrip().startswith(b"#"):
            self.losses.add("line without a telegram", f"line {at.line}")
        else:
            self.notes["remark"] += 1

    def _winch(self, text: bytes, at: Place) -> None:
        found = lci90i.LINE.match(text)
        if found is None:
            self.losses.add("telegram of an LCI-90i that does not fit", f"line {at.line}")
            return
        body, number, clock, name, *texts, check = found.groups()
        if sum(body) % 10_000 != int(check):
            self.losses.add("wrong checksum", f"line {at.line}")
            return
        try:
            time = within(since_1970(datetime.strptime(clock.decode(), "%Y-%m-%dT%H:%M:%S.%f")))
            if max(map(len, texts)) > LONGEST_NUMBER:
                raise ValueError
            values = {key: float(part) for key, part in zip(("tension", "speed", "payout"), texts)}
        except (ValueError, OverflowError):
            self.losses.add("telegram of an LCI-90i that does not fit", f"line {at.line}")
            return
        source = f"{at.device}lci90i/{(name or number).decode('ascii').strip()}"
        row = Row(source, "LCI-90i", values, LCI_UNITS, at.line, at.logged)
        row.clock, row.told = time, "own"
        self.notes["tension"] += 1
        self._add(row)

    def _motion(self, found: re.Match[bytes], at: Place) -> None:
        across, along, heave, status, roll, pitch = found.groups()
        vertical = int(along, 16)
        centi = [int(part.replace(b" ", b"")) / 100 for part in (heave, roll, pitch)]
        if max(abs(centi[1]), abs(centi[2])) > 90.0:
            self.losses.add("telegram of TSS1 with an angle beyond 90 deg", f"line {at.line}")
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
        self._add(Row(f"{at.device}tss1", "TSS1", values, TSS_UNITS, at.line, at.logged))

    def _add(self, row: Row) -> None:
        columns = self._columns.setdefault(row.source, set())
        if not columns >= row.values.keys():
            if len(columns | row.values.keys()) > MOST_COLUMNS:
                self.losses.add(f"sentence beyond {MOST_COLUMNS} columns of its kind", f"line {row.line}")
                return
            columns.update(row.values)
        self.rows.append(row)


def _prefix(name: bytes) -> str:
    return name.decode("ascii") + "/"


class Telegram(NamedTuple):
    """A format of such a log: its name, and whether the text of a head tells it; all telegrams are read, whatever it
    is."""

    name: str
    told: Callable[[bytes], bool]

    def recognise(self, head: bytes, path: Path) -> bool:
        """Whether it is in the head."""
        return self.told(text_of(head))

    def read(self, path: Path) -> Log:
        """All telegrams."""
        telegrams = Telegrams(path)
        telegrams.read()
        return assemble(path, self.name, telegrams.rows, telegrams.losses, telegrams.notes)


def _sentences(text: bytes) -> bool:
    """A sentence with a right checksum, or two without one."""
    if any(exclusive_or(found[1]) == int(found[2], 16) for found in SENTENCE.finditer(text)):
        return True
    return sum(IDENTITY.fullmatch(found[1].decode("ascii")) is not None for found in BARE.finditer(text)) >= 2


def _winches(text: bytes) -> bool:
    """A telegram of a winch display with a right checksum."""
    lines = (lci90i.LINE.match(text, start.start()) for start in LCI90I.finditer(text))
    return any(found and sum(found[1]) % 10_000 == int(found[8]) for found in lines)


NMEA0183 = Telegram("nmea0183", _sentences)
LCI90 = Telegram("lci90i", _winches)  # each name of a winch is a source, so that a renamed one shows
TSS1 = Telegram("tss1", lambda text: tss1.LINE.search(text) is not None)
