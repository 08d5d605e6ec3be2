"""How `cable-sim validate shoals` counts, and draws its passes; all of them take a quarter of an hour."""

import numpy as np

from verification.experiments.shoals import MARGIN, Passed, false_alarm, ground_of, markdown, tow_of


def test_strikes_and_false_alarms_are_counted_by_the_truth():
    rows = [
        Passed("calibrated 0.0", "clear", "", 7.0, None),
        Passed("calibrated 0.1", "clear", "", -0.5, None),
        Passed("calibrated 0.2", "act", "haul", -9.0, 6.0),
        Passed("calibrated 0.3", "act", "haul", MARGIN + 1.0, 9.0),
        Passed("calibrated 0.4", "cannot", "", -30.0, None),
    ]
    assert [false_alarm(row) for row in rows] == [False, False, False, True, False]
    text = "\n".join(markdown(rows))
    assert "calibrated 0.1 (clear ): -0.50 m" in text and "| calibrated | act | 2 | 1 | 0 | 0 | 1 |" in text


def test_passes_are_drawn_once_for_all():
    one, again = (ground_of(np.random.default_rng(3), 50.0, -200.0) for _ in range(2))
    assert np.array_equal(one.depth, again.depth) and one.distance[0] == -250.0
    assert one.depth.min() < 1.8 * 50.0 + 2.0 < one.depth.max() and tow_of(2) == tow_of(2)
