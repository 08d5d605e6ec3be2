"""The one way to open what a user names: a regular file, of which nothing is waited for. Imports nothing of ours."""

from __future__ import annotations

import csv
import errno
import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import Any

KINDS = (
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


class NoRegularFile(OSError):
    """A pipe, socket or device, which may be waited for without end, or has no end."""

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"


def _checked(path: str | os.PathLike, mode: int, written: bool = False) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder, and a file is wanted", os.fspath(path))
    if not stat.S_ISREG(mode):
        kind = next((name for of_kind, name in KINDS if of_kind(mode)), "no regular file")
        remedy = "written; give another name" if written else "read; write it into a file and give that"
        why = f"it is {kind}, and only regular files are {remedy}"
        raise NoRegularFile(errno.EINVAL, why, os.fspath(path))


def regular(path: str | os.PathLike) -> Path:
    """The path, for a library that opens it itself; OSError where it is no regular file."""
    _checked(path, os.stat(path).st_mode)
    return Path(path)


def place(path: str | os.PathLike) -> Path:
    """The path, for what is written there: nothing is there yet, or a regular file; OSError."""
    with suppress(FileNotFoundError):
        _checked(path, os.stat(path).st_mode, written=True)
    return Path(path)


def _opener(path: str, flags: int) -> int:
    number = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    try:
        _checked(path, os.fstat(number).st_mode)
    except OSError:
        os.close(number)
        raise
    return number


def open_file(path: str | os.PathLike, mode: str = "r", **options: Any) -> Any:
    """`open`; OSError, at once, where it is no regular file."""
    looked = regular if mode[0] == "r" else place  # before: to open may do something
    return open(looked(path), mode, opener=_opener, **options)


def read_bytes(path: str | os.PathLike) -> bytes:
    """The bytes of a file; OSError."""
    with open_file(path, "rb") as file:
        return bytes(file.read())


def read_text(path: str | os.PathLike, encoding: str = "utf-8") -> str:
    """The text of a file, line ends as \\n; OSError, UnicodeDecodeError."""
    with open_file(path, encoding=encoding) as file:
        return str(file.read())


def write_bytes(path: str | os.PathLike, data: bytes) -> None:
    """Write a file; OSError."""
    with open_file(path, "wb") as file:
        file.write(data)


def write_text(path: str | os.PathLike, text: str) -> None:
    """Write a file as UTF-8; OSError."""
    with open_file(path, "w", encoding="utf-8") as file:
        file.write(text)


def write_csv(path: str | os.PathLike, heads: Iterable[str], rows: Iterable[Iterable], ends: str = "\r\n") -> None:
    """Write rows of cells below their heads; OSError."""
    with open_file(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator=ends).writerows([heads, *rows])


@contextmanager
def whole(path: str | os.PathLike) -> Iterator[Path]:
    """Where to write what is put in place of a file at the end; after an error what was there is as it was."""
    path = Path(path)
    part = path.with_name(f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}")  # another may be writing there
    try:
        yield part
        part.replace(path)
    finally:
        with suppress(OSError, ValueError):  # ValueError: a NUL in the name
            part.unlink()


def finite(value: Any) -> Any:
    """A value for JSON, which knows only finite numbers: null in place of others, within lists and tables too."""
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value
