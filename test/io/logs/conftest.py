"""Bytes read as a log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cable_sim_ros.tools.logs.formats import read_log
from cable_sim_ros.tools.logs.log import Log


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Log]:
    """Reads bytes as a file of this name; by: a reader of one format, in place of the one that is found."""

    def of(data: bytes, name: str = "log", by: Callable[[Path], Log] = read_log) -> Log:
        path = tmp_path / name
        path.write_bytes(data)
        return by(path)

    return of
