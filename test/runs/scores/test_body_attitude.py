"""Roll, pitch and heading of a towbody are scored where both have them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.tools.compare.comparison import compare
from cable_sim_ros.tools.logs.mapping.words import WORDS
from cable_sim_ros.tools.logs.own_signals import signals_of_frames

pytestmark = pytest.mark.check


def ticks(pitch: float, yaw: float, roll: float = 0.02) -> np.recarray:
    """100 s of a fish that pitches by 0.1 rad about ``pitch`` [rad]; its heading passes south."""
    frames = np.zeros(1000, TICK_OUTPUT).view(np.recarray)
    t = 0.1 * np.arange(len(frames))
    frames.time, frames.ship_quaternion = (1e9 * t).astype(np.int64), (0.0, 0.0, 0.0, 1.0)
    turns = np.stack([yaw + np.pi * t / 100.0, pitch + 0.1 * np.sin(t), roll + 0.0 * t], axis=1)
    frames.body_quaternion = Rotation.from_euler("ZYX", turns).as_quat()
    return frames


def test_the_attitude_of_a_fish_is_scored_as_that_of_a_ship_is():
    a, b = (signals_of_frames(ticks(*angles), "run") for angles in ((0.05, 3.0), (0.08, 3.0 - 2.0 * np.pi)))
    found = {score.quantity: score for score in compare(a, b, "a", "b").scores}
    assert found["body_pitch"].figures["bias"] == pytest.approx(0.03, abs=1e-9) and found["body_pitch"].unit == "rad"
    assert found["body_roll"].figures["bias"] == pytest.approx(0.0, abs=1e-9)
    assert found["body_yaw"].figures["bias"] == pytest.approx(0.0, abs=1e-9), "one turn more is the same"
    assert WORDS["body_pitch_nose_up"][:2] == ("body_pitch", "rad") and WORDS["body_pitch_nose_up"][2] == -1.0


def test_a_level_towbody_has_no_attitude_to_score():
    level = ticks(0.0, 0.0)
    level.body_quaternion = (0.0, 0.0, 0.0, 1.0)
    assert not {one.quantity for one in signals_of_frames(level, "run")} & {"body_pitch", "body_roll", "body_yaw"}
