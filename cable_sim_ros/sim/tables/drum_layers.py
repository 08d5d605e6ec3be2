"""Layers of cable on the drum of a scene, in numbers for physics/drum_layers.py."""

from __future__ import annotations

from math import sqrt
from typing import cast

import numpy as np

from ...physics.winch import DRUM
from ..scene import Scene

BEDDED = 0.5 * sqrt(3.0)  # diameters that a layer lies above the next, each turn between two below


def layered(scene: Scene) -> np.record:
    """DRUM with radius and layers alone; no turns in a layer where the scene has none."""
    winch, diameter, row = scene.winch, scene.cable.diameter, np.zeros(1, DRUM).view(np.recarray)
    row.radius = winch.drum_radius + 0.5 * diameter
    row.lay_pitch = diameter if winch.lay_pitch is None else winch.lay_pitch
    row.lay_rise = BEDDED * diameter if winch.lay_rise is None else winch.lay_rise
    row.lay_turns = winch.lay_width / row.lay_pitch
    return cast(np.record, row[0])
