"""The real simulator behind real topics: recorded ship motion, and the recording replayed."""

import numpy as np
import pytest
from conftest import COMPILED

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.ros.play.live import live
from cable_sim_ros.runs.offline import replay

pytestmark = [pytest.mark.realtime, COMPILED]


def test_recorded_ship_motion_through_the_node_and_replayed(world):
    report = live("nbp1406", "full_scale", 6.0, world.folder / "out", domain=world.domain, progress=lambda *_: None)
    metrics = report["node"]
    assert metrics["last"] == "running" and metrics["dropped"] == {}
    recorded = load_run(report["bag"]).frames
    assert len(recorded) == metrics["published_ticks"] >= 400
    for name in recorded.dtype.names:
        assert np.isfinite(recorded[name]).all(), name
    assert 500.0 < recorded["tension"].mean() < 20_000.0

    again = replay(report["bag"]).frames
    # samples that came too late for a tick come too late again
    same = min(len(again), len(recorded))
    assert (again["time"][:same] == recorded["time"][:same]).all()
    for name in ("tension", "payout", "body_position", "contact_resultant"):
        assert np.abs(again[name][:same] - recorded[name][:same]).max(initial=0.0) <= 1e-6, name
