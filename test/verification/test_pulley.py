"""The pulley experiment: its two-point load, start, energy; the command."""

import numpy as np
import pytest

from verification.experiments.pulley import CONFIGURATIONS, Choice, build, ranges, swing


@pytest.mark.parametrize("number", CONFIGURATIONS)
def test_it_starts_where_the_table_says_and_gains_nothing(number):
    report = swing(number, 1.0)
    assert report.wrap[0] == pytest.approx(CONFIGURATIONS[number][3], abs=0.2)
    assert report.energy.max() < 2e-3 * np.ptp(report.energy) + 0.02, "a passive system never gains"
    low, high = ranges(report)["wrap"]
    assert high > 120.0 and low > CONFIGURATIONS[number][3] - 0.5


def test_the_load_is_the_rigid_body_of_the_source():
    """Mass, first and second moment about the rope's end: m, m L_PG, m L_PI^2 (its swing has the right inertia)."""
    mass, inertia, centre, _ = CONFIGURATIONS[2]
    length, aa, ab, bb = (build(2, Choice()).model.struts[name][0] for name in ("length", "aa", "ab", "bb"))
    assert aa + 2.0 * ab + bb == pytest.approx(mass)
    assert (ab + bb) * length == pytest.approx(mass * centre)
    assert bb * length**2 == pytest.approx(mass * inertia**2)


def test_validate_tells_measured_ours_allowed_and_choices(validated):
    report, rows = validated("pulley", "--duration", "0.5")
    row = rows["configuration 1, largest wrap"]
    assert row["measured"] == 146.0 and row["allowed"] == 2.77 and row["unit"] == "deg"
    withheld = [row for name, row in rows.items() if "configuration 2" in name]
    assert withheld and all(r["measured"] is None for r in withheld)
    assert len(report["choices"]) >= 10
    loss = rows["with loss: damping of all motion"]["ours"]
    assert 0.015 < loss < 0.03, "between the two dampings that enclose the measured wrap"
    angles = [name.removeprefix("with loss: configuration ") for name in rows if name.startswith("with loss:")]
    angles = [name for name in angles if name.endswith("wrap")]
    assert angles == ["1, smallest wrap", "3, smallest wrap", "3, largest wrap"], "nothing is judged by itself"


def test_loss_takes_energy():
    with_loss, without = swing(3, 2.0, Choice(loss=0.05)), swing(3, 2.0)
    assert with_loss.energy[-1] < without.energy[-1] - 1.0
