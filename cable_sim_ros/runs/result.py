"""What a run gives, and its folder."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..files import write_text
from ..io.bags.bag import BagError
from ..io.bags.bag_writer import cannot_make
from ..io.scenes.document import RUN_BAG
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


def bag_path(out: str | os.PathLike | None) -> Path | None:
    """The bag of a run in its folder, which is made; None without one. Raises BagError where that cannot be."""
    if out is None:
        return None
    bag = Path(out) / RUN_BAG
    try:  # said before the run, not after it
        if bag.exists():
            raise BagError(
                f"'{bag}' exists already: nothing was simulated, a recording is not overwritten; "
                "give another folder with --out, or remove it"
            )
        Path(out).mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=os.fspath(out)).close()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise BagError(f"{cannot_make(bag, error)} with --out; nothing was simulated") from None
    return bag


def write_summary(out: str | os.PathLike | None, result: Run) -> None:
    """Figures of a run into its folder."""
    if out is not None:
        write_text(Path(out) / "summary.json", json.dumps(result.metrics, indent=1) + "\n")
