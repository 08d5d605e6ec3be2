"""The flume tank of Westin (2018) 4.3: search, bend test, damping, the winch's motion, one short case of the four.

The experiment on computed drag factors: what it prints is near what it is compared with.
"""

import numpy as np
import pytest

from verification.experiments import MISSED, OPEN, Comparison, Result, flume, turbulence, verdict_of, viv_tow
from verification.experiments.table import markdown


@pytest.fixture
def short(monkeypatch):
    """One damping ratio, one ribbon, one other choice each."""
    monkeypatch.setattr(viv_tow, "DAMPINGS", {0.02: "why"})
    monkeypatch.setattr(viv_tow, "RIBBONS", {2.0: viv_tow.RIBBONS[2.0]})
    for name in ("OTHERWISE_FLUME", "OTHERWISE_FULL"):
        monkeypatch.setattr(viv_tow, name, {"no strumming": {"viv.law": "off"}})


def test_validate_prints_printed_ours_allowed_and_why(short, validated, kept):
    report, rows = validated("viv_tow", "--duration", "2")
    assert kept(rows.values()) >= 8
    assert rows["flume, damping 0.02: miss"]["ours"] < 13.0
    assert rows["full scale: mean factor on the bare part"]["ours"] == pytest.approx(2.05, abs=0.05)
    assert 100 < rows["full scale, lowest mode"]["ours"] < rows["full scale, highest mode"]["ours"] < 250
    assert report["choices"][0]["choice"] == "flume: no strumming" and report["choices"][0]["x"] > 100.0


def test_validate_repeats_the_turbulent_flume(validated, monkeypatch):
    monkeypatch.setattr(turbulence, "OTHERWISE", {"another seed": turbulence.OTHERWISE["another seed"]})
    monkeypatch.setattr(turbulence, "SETTLING", 4.0)
    report, rows = validated("turbulence", "--duration", "1")
    measured = rows["standard deviation along X_E"]
    assert measured["measured"] == 1.19 and abs(measured["allowed"] - 0.37) < 1e-9 and measured["unit"] == "cm"
    assert abs(rows["mean place x"]["ours"] + 0.708) < 0.05 and rows["ellipsoid volume"]["measured"] == 4.82
    assert set(report["choices"][0]) == {"choice", "X_E in cm", "Y_E in cm", "Z_E in cm"}


def test_golden_section_finds_the_least_cost():
    assert flume.golden(lambda x: (x - 1.7) ** 2, 1.0, 2.0, 1e-4) == pytest.approx(1.7, abs=1e-4)
    assert flume.golden(lambda x: x, 1.0, 2.0, 1e-4) == pytest.approx(1.0, abs=1e-3)


def test_distance_is_that_to_the_nearest_place_of_the_line():
    line = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, -1.0)])
    assert flume.off(np.array([(0.5, 0.1), (1.2, -0.5), (1.0, -1.3)]), line) == pytest.approx(0.01 + 0.04 + 0.09)


def test_bend_test_gives_back_the_stiffness_of_its_points():
    tip = flume.bent(flume.EI)[-1]
    assert 1e3 * tip == pytest.approx([20.648, -37.617], rel=2e-4)  # an independent code at 20 elements
    assert flume.stiffness_of(flume.photograph(1.3 * flume.EI, 0, 0.0)) == pytest.approx(1.3 * flume.EI, rel=2e-3)


def test_first_mode_is_damped_as_the_thesis_says_and_not_by_an_objective_law():
    """omega / 2 T of a light pendulum is 119; the line's own weight and its clamp leave 112.7."""
    of_55, ours = flume.damping_per_c()
    assert of_55 == pytest.approx(112.72, rel=1e-3) and 0.0 < ours < 1e-3


def test_winch_motion_is_that_of_the_record_smaller_and_faster():
    t, curve = flume.winch_motion(flume.CHOSEN)
    half, curve_half = flume.winch_motion(flume.CHOSEN._replace(smaller=200.0, faster=10.0))
    assert half[-1] == pytest.approx(0.5 * t[-1]) and np.abs(curve(t).mean(axis=0)).max() < 1e-12
    assert curve_half(half) == pytest.approx(0.5 * curve(t), abs=1e-12)
    assert 5e-3 < curve(t)[:, 2].std() < 3e-2


def test_compensation_shrinks_the_path_and_rows_judge_it():
    found = {name: [flume.trace(name, 5.0)] for name in ("uncompensated", "simplified")}
    assert found["simplified"][0].volume < 0.7 * found["uncompensated"][0].volume
    assert 0.05 < found["simplified"][0].track < 2.0 and found["uncompensated"][0].track == 0.0
    rows = {row.name: row for row in flume.case_rows(found)}
    volume = rows["simplified: ellipsoid volume"]
    assert (volume.measured, volume.simulated) == (flume.CASES["simplified"][1][0], flume.CASES["simplified"][2][0])
    assert volume.allowed == pytest.approx(36.55 - 26.68)
    less = rows["simplified: volume less than uncompensated"]
    assert less.ours > 30.0 and less.measured == pytest.approx(80.0, abs=0.1)


def test_table_has_the_source_s_own_simulation_and_a_verdict():
    rows = [Comparison("a", "m", 1.0, 2.0, 0.5, "x", "why", 1.9), Comparison("b", "m", 1.0, None, None, "x")]
    assert [verdict_of(row) for row in rows] == [MISSED, OPEN]
    lines = markdown(Result("x", rows, [], lambda folder: folder)).splitlines()
    assert lines[0] == "| figure | unit | measured | their simulation | ours | allowed | verdict | who | why apart |"
    assert lines[2] == "| a | m | 2 | 1.9 | 1 | 0.5 | MISSED | x | why |"
    assert lines[3] == "| b | m | - | - | 1 | - | - | x |  |"
    bare = markdown(Result("x", [Comparison("b", "m", 1.0, None, None, "x")], [], lambda folder: folder)).splitlines()
    assert bare[0] == "| figure | unit | measured | ours | allowed | who |"
