"""ULog files of autopilots: each message instance a source, `vehicle_attitude/0`, on the clock since boot.

pyulog decodes. The file is walked here first: what is sound goes to pyulog, what is not is counted with its place, and
no definition is taken that makes more fields than a message has bytes. Source: ULog file format, version 1, PX4 guide.
"""

from __future__ import annotations

import re
import struct
from contextlib import redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....errors import told_as
from ....files import read_bytes
from ..formats import extra
from ..log import Log, LogError, Losses, Source
from .leaves import MAX_COLUMNS, MAX_ELEMENTS

MAGIC = b"\x55\x4c\x6f\x67\x01\x12\x35"
BEGIN = 16  # bytes of the head of a file
HEAD = struct.Struct("<HB")
KNOWN = re.compile(rb"[BFDIMPQARSOLC]")
SIZES = dict(int8_t=1, uint8_t=1, int16_t=2, uint16_t=2, int32_t=4, uint32_t=4, int64_t=8, uint64_t=8)
SIZES |= dict(float=4, double=8, bool=1, char=1)
FIELD = re.compile(r"(\w+)(?:\[(\d{1,5})\])? (\w+)", re.ASCII)
MAX_FIELDS = 4096  # of a message, those within fields included
MAX_MICROSECONDS = 2**62 // 1000
UTC = "time_utc_usec"  # of messages of a satellite receiver
GARBLED, CUT = "bytes that are no message", "message cut off"


class Layout(NamedTuple):
    """Of a kind of messages: fields in all, bytes, and bytes without the padding at its end."""

    fields: int
    size: int
    least: int


def recognise(head: bytes, path: Path) -> bool:
    """By the first seven bytes."""
    return head.startswith(MAGIC)


def read(path: Path) -> Log:
    """Read a ULog file, or what is left of it. LogError if pyulog is not there, or nothing can be read."""
    extra("pyulog", path)
    from pyulog import ULog

    with told_as(LogError, f"{path}: cannot be read", "; nothing was read"):
        data = read_bytes(path)
    log = Log(str(path), "ulog", {}, 0)
    if len(data) < BEGIN or not data.startswith(MAGIC):
        raise LogError(f"{path}: has {len(data)} bytes and no head of a ULog file; nothing was read. Copy it again")
    walk = _Walk(data, log.losses)
    try:
        with redirect_stdout(StringIO()):  # it prints what it finds damaged
            items = ULog(BytesIO(walk.sound())).data_list
    except Exception as error:  # pyulog checks little
        raise LogError(f"{path}: pyulog cannot read it ({type(error).__name__}); nothing was read") from None
    untimed = 0
    for item in items:
        source, dropped = _source(f"{item.name}/{item.multi_id}", item, log)
        if source is None:
            untimed += dropped
            continue
        while source.name in log.sources:
            source.name += "+"
        log.sources[source.name] = source
        log.records += len(source)
        if dropped:
            log.losses.add("time since boot beyond 146 years", source.name, dropped)
    if untimed:
        log.notices.append(f"{untimed} messages without a timestamp are left out")
    lost = walk.records - log.records - untimed - log.losses.counts.get("time since boot beyond 146 years", 0)
    if lost > 0:
        log.losses.add("message whose subscription was replaced", "the end of the file", lost)
    if walk.dropouts:
        log.notices.append(f"the logger itself lost data {walk.dropouts} times, {walk.silent * 1e-3:.3g} s in all")
    _clock(log)
    return log


