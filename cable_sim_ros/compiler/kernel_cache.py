"""Compiled kernels on disk: a file for each, named by the hash of what it is made of.

A name is never given to other content, so that nothing goes stale: an edit gives other names, and what is found under a
name is the code itself, whole. No index is kept and no lock taken: processes may read and write at the same time. Files
unused for a month are removed, and the oldest beyond MAX_BYTES.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import time
import uuid
from pathlib import Path

KERNELS = "kernels"  # its folder below that of the project
MAX_BYTES = 400_000_000
UNUSED = 30 * 86400.0  # s
TOUCHED = 86400.0  # s; a file that is used is marked so once a day
CHECK = 32  # bytes of the checksum before the content
_swept: set[str] = set()


def roots() -> list[Path]:
    """Folders for what is compiled, the first that can be written is used: user cache, temporary folder."""
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    own = Path(tempfile.gettempdir()) / f"cable_sim_ros-{os.getuid()}"
    try:
        first = Path(base) if base else Path.home() / ".cache"
    except RuntimeError:  # no home at all
        return [own]
    return [first / "cable_sim_ros", own]


def _own(folder: Path) -> bool:
    """Is it a folder of this user? What lies in it is run."""
    try:
        return folder.stat().st_uid in (os.getuid(), 0)
    except OSError:
        return False


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return _own(folder)
    except OSError:
        return False


class KernelFiles:
    """Contents by name, in the first of ``folders`` that can be written; read from all of them."""

    def __init__(self, folders: list[Path]):
        self.folders = folders

    def find(self, name: str) -> Path | None:
        """The file of that name, None: there is none."""
        for folder in self.folders:
            path = folder / name
            if path.is_file() and _own(folder):
                return path
        return None

    def read(self, name: str) -> bytes | None:
        """The content of that name, None: there is none that is whole."""
        path = self.find(name)
        if path is None:
            return None
        try:
            data = path.read_bytes()
        except OSError:  # removed a moment ago
            return None
        with contextlib.suppress(OSError):  # not ours to mark
            if time.time() - path.stat().st_mtime > TOUCHED:
                os.utime(path)
        check, content = data[:CHECK], data[CHECK:]
        return content if hashlib.sha256(content).digest() == check else None

    def first(self) -> Path:
        """The first folder that can be written, or could not even be made."""
        return next((folder for folder in self.folders if _writable(folder)), self.folders[-1])

    def writable(self) -> bool:
        """Is there a folder to write to?"""
        return _writable(self.first())

    def write(self, name: str, content: bytes) -> bool:
        """Keep the content under that name. False: nowhere to write, it will be compiled again."""
        for folder in self.folders:
            part = folder / f".{name[:80]}.{uuid.uuid4().hex[:12]}"
            try:
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                if not _own(folder):
                    continue
                part.write_bytes(hashlib.sha256(content).digest() + content)
                os.replace(part, folder / name)
            except OSError:
                with contextlib.suppress(OSError):
                    part.unlink()
                continue
            if str(folder) not in _swept:
                _swept.add(str(folder))
                sweep(folder)
            return True
        return False


def sweep(folder: Path, now: float | None = None) -> None:
    """Remove what was not used for a month, then the oldest beyond MAX_BYTES, and folders of numba's as old."""
    now = time.time() if now is None else now
    found = []
    for path in folder.iterdir():
        with contextlib.suppress(OSError):
            status = path.stat()
            found.append((status.st_mtime, status.st_size, path))
    total = 0
    for used, size, path in sorted(found, reverse=True):
        total += size
        left_over = path.name.startswith(".") and now - used > TOUCHED  # of a writer that died
        if left_over or now - used > UNUSED or total > MAX_BYTES:
            with contextlib.suppress(OSError):
                path.unlink()
    for other in folder.parent.iterdir():
        if re.fullmatch("[0-9a-f]{16}", other.name) and other.is_dir():
            with contextlib.suppress(OSError):
                if all(now - path.stat().st_mtime > UNUSED for path in [other, *other.rglob("*")]):
                    shutil.rmtree(other, ignore_errors=True)


files = KernelFiles([root / KERNELS for root in roots()])
