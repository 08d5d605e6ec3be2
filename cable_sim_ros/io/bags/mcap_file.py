"""An MCAP file as pieces that are read one by one, whatever has happened to the rest of it.

With a whole summary the pieces are those of its chunk index. Without, the file is walked record by record: behind one
that cannot be read the walk goes on at the next that can. Source: MCAP specification, version 0.
"""

from __future__ import annotations

import contextlib
import os
import re
import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from ...files import open_file

MAX_RECORD = 64_000_000  # bytes of one record, and of one chunk decompressed
MAGIC = b"\x89MCAP0\r\n"
END = 37  # bytes of footer and magic
HEAD = struct.Struct("<BQ")  # opcode, length
CHUNK = struct.Struct("<QQQII")  # first time, last time, size, checksum, length of the compression's name
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
BLOCK = 1024 * 1024  # bytes read at a time in a search, and of messages outside of chunks that are one piece
ZEROS = bytes(BLOCK + HEAD.size)
# the sixth byte of a record's head: opcode, length below 2**26. Zeros are looked for first, for speed
CANDIDATE = re.compile(rb"\x00(?=\x00\x00\x00)(?<=[\x01-\x0f].{3}[\x00-\x03]\x00)", re.DOTALL)
INNER = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)


class Unreadable(Exception):
    """A record, a chunk or a file that cannot be read; the text is a clause that says why."""


class Piece(NamedTuple):
    """A chunk, or a range of messages outside of chunks: place and size in the file [bytes], log times [ns]."""

    offset: int
    size: int
    first: int
    last: int
    chunk: bool = True


class Loss(NamedTuple):
    """A range of the file that could not be read [bytes], and why; chunk: it held messages, as far as is known."""

    offset: int
    size: int
    why: str
    chunk: bool = True


class Raw(NamedTuple):
    """One message: log time and publish time [ns], channel, bytes."""

    time: int
    published: int
    channel: int
    data: bytes


