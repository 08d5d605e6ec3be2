"""Records of a fixed size in a binary log: found wherever they stand, so that damage costs what it hit.

A record is where its check says so. Bytes between records are lost; each run of them counts once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ....files import open_file
from ..log import LogError, Losses

BLOCK = 1 << 22  # bytes


def records_of(
    path: Path, size: int, valid: Callable[[np.ndarray], np.ndarray], losses: Losses
) -> Iterator[tuple[int, np.ndarray]]:
    """Blocks of records: the byte at which the first of a block stands, and uint8 [n, size].

    valid: of m bytes, m >= size, one bool for each of the m - size + 1 places: does a whole record begin there?
    """
    rest, base, expected = b"", 0, 0  # base: byte of the file where rest begins; expected: of the next record
    try:
        with open_file(path, "rb") as file:
            while block := file.read(BLOCK):
                data = np.frombuffer(rest + block, np.uint8)
                places = max(len(data) - size + 1, 0)
                starts = _apart(np.flatnonzero(valid(data)) if places else np.zeros(0, np.int64), size)
                before = np.concatenate(([expected - base], starts + size))  # ends of the records before each
                for end in before[:-1][before[:-1] != starts]:
                    losses.add("damaged bytes before a record", f"byte {base + int(end)}")
                if starts.size:
                    expected = base + int(before[-1])
                    yield base + int(starts[0]), data[starts[:, None] + np.arange(size)]
                decided = max(places, expected - base)
                rest, base = data[decided:].tobytes(), base + decided
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror}); nothing was read. Give a file") from None
    end = base + len(rest)
    if end > expected:
        cut = end - expected < size
        losses.add("record cut off at the end" if cut else "damaged bytes at the end of the file", f"byte {expected}")


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
