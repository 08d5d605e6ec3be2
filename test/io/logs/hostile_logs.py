"""A reader of logs against damage: files cut off, files with flipped bits, each read or refused in a clear line."""

from __future__ import annotations

import random
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from cable_sim_ros.tools.logs.log import Log, LogError

CUTS, FLIPS = 64, 200
TRACED = 5  # of so many files the memory of one is counted, which costs time
SLOWEST = 10.0  # s of CPU for one file of a test
MEMORY, PER_BYTE = 64e6, 4000.0  # bytes that a reader may take, and for each byte of the file


def survive(read: Callable[[Path], Log], data: bytes, path: Path) -> tuple[list[Log | None], list[Log | None]]:
    """Read `data` cut off at many places, then with one to three bits flipped; data should be a few kB.

    read: of a module of io/logs; path: where the damaged files are written, its suffix is kept. Fails on any other end
    than a sound Log or a LogError of one line that names the file, on more records of a part than of the whole, on more
    memory than the file accounts for, and on a read without end. Returns what came of the cuts and of the flips, None
    for a refusal, for what a format promises beyond that.
    """
    path.write_bytes(data)
    whole = read(path)  # also imports what the reader needs, before memory is counted
    assert_sound(whole)
    assert whole.records > 0
    parts = [_outcome(read, hurt, path, what, k) for k, (what, hurt) in enumerate(damaged(data, CUTS, FLIPS))]
    for k, part in enumerate(parts[:CUTS]):
        assert part is None or part.records <= whole.records, f"cut at {k}/{CUTS}: more records than in the whole file"
    path.write_bytes(data)
    return parts[:CUTS], parts[CUTS:]


def damaged(data: bytes, cuts: int, flips: int) -> Iterator[tuple[str, bytes]]:
    """What was done to `data`, and what is left of it: cut off at so many places, then so often with flipped bits."""
    for k in range(cuts):
        yield f"cut at {k}/{cuts}", data[: len(data) * k // cuts]
    chance = random.Random(len(data))
    for k in range(flips):
        hurt, places = bytearray(data), []
        for _ in range(chance.choice((1, 1, 3))):
            place, bit = chance.randrange(len(data)), chance.randrange(8)
            hurt[place] ^= 1 << bit
            places.append((place, bit))
        yield f"flip {k} of (byte, bit) {places}", bytes(hurt)


def _outcome(read: Callable[[Path], Log], data: bytes, path: Path, what: str, k: int) -> Log | None:
    path.write_bytes(data)
    if k % TRACED == 0:
        tracemalloc.start()
    begun = time.process_time()
    try:
        log = read(path)
        assert_sound(log)
    except LogError as error:
        text = str(error)
        assert str(path) in text, f"{what}: {text!r} does not name the file"
        assert "\n" not in text and len(text) < 1000, f"{what}: {text!r} is no clear line"
        log = None
    except AssertionError:
        raise
    except Exception as error:
        raise AssertionError(f"{what}: {type(error).__name__}: {error}") from error
    finally:
        used = tracemalloc.get_traced_memory()[1]  # 0 where it is not counted
        tracemalloc.stop()
    assert time.process_time() - begun < SLOWEST, f"{what}: takes too long"
    assert used < MEMORY + PER_BYTE * len(data), f"{what}: takes {used:.0f} bytes for a file of {len(data)}"
    return log


def assert_sound(log: Log) -> None:
    """Clocks and columns of each source are as long as each other, and of the types that Log promises."""
    for name, source in log.sources.items():
        assert source.name == name
        clocks = [clock for clock in (source.logged, source.device) if clock is not None]
        for clock in clocks:
            assert clock.dtype == np.int64 and clock.shape == (len(source),), name
        for column, values in source.columns.items():
            assert values.dtype == np.float64 and values.shape == (len(source),), f"{name}: {column}"
    assert log.records >= 0 and all(count > 0 for count in log.losses.counts.values())
    assert set(log.losses.counts) == set(log.losses.first)
