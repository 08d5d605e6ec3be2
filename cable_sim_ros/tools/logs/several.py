"""Several files and folders as one log: read one after the other, each closed before the next, sources joined."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .formats import read_log
from .log import Log, LogError, Source
from .mapping.time_base import begin_of

Paths = str | os.PathLike | Sequence[str | os.PathLike]
MOST_FILES = 100_000
MOST_NUMBERS = 200_000_000  # of all columns that are kept: 1.6 GB


def paths_of(given: Paths) -> list[Path]:
    """Files and folders that were named; LogError where there is none."""
    paths = [Path(given)] if isinstance(given, (str, os.PathLike)) else [Path(one) for one in given]
    if not paths:
        raise LogError("no file was given: nothing was read. Give a log")
    return paths


def files_of(paths: Iterable[Path]) -> Iterator[tuple[Path, bool]]:
    """Files and bags of files and folders, in order of their names; whether each was named itself."""
    count = 0
    for path in paths:
        named = not path.is_dir() or is_bag(path)
        for one in [path] if named else _inside(path):
            count += 1
            if count > MOST_FILES:
                raise LogError(f"{path}: more than {MOST_FILES} files; nothing was read. Give a part of them")
            yield one, named


def is_bag(path: Path) -> bool:
    """Is a folder a bag?"""
    return (path / "metadata.yaml").is_file() or any(path.glob("*.mcap")) or any(path.glob("*.db3"))


def _inside(folder: Path) -> Iterator[Path]:
    for root, folders, files in os.walk(folder):
        if root != str(folder) and "metadata.yaml" in files:
            folders.clear()
            yield Path(root)
            continue
        folders.sort()
        for name in sorted(files):
            if not name.startswith("."):
                yield Path(root) / name


class Joined:
    """Logs of one kind joined: parts of the sources are kept, of these the columns that are wanted.

    wanted: columns of a source to keep, None where it is of no use; the names of all others are kept as `left`.
    """

    def __init__(self, wanted: Callable[[Source], Collection[str] | None]) -> None:
        self.wanted = wanted
        self.files: list[str] = []
        self.numbers = self.records = 0
        self._parts: dict[str, list[Source]] = {}
        self._left: dict[str, None] = {}
        self._first: Log | None = None
        self._begin: int | None = None

    def add(self, log: Log) -> None:
        """Another one; LogError where it is too much."""
        if self._first is None:
            self._first = Log(log.path, log.format, {}, 0, notices=[])
        self.files.append(log.path)
        self.records += log.records
        for cause, count in log.losses.counts.items():
            self._first.losses.add(cause, f"{log.path}: {log.losses.first[cause]}", count)
        for notice in log.notices:
            if notice not in self._first.notices and len(self._first.notices) < 50:
                self._first.notices.append(notice)
        for name, source in log.sources.items():
            if not len(source):
                continue
            stamps = source.stamps
            if stamps is not None:
                begin = begin_of(stamps)
                self._begin = begin if self._begin is None else min(begin, self._begin)
            kept = self.wanted(source)
            if kept is None:
                self._left[name] = None
                continue
            columns = {c: v for c, v in source.columns.items() if c in kept}
            left = tuple(c for c in source.columns if c not in columns)
            self.numbers += sum(map(len, columns.values())) + 2 * len(source)
            if self.numbers > MOST_NUMBERS:
                raise LogError(
                    f"{log.path}: with it there are more than {MOST_NUMBERS} numbers to keep; nothing was read. "
                    f"Give fewer files at a time"
                )
            self._parts.setdefault(name, []).append(replace(source, columns=columns, left=left))

    def log(self) -> Log:
        """All of them as one."""
        assert self._first is not None
        one = self._first
        count = len(self.files)
        path = self.files[0] if count == 1 else f"{self.files[0]} and {count - 1} more"
        sources = {name: _joined(parts) for name, parts in self._parts.items()}
        left = [name for name in self._left if name not in sources]
        return Log(path, one.format, sources, self.records, one.losses, one.notices, left, self._begin)


def _joined(parts: list[Source]) -> Source:
    if len(parts) == 1:
        return parts[0]
    clocks = []
    for which in ("logged", "device"):
        stamps = [getattr(part, which) for part in parts]
        clocks.append(None if any(one is None for one in stamps) else stamps)
    ruling = clocks[0] or clocks[1]
    order = range(len(parts)) if ruling is None else np.argsort([int(one[0]) for one in ruling], kind="stable")
    names = list(dict.fromkeys(name for part in parts for name in part.columns))
    columns = {
        name: np.concatenate([parts[k].columns.get(name, np.full(len(parts[k]), np.nan)) for k in order])
        for name in names
    }
    logged, device = (None if one is None else np.concatenate([one[k] for k in order]) for one in clocks)
    units: dict[str, str] = {}
    for part in parts:
        units = {**part.units, **units}
    left = tuple(dict.fromkeys(name for part in parts for name in part.left if name not in columns))
    doubts = tuple(dict.fromkeys(line for part in parts for line in part.doubts))
    return Source(parts[0].name, parts[0].kind, logged, device, columns, units, left, doubts)


def read_each(paths: Iterable[Path], format: str | None, skipped: list[str]) -> Iterator[Log]:
    """Logs of files and folders one by one; what of a folder is no log is named in `skipped`, what was named raises."""
    for path, named in files_of(paths):
        try:
            yield read_log(path, format)
        except LogError as error:
            if named:
                raise
            skipped.append(str(error))
