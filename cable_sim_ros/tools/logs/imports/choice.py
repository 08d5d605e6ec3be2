"""What a user may choose of the track of an imported ship."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Choice:
    """track: measured, or mean: a straight one at `speed` [m/s, None: that of the scene of
    a run], measured deviations of 30 s and less about it;
    heading: from east to north [rad], None: that of the log; height: mean of base_link above the water [m]."""

    track: str = "measured"
    speed: float | None = None
    heading: float | None = None
    height: float = 0.0
