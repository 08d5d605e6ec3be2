"""Arrays as the bytes of an .npz file and back, for files that anybody may have written.

Nothing is unpacked or parsed before its size, kind and place have been judged; an array is taken only where its dtype
and shape are those that are wanted. A file that `sealed` made ends in a SHA-256 over all bytes before it, kept as the
comment of the zip file, so that other readers of .npz take it as well. Every problem is an `Unfit`.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from ...files import open_file

MAX_FILE = 256_000_000  # bytes of a file
MAX_HEAD = 32_768  # bytes of the header of one array: that of MEMORY has some thousand
MAX_MEMBERS, MAX_INDEX = 64, 65_536  # arrays of a file, bytes of its directory
SEAL = b"sha256:"
SEAL_SIZE = len(SEAL) + 64
END = struct.Struct("<4s4H2LH")  # end of the central directory, PKWARE APPNOTE 4.3.16
LOCATOR = 20  # bytes of what says that a longer directory stands before it
FLAGS_TAKEN = 0x0806  # of a member: names in UTF-8, the level of deflate
DATE = (1980, 1, 1, 0, 0, 0)  # the same state is the same bytes
SUFFIX = ".npy"


class Unfit(ValueError):
    """Bytes that are not what they should be; the text is a clause that says why."""


class Foreign(Unfit):
    """A member that is none of those wanted."""


def npz(members: Mapping[str, np.ndarray], compressed: bool = False) -> bytes:
    """Arrays as an .npz file, in their order; a text is an array of bytes, see `text`."""
    memory = io.BytesIO()
    how = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(memory, "w", how) as archive:
        for name, array in members.items():
            content = io.BytesIO()
            npy.write_array(content, np.asanyarray(array), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(name + SUFFIX, DATE), content.getvalue(), how)
    return memory.getvalue()


def text(value: str) -> np.ndarray:
    """A text as an array that `npz` takes."""
    return np.array(value.encode())


def sealed(data: bytes) -> bytes:
    """An .npz file with its checksum."""
    body = data[:-2] + struct.pack("<H", SEAL_SIZE)  # the end says how long the comment is
    return body + SEAL + hashlib.sha256(body).hexdigest().encode()


def is_sealed(data: bytes) -> bool:
    """Does a file end in a checksum? Unfit where that is not the one of its bytes."""
    if data[-SEAL_SIZE:-64] != SEAL:
        return False
    if hashlib.sha256(memoryview(data)[:-SEAL_SIZE]).hexdigest().encode() != data[-64:]:
        raise Unfit("its checksum is not that of its content: bytes were changed")
    return True


def parts(data: bytes, names: Collection[str], maximum: int = MAX_FILE, packed: bool = False) -> dict[str, bytes]:
    """Members of an .npz file by their names, as bytes; names: those it may have; most: bytes of all of them; packed:
    they may be compressed."""
    count = _judge_end(data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) != count:
                raise Unfit(f"its directory says {count} members and has {len(members)}")
            _judge(members, names, maximum if packed else min(maximum, len(data)), packed)
            found = {}
            for member in members:
                with archive.open(member) as file:
                    found[member.filename.removesuffix(SUFFIX)] = file.read(member.file_size)
            return found
    except Unfit:
        raise
    except Exception as error:  # zipfile raises what it likes
        raise Unfit(f"{type(error).__name__}: {error}") from None


def _judge_end(data: bytes) -> int:
    """How many members a small directory at the end of the file says there are; Unfit where it is another."""
    at = len(data) - END.size - (SEAL_SIZE if data[-SEAL_SIZE:-64] == SEAL else 0)
    if at < 0 or data[at : at + 4] != b"PK\x05\x06":
        raise Unfit("its end is missing")
    _, _, _, _, count, size, _, _ = END.unpack_from(data, at)
    if count > MAX_MEMBERS or size > MAX_INDEX or data[at - LOCATOR :].startswith(b"PK\x06\x07"):
        raise Unfit(f"its directory has {count} members in {size} bytes, at most {MAX_MEMBERS} in {MAX_INDEX} fit")
    return count


def _judge(members: list[zipfile.ZipInfo], names: Collection[str], maximum: int, packed: bool) -> None:
    seen: set[str] = set()
    total = 0
    for member in members:
        name = member.filename.removesuffix(SUFFIX)
        if not member.filename.endswith(SUFFIX) or name not in names:
            raise Foreign(f"'{member.filename:.40}' is not part of it")
        if name in seen:
            raise Unfit(f"'{name}' is there twice")
        if member.flag_bits & ~FLAGS_TAKEN:
            raise Unfit(f"'{name}' is encrypted or packed in another way (flags {member.flag_bits:#x})")
        how = member.compress_type
        if how != zipfile.ZIP_STORED and not (packed and how == zipfile.ZIP_DEFLATED):
            raise Unfit(f"'{name}' is compressed (method {how})")
        if how == zipfile.ZIP_STORED and member.compress_size != member.file_size:
            raise Unfit(f"the two sizes of '{name}' contradict each other")
        total += member.file_size
        if total > maximum:
            raise Unfit(f"its arrays would have more than {maximum} bytes")
        seen.add(name)


def array(name: str, data: bytes, like: np.ndarray) -> np.ndarray:
    """A member of `parts` as an array of the dtype and shape of ``like``."""
    kind, shape, at = _header(name, data)
    if kind != like.dtype or shape != like.shape:
        raise Unfit(f"'{name}' is {_shown(kind, shape)}, expected {_shown(like.dtype, like.shape)}")
    if len(data) - at != like.nbytes:
        raise Unfit(f"'{name}' has {len(data) - at} bytes, its shape wants {like.nbytes}")
    return np.frombuffer(data, like.dtype, like.size, at).reshape(like.shape).copy()


def text_of(name: str, data: bytes, maximum: int) -> str:
    """A member of `parts` as text, of at most so many bytes."""
    kind, shape, at = _header(name, data)
    if kind.kind not in "SU" or shape or kind.itemsize != len(data) - at:
        raise Unfit(f"'{name}' is no text")
    if kind.itemsize > maximum:
        raise Unfit(f"'{name}' has {kind.itemsize} bytes, at most {maximum} are taken")
    try:  # U: of versions before the checksum
        return data[at:].decode("utf-32-le" if kind.kind == "U" else "utf-8").rstrip("\0")
    except UnicodeDecodeError:
        raise Unfit(f"'{name}' is no text") from None


def _header(name: str, data: bytes) -> tuple[np.dtype, tuple[int, ...], int]:
    """dtype and shape of a member, and where its numbers begin."""
    file = io.BytesIO(data[: MAX_HEAD + 16])
    try:
        version = npy.read_magic(file)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, turned, kind = read(file, max_header_size=MAX_HEAD)
        if turned:
            raise ValueError("its order is that of Fortran")
    except Exception as error:  # numpy has Python parse it, which raises what it likes
        raise Unfit(f"the header of '{name}' cannot be read ({type(error).__name__}: {error!s:.100})") from None
    return kind, shape, file.tell()


def _shown(kind: np.dtype, shape: tuple[int, ...]) -> str:
    return f"{kind.kind}{list(shape)!s:.60}" + ("" if kind.names else f" of {kind.itemsize} bytes")


# ---- files


def read_file(path: str | os.PathLike) -> bytes:
    """The bytes of a regular file of at most MAX_FILE; OSError, or Unfit. A pipe is not waited for."""
    with open_file(path, "rb") as file:
        if (size := os.fstat(file.fileno()).st_size) > MAX_FILE:
            raise Unfit(f"it has {size} bytes, at most {MAX_FILE} are read")
        return bytes(file.read(MAX_FILE))


def write_file(path: str | os.PathLike, data: bytes) -> None:
    """Write a file, whole or not at all, through no link: one of this name is replaced, not followed. OSError."""
    path = Path(path)
    part = open_part(path)
    try:
        with open(part, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part_of(path), path)
    except OSError:
        part_of(path).unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(folder)  # the name too
    finally:
        os.close(folder)


def part_of(path: Path) -> Path:
    """Where a file is written before it has its name."""
    return path.with_name(path.name + ".part")


def open_part(path: Path) -> int:
    """A new file beside a path, as a descriptor; what stood there is removed, a link is not followed. OSError."""
    part = part_of(path)
    part.unlink(missing_ok=True)
    return os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
