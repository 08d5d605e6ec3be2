"""The tow at full scale as an experiment: statics as printed, load on the sheave, reductions beside his."""

from __future__ import annotations

import numpy as np
import pytest

from verification.experiments.full_scale import HIS, NO_FACTOR, moving_rows, pressed, running, static_rows, still


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
