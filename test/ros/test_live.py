"""The live run: node and player in processes of their own, and what is reported when one of them fails."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.ros.play.live import LiveError, live

FAKE = [sys.executable, str(Path(__file__).with_name("fake_sim.py")), "cable_sim_ros.ros.node"]


@pytest.fixture
def own(world, monkeypatch):
    for name in ("NUMBA_CACHE_DIR", "PYTHONPATH"):
        monkeypatch.setenv(name, world.environment[name])
    monkeypatch.setattr("cable_sim_ros.ros.play.live.STOP", ((signal.SIGINT, 600.0),))
    return world


def run(own, bag, progress=lambda *_: None) -> dict:
    return live(bag, "full_scale", 2.0, own.folder / "out", domain=own.domain, node_command=FAKE, progress=progress)


def test_live_returns_figures_and_a_bag(own, bag):
    phases = []
    report = run(own, bag, lambda phase, done, total: phases.append(phase))
    assert report["node_exit"] == report["player_exit"] == 0
    metrics = report["node"]
    assert metrics["ticks"] > 0 and metrics["missed_ticks"] == metrics["overruns"] + metrics["skipped"]
    assert len(load_run(report["bag"]).frames) == metrics["published_ticks"]
    assert phases[-1] == "running in real time"


@pytest.mark.parametrize("poll", [0.0, 2.0], ids=["sees it fail", "finds it ended"])
def test_what_fails_is_reported_with_its_last_lines(own, bag, monkeypatch, poll):
    """The same words whether the node is seen before it has ended or after."""
    said = "(?s)node is failed: not configured: no static equilibrium: residual 123 N .*last lines:.*residual 123 N"
    with monkeypatch.context() as patched, pytest.raises(LiveError, match=said) as failed:
        patched.setenv("FAKE_START_FAILS", "1")
        patched.setattr("cable_sim_ros.ros.play.live.POLL", poll)
        run(own, bag)
    assert "Traceback" not in str(failed.value)


def test_a_player_that_fails_is_reported_and_no_recording_overwritten(own, bag):
    with pytest.raises(LiveError, match="(?s)player.*no such bag"):
        run(own, "no_such_bag")
    with pytest.raises(LiveError, match="exists already"):  # what it has recorded
        run(own, bag)
