"""The verdict of a node, which keeps counts and no Frames."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros


def ended(statuses, problem="", most=2000.0, **figures):
    from cable_sim_ros.io.load import load_scene
    from cable_sim_ros.physics.frame import FRAME
    from cable_sim_ros.ros.ending import verdict_of_node

    frame = np.zeros(1, FRAME).view(np.recarray)[0]
    frame.status = list(statuses)[-1] if statuses else 0
    latest = frame if statuses else None
    publisher = SimpleNamespace(statuses=Counter(statuses), latest=latest, most_tension=most)
    return verdict_of_node(SimpleNamespace(scene=load_scene("full_scale"), problem=problem), publisher, figures)


@pytest.mark.parametrize(
    "given, state, flags",
    [
        (({0: 6000},), "ok", []),
        (({0: 5000, 64: 1000},), "doubtful", ["MOTION_STALE"]),
        (({0: 5999, 8: 1},), "doubtful", ["DETACHED"]),
        (({0: 6000}, "the solver gave up"), "failed", ["HALTED"]),
        (({}, "no static start"), "failed", ["HALTED"]),
        (({},), "ok", []),
        (({0: 6000}, "", 102e3), "doubtful", ["OVERLOAD"]),
    ],
)
def test_a_node_ends_as_its_ticks_say(given, state, flags):
    found = ended(*given)
    assert (found.state, [reason.flag for reason in found.reasons]) == (state, flags)


def test_lost_messages_and_lost_time_count():
    found = ended({0: 6000}, skips_ahead=1, recorder={"dropped": 3})
    assert [reason.flag for reason in found.reasons] == ["BEHIND", "NOT_RECORDED"]
