"""The water surface of a scene's sea, as the simulation has it, at places in odom."""

from __future__ import annotations

from math import inf, pi

import numpy as np

from ..io.messages.rotation import rotate
from ..physics.sea import AMPLITUDE, FREQUENCY, NUMBER, PHASE, TOWARDS
from ..physics.water import CurrentFrame
from ..sim.scene import Scene
from ..sim.tables.sea_tables import wave_table

AGREES = 0.05  # of the rms elevation at the sheave, and a centimetre: more is another sea than the recorded one
LOOKED_AT = 400  # tick outputs that are compared


class SeaSurface:
    """Elevation of the linear waves of a scene. `agrees`: does it give what the tick outputs say at the sheave?"""

    def __init__(self, scene: Scene) -> None:
        depth = inf if scene.seabed.depth is None else scene.seabed.depth
        self.table = wave_table(scene.water.waves, scene.gravity, depth)
        self.ramp, self.turned = scene.water.ramp, scene.water.waves.frame is CurrentFrame.HEADING
        self.yaw, self.tick = 0.0, scene.solver.tick
        self.agrees, self.start_ns = bool(len(self.table)), 0

    @property
    def length(self) -> float:
        """Length [m] of the wave with most energy."""
        return 2.0 * pi / float(self.table[np.argmax(self.table[:, AMPLITUDE]), NUMBER])

    def __call__(self, x: np.ndarray, y: np.ndarray, seconds: float) -> np.ndarray:
        """Height [m] at x, y [m] of odom, seconds after the start."""
        grown = min(max(seconds, 0.0) / self.ramp, 1.0) if self.ramp > 0.0 else 1.0
        towards = self.table[:, TOWARDS] + self.yaw
        k, omega = self.table[:, NUMBER], self.table[:, FREQUENCY]
        phase = np.multiply.outer(x, k * np.cos(towards)) + np.multiply.outer(y, k * np.sin(towards))
        phase += self.table[:, PHASE] - omega * seconds
        return grown * grown * (3.0 - 2.0 * grown) * (np.cos(phase) @ self.table[:, AMPLITUDE])

    def at(self, frame) -> float:
        """Seconds since the start of the simulation."""
        return 1e-9 * (int(frame["time"]) - self.start_ns)

    def settle(self, frames: np.ndarray) -> None:
        """Find time and direction of the waves from tick outputs of a tow: `surface_elevation` decides."""
        self.agrees = False
        if not len(self.table) or not len(frames):
            return
        some = frames[:: max(1, len(frames) // LOOKED_AT)]
        first = frames[0]
        ahead = rotate(first["ship_quaternion"], (1.0, 0.0, 0.0))
        self.yaw = float(np.arctan2(ahead[1], ahead[0])) if self.turned else 0.0
        known, (x, y) = some["surface_elevation"], some["sheave_position"][:, :2].T
        bound = AGREES * float(np.sqrt(np.mean(known**2))) + 0.01
        by_tick = int(first["time"]) - round(1e9 * self.tick * int(first["tick"]))
        for start in (by_tick, int(first["time"]), int(first["time"]) - round(1e9 * self.tick)):
            self.start_ns = start
            ours = np.array([float(self(a, b, self.at(f))) for a, b, f in zip(x, y, some)])
            if np.sqrt(np.mean((ours - known) ** 2)) <= bound:
                self.agrees = True
                return