class McapFile:
    """One MCAP file, open for reading; Unreadable if it is none.

    pieces: in order of the file; schemas, channels: by id; metadata: by name; losses: what a walk could not read;
    cut_off: the file ends without its summary.
    """

    def __init__(self, path: str | os.PathLike) -> None:
        self.path = Path(path)
        self.schemas: dict[int, records.Schema] = {}
        self.channels: dict[int, records.Channel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.pieces: list[Piece] = []
        self.losses: list[Loss] = []
        self.cut_off = False
        self._chunked = False
        self._file = open_file(self.path, "rb", buffering=0)
        try:
            self.size = os.fstat(self._file.fileno()).st_size
            if not self.size:
                raise Unreadable("it is empty")
            self._effort = 4 * self.size + MAX_RECORD  # bytes that a search may read: no file takes for ever
            if not self._from_summary():
                self._walk()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> McapFile:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def messages(self, piece: Piece) -> list[Raw]:
        """Messages of a piece in order of the file; Unreadable if they cannot be read whole."""
        raw: list[Raw] = []
        self._parse(
            self._content(piece.offset, piece.size) if piece.chunk else self._read(piece.offset, piece.size), raw
        )
        return raw

    # ---- bytes

    def _read(self, offset: int, size: int) -> bytes:
        data = os.pread(self._file.fileno(), size, offset) if size <= MAX_RECORD + 64 else b""
        if len(data) != size:
            raise Unreadable(f"it is cut off: {size} bytes are wanted, {max(0, self.size - offset)} are there")
        return data

    def _content(self, offset: int, size: int) -> bytes:
        """Records of a chunk, decompressed; size: of its record, head included."""
        if not HEAD.size + CHUNK.size + 8 <= size <= MAX_RECORD:
            raise Unreadable(f"a chunk of {size_text(size)} is above the limit of {size_text(MAX_RECORD)}")
        record = memoryview(self._read(offset, size))
        *_, length, checksum, letters = CHUNK.unpack_from(record, HEAD.size)
        at = HEAD.size + CHUNK.size + letters
        if record[0] != Opcode.CHUNK or letters > 8 or struct.unpack_from("<Q", record, at)[0] != size - at - 8:
            raise Unreadable("the lengths of a chunk contradict each other")
        data = _decompress(bytes(record[at - letters : at]), record[at + 8 :], length)
        if checksum and zlib.crc32(data) != checksum:
            raise Unreadable("the checksum of a chunk is wrong")
        return data

    def _parse(self, data: bytes, raw: list[Raw] | None) -> tuple[int, int]:
        """Take in the records of a chunk: schemas and channels; messages into `raw`. First and last time [ns]."""
        at, end, first, last = 0, len(data), 2**64, 0
        try:
            while at < end:
                opcode, length = HEAD.unpack_from(data, at)
                body = at + 9
                at = body + length
                if at > end:
                    raise Unreadable("a record within a chunk is longer than the chunk")
                if opcode == Opcode.MESSAGE and length >= MESSAGE.size:
                    channel, _, time, published = MESSAGE.unpack_from(data, body)
                    if time < first:
                        first = time
                    if time > last:
                        last = time
                    if raw is not None:
                        raw.append(Raw(time, published, channel, data[body + MESSAGE.size : at]))
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._register(opcode, data[body:at])
        except struct.error:
            raise Unreadable("a record within a chunk is too short") from None
        return min(first, last), last

    def _register(self, opcode: int, body: bytes) -> None:
        record = _record_of(records.Schema if opcode == Opcode.SCHEMA else records.Channel, body)
        if isinstance(record, records.Schema):
            self.schemas[record.id] = record
        else:
            self.channels[record.id] = record

    # ---- with a summary

    def _from_summary(self) -> bool:
        """Fill in from the summary; False, and nothing filled in, where it is not there whole."""
        pieces: list[Piece] = []
        statistics = None
        try:
            tail = self._read(self.size - END, END)
            start, _, checksum = struct.unpack_from("<QQI", tail, HEAD.size)
            if HEAD.unpack_from(tail) != (Opcode.FOOTER, 20) or tail[29:] != MAGIC or start < len(MAGIC):
                return False
            data = self._read(start, self.size - END - start) if start <= self.size - END else b""
            if checksum and zlib.crc32(tail[:25], zlib.crc32(data)) != checksum:
                return False
            for opcode, body in _split(data):
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._register(opcode, body)
                elif opcode == Opcode.CHUNK_INDEX:
                    first, last, offset, size = struct.unpack_from("<4Q", body)
                    pieces.append(Piece(offset, size, first, last))
                elif opcode == Opcode.STATISTICS:
                    statistics = _record_of(records.Statistics, body)
                elif opcode == Opcode.METADATA_INDEX:
                    index = _record_of(records.MetadataIndex, body)
                    self._take_metadata(index.offset, index.length)
        except (Unreadable, struct.error, OSError):
            statistics = None
        pieces.sort()
        apart = all(_end(a) <= b.offset for a, b in zip(pieces, pieces[1:]))
        whole = (
            statistics is not None
            and statistics.chunk_count == len(pieces)
            and (_end(pieces[-1]) <= start and apart and self.channels if pieces else not statistics.message_count)
        )
        if not whole:
            self.schemas, self.channels, self.metadata = {}, {}, {}
            return False
        self.pieces = pieces
        return True

    def _take_metadata(self, offset: int, size: int) -> None:
        try:
            record = _record_of(records.Metadata, self._read(offset, size)[HEAD.size :])
        except Unreadable:
            return  # it has no checksum, and says again what metadata.yaml says
        self.metadata[record.name] = record.metadata

    # ---- without

    def _walk(self) -> None:
        self.cut_off = True
        if self.size < len(MAGIC) or self._read(0, len(MAGIC)) != MAGIC:
            at = self._search(0, "it does not begin as an MCAP file")
            if not self.pieces and at >= self.size:
                raise Unreadable("it is no MCAP file")
        else:
            at = len(MAGIC)
        while at < self.size:
            try:
                at = self._take(at)
            except Unreadable as error:
                at = self._search(at, str(error))

    def _take(self, at: int) -> int:
        """Take in the record at a place; where the next one begins. Unreadable if that cannot be known."""
        opcode, length = HEAD.unpack(self._read(at, HEAD.size))
        end = at + HEAD.size + length
        if not _known(opcode):
            raise Unreadable("a record has an unknown kind")
        if opcode == Opcode.FOOTER and end + len(MAGIC) == self.size:
            self.cut_off = False
            return self.size
        if end > self.size:
            raise Unreadable(
                f"a record is cut off: {size_text(length)} are wanted, {size_text(self.size - at)} are there"
            )
        if opcode == Opcode.CHUNK:
            self._chunked = True
            try:
                first, last = self._parse(self._content(at, end - at), None)
            except Unreadable as error:
                if not self._plausible(end):
                    raise
                self.losses.append(Loss(at, end - at, str(error)))
            else:
                self.pieces.append(Piece(at, end - at, first, last))
            return end
        if opcode == Opcode.MESSAGE_INDEX and length >= 6:
            if struct.unpack("<I", self._read(at + HEAD.size + 2, 4))[0] == length - 6:
                return end  # whole; what follows has to speak for itself
        if not self._plausible(end):
            raise Unreadable("a record's length leads nowhere")
        if length > MAX_RECORD:
            self.losses.append(
                Loss(at, end - at, f"a record of {size_text(length)} is above the limit of {size_text(MAX_RECORD)}")
            )
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._register(opcode, self._read(at + HEAD.size, length))
        elif opcode == Opcode.MESSAGE:
            self._take_message(at, end)
        elif opcode == Opcode.METADATA:
            self._take_metadata(at, end - at)
        return end

    def _take_message(self, at: int, end: int) -> None:
        time = MESSAGE.unpack(self._read(at + HEAD.size, MESSAGE.size))[2]
        before = self.pieces[-1] if self.pieces else None
        if before and not before.chunk and _end(before) == at and end - before.offset <= BLOCK:
            self.pieces[-1] = Piece(
                before.offset, end - before.offset, min(before.first, time), max(before.last, time), False
            )
        else:
            self.pieces.append(Piece(at, end - at, time, time, False))

    def _plausible(self, at: int) -> bool:
        """A record may begin here; the end of the file will do too."""
        if at + HEAD.size > self.size:
            return True
        opcode, length = HEAD.unpack(self._read(at, HEAD.size))
        return _known(opcode) and (length <= MAX_RECORD or at + HEAD.size + length <= self.size)

    def _search(self, lost: int, why: str) -> int:
        """Where the next whole record begins behind a place; what lies between is a loss."""
        start = lost + 1
        head = os.pread(self._file.fileno(), 1, lost)
        chunk = not head or not _known(head[0]) or head[0] in (*INNER, Opcode.CHUNK)  # else: of the index
        while start < self.size and self._effort > 0:
            block = os.pread(self._file.fileno(), BLOCK + HEAD.size, start)
            self._effort -= len(block)
            if block == ZEROS[: len(block)]:
                start = self._behind_hole(start)
                continue
            for found in CANDIDATE.finditer(block):
                at = start + found.start() - 5
                if self._begins(at):
                    self.losses.append(Loss(lost, at - lost, why, chunk))
                    return at
            start += BLOCK
        self.losses.append(Loss(lost, self.size - lost, why, chunk))
        return self.size

    def _behind_hole(self, at: int) -> int:
        """Where a search goes on behind a block of zeros; the hole of a sparse file is passed at once."""
        with contextlib.suppress(OSError):  # not every file system knows its holes
            data = os.lseek(self._file.fileno(), at, os.SEEK_DATA)
            return max(at + BLOCK, data - HEAD.size)
        return at + BLOCK

    def _begins(self, at: int) -> bool:
        """A record begins here for sure: a whole chunk, or three records in a row."""
        opcode, length = HEAD.unpack(self._read(at, HEAD.size)) if at + HEAD.size <= self.size else (0, 0)
        end = at + HEAD.size + length
        if opcode == Opcode.FOOTER:
            return length == 20 and end + len(MAGIC) == self.size
        if opcode == Opcode.CHUNK:
            self._effort -= length
            try:
                self._content(at, HEAD.size + length)
            except Unreadable:
                return False
            return True
        if self._chunked and opcode in INNER:
            return False  # within a chunk that is lost: nothing vouches for it
        for _ in range(2):
            if end + HEAD.size > self.size or not self._plausible(end):
                return False
            end += HEAD.size + HEAD.unpack(self._read(end, HEAD.size))[1]
        return end <= self.size


def _known(opcode: int) -> bool:
    return Opcode.HEADER <= opcode <= Opcode.DATA_END


def _end(piece: Piece) -> int:
    return piece.offset + piece.size


def size_text(size: int) -> str:
    """A number of bytes for the user."""
    if size < 10_000:
        return f"{size} bytes"
    if size < 1_000_000:
        return f"{size / 1e3:.0f} kB"
    return f"{size / 1e6:.1f}".removesuffix(".0") + " MB"


def _split(data: bytes):
    """(opcode, body) of records that stand one behind another."""
    at = 0
    while at < len(data):
        opcode, length = HEAD.unpack_from(data, at)
        at += HEAD.size + length
        if at > len(data):
            raise Unreadable("a record of the summary is longer than the summary")
        yield opcode, data[at - length : at]


def _record_of(kind, body: bytes):
    """A record of the mcap library from its bytes."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except Exception as error:  # the library checks nothing: a torn record may fail in any way
        raise Unreadable(f"a {kind.__name__.lower()} record is damaged ({type(error).__name__})") from None


def _decompress(name: bytes, data: memoryview, size: int) -> bytes:
    """A chunk's content of the size that it says; Unreadable if that is not what comes out."""
    if size > MAX_RECORD:
        raise Unreadable(f"a chunk of {size_text(size)} decompressed is above the limit of {size_text(MAX_RECORD)}")
    try:
        if name == b"zstd":
            if zstandard.get_frame_parameters(data).content_size in (size, zstandard.CONTENTSIZE_UNKNOWN):
                content = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
            else:
                content = b""
        elif name == b"lz4":
            content = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        elif name == b"":
            content = bytes(data)
        else:
            raise Unreadable("the compression of a chunk is unknown")
    except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
        raise Unreadable(f"a chunk cannot be decompressed ({error})") from None
    if len(content) != size:
        raise Unreadable("a chunk does not have the size that it says")
    return content
