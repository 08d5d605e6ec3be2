"""Bytes of a log, read from a file."""

import pytest

from cable_sim_ros.tools.logs.formats import read_log


@pytest.fixture
def read(tmp_path):
    """The log that is made of bytes, by the reader that the first of them tell."""

    def of(data, name="log"):
        path = tmp_path / name
        path.write_bytes(data)
        return read_log(path)

    return of
