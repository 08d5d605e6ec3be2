"""Strip charts: what they show, and their scale."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...io.messages.markers import Colours
from ...physics.towbody import BodyModel
from ...runs.summary import pitch_and_roll
from ...sim.scene import Scene

POINTS = 240  # pieces of a chart, of which least and largest are kept


class Strip(NamedTuple):
    """One chart: title with unit, colour, and its value from tick outputs (an array of them)."""

    title: str
    colour: str
    of: Callable[[np.ndarray], np.ndarray]
    least: float  # span of the scale, at least


def strips_of(scene: Scene, forces: Colours) -> tuple[Strip, ...]:
    """The charts of a scene; forces: their unit. A scale spans at least a thousandth of the cable, or so of tension."""
    least = 1e-3 * sum(section.length for section in scene.cable.sections.values())
    swing = 4e-3 * scene.contact.working_tension / forces.divisor
    charts = (
        Strip(f"tension at the sheave [{forces.unit}]", "#1f6fb2", lambda f: f["tension"] / forces.divisor, swing),
        Strip("depth of the towbody [m]", "#d4651b", lambda f: -f["body_position"][..., 2], least),
        Strip("pay-out [m]", "#6a4c9c", lambda f: f["payout"], least),
        Strip("height of the sheave above mean water [m]", "#2a8a5e", lambda f: f["sheave_position"][..., 2], least),
    )
    if scene.towbody.model is not BodyModel.RIGID:
        return charts
    return (*charts, Strip("pitch of the towbody, nose up [deg]", "#c23b33", lambda f: pitch_and_roll(f)[0], 0.5))


def scale(value: np.ndarray, least: float) -> tuple[float, float]:
    """Ends of the scale: what there is with a tenth of room, and at least a span."""
    good = value[np.isfinite(value)]
    if not len(good):
        return 0.0, least
    low, high = float(good.min()), float(good.max())
    span = max(high - low, least, 1e-3 * abs(high))
    middle = 0.5 * (low + high)
    return middle - 0.6 * span, middle + 0.6 * span
