"""XTF files of side-scan sonars and multibeams: attitude, gyro, positions, and the headers of the pings, with cable out
and layback.

The layouts are those of pyxtf. The packets are walked here: pyxtf's own reader runs what an index file beside the log
holds, and ends at the first damage. Source: XTF file format, revision 42 (Triton).
"""

from __future__ import annotations

import ctypes
from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from ....errors import told_as
from ....files import open_file
from ..formats import extra
from ..log import Builder, Log, LogError

FORMAT = 0x7B  # first byte of the file
BLOCK = 1024  # bytes of the head, and of each that follows where there are many channels
MAGIC = b"\xce\xfa"  # of a packet
START = 14  # bytes that begin a packet; its size is the last four
LARGEST = 512  # bytes of the headers that are read
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
GARBLED, CUT = "bytes that are no packet", "packet cut off"
DATE = ("Year", "Month", "Day", "Hour", "Minute", "Second")
FRAME = {*DATE, "HSeconds", "Millisecond", "Microsecond", "MagicNumber", "HeaderType", "NumChansToFollow"}
FRAME |= {"NumBytesThisRecord", "SourceEpoch", "EpochMicroseconds", "TimeTag", "JulianDay"}
UNITS = dict.fromkeys(("Pitch", "Roll", "Heading", "Yaw", "Gyro", "ShipGyro", "SensorPitch", "SensorRoll"), "deg")
UNITS |= {"SensorHeading": "deg", "Heave": "m", "ShipSpeed": "kn", "SensorSpeed": "kn", "SpeedLog": "kn"}
UNITS |= dict.fromkeys(("CableOut", "Layback", "SensorDepth", "SensorPrimaryAltitude", "SensorAuxAltitude"), "m")
UNITS |= {"ShipAltitude": "dm", "ShipDepth": "dm", "RawAltitude": "m", "SoundVelocity": "m/s", "OceanTide": "m"}
POSITIONS = [f"{what}{axis}coordinate" for what in ("Raw", "Ship", "Sensor") for axis in "XY"]
NAVIGATION_UNITS = {0: "m", 3: "deg"}  # of the head of the file


class Kind(NamedTuple):
    """Of packets: source, class of pyxtf, field of the part of a second and ns that one of it is."""

    source: str
    layout: str
    part: str
    unit: int


KINDS = {
    3: Kind("attitude", "XTFAttitudeData", "Millisecond", 1_000_000),
    42: Kind("navigation", "XTFHeaderNavigation", "Microsecond", 1000),
    23: Kind("gyro", "XTFHeaderGyro", "Microsecond", 1000),
    84: Kind("gyro_source_time", "XTFHeaderGyro", "Microsecond", 1000),
    107: Kind("position", "XTFPosRawNavigation", "Microsecond", 100_000),  # tenths of a millisecond, by the source
    0: Kind("sonar_ping", "XTFPingHeader", "HSeconds", 10_000_000),
} | {k: Kind("bathymetry_ping", "XTFPingHeader", "HSeconds", 10_000_000) for k in (2, 17, 28, 61, 62, 74, 78)}


def recognise(head: bytes, path: Path) -> bool:
    """By its first byte, and the packet behind its head."""
    starts = range(BLOCK, min(len(head), 9 * BLOCK), BLOCK)
    return head[:1] == bytes((FORMAT,)) and any(head[at : at + 2] == MAGIC for at in starts)


