"""Messages of MCAP, SQLite and ROS 1 files as they stand in them, with the definitions of their types.

MCAP is read by io/bags, SQLite by sqlite3, both row by row and chunk by chunk. ROS 1 files are walked here, because
rosbags needs their index, which a bag that was cut off lacks, and decompresses without a bound. Source: ROS 1 bag
format 2.0 (wiki.ros.org/Bags/Format/2.0).
"""

from __future__ import annotations

import bz2
import re
import sqlite3
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lz4.frame

from ....files import open_file
from ....io.bags.mcap_file import MAX_RECORD, McapFile, Unreadable
from ..log import LogError, Losses

MCAP, SQLITE, ROS1 = b"\x89MCAP0\r\n", b"SQLite format 3\0", b"#ROSBAG V"
CHUNK = "chunk that cannot be read"
RECORD = "record that cannot be read"
CUT = "end of the file is missing"
U32 = struct.Struct("<I")
MAX_HEAD = 1_000_000  # bytes of the header of a ROS 1 record: a connection's is a topic, a chunk's a few numbers
ROS1_CHUNK = re.compile(rb"op=\x05")
Notices = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Topic:
    """A topic of one file: encoding of its messages, definition of its type and how that is written."""

    name: str
    msgtype: str
    encoding: str
    schema_encoding: str = ""
    schema: str = ""


Item = tuple[Topic, int, bytes]  # topic, log time [ns], message


def messages_of(path: Path, losses: Losses, notice: Notices) -> Iterator[Item]:
    """Messages of one file. Raises LogError where it is none of the three kinds, or nothing can be read."""
    with open_file(path, "rb") as file:
        head = file.read(16)
    if head.startswith(MCAP):
        yield from _mcap(path, losses, notice)
    elif head.startswith(SQLITE):
        yield from _sqlite(path, losses, notice)
    elif head.startswith(ROS1):
        yield from _ros1(path, losses, notice)
    else:
        raise LogError(f"{path}: is neither MCAP nor SQLite nor a ROS 1 bag; nothing was read. Give a bag")


# ---- MCAP


def _mcap(path: Path, losses: Losses, notice: Notices) -> Iterator[Item]:
    try:
        file = McapFile(path)
    except Unreadable as error:
        raise LogError(f"{path}: cannot be read as MCAP ({error}); nothing was read. Give another copy") from None
    with file:
        for loss in file.losses:
            losses.add(CHUNK if loss.chunk else RECORD, f"byte {loss.offset} of {path.name}: {loss.why}")
        if file.cut_off and not file.losses:
            notice(f"{path.name} ends without its index, as of a recording that was cut off")
        topics: dict[int, Topic | None] = {}
        for piece in file.pieces:
            try:
                raw = file.messages(piece)
            except (Unreadable, OSError) as error:
                losses.add(CHUNK, f"byte {piece.offset} of {path.name}: {error}")
                continue
            for item in raw:
                if item.channel not in topics:
                    topics[item.channel] = _channel(file, item.channel)
                topic = topics[item.channel]
                if topic is None:
                    losses.add("message of a channel without a description", f"byte {piece.offset} of {path.name}")
                else:
                    yield topic, item.time, item.data


def _channel(file: McapFile, number: int) -> Topic | None:
    channel = file.channels.get(number)
    if channel is None:
        return None
    schema = file.schemas.get(channel.schema_id)
    if schema is None:
        return Topic(channel.topic, "", channel.message_encoding)
    text = schema.data.decode("utf-8", "replace")
    return Topic(channel.topic, schema.name, channel.message_encoding, schema.encoding, text)


# ---- SQLite


