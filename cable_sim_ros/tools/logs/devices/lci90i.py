"""LCI-90i, winch display: each name of a winch is a source, so that a renamed one shows."""

from __future__ import annotations

import re
from pathlib import Path

from ...telegrams import lci90i
from ..log import Log
from .lines import text_of
from .telegrams import read_telegrams

_START = re.compile(rb"\d\dRD,")


def recognise(head: bytes, path: Path) -> bool:
    """Whether a telegram with a right checksum is in the head."""
    text = text_of(head)
    for start in _START.finditer(text):
        found = lci90i.LINE.match(text, start.start())
        if found and sum(found[1]) % 10_000 == int(found[8]):
            return True
    return False


def read(path: Path) -> Log:
    """All telegrams."""
    return read_telegrams(path, "lci90i")
