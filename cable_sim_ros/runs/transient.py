"""What the figures of a run leave out at its beginning: the take-up of motion, waves and turbulence while they grow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..physics.water import WaveKind
from ..sim.scene import Scene
from ..sim.verdict import Reason, check
from .summary import SKIP

GROWN = 0.95  # of water.ramp: 0.993 of the size


def growth(scene: Scene) -> tuple[float, str]:
    """Seconds over which the sea grows from the static start, and what grows; (0, "") where nothing does."""
    water = scene.water
    grows = ["waves"] * (water.waves.kind is not WaveKind.OFF) + ["turbulence"] * any(water.turbulence.deviation)
    return (water.ramp if grows else 0.0), " and ".join(grows)


def start_up(scene: Scene, moved: bool) -> float:
    """Seconds that the figures leave out; moved: is there a motion of the ship?"""
    return max(SKIP if moved else 0.0, growth(scene)[0])


def still_growing(scene: Scene, metrics: Mapping[str, Any], before: float = 0.0) -> list[Reason]:
    """The reason that makes a run doubtful whose figures begin before the sea has grown; figures: by JSON name.

    before: s that had been simulated when the run began.
    """
    ramp, what = growth(scene)
    skip = metrics.get("skip_s")
    if ramp == 0.0 or skip is None or skip + before >= GROWN * ramp:
        return []
    x = (skip + before) / ramp
    return [
        check(
            "SEA_GROWING",
            f"{what} grow from the static start over water.ramp = {ramp:g} s, but of a run of "
            f"{metrics['duration_s']:.3g} s the figures leave out no more than half, {skip:.3g} s, after which the "
            f"growth is at {100.0 * x * x * (3.0 - 2.0 * x):.0f} %: they are not those of the grown sea. Simulate "
            f"{2.0 * ramp:g} s or more, or make water.ramp shorter; the static tow is that of the scene without {what}",
        )
    ]
