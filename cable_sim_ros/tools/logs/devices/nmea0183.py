"""NMEA 0183: sentences of any talker, with or without stamps of a logger; other telegrams between them are read too."""

from __future__ import annotations

import re
from pathlib import Path

from ...telegrams.fields import exclusive_or
from ..log import Log
from .lines import text_of
from .sentences import IDENTITY
from .telegrams import read_telegrams

_CHECKED = re.compile(rb"[$@]([A-Z0-9]{4,8},[^*$!\r\n]*)\*([0-9A-Fa-f]{2})")
_BARE = re.compile(rb"^[^$\r\n]{0,40}\$([A-Z0-9]{4,8}),[-+,.\w]*[\r\n]", re.MULTILINE)


def recognise(head: bytes, path: Path) -> bool:
    """Whether a sentence with a right checksum is in the head, or two without one."""
    text = text_of(head)
    if any(exclusive_or(found[1]) == int(found[2], 16) for found in _CHECKED.finditer(text)):
        return True
    bare = [found[1] for found in _BARE.finditer(text) if IDENTITY.fullmatch(found[1].decode("ascii"))]
    return len(bare) >= 2


def read(path: Path) -> Log:
    """All telegrams."""
    return read_telegrams(path, "nmea0183")