def _sqlite(path: Path, losses: Losses, notice: Notices) -> Iterator[Item]:
    beside = path.with_name(path.name + "-wal")
    mode = "mode=ro" if beside.is_file() and beside.stat().st_size else "immutable=1"  # no file is made beside it
    name = str(path.absolute()).replace("%", "%25").replace("?", "%3f").replace("#", "%23")
    size = path.stat().st_size
    rows = at = 0
    database = None
    try:
        database = sqlite3.connect(f"file:{name}?{mode}", uri=True)
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD)
        database.text_factory = lambda data: data.decode("utf-8", "replace")
        steps = [100 + size // 100]  # thousands of instructions: a ring of damaged pages has no end

        def spent() -> bool:
            steps[0] -= 1
            return steps[0] < 0

        database.set_progress_handler(spent, 1000)
        topics = _tables(database)
        # by row, not by time: the index of times may be damaged, and rows are in the order of the recording
        for rowid, number, time, data in database.execute("SELECT rowid, topic_id, timestamp, data FROM messages"):
            at = rowid
            rows += 1
            topic = topics.get(number)
            if rows > size:
                raise sqlite3.DatabaseError("more rows than bytes")
            if topic is None:
                losses.add("message of an unknown topic", f"row {rowid} of {path.name}")
            elif not isinstance(time, int) or not isinstance(data, bytes):
                losses.add(RECORD, f"row {rowid} of {path.name}: its time or data has another type")
            else:
                yield topic, time, data
    except (sqlite3.Error, ValueError, OverflowError, MemoryError) as error:
        why = " ".join(str(error).split())[:120]
        if not rows:
            raise LogError(f"{path}: cannot be read as a SQLite bag ({why}); nothing was read") from None
        losses.add(f"rest of {path.name} that cannot be read", f"behind row {at}: {why}")
    finally:
        if database is not None:
            database.close()


def _tables(database: sqlite3.Connection) -> dict[Any, Topic]:
    """Topics by number; definitions are there since rosbag2 of Iron."""
    names = {row[0] for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    definitions = {}
    if "message_definitions" in names:
        rows = database.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
        definitions = {str(kind): (str(encoding or ""), str(text or "")) for kind, encoding, text in rows}
    return {
        number: Topic(str(name), str(kind), str(form), *definitions.get(str(kind), ("", "")))
        for number, name, kind, form in database.execute("SELECT id, name, type, serialization_format FROM topics")
    }


# ---- ROS 1


def _ros1(path: Path, losses: Losses, notice: Notices) -> Iterator[Item]:
    size = path.stat().st_size
    connections: dict[int, Topic] = {}
    with open_file(path, "rb") as file:
        line = file.readline(64)
        if not line.startswith(b"#ROSBAG V2.0\n"):
            raise LogError(f"{path}: is a ROS 1 bag of another version than 2.0; nothing was read. rosbag migrates it")
        at, index, effort = len(line), -1, 4 * size
        while at < size:
            try:
                head, start, length = _head(_at(file, at), size - at)
                if length > MAX_RECORD and head.get("op") == b"\x05":
                    raise ValueError(f"a chunk of {length} bytes is above the limit of {MAX_RECORD}")
            except ValueError as error:
                losses.add(CUT if "cut off" in str(error) else RECORD, f"byte {at} of {path.name}: {error}")
                at, effort = _next_chunk(file, at + 1, size, effort)
                continue
            kind = head.get("op", b"")
            try:
                if kind == b"\x03":
                    index = _number(head, "index_pos", 8)
                elif kind == b"\x05":
                    file.seek(at + start)
                    yield from _inner(_unpacked(head, file.read(length)), connections, losses, f"byte {at}", path.name)
                elif kind == b"\x07":
                    file.seek(at + start)
                    _connect(head, file.read(length), connections)
            except ValueError as error:
                losses.add(CHUNK if kind == b"\x05" else RECORD, f"byte {at} of {path.name}: {error}")
            at += start + length
        if not 0 < index < size:
            notice(f"{path.name} ends without its index, as of a recording that was cut off")


def _at(file: Any, at: int) -> bytes:
    """Bytes that begin a record, as many as its header needs."""
    file.seek(at)
    data = file.read(512)
    if len(data) == 512 and U32.unpack_from(data)[0] > 500:
        data += file.read(min(U32.unpack_from(data)[0], MAX_HEAD))
    return data


def _inner(data: bytes, connections: dict[int, Topic], losses: Losses, place: str, name: str) -> Iterator[Item]:
    """Messages of a chunk; what is behind a record that cannot be read is lost. ValueError."""
    at = 0
    while at < len(data):
        wanted = U32.unpack_from(data, at)[0] + 8 if at + 4 <= len(data) else 8
        head, start, length = _head(data[at : at + wanted], len(data) - at)
        body = data[at + start : at + start + length]
        at += start + length
        if head.get("op") == b"\x07":
            _connect(head, body, connections)
        elif head.get("op") == b"\x02":
            topic = connections.get(_number(head, "conn", 4))
            time = head.get("time", b"")
            if topic is None or len(time) != 8:
                losses.add("message of an unknown connection", f"{place} of {name}")
                continue
            seconds, rest = struct.unpack("<II", time)
            yield topic, seconds * 1_000_000_000 + rest, body


def _head(data: bytes, left: int) -> tuple[dict[str, bytes], int, int]:
    """Fields of a record's header, where its data begins, and their length; left: bytes of the file. ValueError."""
    if len(data) < 8:
        raise ValueError("the record is cut off")
    end = 4 + U32.unpack_from(data)[0]
    if end + 4 > left:
        raise ValueError("the record is cut off")
    if end + 4 > len(data):
        raise ValueError("the header of the record is too long")
    fields, at = {}, 4
    while at < end:
        if at + 4 > end:
            raise ValueError("the header of the record is damaged")
        stop = at + 4 + U32.unpack_from(data, at)[0]
        key, equals, value = data[at + 4 : stop].partition(b"=")
        if stop > end or not equals:
            raise ValueError("the header of the record is damaged")
        fields[key.decode("latin-1")] = value
        at = stop
    length = U32.unpack_from(data, end)[0]
    if end + 4 + length > left:
        raise ValueError("the record is cut off")
    return fields, end + 4, length


def _number(head: dict[str, bytes], key: str, width: int) -> int:
    if len(head.get(key, b"")) != width:
        raise ValueError(f"the header of the record has no {key}")
    return int.from_bytes(head[key], "little")


def _connect(head: dict[str, bytes], body: bytes, connections: dict[int, Topic]) -> None:
    number = _number(head, "conn", 4)
    if number in connections:
        return
    inner = _head(U32.pack(len(body)) + body + bytes(4), len(body) + 8)[0]
    kind, text = (inner.get(key, b"").decode("utf-8", "replace") for key in ("type", "message_definition"))
    if not kind:
        raise ValueError("a connection has no type")
    name = head.get("topic", b"").decode("utf-8", "replace")
    connections[number] = Topic(name, kind, "ros1", "ros1msg", text or " ")


def _unpacked(head: dict[str, bytes], data: bytes) -> bytes:
    """Content of a chunk, of the size that it says. ValueError."""
    size, name = _number(head, "size", 4), head.get("compression", b"")
    if size > MAX_RECORD:
        raise ValueError(f"a chunk of {size} bytes decompressed is above the limit of {MAX_RECORD}")
    try:
        if name == b"bz2":
            data = bz2.BZ2Decompressor().decompress(data, size + 1)
        elif name == b"lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        elif name != b"none":
            raise ValueError("the compression of a chunk is unknown")
    except (OSError, RuntimeError, EOFError, MemoryError) as error:
        raise ValueError(f"a chunk cannot be decompressed ({type(error).__name__})") from None
    if len(data) != size:
        raise ValueError("a chunk does not have the size that it says")
    return data


def _next_chunk(file: Any, at: int, size: int, effort: int) -> tuple[int, int]:
    """Where the next chunk begins, the end of the file if there is none; effort: bytes that a search may still read."""
    while at < size and effort > 0:
        file.seek(at)
        block = file.read(MAX_HEAD)
        effort -= len(block)
        for found in ROS1_CHUNK.finditer(block):
            for start in range(max(0, found.start() - 120), found.start() - 7):
                try:
                    head, begin, _ = _head(block[start : start + 4096], size - at - start)
                except ValueError:
                    continue
                if head.get("op") == b"\x05" and {"compression", "size"} <= head.keys() and begin < 200:
                    return at + start, effort
        at += max(1, len(block) - 200)
    return size, effort
