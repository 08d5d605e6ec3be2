"""The live run: node and player in processes of their own, and what is reported when one of them fails."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

FAKE = [sys.executable, str(Path(__file__).with_name("fake_sim.py")), "cable_sim_ros.ros.node"]


@pytest.fixture
def own(world, monkeypatch):
    for name in ("NUMBA_CACHE_DIR", "PYTHONPATH"):
        monkeypatch.setenv(name, world.environment[name])
    return world


def test_live_returns_figures_and_a_bag(own, bag):
    from cable_sim_ros.io.recordings.recorded_run import load_run
    from cable_sim_ros.ros.play.live import live

    phases = []
    report = live(
        bag,
        "full_scale",
        4.0,
        own.folder / "out",
        domain=own.domain,
        node_command=FAKE,
        progress=lambda phase, done, total: phases.append(phase),
    )
    assert report["node_exit"] == report["player_exit"] == 0
    metrics = report["node"]
    assert metrics["ticks"] > 0 and metrics["missed_ticks"] == metrics["overruns"] + metrics["skipped"]
    assert len(load_run(report["bag"]).frames) == metrics["published_ticks"]
    assert phases[-1] == "running in real time"


def test_a_node_that_fails_is_reported_with_its_last_lines(own, bag, monkeypatch):
    from cable_sim_ros.ros.play.live import LiveError, live

    monkeypatch.setenv("FAKE_START_FAILS", "1")
    with pytest.raises(LiveError, match="(?s)node.*residual 123 N"):
        live(bag, "full_scale", 4.0, own.folder / "out", domain=own.domain, node_command=FAKE, progress=lambda *_: None)


def test_a_bag_that_is_none_is_reported(own):
    from cable_sim_ros.ros.play.live import LiveError, live

    with pytest.raises(LiveError, match="(?s)player.*no such bag"):
        live(
            "no_such_bag",
            "full_scale",
            4.0,
            own.folder / "out",
            domain=own.domain,
            node_command=FAKE,
            progress=lambda *_: None,
        )


def test_an_old_recording_is_not_overwritten(own, bag):
    from cable_sim_ros.ros.play.live import LiveError, live

    (own.folder / "out" / "tow").mkdir(parents=True)
    with pytest.raises(LiveError, match="exists already"):
        live(bag, "full_scale", 4.0, own.folder / "out", domain=own.domain, node_command=FAKE)
