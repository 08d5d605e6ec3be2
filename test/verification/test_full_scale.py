"""The tow at full scale as an experiment: statics as printed, load on the sheave, reductions beside his.

The lowered CTD of RV Meteor: windows and growth on made records, the shipped record, one gain of the model.
"""

from __future__ import annotations

import numpy as np
import pytest

from verification.experiments.full_scale import HIS, NO_FACTOR, moving_rows, pressed, running, static_rows, still
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


@pytest.fixture(scope="module")
def loads():
    return {n: pressed(n) for n in (20, 40)}


def test_statics_stand_beside_what_is_printed(loads):
    found = [("factor 3.54", still({})), ("factor 1", still(NO_FACTOR))]
    rows = {row.name: row for row in static_rows(found, loads)}
    depth = rows["factor 3.54: depth"]
    assert (depth.measured, depth.simulated) == (108.0, 108.0) and depth.ours == pytest.approx(107.4, abs=0.2)
    assert rows["factor 1: depth"].ours > 1.5 * depth.ours and rows["factor 1: depth"].measured is None
    assert rows["factor 3.54: departure angle"].ours == pytest.approx(74.0, abs=0.6)


def test_load_on_the_sheave_adds_up_to_its_resultant(loads):
    """About 2 T sin(wrap / 2), whatever the mesh; how it spreads depends on the mesh."""
    for load in loads.values():
        assert load.resultant == pytest.approx(1304.0, rel=2e-3) and load.arc > 10.0
    assert loads[20].load.max() > 1.2 * loads[40].load.max()


def test_the_cable_runs_through_the_mesh_with_his_numbers():
    scene = running({"bare": 6, "faired": 4}, 0.02)
    sections = scene.cable.sections
    assert scene.winch.drum.value == "feed" and scene.solver.tick == 0.02
    assert sections["bare"].drag_amplification == sections["faired"].drag_amplification == 3.54
    assert sections["bare"].length + sections["faired"].length - scene.winch.scope == pytest.approx(30.0)
    assert scene.mesh.sections["bare"].elements == 6


def test_reductions_are_of_the_run_without_compensation():
    found = {
        ("NBP1406", "hold"): (3700.0, 200.0, 0.1, 1.0, 2.0, 50.0),
        ("NBP1406", "simplified_sheave"): (3700.0, 20.0, 0.02, 1.0, 2.0, 60.0),
    }
    rows = {row.name: row for row in moving_rows(found)}
    less = rows["NBP1406, simplified: less deviation of the tension"]
    assert less.ours == pytest.approx(90.0) and less.simulated == pytest.approx(100.0 * (1.0 - 23.5 / 262.8))
    assert rows["NBP1406, simplified: less deviation of the contact"].ours == pytest.approx(-20.0)
    assert rows["NBP1406, no compensation: ellipsoid volume"].simulated == HIS["hold"][2]
    assert all(row.allowed is None for row in rows.values()) and np.isfinite([row.ours for row in rows.values()]).all()
