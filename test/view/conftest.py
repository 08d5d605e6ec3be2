"""One recorded run for all tests of view and film."""

from pathlib import Path

import pytest
from recorded import tow_in_waves

from cable_sim_ros.tools.view.moment import BagRun


@pytest.fixture(scope="session")
def bag(tmp_path_factory) -> Path:
    """The side-scan tow in waves over a seabed, 8 s."""
    return tow_in_waves(tmp_path_factory.mktemp("view"))


@pytest.fixture(scope="session")
def run(bag) -> BagRun:
    """The same, read."""
    return BagRun(bag)
