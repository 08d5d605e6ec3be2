"""The one way to open what a user names: a regular file, of which nothing is waited for. Imports nothing of ours."""

from __future__ import annotations

import errno
import os
import stat
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


def _checked(path: str | os.PathLike, mode: int) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder, and a file is wanted", os.fspath(path))
    if not stat.S_ISREG(mode):
        kind = next((name for of_kind, name in KINDS if of_kind(mode)), "no regular file")
        why = f"it is {kind}, and only regular files are read; write it into a file and give that"
        raise NoRegularFile(errno.EINVAL, why, os.fspath(path))


def regular(path: str | os.PathLike) -> Path:
    """The path, for a library that opens it itself; OSError where it is no regular file."""
    _checked(path, os.stat(path).st_mode)
    return Path(path)


def _opener(path: str, flags: int) -> int:
    number = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _checked(path, os.fstat(number).st_mode)
    except OSError:
        os.close(number)
        raise
    return number


def open_file(path: str | os.PathLike, mode: str = "r", **options: Any) -> Any:
    """`open` for reading; OSError, at once, where it is no regular file."""
    return open(regular(path), mode, opener=_opener, **options)  # looked at before: to open may do something


def read_bytes(path: str | os.PathLike) -> bytes:
    """The bytes of a file; OSError."""
    with open_file(path, "rb") as file:
        return bytes(file.read())


def read_text(path: str | os.PathLike, encoding: str = "utf-8") -> str:
    """The text of a file, line ends as \\n; OSError, UnicodeDecodeError."""
    with open_file(path, encoding=encoding) as file:
        return str(file.read())
