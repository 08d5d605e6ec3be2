"""The interval of a tow's place for many cables and speeds, made once: for one that is asked often."""

from __future__ import annotations

from math import hypot, radians, remainder
from typing import NamedTuple

import numpy as np

from ...sim.scene import Scene
from ...sim.tables.current import flow_of
from .ranges import Ranges
from .static_place import COVERAGE, NoShape, Tow, band_of

SHARES = (0.5, 1.0, 1.5)  # of the scene's cable out and speed
LEAST_SPEED, LEAST_CABLE = 0.5, 10.0  # m/s, m: of which shares are taken at least
TURNED = radians(15.0)  # of the heading, from which a current of the world makes another tow


class Spread(NamedTuple):
    """Standard deviations [m] of a towbody along its layback, across it, and of its depth."""

    along: float
    across: float
    depth: float


class BandTable:
    """Of a scene at its heading."""

    def __init__(self, scene: Scene, ranges: Ranges) -> None:
        self.heading = radians(scene.ship.heading_deg)
        held = sum(section.length for section in scene.cable.sections.values())
        middle = max(scene.winch.scope or 0.5 * held, LEAST_CABLE)
        self.cables = np.unique([min(share * middle, 0.95 * held) for share in SHARES])
        self.speeds = np.array([share * max(scene.ship.tow_speed, LEAST_SPEED) for share in SHARES])
        depths = np.linspace(0.0, float(self.cables[-1]), 5)
        self.flows = any(hypot(*flow_of(scene.water, self.heading)(-float(depth))) > 0.0 for depth in depths)
        east, north = np.cos(self.heading), np.sin(self.heading)
        self._rows = np.full((len(self.cables), len(self.speeds), 3), np.nan)
        for i, cable in enumerate(self.cables):
            for k, speed in enumerate(self.speeds):
                try:
                    band = band_of(scene, Tow(float(cable), speed * east, speed * north, self.heading), ranges)[1]
                except NoShape:
                    continue
                self._rows[i, k] = np.array([band.along, band.across, band.depth]) / COVERAGE

    def of(self, cable: float, speed: float, heading: float) -> Spread | None:
        """Of a cable out [m], a speed [m/s] and a heading [rad]; None where nothing is known of it."""
        inside = self.cables[0] <= cable <= self.cables[-1] and self.speeds[0] <= speed <= self.speeds[-1]
        if not inside or (self.flows and abs(remainder(heading - self.heading, 2.0 * np.pi)) > TURNED):
            return None
        found = [
            float(np.interp(cable, self.cables, [np.interp(speed, self.speeds, row) for row in self._rows[:, :, k]]))
            for k in range(3)
        ]
        return Spread(*found) if np.isfinite(found).all() else None
