"""What a run of a cell gives, whoever drove the winch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

SKIPPED = "skipped"


class Done(NamedTuple):
    """Tick outputs of a run, the state of its verdict (or skipped), and why it is not ok."""

    frames: np.recarray | None
    state: str
    reason: str = ""


class Span(NamedTuple):
    """Seconds of full scale that are simulated, and of them left out of the figures."""

    duration: float
    start_up: float