def read(path: Path) -> Log:
    """Read an XTF file, or what is left of it. LogError if pyxtf is not there, or there is no packet."""
    extra("pyxtf", path)
    import pyxtf

    log = Log(str(path), "xtf", {}, 0)
    builder, left_out = Builder(), Counter[int]()
    layouts = {number: getattr(pyxtf, kind.layout) for number, kind in KINDS.items()}
    with told_as(LogError, f"{path}: cannot be read", "; nothing was read"), open_file(path, "rb") as file:
        size = path.stat().st_size
        head = file.read(BLOCK)
        if len(head) < BLOCK or head[0] != FORMAT:
            raise LogError(f"{path}: has no head of an XTF file; nothing was read. Copy it again")
        header = pyxtf.XTFFileHeader.from_buffer_copy(head)
        told = UNITS | dict.fromkeys(POSITIONS, NAVIGATION_UNITS.get(header.NavUnits, ""))
        told = {name: unit for name, unit in told.items() if unit}
        names: dict[tuple[str, int], str] = {}  # of a kind and a channel of it: each is another device
        units: dict[str, dict[str, str]] = {}
        at = BLOCK
        while at < size:
            file.seek(at)
            data = file.read(LARGEST)
            length = _length(data, size - at)
            if not length:
                following = _next(file, at + 1, size)
                cut = data[:2] == MAGIC and following == size
                if at > BLOCK or following % BLOCK or following > 10 * BLOCK:  # else: more heads of channels
                    log.losses.add(CUT if cut else GARBLED, f"byte {at}")
                at = following
                continue
            kind = KINDS.get(data[2])
            if kind is None:
                left_out[data[2]] += 1
            elif length < ctypes.sizeof(layouts[data[2]]):
                log.losses.add("packet shorter than its kind", f"byte {at}")
            else:
                name = names.get((kind.source, data[3]))
                if name is None:
                    first = not any(source == kind.source for source, _ in names)
                    name = kind.source if first else f"{kind.source}/{data[3]}"
                    names[kind.source, data[3]], units[name] = name, told
                _take(builder, name, kind, layouts[data[2]].from_buffer_copy(data), units)
            at += length
    log.sources, log.records = builder.sources(), builder.records
    for source in log.sources.values():
        if source.device is not None and not source.device.any():
            source.device = None
    for name in [name for name, source in log.sources.items() if source.logged is None and source.device is None]:
        log.losses.add(
            "packet without a time", f"packet of {name}", len(next(iter(log.sources[name].columns.values())))
        )
        del log.sources[name]
    log.records = sum(len(source) for source in log.sources.values())
    for number, count in left_out.most_common(20):
        log.notices.append(f"{count} packets of kind {number} ({_name(pyxtf, number)}) hold no motion and are left out")
    return log


def _length(data: bytes, left: int) -> int:
    """Bytes of the packet that begins here, 0 if none does, or not whole."""
    if len(data) < START or data[:2] != MAGIC:
        return 0
    length = int.from_bytes(data[10:14], "little")
    return length if START <= length <= left else 0


def _next(file: BinaryIO, at: int, size: int) -> int:
    """Where the next packet begins that another one follows, or the end of the file."""
    while at < size:
        file.seek(at)
        block = file.read(1_000_000)
        found = block.find(MAGIC)
        while found >= 0:
            start = at + found
            file.seek(start)
            length = _length(file.read(START), size - start)
            if length:
                file.seek(start + length)
                if start + length == size or file.read(2) == MAGIC:
                    return start
            found = block.find(MAGIC, found + 1)
        at += max(1, len(block) - 1)
    return size


def _take(builder: Builder, name: str, kind: Kind, packet: Any, units: dict[str, dict[str, str]]) -> None:
    values = {}
    for field in packet._fields_:
        value = getattr(packet, field[0])
        if field[0] not in FRAME and not field[0].startswith("Reserved") and isinstance(value, (int, float)):
            values[field[0]] = float(value)
    tag = getattr(packet, "TimeTag", None)
    device = None if tag is None else tag * 1_000_000
    here = {field: unit for field, unit in units[name].items() if field in values}
    units[name] = {}  # one record is enough
    builder.add(name, kind.layout, values, logged=_time(kind, packet), device=device, units=here)


def _time(kind: Kind, packet: Any) -> int | None:
    """ns since 1970 of the date in a packet, else of the clock of its source, else None."""
    seconds = getattr(packet, "SourceEpoch", 0)
    try:
        day = datetime(*(getattr(packet, part) for part in DATE)).replace(tzinfo=UTC)
    except ValueError:
        return seconds * 1_000_000_000 + getattr(packet, "EpochMicroseconds", 0) * 1000 if seconds else None
    if day < EPOCH or day.year > 2200:
        return None
    return (day - EPOCH) // timedelta(seconds=1) * 1_000_000_000 + getattr(packet, kind.part) * kind.unit


def _name(pyxtf: Any, number: int) -> str:
    try:
        return pyxtf.XTFHeaderType(number).name
    except ValueError:
        return "not known"
