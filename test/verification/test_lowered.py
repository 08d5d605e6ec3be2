"""The lowered CTD of RV Meteor: windows and growth on made records, the shipped record, one gain of the model."""

from __future__ import annotations

import numpy as np
import pytest

from verification.experiments.lowered import WINDOW, Window, gain, growth, recorded, slope, windows


def made(per_km: float) -> tuple[np.ndarray, np.ndarray]:
    """Lowered at 0.9 m/s, stopped for 100 s in the middle, with a swing of 0.3 m/s that grows with depth."""
    t = np.arange(0.0, 1200.0, 0.5)
    rate = np.where(np.abs(t - 600.0) < 50.0, 0.0, 0.9)
    depth = np.cumsum(0.5 * rate)
    w = 2.0 * np.pi / 7.8
    return t, depth + 0.3 / w * np.exp(1e-3 * per_km * depth) * np.sin(w * t)


@pytest.mark.parametrize("per_km", [0.0, 1.0])
def test_growth_of_a_made_record_is_found(per_km):
    found = windows(*made(per_km))
    assert 4 <= len(found) <= 7
    assert all(w.rate == pytest.approx(0.9, abs=0.05) for w in found)  # none over the stop
    measured, half = growth(found)
    assert measured == pytest.approx(per_km, abs=0.06) and half < 0.2


def test_interval_covers_scatter():
    found = [Window(100.0 * k, 0.9, 0.3 * (1.1 if k % 2 else 1.0 / 1.1)) for k in range(1, 10)]
    measured, half = growth(found)
    assert abs(measured) < half < 0.5


def test_shipped_record_is_a_cast_to_1027_m():
    t, depth = recorded()
    assert depth.max() == pytest.approx(1027.0, abs=2.0) and t[-1] == pytest.approx(2971.0, abs=2.0)
    found = windows(t, depth)
    assert len(found) >= 6 and all(0.1 < w.swing < 0.5 for w in found)
    assert (len(found)) * WINDOW < t[-1]


def test_body_on_a_steel_cable_follows_the_sheave():
    assert gain(100.0, 24.0) == pytest.approx(1.0, abs=0.03)
    assert slope({100.0: 1.0, 1100.0: np.e}) == pytest.approx(1.0)
