"""The experiment on computed drag factors: what it prints is near what it is compared with."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from verification.experiments import viv_tow


@pytest.fixture
def short(monkeypatch):
    """One damping ratio, one ribbon, one other choice each."""
    monkeypatch.setattr(viv_tow, "DAMPINGS", {0.02: "why"})
    monkeypatch.setattr(viv_tow, "RIBBONS", {2.0: viv_tow.RIBBONS[2.0]})
    for name in ("OTHERWISE_FLUME", "OTHERWISE_FULL"):
        monkeypatch.setattr(viv_tow, name, {"no strumming": {"viv.law": "off"}})


def test_validate_prints_printed_ours_allowed_and_why(short, tmp_path):
    done = CliRunner().invoke(
        commands.main,
        ["validate", "viv_tow", "--json", "--duration", "2", "--out", str(tmp_path)],
        catch_exceptions=False,
    )
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)[0]
    rows = {row["name"]: row for row in report["rows"]}
    checked = [row for row in rows.values() if row["measured"] is not None and row["allowed"] is not None]
    assert len(checked) >= 8
    for row in checked:
        assert abs(row["ours"] - row["measured"]) <= row["allowed"], row["name"]
    assert rows["flume, damping 0.02: miss"]["ours"] < 13.0
    assert rows["full scale: mean factor on the bare part"]["ours"] == pytest.approx(2.05, abs=0.05)
    assert 100 < rows["full scale, lowest mode"]["ours"] < rows["full scale, highest mode"]["ours"] < 250
    assert report["choices"][0]["choice"] == "flume: no strumming" and report["choices"][0]["x"] > 100.0
    assert (tmp_path / "strumming.png").stat().st_size > 20_000
