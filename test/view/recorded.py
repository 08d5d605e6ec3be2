"""Scenes that the tests of view and film look at."""

from __future__ import annotations

import yaml

from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.scenes.load import scene_from_dict


def scene_with(name: str, **changes):
    """A shipped scene with other blocks."""
    data = yaml.safe_load((share_folder() / "config" / f"{name}.yaml").read_text("utf-8"))
    for key, value in changes.items():
        data[key] = {**data.get(key, {}), **value} if isinstance(value, dict) else value
    return scene_from_dict(data, name)
