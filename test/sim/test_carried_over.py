"""A running tow on another clock and at another place: the cable hangs as it did, and nothing jumps."""

import os

import numpy as np
import pytest
from underway import sail

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.sim.rebase import carried_over
from verification.shipped import started

pytestmark = [
    pytest.mark.trust,
    pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="too slow without compilation"),
]
SECOND = 1_000_000_000


@pytest.mark.parametrize("begin", [1000 * SECOND, 20_000_000], ids=["later", "earlier"])
def test_the_tow_goes_on_on_another_clock_and_elsewhere(begin):
    sim = started(load_scene("side_scan"), time_ns=100 * SECOND, position=(5.0, -7.0))
    for t in np.arange(0.0, 2.0, 0.02):
        sail(sim, t, np.sin(0.6 * t), 0.6 * np.cos(0.6 * t), at=(5.0, -7.0), begin=100 * SECOND)
    sim.run(150)
    before, shape, saved = sim.frame.copy(), sim.shape.copy(), sim.snapshot()
    held = saved["memory"].time.now
    sim.inputs.motion_head[0] = sim.inputs.command_head[0] = 0
    sim.restore(carried_over(sim.snapshot(), begin, (3e4, 2e4)))
    assert saved["memory"].time.now == held, "the snapshot itself stays as it is"
    assert sim.state.now.time.ticks == 150 and (sim.state.q == saved["nodes"][0]).all()
    frame = sim.tick()
    assert frame.time == begin + 10_000_000 and frame.tick == 151
    moved = np.array((3e4, 2e4)) - before.ship_position[:2]
    step = 0.01 * sim.scene.ship.tow_speed
    for name in ("ship_position", "sheave_position", "body_position"):
        went = frame[name] - before[name]
        assert went[:2] - moved == pytest.approx((step, 0.0), abs=2e-3), name
    went = sim.shape[:, :3] - shape[:, :3]
    assert np.abs(went - (*(moved + (step, 0.0)), 0.0)).max() < 0.02
    assert frame.tension == pytest.approx(before.tension, abs=5.0)
    assert frame.detachments == before.detachments and not frame.status & ~(64 | 128)
    frames = sim.run(100)  # without motion the ship comes to its mean track
    assert np.abs(np.diff(frames.tension)).max() < 20.0
    assert np.abs(np.diff(frames.ship_position[:, 2])).max() < 0.02