class _Walk:
    """The messages of a file, one behind another; `sound` are those that pyulog gets."""

    def __init__(self, data: bytes, losses: Losses) -> None:
        self.records = self.dropouts = self.silent = 0
        self._data, self._losses = data, losses
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self._layouts: dict[int, Layout] = {}  # of what is subscribed to
        self._known: dict[str, Layout] = {}
        self._definitions: list[bytes] = []
        self._rest: list[bytes] = []
        self._left = 100_000 + len(data) // 4  # fields that all subscriptions may have: each costs memory
        self._appended: list[int] = []
        self._go()

    def sound(self) -> bytes:
        """Head, definitions, subscriptions and data."""
        return b"".join((self._data[:BEGIN], *self._definitions, *self._rest))

    def _go(self) -> None:
        data, at, size = self._data, BEGIN, len(self._data)
        while at < size:
            if at + 3 > size:
                self._losses.add(CUT, f"byte {at}")
                return
            length, kind = HEAD.unpack_from(data, at)
            end = at + 3 + length
            if self._appended and at <= self._appended[0] < end:  # written behind a crash: what was begun is not whole
                at = self._appended.pop(0)
                continue
            why = self._take(chr(kind), at, end) if end <= size else CUT
            if why == CUT and self._next(at + 1) == size:
                self._losses.add(CUT, f"byte {at}")
                return
            if why:
                self._losses.add(GARBLED if why == CUT else why, f"byte {at}")
                end = end if why not in (GARBLED, CUT) else self._next(at + 1)
            at = end

    def _next(self, at: int) -> int:
        """Where the next three messages stand in a row."""
        data, size = self._data, len(self._data)
        for found in KNOWN.finditer(data, at + 2):
            place = start = found.start() - 2
            for _ in range(3):
                if place + 3 > size:
                    break
                length, kind = HEAD.unpack_from(data, place)
                if not self._plausible(kind, place, length):
                    break
                place += 3 + length
            else:
                return start
            if place == size:
                return start
        return size

    def _plausible(self, kind: int, at: int, length: int) -> bool:
        end = at + 3 + length
        if end > len(self._data) or not KNOWN.match(bytes((kind,))) or not length:
            return False
        if kind != ord("D"):
            return length < 10_000
        layout = self._layouts.get(int.from_bytes(self._data[at + 3 : at + 5], "little"))
        return layout is not None and layout.least <= length - 2 <= layout.size

    def _take(self, kind: str, at: int, end: int) -> str:
        """Take in a message; why not, "" if so."""
        body = self._data[at + 3 : end]
        if kind == "D":
            layout = self._layouts.get(int.from_bytes(body[:2], "little")) if len(body) > 1 else None
            if layout is None or not layout.least <= len(body) - 2 <= layout.size:
                return GARBLED if layout else "message without its definition"
            self.records += 1
        elif kind == "F":
            name, fields = _format(body)
            if not name or name in self._formats:
                return "" if name else "definition that cannot be read"
            self._formats[name] = fields
            self._definitions.append(self._data[at:end])
            return ""
        elif kind == "A":
            layout = self._layout(body[3:].decode("utf-8", "replace"), 0) if len(body) > 3 else None
            self._left -= layout.fields if layout else 0
            if layout is None or self._left < 0:
                return "subscription that cannot be used"
            self._layouts[int.from_bytes(body[1:3], "little")] = layout
        elif kind == "O" and len(body) == 2:
            self.dropouts, self.silent = self.dropouts + 1, self.silent + int.from_bytes(body, "little")
            return ""
        elif kind == "B" and len(body) >= 40 and at == BEGIN:
            if body[8] & 1:
                self._appended = [place for place in struct.unpack_from("<3Q", body, 16) if place > at]
            return ""
        elif KNOWN.match(kind.encode("latin-1")):
            return ""
        elif len(body) and end + 3 <= len(self._data) and KNOWN.match(self._data[end + 2 : end + 3]):
            return ""  # of a later version of the format
        else:
            return GARBLED
        self._rest.append(self._data[at:end])
        return ""

    def _layout(self, name: str, depth: int) -> Layout | None:
        """Of a message with those within it; None if it is not defined, contains itself or is too wide."""
        if name in self._known:
            return self._known[name]
        if name not in self._formats or depth > 20:
            return None
        count = size = padding = 0
        for kind, length, field in self._formats[name]:
            inner = Layout(1, SIZES[kind], SIZES[kind]) if kind in SIZES else self._layout(kind, depth + 1)
            if inner is None:
                return None
            times = max(1, length)
            count, size = count + times * inner.fields, size + times * inner.size
            padding = padding + times * inner.size if field.startswith("_padding") else 0
            if count > MAX_FIELDS or size > 65_535:
                return None
        self._known[name] = Layout(count, size, size - padding)
        return self._known[name]


def _format(body: bytes) -> tuple[str, list[tuple[str, int, str]]]:
    """Name and fields (type, length or 0, name) of a definition; no name if it cannot be one."""
    name, _, rest = body.decode("utf-8", "replace").partition(":")
    fields = []
    for text in rest.split(";"):
        if not text:
            continue
        found = FIELD.fullmatch(text)
        if found is None:
            return "", []
        fields.append((found[1], int(found[2] or 0), found[3]))
    sound = re.fullmatch(r"\w+", name, re.ASCII) and fields and len({field for *_, field in fields}) == len(fields)
    return (name, fields) if sound else ("", [])


def _source(name: str, item, log: Log) -> tuple[Source | None, int]:
    """Source of a message instance, and how many of its records were left out."""
    if "timestamp" not in item.data:
        return None, len(next(iter(item.data.values())))
    stamps = item.data["timestamp"].astype(np.uint64)
    good = stamps < MAX_MICROSECONDS
    texts = {field.field_name for field in item.field_data if field.type_str == "char"}
    long = {column.rpartition("[")[0] for column in item.data if column.endswith(f"[{MAX_ELEMENTS}]")} - texts
    columns = {
        column: values[good].astype(np.float64)
        for column, values in item.data.items()
        if column != "timestamp" and column not in texts and column.rpartition("[")[0] not in long
    }
    if long:
        log.notices.append(f"{name}: left out, above {MAX_ELEMENTS} elements: {', '.join(sorted(long)[:5])}")
    if len(columns) > MAX_COLUMNS:
        log.notices.append(f"{name}: {len(columns) - MAX_COLUMNS} columns behind the first {MAX_COLUMNS} are left out")
        columns = dict(list(columns.items())[:MAX_COLUMNS])
    device = stamps[good].astype(np.int64) * 1000
    return Source(name, item.name, None, device, columns), int(len(good) - good.sum())


def _clock(log: Log) -> None:
    """The logger's clock, where a satellite receiver told UTC: then also of all other sources."""
    for source in log.sources.values():
        utc = source.columns.get(UTC)
        if utc is None or source.device is None:
            continue
        told = (utc > 1e15) & (utc < 7e15)  # 2001 to 2191
        if not told.any():
            continue
        offsets = utc[told].astype(np.int64) * 1000 - source.device[told]
        offset = int(offsets[0]) + int(np.median(offsets - offsets[0]))
        spread = float(np.abs(offsets - offset).max()) * 1e-9
        for other in log.sources.values():
            assert other.device is not None
            other.logged = other.device + offset
        log.notices.append(
            f"times are since boot; UTC is that of {source.name}, {int(told.sum())} fixes, which differ by up to "
            f"{spread:.3g} s from one offset"
        )
        return
    log.notices.append("times are since boot: no satellite receiver told UTC, so there is no clock of a logger")
