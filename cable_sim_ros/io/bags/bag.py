"""Bags of any kind, read: whole ones, and what is left of damaged ones.

MCAP is read here, chunk by chunk, so that one bad chunk costs one chunk; SQLite and ROS 1 are read by rosbags.
`BagWriter` and `BagError` are those of io/bags/bag_writer.py.
"""

from __future__ import annotations

import os
import sqlite3
import warnings
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path, PurePath
from typing import Any, NamedTuple

from rosbags.highlevel import AnyReader

from ...files import read_text, regular
from ..scenes.yaml12 import YamlError, parse
from .bag_writer import BagError as BagError
from .bag_writer import BagWriter as BagWriter
from .bag_writer import shown
from .mcap_file import MAX_RECORD, McapFile, Piece, Raw, Unreadable, size_text
from .typestore import STORE

MAX_METADATA = 1_000_000  # bytes of metadata.yaml
MAX_VALUES = 100_000  # in them; each file of a bag has about seven
MAX_HELD = 128_000_000  # bytes held to put messages of overlapping chunks in order
MAX_REPORT = 100  # losses kept as text


class DamageWarning(UserWarning):
    """A bag was damaged and nobody who read it asked for the Damage."""


class Message(NamedTuple):
    """One recorded message: topic, type, log time [ns] and CDR bytes."""

    topic: str
    msgtype: str
    time: int
    data: bytes


@dataclass
class Damage:
    """What could not be read of a bag; false while nothing is lost. `str` is one line for the user.

    messages: one text a loss, the first hundred of them.
    """

    path: str = ""
    chunks_lost: int = 0
    bytes_lost: int = 0
    messages: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.messages)

    def add(self, text: str, *, chunks: int = 0, size: int = 0) -> None:
        self.chunks_lost += chunks
        self.bytes_lost += size
        if len(self.messages) < MAX_REPORT and text not in self.messages:
            self.messages.append(text)

    def __str__(self) -> str:
        first = self.messages[0] if self.messages else "nothing was lost"
        others = f", and {len(self.messages) - 1} more" if len(self.messages) > 1 else ""
        count = f"{self.chunks_lost} chunk{'s' * (self.chunks_lost > 1)}"
        sum_of = f"; {count}, {size_text(self.bytes_lost)} lost" if self.chunks_lost else ""
        return f"bag '{self.path}' is damaged: {first}{others}{sum_of}; the rest was read"


