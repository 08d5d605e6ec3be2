"""What a check of a scene says."""

from __future__ import annotations

from typing import NamedTuple


class Problem(NamedTuple):
    """What is wrong (or doubtful) with which key, and the way out. ``number`` and ``threshold`` stand in the text."""

    key: str
    text: str
    remedy: str
