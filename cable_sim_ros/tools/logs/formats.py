"""Table of the formats that are read. A format is recognised by its first bytes, never by its name alone.

A row names a module beside this one, or an object in it, that has `recognise(head: bytes, path: Path) -> bool` and
`read(path: Path) -> Log`; modules of other makers are imported when such a log is read.
"""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple

from ...files import open_file
from .log import Log, LogError, unread
from .not_valid import without_invalid

HEAD = 65_536  # bytes that tell the format
EXTRA = "pip install 'cable_sim_ros[import]'"


class Format(NamedTuple):
    """name: word of the command line; title: for people; place: of its reader."""

    name: str
    title: str
    place: str

    @property
    def reader(self) -> Any:
        """What recognises and reads it."""
        return resolve_name(f"{__package__}.{self.place}")


CONTAINERS: tuple[Format, ...] = (
    Format("bag", "bag of ROS 1 or ROS 2 (MCAP, SQLite)", "containers.ros_bags"),
    Format("ulog", "ULog of an autopilot", "containers.ulog"),
    Format("xtf", "XTF of a sonar or multibeam", "containers.xtf"),
    Format("parquet", "Parquet table", "containers.parquet"),
    Format("netcdf", "NetCDF 3 or 4", "containers.netcdf"),
)
TELEGRAMS: tuple[Format, ...] = (  # before tables: some of them look like CSV
    Format("nmea2000", "NMEA 2000, raw form of canboat, candump", "devices.nmea2000_raw"),
    Format("nmea0183", "NMEA 0183 sentences, stamped or not", "devices.telegrams:NMEA0183"),
    Format("lci90i", "LCI-90i winch display", "devices.telegrams:LCI90"),
    Format("tss1", "TSS1 motion sensor", "devices.telegrams:TSS1"),
    Format("profiler-winch", "winch of a profiler, text", "devices.profiler_winch"),
    Format("3dm-gx3", "3DM-GX3 records 0xCB", "devices.gx3"),
    Format("fdchp", "flux package of a buoy, records of 55 bytes", "devices.fdchp"),
)
TABLES: tuple[Format, ...] = (Format("csv", "table of text (CSV)", "containers.csv_log"),)
FORMATS: tuple[Format, ...] = CONTAINERS + TELEGRAMS + TABLES  # order: the first that recognises a file reads it


def read_log(path: str | os.PathLike, name: str | None = None) -> Log:
    """Read a file of any known format; name: of FORMATS, None: found from its first bytes. LogError if it cannot be."""
    path = Path(path)
    with unread(path):
        if path.is_dir():
            head = b""
        else:
            with open_file(path, "rb") as file:
                head = file.read(HEAD)
    for row in FORMATS:
        if row.name == name or (name is None and row.reader.recognise(head, path)):
            return without_invalid(row.reader.read(path))
    known = ", ".join(row.name for row in FORMATS)
    if name is not None:
        raise LogError(f"{path}: there is no format '{name}'; nothing was read. Known: {known}")
    what = "is empty" if not head and not path.is_dir() else "is of no format that is read here"
    raise LogError(f"{path}: {what}; nothing was read. Known: {known}; name one with --format, or save it as CSV")


def extra(module: str, path: Path) -> None:
    """Raise LogError where a parser of another maker is not installed."""
    try:
        import_module(module)
    except ImportError:
        raise LogError(f"{path}: is read with {module}, which is not installed; nothing was read. {EXTRA}") from None
