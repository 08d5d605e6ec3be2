"""Pitch that goes against the surge is doubted; the recorded ships are not, nor motion without one of the two."""

import numpy as np
import pytest

from cable_sim_ros.io.messages.messages import decode_odometry
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.runs.mean_track import pitch_sign

pytestmark = pytest.mark.trust


@pytest.fixture(scope="module", params=["nbp1406", "lmg1903"])
def frames(request):
    """Ten tick outputs a second of a recorded ship, a minute of them."""
    data = [message for _, kind, message in read_motion(find_bag(request.param)) if kind == "odometry"][1000:4000:5]
    poses = [decode_odometry(message) for message in data]
    found = np.zeros(len(poses), TICK_OUTPUT).view(np.recarray)
    found["time"] = [pose.stamp for pose in poses]
    angles = np.array([pose.angles for pose in poses])
    found["ship_quaternion"] = quaternions(angles)
    track = np.array([pose.position for pose in poses])
    found["ship_velocity"] = np.gradient(track, found["time"] * 1e-9, axis=0)
    return found, angles


def quaternions(angles):
    c, s = np.cos(0.5 * angles).T, np.sin(0.5 * angles).T
    return np.column_stack(
        [
            s[0] * c[1] * c[2] - c[0] * s[1] * s[2],
            c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
            c[0] * c[1] * s[2] - s[0] * s[1] * c[2],
            c[0] * c[1] * c[2] + s[0] * s[1] * s[2],
        ]
    )


def test_a_pitch_of_the_other_sign_is_doubted(frames):
    found, angles = frames
    assert pitch_sign(found) == []
    other = found.copy()
    other["ship_quaternion"] = quaternions(angles * (1.0, -1.0, 1.0))
    (reason,) = pitch_sign(other)
    assert reason.flag == "PITCH_SIGN" and "Pitch is positive bow down here" in reason.text
    assert "body_depth_m" in reason.metrics


def test_without_pitch_surge_or_time_nothing_is_said(frames):
    found, angles = frames
    for changed in (
        {"ship_quaternion": quaternions(angles * (1.0, 0.0, 1.0))},
        {"ship_velocity": np.broadcast_to([2.2, 0.0, 0.0], (len(found), 3))},
    ):
        other = found.copy()
        for name, values in changed.items():
            other[name] = values
        assert pitch_sign(other) == []
    assert pitch_sign(found[:200]) == [] and pitch_sign(found[:0]) == []
