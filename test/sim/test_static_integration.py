"""Pieces of the integration of a static shape."""

from math import hypot

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cable_sim_ros.sim.statics.static_integration import hypot_of

pytestmark = pytest.mark.check
LENGTHS = st.floats(-1e9, 1e9)


@given(LENGTHS, LENGTHS)
@example(0.0, 0.0)
@example(1e-200, 1e-170)
@example(3.0, -4.0)
def test_a_length_is_rounded_as_python_rounds_it(x, y):
    assert hypot_of(x, y) == pytest.approx(hypot(x, y), rel=1e-16, abs=1e-160)
