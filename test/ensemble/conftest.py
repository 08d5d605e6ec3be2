"""The recorded tow, made once."""

from __future__ import annotations

import pytest
from towed import tow


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    return tow(tmp_path_factory.mktemp("towed") / "run")
