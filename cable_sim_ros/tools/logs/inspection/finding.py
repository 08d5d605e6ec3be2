"""A finding of an inspection: where, what, in words, and the numbers that show it."""

from __future__ import annotations

from typing import NamedTuple


class Finding(NamedTuple):
    """where: source, or source.field; what: a word of KINDS; text: a line; evidence: numbers by name."""

    where: str
    what: str
    text: str
    evidence: dict[str, float]


KINDS = (
    "gap", "jitter", "clock", "clock_jump", "renamed", "constant", "reset", "jump", "rounded", "repeated", "unit",
    "heave_sign", "vertical_axis", "exchanged", "heading_jump", "slow", "negative",
)  # fmt: skip
EXAMPLES = 3  # of one kind in a field
