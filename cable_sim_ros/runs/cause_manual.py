"""The page of the causes for which a message of motion or a command is refused, made from what the log says of each."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ..io.messages.fault_hypotheses import DOUBTS, UNUSED
from ..io.messages.messages import CAUSES
from ..terminal import markdown_table

TITLE = """# Causes

Made by `cable-sim manual causes --out docs/causes.md` from the code; do not edit. Why messages of
ship motion, winch, flaps and vehicle are refused, and what to do ([motion](motion.md#causes)).
"""
MISFITS = """## Wrong units and axes

A message is refused while the parts of its stream contradict each other. Where the attitudes of
`odom` and `imu/data` do, that is the odometry.
"""
COUNTED = """## Counted, nothing is refused
"""
EVENTS = {
    "imu_gap": "no message of the IMU for `heave.max_gap`: its heave filter begins anew",
    "gap": "no sample of motion for `ship.max_gap`: it is bridged by a blend",
    "source_change": "from odometry to the IMU or back, by a blend over `ship.source_blend`",
    "position_jump": "odometry jumped by more than `motion.max_jump`: its origin is shifted, the ship stays",
    "heave_diverged": "the displacement of the heave filter went beyond `heave.max_displacement`: it begins anew",
}


def text() -> str:
    """The page in Markdown."""
    messages = [cause for cause, said in CAUSES.items() if said and cause not in DOUBTS]
    events = [(f"`{cause}`", said) for cause, said in EVENTS.items()]
    parts = [TITLE, "## Messages\n", _table(messages), MISFITS, _table(DOUBTS), COUNTED]
    return "\n".join([*parts, markdown_table([("event", "what happened"), *events]) + "\n"])


def _table(causes: Iterable[str]) -> str:
    rows = [(f"`{cause}`", *_parts(CAUSES[cause])) for cause in causes]
    return markdown_table([("cause", "what is wrong", "what to do"), *rows]) + "\n"


def _parts(said: str) -> list[str]:
    """What is wrong, and the remedy, without what stands between: that the message is not used."""
    return re.split(rf":? (?:dropped|(?:odometry is )?{UNUSED})(?:; |$)", said, maxsplit=1)