class BagReader:
    """Messages of a bag in order of log time, and what was lost of it.

    with BagReader(path) as bag: for message in bag: ...; bag.damage is complete when the last message has come.
    topics: name -> type; custom_data: of the metadata. BagError if nothing can be read.
    """

    def __init__(self, path: str | os.PathLike) -> None:
        self.path = Path(path)
        self.damage = Damage(os.fspath(path))
        self.custom_data: dict[str, str] = {}
        self.files: list[McapFile] = []
        self.foreign: AnyReader | None = None
        self._known: set[tuple[McapFile, int]] = set()  # losses
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> BagReader:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Close the files; a second call does nothing."""
        for file in self.files:
            file.close()
        if self.foreign is not None and self.foreign.stack is not None:
            self.foreign.close()

    def __iter__(self) -> Iterator[Message]:
        return self.read()

    @property
    def topics(self) -> dict[str, str]:
        """Name -> type of every topic, also of those without messages."""
        if self.foreign is not None:
            return {c.topic: c.msgtype for c in self.foreign.connections}
        return {topic: kind for file in self.files for topic, kind in topics_of(file).values()}

    def read(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages of some topics, None: of all."""
        yield from self._foreign(topics) if self.foreign is not None else self._sorted(topics)

    def as_written(self, topics: Collection[str]) -> Iterator[Message]:
        """Messages of some topics in the order in which the files have them, whatever their log times say."""
        if self.foreign is not None:
            yield from self._foreign(topics)
            return
        for file, raw in self.pieces():
            yield from self._named(file, raw, topics)

    # ---- opening

    def _open(self) -> None:
        try:
            paths, compressed = self._paths()
            if compressed or not all(path.suffix == ".mcap" for path in paths):
                self._open_foreign()
                return
            problem = ""
            for path in paths:
                try:
                    self.files.append(McapFile(path))
                except (Unreadable, OSError) as error:
                    problem = f"{path.name}: {_reason(error)}"
                    self.damage.add(problem, chunks=1, size=path.stat().st_size if path.exists() else 0)
        except OSError as error:
            raise BagError(_cannot_read(self.path, _reason(error))) from None
        if not self.files:
            raise BagError(_cannot_read(self.path, problem))
        for file in self.files:
            for loss in file.losses:
                self._lost(file, *loss)
            if file.cut_off and not file.losses:
                self.damage.add(f"{file.path.name} ends without its index, as of a recording that was cut off")
        own, beside = _custom_data(self.files), self.custom_data
        if own and beside and own != beside:  # the file's own is written with the messages, under a checksum
            other = ", ".join(sorted(key for key in own.keys() | beside.keys() if own.get(key) != beside.get(key)))
            self.damage.add(f"metadata.yaml says another {other} than the recording itself, which is believed")
        self.custom_data = own or beside

    def _paths(self) -> tuple[list[Path], bool]:
        """Files of the bag, and whether the files or messages are compressed as a whole."""
        if not self.path.exists():
            raise BagError(
                f"bag {shown(os.fspath(self.path))} does not exist: nothing was read; give the directory of a bag"
            )
        if not self.path.is_dir():
            try:
                return [regular(self.path)], False
            except OSError as error:
                raise BagError(_cannot_read(self.path, str(error.strerror))) from None
        try:
            info = _metadata(self.path)
        except ValueError as error:
            paths = sorted(self.path.glob("*.mcap"))
            if not paths:
                raise BagError(_cannot_read(self.path, str(error))) from None
            self.damage.add(f"{error}, and is not used")
            return paths, False
        self.custom_data = info["custom_data"]
        paths = [self.path / PurePath(name).name for name in info["relative_file_paths"]]  # never outside of the bag
        there = sorted(self.path.glob("*.mcap"))
        if there and not all(path.is_file() for path in paths):
            self.damage.add("metadata.yaml names files that are not there, and is not used")
            return there, False
        return paths, info.get("compression_mode", "") in ("file", "message", "FILE", "MESSAGE")

    def _open_foreign(self) -> None:
        for path in [self.path] if self.path.is_file() else sorted(self.path.glob("*.db3")):
            if path.suffix == ".db3":
                _check_sizes(path)
        try:
            reader = AnyReader([self.path], default_typestore=STORE)
            reader.open()
        except Exception as error:  # rosbags, sqlite3 and yaml raise what they like on damaged files
            raise BagError(_cannot_read(self.path, _reason(error))) from None
        self.foreign = reader

    # ---- reading

    def pieces(self) -> Iterator[tuple[McapFile, list[Raw]]]:
        """Messages as they stand in the files, piece by piece, in order of the files."""
        for file in self.files:
            for piece in file.pieces:
                yield file, self._load(file, piece)

    def nameless(self, file: McapFile, channel: int) -> None:
        """Report messages of a channel that `topics_of` does not have."""
        topic = f"of '{file.channels[channel].topic}' that are not CDR" if channel in file.channels else "of a channel"
        self.damage.add(f"messages {topic} or whose description is lost are left out, in {file.path.name}")

    def _named(self, file: McapFile, raw: list[Raw], topics: Collection[str] | None) -> Iterator[Message]:
        names = topics_of(file)
        for item in raw:
            name = names.get(item.channel)
            if name is None:
                self.nameless(file, item.channel)
            elif topics is None or name[0] in topics:
                yield Message(*name, item.time, item.data)

    def _lost(self, file: McapFile, offset: int, size: int, why: str, chunk: bool = True) -> None:
        if (file, offset) in self._known:  # it is read a second time
            return
        self._known.add((file, offset))
        self.damage.add(f"{why}, at byte {offset} of {file.path.name}", chunks=int(chunk), size=size)

    def _sorted(self, topics: Collection[str] | None) -> Iterator[Message]:
        """Messages of the pieces of all files. Pieces that overlap in time are held until they can be merged."""
        work = sorted(((piece, file) for file in self.files for piece in file.pieces), key=lambda item: item[0].first)
        held: list[Message] = []
        size, newest = 0, -1
        for number, (piece, file) in enumerate(work):
            fresh = list(self._named(file, self._load(file, piece, newest), topics))
            held += fresh
            size += sum(len(message.data) for message in fresh)
            held.sort(key=attrgetter("time"))  # stable
            until = work[number + 1][0].first if number + 1 < len(work) else None
            ready = len(held)
            if until is not None and size < MAX_HELD:
                while ready and held[ready - 1].time >= until:
                    ready -= 1
            for message in held[:ready]:
                yield message
                newest = message.time
            del held[:ready]
            size = sum(len(message.data) for message in held)

    def _load(self, file: McapFile, piece: Piece, newest: int = -1) -> list[Raw]:
        try:
            raw = file.messages(piece)
            if raw and min(item.time for item in raw) < min(newest, piece.first):
                raise Unreadable("the times of a chunk are not those that it says")
        except (Unreadable, OSError) as error:
            self._lost(file, piece.offset, piece.size, _reason(error))
            return []
        return raw

    def _foreign(self, topics: Collection[str] | None) -> Iterator[Message]:
        reader = self.foreign
        assert reader is not None
        chosen = [c for c in reader.connections if topics is None or c.topic in topics]
        try:
            for connection, time, raw in reader.messages(connections=chosen) if chosen else ():
                data = bytes(raw)
                if not reader.is2:
                    message = _rebuilt(reader.deserialize(raw, connection.msgtype), connection.msgtype)
                    data = bytes(STORE.serialize_cdr(message, connection.msgtype))
                yield Message(connection.topic, connection.msgtype, time, data)
        except Exception as error:  # as above; what came before is whole
            self.damage.add(f"reading ended early ({_reason(error)})")


