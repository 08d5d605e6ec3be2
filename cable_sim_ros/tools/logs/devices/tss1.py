"""TSS1 of motion sensors: accelerations, heave, roll, pitch, as integers of fixed width without a checksum."""

from __future__ import annotations

from pathlib import Path

from ...telegrams import tss1
from ..log import Log
from .lines import text_of
from .telegrams import read_telegrams


def recognise(head: bytes, path: Path) -> bool:
    """Whether a telegram is in the head."""
    return tss1.LINE.search(text_of(head)) is not None


def read(path: Path) -> Log:
    """All telegrams."""
    return read_telegrams(path, "tss1")
