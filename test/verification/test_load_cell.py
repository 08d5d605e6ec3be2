"""The load cell that carries an unknown mass: known masses are found within their intervals, and the experiment."""

import numpy as np
import pytest

from verification.experiments.load_cell import LoadCell, LoadCellError, Moved, fit, judge

TRUTH = LoadCell(zero=170.0, mass=-180.0, forward=-28.0, port=8.0, lag=0.2)


def ship(seed, components=12):
    """Curves of an irregular motion of a 94 m ship: heave, roll and pitch with phases of their own."""
    rng = np.random.default_rng(seed)
    curves = []
    for deviation in (1.0, 0.012, 0.03):
        omega = 2.0 * np.pi * rng.uniform(0.06, 0.2, components)
        phase, height = rng.uniform(0.0, 2.0 * np.pi, components), deviation * (2.0 / components) ** 0.5

        def curve(t, order=0, omega=omega, phase=phase, height=height):
            turned = np.outer(np.atleast_1d(t), omega) + phase + 0.5 * np.pi * order
            return (height * omega**order * np.sin(turned)).sum(axis=1)

        curves.append(curve)
    return Moved(*curves)


def shown(seed, duration=120.0, noise=12.0):
    """Force of the true cell at 5 Hz, with noise that remembers for about 2 s."""
    motion, rng = ship(seed), np.random.default_rng(1000 + seed)
    t = np.arange(0.0, duration, 0.2)
    steps, left = rng.normal(size=len(t)), np.empty(len(t))
    left[0] = steps[0]
    for k in range(1, len(t)):
        left[k] = 0.9 * left[k - 1] + (1.0 - 0.81) ** 0.5 * steps[k]
    return t, TRUTH.force(t, motion) + noise * left, motion


def test_without_noise_the_cell_is_found():
    t, force, motion = shown(0, noise=0.0)
    found = fit(t, force, motion)
    assert found.cell == pytest.approx(TRUTH, rel=1e-4)
    assert found.explained > 1.0 - 1e-9


def test_the_intervals_hold_the_truth():
    """95 % each: of 5 values in 6 seeds, 30 in all, more than 5 outside would be one case in 300."""
    outside = 0
    for seed in range(6):
        found = fit(*shown(seed))
        off = np.abs(np.subtract(found.cell, TRUTH)) > np.array(found.half_width)
        outside += int(off.sum())
    assert outside <= 5


def test_the_other_half_is_predicted_and_a_wrong_cell_is_not():
    t, force, motion = shown(3, 240.0)
    first, second = t < 120.0, t >= 120.0
    found = fit(t[first], force[first], motion)
    assert judge(found.cell, t[second], force[second], motion).explained > 0.95
    turned = found.cell._replace(mass=-found.cell.mass)
    assert judge(turned, t[second], force[second], motion).explained < 0.0


def test_a_lever_arm_that_is_left_out_is_missed():
    t, force, motion = shown(1, noise=0.0)
    forward, whole = fit(t, force, motion, levers=1), fit(t, force, motion)
    assert forward.explained < whole.explained - 0.002
    assert forward.cell.port == 0.0


@pytest.mark.parametrize(
    "change, text",
    [
        (lambda t, force: (t[:300], force[:300]), "lasts 59.8 s: no mass was fitted, its interval needs 80 s"),
        (lambda t, force: (t, np.full(len(t), -10369.0)), "shows -10369 N throughout"),
        (lambda t, force: (t, TRUTH.force(t, ship(1))), "less than 50 %: no mass was fitted. Align the two clocks"),
        (lambda t, force: (t, TRUTH._replace(lag=5.3).force(t, ship(0))), "is at \\+5 s, the end of what is tried"),
    ],
    ids=["short", "dead", "other ship", "clock"],
)
def test_what_cannot_be_fitted_is_said(change, text):
    t, force, motion = shown(0)
    with pytest.raises(LoadCellError, match=text):
        fit(*change(t, force), motion)


def test_the_experiment(validated, kept):
    """Half of the record of the Palmer says what the other half shows."""
    _, rows = validated("load_cell")
    for half in ("fitted on the first half, second half", "fitted on the second half, first half"):
        assert rows[f"{half}: variance left"]["ours"] < 2.0
    assert kept(rows.values())
