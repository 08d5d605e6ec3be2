"""Drum, motor and brake against closed forms: the experiment `drive`, the shorter half of it.

The drag laws beside the print: every figure within what is allowed, the page as it is computed, the command.
"""

from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from cable_sim_ros.physics.drag_laws import LAWS, DragLaw
from verification.experiments import drag, drive
from verification.experiments.drum import BODY, EA, closed, stepped

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "drag.md").read_text("utf-8")


def test_an_angle_that_is_off_would_be_seen():
    """1 % of drag is 0.08 deg of the steepest model."""
    angles = drag.critical_angles(drag.MODELS[:1], (1.0, 1.01))[0]
    assert 0.05 < angles[0] - angles[1] < 0.12


def test_loading_functions_to_the_printed_digits():
    assert np.abs(drag.loading_functions() - np.array(drag.LOADING_TABLE)).max() < 6e-5


def test_the_page_names_every_law_and_key():
    rows = [line.split("`")[1] for line in PAGE.splitlines() if line.startswith("| `")]
    assert {law.value for law in DragLaw} == set(LAWS) <= set(rows)
    assert {"drag_coefficient", "tangential_coefficient", "friction_coefficient"} <= set(rows)


def test_validate_drag_prints_ours_beside_the_print(validated, kept, tmp_path):
    report, rows = validated("drag")
    assert kept(rows.values()) == 11 + 55 + 49
    different = {name: row for name, row in rows.items() if row["allowed"] is None}
    assert len(different) == 7 and all(row["source"] for row in different.values())
    turned = different["F_1 eq. 12a in reversed flow"]
    assert turned["ours"] == pytest.approx(-turned["measured"], rel=1e-5)
    depth = {row["choice"]: row["depth m"] for row in report["choices"]}
    assert depth["0.11 on sin 2 eta as printed"] == pytest.approx(21.7, abs=0.5), "the judgement of the default"
    page = (tmp_path / "validate.md").read_text("utf-8")
    assert page.count("| model |") == 1
    assert page.startswith("# Experiments: every figure\n\nMade by `cable-sim validate --out DIR`")
    short = (tmp_path / "experiments.md").read_text("utf-8")
    mine = (DOCS / "experiments.md").read_text("utf-8").partition("\n## drag\n")[2].partition("\n## ")[0]
    assert short.rstrip().endswith(mine.rstrip()), "run: cable-sim validate --out DIR, copy DIR/experiments.md to docs"
    assert "| model |" not in short


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
