"""Statistics of the running node that need no ROS."""

from __future__ import annotations

import math

import pytest

from cable_sim_ros.ros.overload import Rate

pytestmark = pytest.mark.check

SECOND = 1_000_000_000


def test_a_rate_that_is_asked_twice_at_once_stays():
    """A state that changes is published beside the regular second: over a millisecond a stream of 100 Hz shows 0."""
    rate = Rate()
    assert math.isnan(rate.of(0, 5 * SECOND)) and math.isnan(rate.of(0, 5 * SECOND + 1))
    assert rate.of(100, 6 * SECOND) == 100.0
    assert rate.of(100, 6 * SECOND + 1_000_000) == 100.0
    assert rate.of(150, 7 * SECOND) == 50.0, "counted from the last whole interval, none is lost"
    assert rate.of(150, 8 * SECOND) == 0.0
