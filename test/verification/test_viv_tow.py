"""The experiment on computed drag factors: what it prints is near what it is compared with."""

from __future__ import annotations

import pytest

from verification.experiments import viv_tow


@pytest.fixture
def short(monkeypatch):
    """One damping ratio, one ribbon, one other choice each."""
    monkeypatch.setattr(viv_tow, "DAMPINGS", {0.02: "why"})
    monkeypatch.setattr(viv_tow, "RIBBONS", {2.0: viv_tow.RIBBONS[2.0]})
    for name in ("OTHERWISE_FLUME", "OTHERWISE_FULL"):
        monkeypatch.setattr(viv_tow, name, {"no strumming": {"viv.law": "off"}})


def test_validate_prints_printed_ours_allowed_and_why(short, validated, kept):
    report, rows = validated("viv_tow", "--duration", "2")
    assert kept(rows.values()) >= 8
    assert rows["flume, damping 0.02: miss"]["ours"] < 13.0
    assert rows["full scale: mean factor on the bare part"]["ours"] == pytest.approx(2.05, abs=0.05)
    assert 100 < rows["full scale, lowest mode"]["ours"] < rows["full scale, highest mode"]["ours"] < 250
    assert report["choices"][0]["choice"] == "flume: no strumming" and report["choices"][0]["x"] > 100.0
