"""Scenes of the laboratory and their starts, without warnings: what they warn of is asked for here."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

from cable_sim_ros.io.scenes.load import SceneWarning, load_scene, override
from cable_sim_ros.sim.mesh.mesh_kinds import FeedMesh
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

quiet = partial(warnings.catch_warnings, action="ignore", category=SceneWarning)  # no SceneWarning is shown


def scene_with(scene: str | Scene, values: dict[str, Any]) -> Scene:
    """A scene, or a shipped one by its name, with other values by key."""
    with quiet():
        return override(load_scene(scene) if isinstance(scene, str) else scene, values)


def started(scene: Scene, mesh: FeedMesh | None = None, **how: Any) -> Simulator:
    """A tow after its static start; mesh: in place of the scene's; how: position and heading."""
    with quiet():
        sim = Simulator(scene, mesh)
        sim.start(**how)
    return sim
