"""Experiments through their command."""

import json

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands


@pytest.fixture
def validated(tmp_path):
    """What `cable-sim validate NAME --json --out DIR` prints, and its rows by name; the picture is drawn."""

    def run(name, *more):
        done = CliRunner().invoke(commands.main, ["validate", name, "--json", *more, "--out", str(tmp_path)])
        assert done.exit_code == 0, done.output
        (report,) = json.loads(done.stdout)
        assert max(path.stat().st_size for path in tmp_path.glob("*.png")) > 10_000
        return report, {row["name"]: row for row in report["rows"]}

    return run


@pytest.fixture
def kept():
    """That rows which are judged are as near as is allowed, and how many they are."""

    def check(rows):
        rows = [row if isinstance(row, dict) else row._asdict() for row in rows]
        judged = [row for row in rows if row["measured"] is not None and row["allowed"] is not None]
        for row in judged:
            assert abs(row["ours"] - row["measured"]) <= row["allowed"], row["name"]
        return len(judged)

    return check
