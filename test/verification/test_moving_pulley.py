"""The rocking arm of Westin (2018) 4.2: its kinematics, its mean load, what an amplitude cannot do."""

import numpy as np
import pytest

from verification.experiments.moving_pulley import (
    CELL,
    FREQUENCY,
    GRAVITY,
    MASS,
    PULLEY,
    RAMP,
    Choice,
    arm,
    build,
    carried,
    low_pass,
    rock,
)
from verification.experiments.pulley import DENSITY


@pytest.mark.parametrize("harmonic", [0.0, 0.1])
@pytest.mark.parametrize("place", [PULLEY, CELL])
def test_rates_of_a_point_of_the_arm_are_those_of_its_path(place, harmonic):
    t = np.linspace(0.0, RAMP + 1.0, 40_001)
    path = carried(place, arm(t, 0.06, harmonic))
    for k in (0, 3):
        rate = np.gradient(path[:, k : k + 3], t, axis=0)[2:-2]
        assert np.abs(rate - path[2:-2, k + 3 : k + 6]).max() < 2e-4
    assert np.ptp(np.hypot(path[:, 0], path[:, 2])) < 1e-12


def test_level_arm_hangs_the_load_from_the_cell():
    """Without friction tension less weight per length times height is the same all along the rope."""
    rig = build(Choice())
    pull = np.linalg.norm(rig.state.reaction[0, :3])
    below = rig.state.q[0, 2] - rig.state.q[-2, 2]
    assert 0.5 < below < 0.6
    assert pull == pytest.approx(MASS * GRAVITY + DENSITY * GRAVITY * below, rel=2e-3)


def test_swing_of_the_tension_is_that_of_the_load_on_the_arm():
    """m x_P A w^2 to both sides: the range grows with the amplitude, its middle stays."""
    small, large = rock(1.0, 2.0), rock(3.0, 2.0)
    for run, degrees in ((small, 1.0), (large, 3.0)):
        swing = 0.5 * (run.ends[1] - run.ends[0])
        wanted = MASS * PULLEY[0] * np.radians(degrees) * (2.0 * np.pi * FREQUENCY) ** 2
        assert swing == pytest.approx(wanted, rel=0.05)
    assert sum(large.ends) / 2.0 == pytest.approx(sum(small.ends) / 2.0, abs=0.2)


def test_the_filter_passes_3_hz_and_stops_5():
    choice = Choice()
    taps = low_pass(choice)
    gain = [
        abs(np.sum(taps * np.exp(-2j * np.pi * f * choice.step * np.arange(len(taps))))) for f in (1.0, 3.0, 5.0, 20.0)
    ]
    assert gain[:2] == pytest.approx([1.0, 1.0], abs=2e-3) and max(gain[2:]) < 2e-3
    assert len(low_pass(Choice(stop_band=0.0))) == 1
