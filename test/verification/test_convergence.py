"""Convergence as an experiment: the difference is to the finest of a family, and a finer mesh or step leaves less."""

import numpy as np
import pytest

from verification.experiments.convergence import Curve, Family, rows_of, tow


def test_difference_is_the_largest_to_the_finest():
    curves = {
        "two": Curve(np.array([(0.0, 1.0), (3.0, 1.0)]), 2, 0.1),
        "four": Curve(np.array([(0.5, 1.0), (1.0, 1.5)]), 4, 0.2),
    }
    family = Family("fig. 1", (("depth", "m"), ("tension", "N")), "x", "", curves)
    rows = rows_of(family)
    assert [(row.name, row.ours) for row in rows] == [
        ("fig. 1, two: depth, largest", pytest.approx(2.0)),
        ("fig. 1, two: depth, rms", pytest.approx(2.125**0.5)),
        ("fig. 1, two: tension, largest", pytest.approx(0.5)),
        ("fig. 1, two: tension, rms", pytest.approx(0.125**0.5)),
    ]


def test_shorter_steps_come_nearer_to_the_shortest():
    long, middle, short = (tow({"bare": 4, "faired": 4}, 4.0, h).samples for h in (0.1, 0.05, 0.01))
    far, near = (np.abs(one[:, 1] - short[:, 1]).max() for one in (long, middle))
    assert len(long) == len(short) == 40 and near < 0.6 * far
    assert np.ptp(short[:, 1]) > 8.0  # the ship begins to heave
