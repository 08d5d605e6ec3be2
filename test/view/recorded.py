"""Recorded runs that the tests of view and film look at, small and made once."""

from __future__ import annotations

import warnings
from pathlib import Path

import yaml

from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.scenes.load import scene_from_dict
from cable_sim_ros.runs import offline

WAVES = {"kind": "jonswap", "height": 1.5, "period": 6.0, "towards_deg": 200.0, "components": 20}


def scene_with(name: str, **changes):
    """A shipped scene with other blocks."""
    data = yaml.safe_load((share_folder() / "config" / f"{name}.yaml").read_text("utf-8"))
    for key, value in changes.items():
        data[key] = {**data.get(key, {}), **value} if isinstance(value, dict) else value
    return scene_from_dict(data, name)


def tow_in_waves(folder: Path) -> Path:
    """A bag of the side-scan tow in waves over a seabed, 8 s."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # waves beside a ship that is moved
        scene = scene_with("side_scan", water={"waves": WAVES, "ramp": 2.0}, seabed={"depth": 120.0})
        return Path(offline.run(scene, rao="simple", duration=8.0, out=folder).bag)
