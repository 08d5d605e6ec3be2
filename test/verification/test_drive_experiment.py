"""Drum, motor and brake against closed forms: the experiment `drive`, the shorter half of it."""

from __future__ import annotations

from math import sqrt

import pytest

from verification.experiments import drive
from verification.experiments.drum import BODY, EA, closed, stepped


@pytest.mark.parametrize(
    "rows",
    [
        lambda: drive.free_rows(drive.FREE[1:2], (200.0,)),
        lambda: drive.free_rows(drive.FREE[3:], (200.0,)),
        lambda: [drive.pendulum_row()],
        drive.stop_rows,
        drive.overhauling_rows,
        lambda: [drive.heat_row()],
        lambda: drive.emergency_rows(1),
        lambda: drive.delay_rows((0.05, 0.4)),
    ],
    ids=["6 m", "stiff", "pendulum", "stops", "overhauling", "heat", "emergency stop", "dead time"],
)
def test_figures_are_as_near_to_their_closed_forms_as_is_allowed(rows, kept):
    found = rows()
    assert kept(found) == len(found) > 0


def test_the_closed_form_of_a_short_rod_is_a_spring_between_two_masses():
    spring = sqrt(EA / 0.01 * (1.0 / 200.0 + 1.0 / BODY))
    assert closed(200.0, 0.01) == pytest.approx(spring, rel=1e-4)
    assert closed(1e12, 0.01) == pytest.approx(sqrt(EA / 0.01 / BODY), rel=1e-4), "a drum that stands"


def test_steps_are_second_order_and_lose_energy_alone():
    errors = [1.0 - stepped(10.0, tick).frequency / 10.0 for tick in (0.01, 0.005)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    assert all(stepped(w, 0.01).decay > 0.0 for w in (1.0, 30.0, 260.0, 2000.0)), "stable for every w h"
