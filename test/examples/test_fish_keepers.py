"""Two keepers of a fish that move its flaps through topics, in lockstep: a depth, and a level attitude."""

import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
LISTING = {"towbody.centre_of_gravity": [-0.02, 0.006, -0.13]}  # 6 mm to port


def kept(tow_sim, scene, script, *arguments, seconds, **parameters):
    """Tick outputs of so many seconds of waves with the keeper, and the node."""
    parameters = {
        "setpoint.algorithm": "hold",
        "lockstep.flap_period": 0.01,  # s: each tick output is answered
        "lockstep.wait": 20.0,  # s of wall time, however busy the machine is
    } | parameters
    sim = tow_sim(scene, mode="lockstep", parameters=parameters)
    sim.run([sys.executable, HERE / script, *arguments], name=script, within=600.0)
    sim.feed(heave=(0.5, 8.0), duration=seconds + 2.0)
    frames = sim.advance(seconds)
    assert not sim.unmet
    return frames, sim


def angles(frames):
    """Roll (port side up) and pitch (nose down), deg."""
    x, y, z, w = frames.body_quaternion.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return np.degrees(roll), np.degrees(np.arcsin(2 * (w * y - z * x)))


def test_a_depth_is_kept_by_a_flap(tow_sim):
    frames, _ = kept(tow_sim, "depressor", "keep_depth.py", "110.5", seconds=12.0)
    depth = -frames.body_position[:, 2]
    assert depth[0] == pytest.approx(108.86, abs=0.1) and depth[-400:].mean() == pytest.approx(110.5, abs=0.5)


@pytest.mark.nightly  # of winch commands every run of CI shows it: test_winch_relay.py
def test_a_depth_is_kept_twice_the_same_to_the_bit(tow_sim):
    first, again = (kept(tow_sim, "depressor", "keep_depth.py", "110.5", seconds=4.0)[0] for _ in range(2))
    assert again.tobytes() == first.tobytes()


def test_a_fish_that_lists_is_kept_level_by_two_flaps(tow_sim):
    frames, sim = kept(tow_sim, "side_scan_fish", "keep_level.py", seconds=12.0, **LISTING)
    roll, pitch = angles(frames)
    assert abs(roll[0]) > 3.0 and abs(pitch[0]) > 1.0, "how it trims without"
    assert abs(roll[-800:].mean()) < 0.3 and abs(pitch[-800:].mean()) < 0.6, "over a wave"
