"""Sobol indices: those of Ishigami's function, and what the command refuses."""

import numpy as np
import pytest

from cable_sim_ros.sweeps.sensitivity import SensitivityError, indices_of, points
from cable_sim_ros.sweeps.sweep_file import checked

PLAN = {
    "sweep": "two",
    "scene": "flume",
    "samples": {"count": 8, "ranges": {"cable.axial_stiffness": {"low": 150.0, "high": 300.0}}},
}


def ishigami(x):
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_indices_of_ishigami():
    """Closed form: first order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437 (Ishigami and Homma 1990)."""
    from types import SimpleNamespace

    from cable_sim_ros.sweeps.sweep_file import Range

    ranges = {name: Range(low=-np.pi, high=np.pi) for name in "abc"}
    samples = SimpleNamespace(ranges=ranges, count=1024, seed=1)
    plan = SimpleNamespace(sweep="ishigami", samples=samples, grid={}, motions=[1], plans=[1], setpoints=[1], seeds=0)
    rows = np.array([[row[name] for name in "abc"] for row in points(plan)])
    found = indices_of("y", list("abc"), ishigami(rows).reshape(5, 1024), 1)
    wanted = {"a": (0.3139, 0.5576), "b": (0.4424, 0.4424), "c": (0.0, 0.2437)}
    for one in found:
        first, total = wanted[one.key]
        assert one.first_low <= first <= one.first_high and one.first == pytest.approx(first, abs=0.03)
        assert one.total_low <= total <= one.total_high and one.total == pytest.approx(total, abs=0.03)
    assert indices_of("y", list("abc"), ishigami(rows).reshape(5, 1024), 1) == found


@pytest.mark.parametrize(
    "change, text",
    [
        ({"samples": None}, "has no samples.ranges"),
        ({"grid": {"winch.scope": [0.9, 1.0]}}, "varies by grid"),
        ({"samples": {**PLAN["samples"], "count": 12}}, "is no power of 2; nothing was simulated. Give 16"),
    ],
)
def test_what_is_no_plan_for_indices_is_refused(change, text):
    with pytest.raises(SensitivityError, match=text):
        points(checked({**PLAN, **change}, "here"))
