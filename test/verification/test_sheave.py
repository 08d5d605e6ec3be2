"""The sweep at the sheave: its answers against the rigid cylinder, and the threshold of the caution."""

from math import cos, degrees, radians, sin

import numpy as np
import pytest

from cable_sim_ros.sim.checks.checks import RESOLVED
from cable_sim_ros.sim.rig.rig import RigError
from verification import sheave
from verification.sheave import LIMITS, RADIUS, TENSION, accumulated, answers, scale, solve

PHI = 2.0 * np.arcsin(0.5 * scale() / RADIUS)  # free elastica: EI / 2 R^2 = T (1 - cos phi)
RIGHT = radians(90.0)


def test_a_hard_sheave_is_the_rigid_cylinder():
    of = answers(solve(RIGHT, 0.25, 0.0, None), RIGHT)
    assert of["resultant"] == pytest.approx(2.0 * TENSION * sin(0.5 * RIGHT), rel=1e-3)
    assert of["lost_deg"] == pytest.approx(degrees(PHI), rel=2e-3)
    assert of["end_reaction"] == pytest.approx(TENSION * sin(PHI), rel=2e-3)
    assert of["inside"] == pytest.approx(TENSION * cos(PHI) / RADIUS, rel=1e-3)


@pytest.mark.parametrize("wrap_deg", [12.0, 90.0])
@pytest.mark.parametrize("phase", [0.0, 0.5])
def test_elements_at_the_threshold_are_within_five_percent(wrap_deg, phase):
    wrap, places = radians(wrap_deg), np.linspace(-0.2, radians(wrap_deg) + 0.2, 401)
    fine, here, coarse = (solve(wrap, ratio, phase, LIMITS[0]) for ratio in (0.15, RESOLVED, 5.0))
    exact, report, rough = (answers(table, wrap) for table in (fine, here, coarse))
    for name, value in exact.items():
        if value == value:
            assert report[name] == pytest.approx(value, rel=0.05), name
    assert np.abs(accumulated(here, places) - accumulated(fine, places)).max() < 0.05
    # far coarser, as the shipped mesh: the resultant holds
    assert rough["resultant"] == pytest.approx(exact["resultant"], rel=1e-3)


def test_a_finest_mesh_that_settles_nowhere_is_told(monkeypatch):
    monkeypatch.setattr(sheave, "solve", lambda *_: None)
    text = "a wrap of 12 deg with elements of 0.1 bending lengths did not settle in any of 4 positions: .*another wrap"
    with pytest.raises(RigError, match=text):
        sheave.reference(radians(12.0), None)
