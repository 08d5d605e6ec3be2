"""A tow recorded once that the tests of the ensemble follow: 60 s of heave, the winch at work from 25 s on.

Its tick is 50 ms: what a copy computes costs a fifth.
"""

from __future__ import annotations

from pathlib import Path

from cable_sim_ros.runs import offline

TICK = 0.05  # s
HEAVE, SECONDS, WINCH = (0.6, 6.0), 60.0, "0 hold, 25 rate 0.5, 45 hold"


def tow(folder: Path) -> Path:
    """The bag."""
    return Path(offline.run("side_scan", heave=HEAVE, duration=SECONDS, winch=WINCH, every=TICK, out=folder).bag)
