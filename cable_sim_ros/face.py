"""What a user of the package works with, imported lazily by the names of `cable_sim_ros` itself."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from .io.load import load_scene, scene_from_dict
from .sim import simulator
from .sim.scene import Scene


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
