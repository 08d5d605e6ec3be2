"""What a run gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..io.sources.recorded_tow import Residual
from ..sim.scene import Scene
from ..sim.verdict import Verdict


@dataclass
class Run:
    """What a run gave: tick outputs, plain figures by JSON name, why it ended early ("" = it did not), files made."""

    frames: np.recarray
    metrics: dict[str, Any]
    problem: str = ""
    bag: Path | None = None
    residuals: list[Residual] = field(default_factory=list)
    verdict: Verdict = field(default_factory=Verdict)
    scene: Scene | None = None  # that was simulated
    run_verdict: Verdict | None = None  # on the run that a replay with a journal repeats; `verdict`: is it that run?
