"""A recorded bag as regression: what the node makes of a recorded motion today, against what is in the bag.

Here the bag is recorded first, in lockstep; in your project it lies under version control, and is recorded anew where a
change is meant.
"""

import numpy as np
import pytest

from cable_sim_ros.testing import load_run, replay, tow

SECONDS = 3.0
WAITS = {"lockstep.wait": 600.0}  # s of wall time for a message, on a machine with other work


@pytest.fixture(scope="module")
def golden(tmp_path_factory):
    """Bag of a short run: motion, tick outputs, and the journal of what every tick saw."""
    pytest.importorskip("rclpy")
    folder = tmp_path_factory.mktemp("golden")
    with tow("full_scale", mode="lockstep", parameters=WAITS, record=True, folder=folder) as sim:
        sim.feed("nbp1406", start=60.0, duration=SECONDS + 1.0)
        sim.advance(SECONDS)
    return sim.recording


def test_the_node_gives_the_recorded_frames_again(tow_sim, golden):
    recorded = load_run(golden).frames
    sim = tow_sim("full_scale", mode="lockstep", parameters=WAITS)
    sim.feed(golden)  # its motion; with commands=True its winch commands too
    frames = sim.advance(SECONDS)
    assert np.array_equal(frames.time, recorded.time)
    # On the machine and with the versions of the recording: the same bits. Elsewhere the last digits of sin and exp
    # differ; 1e-6 of the tension is then a fair limit.
    for name in frames.dtype.names:
        assert np.array_equal(frames[name], recorded[name]), name


def test_the_recording_replayed_without_ros_is_the_same(golden):
    again = replay(golden)
    assert again.metrics["largest_difference"]["difference"] == 0.0
    assert again.metrics["largest_difference"]["ticks"] == round(SECONDS / 0.01)
