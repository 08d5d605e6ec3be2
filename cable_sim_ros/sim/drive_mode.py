"""The mode of the winch in force, in one of eight words: what `drive.mode` is, and what commands a drum that follows.

`drive.mode: follow` carries out the newest command and the set-point law; which of them decides is told apart here.
"""

from __future__ import annotations

from collections import Counter
from typing import Protocol

import numpy as np

from ..physics.heave_compensation import SetpointLaw
from ..physics.inputs import COMMAND_ROWS, Inputs
from ..physics.tick_output import Flag
from ..physics.winch_drive import BRAKE, EMERGENCY_STOP, FOLLOW, RENDER, TENSION

IN_FORCE = (  # word, when
    ("hold", "no command, a rate of zero, or a command past its time-out; no set-point law"),
    ("rate", "a rate is commanded; no set-point law"),
    ("length", "a length is commanded; no set-point law"),
    ("tension", "`drive.mode: tension`, or the set-point law `constant_tension`"),
    ("ahc", "another set-point law but `hold`; commands add to it"),
    ("render", "`drive.mode: render`, the brake open"),
    ("brake", "`drive.mode: brake`, and while a brake lifts"),
    ("emergency_stop", "`drive.mode: emergency_stop`"),
)
WORDS = tuple(word for word, _ in IN_FORCE)
SAME = 2  # ns, of the times of a command


class Commanded(Protocol):
    """A command; NaN or None: not commanded."""

    @property
    def payout(self) -> float | None: ...

    @property
    def rate(self) -> float | None: ...


def mode_in_force(row: np.record, command: Commanded | None, law: SetpointLaw) -> str:
    """The mode, a word of IN_FORCE, after a tick; command: the newest carried out, None: none yet; law: in force."""
    given = (None, None) if command is None else (command.payout, command.rate)
    payout, rate = (np.array([np.nan if value is None else value]) for value in given)
    return WORDS[_words(np.atleast_1d(np.asarray(row)), payout, rate, law)[0]]


def count_modes(frames: np.ndarray, inputs: Inputs, law: SetpointLaw) -> Counter[str]:
    """Ticks by the mode in force, of a chunk of ticks whose commands still stand in the ring of inputs."""
    head = int(inputs.command_head[0])
    rows = np.arange(max(0, head - COMMAND_ROWS), head) % COMMAND_ROWS
    known = np.append(inputs.command[rows], [[np.nan, np.nan]], axis=0)  # the last: none
    begun = frames["time"] - np.rint(frames["command_age"] * 1e9).astype(np.int64)
    at = np.searchsorted(inputs.command_time[rows], begun + SAME, "right") - 1
    at[frames["command_age"] < 0.0] = -1
    payout, rate = known[at].T
    words, counts = np.unique(_words(frames, payout, rate, law), return_counts=True)
    return Counter({WORDS[word]: int(count) for word, count in zip(words, counts, strict=True)})


def _words(frames: np.ndarray, payout: np.ndarray, rate: np.ndarray, law: SetpointLaw) -> np.ndarray:
    """Places in WORDS."""
    mode, stale = frames["winch_mode"], frames["status"] & int(Flag.COMMAND_STALE) != 0
    lifts = np.isin(mode, (FOLLOW, RENDER)) & (frames["brake_set"] > 0.0)
    every = np.ones(len(frames), bool)
    cases = (
        ("brake", lifts | (mode == BRAKE)),
        ("emergency_stop", mode == EMERGENCY_STOP),
        ("tension", mode == TENSION),
        ("render", mode == RENDER),
        ("tension", every & (law is SetpointLaw.CONSTANT_TENSION)),
        ("ahc", every & (law is not SetpointLaw.HOLD)),
        ("hold", stale),
        ("length", ~np.isnan(payout)),
        ("rate", ~np.isnan(rate) & (rate != 0.0)),
        ("hold", every),
    )
    return np.select([where for _, where in cases], [WORDS.index(word) for word, _ in cases])
