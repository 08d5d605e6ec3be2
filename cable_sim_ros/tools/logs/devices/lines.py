"""Lines of a text log, however it was written: CR, LF or both, NUL bytes, UTF-16, lines without end.

Records of a fixed size in a binary log: found wherever they stand, so that damage costs what it hit.

A record is where its check says so. Bytes between records are lost; each run of them counts once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....errors import told_as
from ....files import open_file
from ..log import Log, LogError, Losses, unread

RECORDS = 1 << 22  # bytes

LONGEST = 65_536  # bytes of a line; the longest sentence that is known (TSPHA of a wave buoy) has 22 836
BLOCK = 1 << 20
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")  # of UTF-8 and UTF-16
TEXT = frozenset([*range(0x20, 0x7F), *b"\t\r\n\x01\x02\x03"])  # also SOH, STX, ETX, which frame telegrams


def records_of(path: Path, size: int, valid: Callable[[np.ndarray], np.ndarray], losses: Losses) -> np.ndarray:
    """All records, uint8 [n, size].

    valid: of m bytes, m >= size, one bool for each of the m - size + 1 places: does a whole record begin there?
    """
    found = [np.zeros((0, size), np.uint8)]
    rest, base, expected = b"", 0, 0  # base: byte of the file where rest begins; expected: of the next record
    unreadable = told_as(LogError, f"{path}: cannot be read", "; nothing was read. Give a file")
    with unreadable, open_file(path, "rb") as file:
        while block := file.read(RECORDS):
            data = np.frombuffer(rest + block, np.uint8)
            places = max(len(data) - size + 1, 0)
            starts = _apart(np.flatnonzero(valid(data)) if places else np.zeros(0, np.int64), size)
            before = np.concatenate(([expected - base], starts + size))  # ends of the records before each
            for end in before[:-1][before[:-1] != starts]:
                losses.add("damaged bytes before a record", f"byte {base + int(end)}")
            if starts.size:
                expected = base + int(before[-1])
                found.append(data[starts[:, None] + np.arange(size)])
            decided = max(places, expected - base)
            rest, base = data[decided:].tobytes(), base + decided
    end = base + len(rest)
    if end > expected:
        cut = end - expected < size
        losses.add("record cut off at the end" if cut else "damaged bytes at the end of the file", f"byte {expected}")
    return np.concatenate(found)


def _apart(candidates: np.ndarray, size: int) -> np.ndarray:
    """Of places at which a record may begin, the first and each next one that overlaps no other."""
    if not candidates.size or np.diff(candidates).min(initial=size) >= size:
        return candidates
    kept, free = [], 0
    for place in candidates.tolist():
        if place >= free:
            kept.append(place)
            free = place + size
    return np.array(kept, np.int64)


class Line(NamedTuple):
    """number: from 1; text: without its end; whole: False where the file ends within it."""

    number: int
    text: bytes
    whole: bool


def lines_of(path: Path, losses: Losses) -> Iterator[Line]:
    """Lines that are not blank; one that is too long is lost. NUL bytes are left out, so UTF-16 of ASCII is read."""
    with unread(path), open_file(path, "rb") as file:
        yield from _lines(file, losses)


def _lines(file, losses: Losses) -> Iterator[Line]:
    rest, number, skipping = b"", 0, False
    first = True
    while block := file.read(BLOCK):
        if first:
            block = _unmarked(block)
            first = False
        text = rest + block.replace(b"\0", b"")
        held = text.endswith(b"\r")  # its LF may come with the next block
        parts = (text[:-1] if held else text).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
        rest = parts.pop() + (b"\r" if held else b"")
        for part in parts:
            number += 1
            if skipping or len(part) > LONGEST:
                skipping = False
                losses.add(f"line longer than {LONGEST} bytes", f"line {number}")
            elif part.strip():
                yield Line(number, part, True)
        if len(rest) > LONGEST:
            rest, skipping = b"", True
    if skipping:
        losses.add(f"line longer than {LONGEST} bytes", f"line {number + 1}")
    elif rest.strip():
        yield Line(number + 1, rest.rstrip(b"\r"), rest.endswith(b"\r"))


def _unmarked(head: bytes) -> bytes:
    for mark in MARKS:
        head = head.removeprefix(mark)
    return head


def text_of(head: bytes) -> bytes:
    """The head of a file without NUL bytes and marks, b"" where it is no text."""
    text = _unmarked(head).replace(b"\0", b"")
    start = text[:512]
    return text if sum(byte in TEXT for byte in start) >= 0.9 * len(start) else b""


def with_records(log: Log, what: str) -> Log:
    """The log; LogError where it has no record. what: that was looked for."""
    if log.records:
        return log
    raise LogError(
        f"{log.path}: holds no {what} that could be read ({log.losses}); nothing was read. Check that it is such a log"
    )
