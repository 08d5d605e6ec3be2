"""What a user of the package works with, imported lazily by the names of `cable_sim_ros` itself."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from .io.scenes.load import load_scene, scene_from_dict
from .io.scenes.winch_plan import MODE_KEY, WinchPlan
from .sim import simulator
from .sim.live_parameters import set_live
from .sim.scene import Scene

PIECE = 50.0  # command time-outs whose commands are pushed at once: fewer than the ring holds


class Simulator(simulator.Simulator):
    """One tow. ``scene``: a Scene, the name of a shipped one, the path of a file, or plain data as in a file.

    Use: ``sim.start()``, then ``sim.push(ShipMotion(...))`` and ``sim.tick()`` or ``sim.run(n)``. Raises SceneError.
    """

    def __init__(self, scene: Scene | str | os.PathLike | Mapping[str, Any]):
        if isinstance(scene, Mapping):
            scene = scene_from_dict(scene, "scene given as a dict")
        elif isinstance(scene, (str, os.PathLike)):
            scene = load_scene(scene)
        super().__init__(scene)

    def set(self, name: str, value: Any) -> None:
        """Give a number that may change while the tow runs another value, from the next tick on.

        name: its dotted key, such as ``drive.mode`` or ``setpoint.algorithm`` ("live" in the parameter manual). Raises
        KeyError for a key that is not live, ValueError with the reason for a value that cannot be served.
        """
        set_live(self, name, value)

    def run(
        self, count: int, winch: WinchPlan | str | os.PathLike | None = None, *, heads: np.ndarray | None = None
    ) -> np.recarray:
        """Advance ``count`` ticks; returns their tick outputs. Raises SolverError, PlanError.

        winch: a plan, its text or file, its times in s from the start of the simulation; give it again to go on with
        it. What else is pushed as a winch command meanwhile must not be newer than the plan's. heads: see the class
        above, without a plan.
        """
        if winch is None:
            return super().run(count, heads=heads)
        plan, drum, start = WinchPlan.of(winch), self.model.settings[0].drum, int(self.state.now.time.start)
        plan.check(drum, self.scene)
        tick, parts, left = int(self.model.settings[0].tick_ns), [], count
        piece = max(1, int(PIECE * drum.timeout * 1e9) // tick)
        while left > 0:
            now = int(self.frame.time)
            ticks, mode = plan.mode_at((now - start) // tick, tick)
            if mode and mode != self.scene.drive.mode.value:
                self.set(MODE_KEY, mode)
            ticks = min(piece, left, ticks)
            for command in plan.commands(drum, start, now, now + ticks * tick):
                self.push(command)
            parts.append(super().run(ticks))
            left -= ticks
        return np.concatenate(parts).view(np.recarray) if parts else super().run(0)