def read_bag(path: str | os.PathLike, damage: Damage | None = None) -> Iterator[Message]:
    """Messages of a bag in order of log time; BagError if nothing can be read.

    damage: filled with what was lost, at the latest behind the last message; without it that is a DamageWarning.
    """
    with BagReader(path) as reader:
        yield from reader
        report(reader, damage)


def report(reader: BagReader, damage: Damage | None) -> None:
    """Hand the damage on to who asked for it; else warn."""
    if damage is not None:
        vars(damage).update(vars(reader.damage))
    elif reader.damage:
        warnings.warn(str(reader.damage), DamageWarning, stacklevel=3)


def read_metadata(path: str | os.PathLike) -> dict[str, Any]:
    """The ``rosbag2_bagfile_information`` of a bag directory, checked; BagError if there is none."""
    try:
        return _metadata(Path(path))
    except ValueError as error:
        raise BagError(
            f"'{path}' is not a bag directory ({error}): nothing was read; give the directory that holds metadata.yaml"
        ) from None


def _metadata(path: Path) -> dict[str, Any]:
    """As above, types of what is used checked; ValueError with the reason."""
    file = path / "metadata.yaml"
    try:
        if file.stat().st_size > MAX_METADATA:
            raise ValueError(f"metadata.yaml is larger than {size_text(MAX_METADATA)}")
        info = parse(read_text(file), MAX_VALUES)[0]["rosbag2_bagfile_information"]
        names, data = info["relative_file_paths"], info.get("custom_data") or {}
    except (OSError, UnicodeError, YamlError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"metadata.yaml: {_reason(error)}") from None
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise ValueError("metadata.yaml: relative_file_paths is not a list of file names")
    if not isinstance(data, dict) or not all(isinstance(k, str) and isinstance(v, str) for k, v in data.items()):
        raise ValueError("metadata.yaml: custom_data is not a table of texts")
    return info | {"custom_data": data}


def topics_of(file: McapFile) -> dict[int, tuple[str, str]]:
    """Channel -> topic and type, of CDR messages whose type is known."""
    return {
        channel.id: (channel.topic, file.schemas[channel.schema_id].name)
        for channel in file.channels.values()
        if channel.schema_id in file.schemas and channel.message_encoding == "cdr"
    }


def _custom_data(files: list[McapFile]) -> dict[str, str]:
    """Custom data as an MCAP file keeps it beside metadata.yaml; empty where it does not."""
    for file in files:
        try:
            inner = parse(file.metadata["rosbag2"]["serialized_metadata"], MAX_VALUES)[0]["custom_data"]
            return {str(key): str(value) for key, value in inner.items()}
        except (KeyError, TypeError, AttributeError, YamlError):
            continue
    return {}


def _check_sizes(path: Path) -> None:
    """BagError for a SQLite file with a message that would not fit: it is read row by row, each row whole."""
    try:
        database = sqlite3.connect(f"file:{regular(path)}?mode=ro", uri=True)
        try:
            count, maximum = database.execute(
                "SELECT count(*), max(length(data)) FROM messages WHERE length(data) > ?", (MAX_RECORD,)
            ).fetchone()
        finally:
            database.close()
    except (sqlite3.Error, OSError) as error:
        raise BagError(_cannot_read(path, _reason(error))) from None
    if count:
        raise BagError(
            _cannot_read(
                path, f"{count} messages are above the limit of {size_text(MAX_RECORD)}, up to {size_text(maximum)}"
            )
        )


def _reason(error: BaseException) -> str:
    """One short line of an error."""
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    text = " ".join(str(error).split())
    name = "" if isinstance(error, (Unreadable, ValueError)) else f"{type(error).__name__}: "
    return f"{name}{text[:200]}"


def _cannot_read(path: str | os.PathLike, why: str) -> str:
    return (
        f"bag {shown(os.fspath(path))} cannot be read ({why}): nothing was read; give the directory of a bag, an .mcap "
        f"file or a .bag file"
    )


def _rebuilt(message: object, msgtype: str) -> Any:
    """A ROS 1 message as its ROS 2 type, by field name: ROS 1 headers have one field more."""
    cls: Any = STORE.types[msgtype]
    values: dict[str, Any] = {}
    for name, (node, what) in STORE.get_msgdef(msgtype).fields:
        value = getattr(message, name)
        values[name] = _rebuilt(value, str(what)) if node.name == "NAME" else value
    return cls(**values)
