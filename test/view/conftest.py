"""One recorded run for all tests of view and film."""

import warnings
from pathlib import Path

import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs import offline
from cable_sim_ros.tools.view.moment import BagRun


@pytest.fixture(scope="session")
def bag(tmp_path_factory) -> Path:
    """The side-scan tow in waves over a seabed, 8 s."""
    waves = {"kind": "jonswap", "height": 1.5, "period": 6.0, "towards_deg": 200.0, "components": 20}
    with warnings.catch_warnings(action="ignore"):  # waves beside a ship that is moved
        scene = override(load_scene("side_scan"), {"water.waves": waves, "water.ramp": 2.0, "seabed.depth": 120.0})
        return Path(offline.run(scene, rao="simple", duration=8.0, out=tmp_path_factory.mktemp("view")).bag)


@pytest.fixture(scope="session")
def run(bag) -> BagRun:
    """The same, read."""
    return BagRun(bag)
