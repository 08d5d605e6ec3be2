"""A sample of the surveys that `cable-sim validate surveys` runs: the interval of a turn holds its truths."""

import numpy as np

from verification.experiments.surveys import KINDS, PARTS, QUICK_KIND, markdown, study, survey_of


def test_a_turn_holds_its_truths():
    """6 truths of one turn: seeded; a share of 0.95 with a standard deviation of 0.09."""
    one = study(QUICK_KIND, 0, 6)
    assert one.inside.shape == one.steady.shape == (6, len(PARTS)) and 0.4 < one.copies < 0.9
    assert (one.inside.mean(axis=0) >= 0.68).all() and one.inside.mean() < 1.0
    text = "\n".join(markdown([one]))
    assert f"| {QUICK_KIND} | 6 |" in text and "nan" not in text and "inf" not in text


def test_surveys_are_drawn_once_for_all_and_within_their_sizes():
    for kind in KINDS:
        scene, log = survey_of(kind, 3)
        again = survey_of(kind, 3)[1]
        assert np.array_equal(log.track, again.track) and not np.array_equal(
            log.cable[:1], survey_of(kind, 4)[1].cable[:1]
        )
        assert 60.0 < log.cable.min() <= log.cable.max() < 280.0 and np.isfinite(log.track).all()
        assert (scene.water.current_variation.time is not None) == (kind == "current")
        assert np.ptp(log.yaw) > 0.7 if kind == "turn" else np.ptp(log.yaw) == 0.0
