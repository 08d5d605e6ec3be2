"""The recorded tow, made once."""

from pathlib import Path

import pytest
from towed import HEAVE, SECONDS, TICK, WINCH

from cable_sim_ros.runs import offline


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    out = tmp_path_factory.mktemp("towed") / "run"
    return Path(offline.run("side_scan", heave=HEAVE, duration=SECONDS, winch=WINCH, every=TICK, out=out).bag)
