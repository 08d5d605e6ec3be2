"""Summary: every figure against one computed by hand from made-up motion."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
from synthetic import DEPTH, HEAVE, TENSION, make_frames, write_run

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs.short_summary import rows
from cable_sim_ros.runs.summary import OUTSIDE, SUMMARY, ellipsoid_volume, summarize, summary_table, tow_axes
from cable_sim_ros.sim.flag_rules import ATTITUDE

pytestmark = pytest.mark.trust


def run(seconds=60.0, tick_s=0.1):
    frames = make_frames(round(seconds / tick_s), tick_s)
    frames["ship_velocity"] = 2.5 * np.array([math.cos(math.pi / 6), math.sin(math.pi / 6), 0])
    return frames


def test_figures_of_a_sine():
    metrics = summarize(run(60.0))  # 20 s to 60 s: four whole waves
    assert metrics["tension_mean_n"] == pytest.approx(TENSION, abs=0.01)
    assert metrics["tension_std_n"] == pytest.approx(1500 / math.sqrt(2), rel=1e-6)
    assert metrics["tension_max_n"] == pytest.approx(TENSION + 1500, rel=1e-3)
    assert metrics["tension_min_n"] == pytest.approx(TENSION - 1500, rel=1e-3)
    assert metrics["body_depth_m"] == pytest.approx(DEPTH, abs=1e-9)
    assert metrics["body_depth_std_m"] == pytest.approx(0.4 * HEAVE / math.sqrt(2))
    assert metrics["sheave_heave_std_m"] == pytest.approx(HEAVE / math.sqrt(2))
    assert metrics["body_position_m"] == pytest.approx([-320, 0, -DEPTH], abs=1e-9)
    assert metrics["contact_resultant_mean_n"] == pytest.approx(1.2 * TENSION)
    assert metrics["wrap_angle_mean_deg"] == pytest.approx(math.degrees(0.9))
    assert (metrics["steps"], metrics["iterations"]) == (600, 1800)
    assert (metrics["duration_s"], metrics["skip_s"]) == (pytest.approx(59.9), 20.0)
    assert metrics["ellipsoid_volume_m3"] == 0.0  # the made-up towbody only heaves


def test_skipped_start_does_not_count_but_its_flags_do():
    frames = run(60.0)
    frames["tension"][:100] = 1e6
    frames["status"][3:5] = Flag.HALVED | Flag.MOTION_BLENDING
    frames["status"][-1] = Flag.HALVED
    metrics = summarize(frames, skip_s=10.0)
    assert metrics["tension_max_n"] < 11e3
    assert metrics["flags"] == {"HALVED": 3, "MOTION_BLENDING": 2}
    assert summarize(frames, skip_s=9.8)["tension_max_n"] == 1e6


def test_extremes_of_a_haul_are_those_of_the_whole_run():
    frames = run(60.0)
    frames["payout"] = np.linspace(400.0, 100.0, len(frames))
    frames["body_position"][5, 2] = -500.0
    frames["status"][7:17] = Flag.DRUM_END
    metrics = summarize(frames)
    assert (metrics["payout_min_m"], metrics["payout_max_m"]) == (100.0, 400.0)
    assert metrics["body_depth_max_m"] == 500.0 and metrics["body_depth_min_m"] == pytest.approx(DEPTH - 0.6, abs=1e-3)
    assert metrics["layback_max_m"] == frames["layback"].max() and metrics["scope_min_m"] == frames["scope"].min()
    assert metrics["cable_on_drum_max_m"] == frames["cable_on_drum"].max()
    assert metrics["drum_end_s"] == pytest.approx(1.0)


def test_a_haul_is_not_summed_up_as_a_tow_at_one_place():
    """Deviations, ellipsoid and place of a tow that goes from 300 m to 200 m are of no place; scope and depth at both
    ends are there. Heave of a compensation, whatever its size, is no haul."""
    frames = run(60.0)
    time = (frames["time"] - frames["time"][0]) * 1e-9
    frames["scope"] = np.interp(time, [10.0, 50.0], [300.0, 200.0])
    frames["body_position"][:, 2] = -frames["scope"] / 3.0
    metrics = summarize(frames)
    assert {name for name, value in metrics.items() if value is None} - {*OUTSIDE, *PASSAGE} == {
        "tension_std_n",
        "body_depth_std_m",
        "body_position_m",
        "ellipsoid_volume_m3",
        "ellipsoid_volume_points_m3",
        *ATTITUDE,
    }
    assert (metrics["scope_start_m"], metrics["scope_end_m"], metrics["body_depth_end_m"]) == (
        300.0,
        200.0,
        200.0 / 3.0,
    )
    assert 50.0 < metrics["hauled_m"] < 100.0
    frames["scope"] = 300.0 + 3.0 * np.sin(2.0 * np.pi * time / 10.0)
    heaved = summarize(frames)
    assert heaved["hauled_m"] < 0.1 and heaved["tension_std_n"] > 0.0


def test_round_off_is_no_deviation():
    frames = run(60.0)
    frames["tension"] = 3191.0 + 1e-13 * np.arange(len(frames))
    assert summarize(frames)["tension_std_n"] == 0.0


def test_a_length_that_an_older_recording_lacks_is_unknown():
    frames = run(60.0)
    frames["scope"] = np.nan
    metrics = summarize(frames)
    assert metrics["scope_min_m"] is None and metrics["scope_max_m"] is None and metrics["payout_min_m"] is not None


def test_short_run_keeps_its_second_half():
    metrics = summarize(run(10.1), skip_s=20.0)
    assert metrics["skip_s"] == pytest.approx(5.0)
    assert summarize(run(0.1))["tension_std_n"] == 0.0  # one frame


def test_figures_are_the_declared_ones_and_plain_json():
    metrics = summarize(run(), missed_ticks=2, latency_p99_ms=3.5)
    assert list(metrics) == [name for name, *_ in SUMMARY]
    again = json.loads(json.dumps(metrics, allow_nan=False))
    assert again == metrics
    assert (again["missed_ticks"], again["latency_p99_ms"], again["realtime_factor"]) == (2, 3.5, None)


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: summarize(run()[:0]), ValueError, "no frames: there is nothing to summarise"),
        (lambda: summarize(run(), skip_s=-1.0), ValueError, "skip_s is -1.0 s: the summary was not made"),
        (lambda: summarize(run(), skip_s=math.nan), ValueError, "skip_s is nan s"),
        (lambda: summarize(run(), speed=1.0), TypeError, "no summary field is called speed"),
    ],
)
def test_refusals(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_ellipsoid_of_normal_positions():
    random = np.random.default_rng(3)
    time = np.linspace(0, 1000, 40_000)
    std = np.array([0.5, 0.2, 0.3])
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    positions = random.normal(size=(len(time), 3)) * std @ turn + [5, 6, -100] + np.outer(time, [2.0, -1.0, 0.0])
    exact = 4 / 3 * math.pi * std.prod() * 7.814728**1.5  # chi-square, 3 degrees, 95 %: tables
    assert ellipsoid_volume(time, positions) == pytest.approx((exact, exact), rel=0.03)


def test_ellipsoid_of_points_holds_its_share():
    time = np.linspace(0, 100, 2001)
    waves = np.array([np.sin(time), 0.4 * np.cos(1.3 * time), 0.2 * np.sin(0.7 * time + 1)]).T
    normal, points = ellipsoid_volume(time, waves)
    assert 0 < points < normal  # sines have no tails
    rest = waves - waves.mean(axis=0)
    scale = (points / normal) ** (2 / 3) * 7.814728
    inside = np.einsum("ij,jk,ik->i", rest, np.linalg.inv(np.cov(rest.T)), rest) < scale
    assert inside.mean() == pytest.approx(0.95, abs=0.01)


@given(st.floats(0.1, 10), st.floats(-3, 3), st.floats(-5, 5))
@settings(max_examples=25)
def test_ellipsoid_scales_with_the_cube_and_ignores_place_heading_and_speed(scale, heading, speed):
    time = np.linspace(0, 50, 400)
    waves = np.array([np.sin(time), np.cos(1.3 * time), np.sin(0.7 * time)]).T
    c, s = math.cos(heading), math.sin(heading)
    moved = scale * waves @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [7, 8, -9] + np.outer(time, [speed, 1, 0])
    assert ellipsoid_volume(time, moved) == pytest.approx(np.array(ellipsoid_volume(time, waves)) * scale**3, rel=1e-6)


@pytest.mark.parametrize(
    "positions",
    [
        np.zeros((50, 3)),
        np.outer(np.arange(50), [1, 2, 3]),
        np.ones((3, 3)),
        np.random.default_rng(0).normal(size=(50, 3)) * [1, 0, 1] + 1e4,
    ],
)
def test_degenerate_ellipsoid_is_zero(positions):
    assert ellipsoid_volume(np.arange(len(positions)) * 1.0, np.asarray(positions, float)) == (0.0, 0.0)


def test_tow_axes_follow_the_track_or_else_the_heading():
    frames = run()
    assert tow_axes(frames) == pytest.approx(np.array([[math.cos(math.pi / 6), 0.5], [-0.5, math.cos(math.pi / 6)]]))
    frames["ship_velocity"] = 0
    assert tow_axes(frames)[0] == pytest.approx([math.cos(math.pi / 6), 0.5])  # heading 30 degrees


def test_summary_of_a_bag_is_that_of_its_frames(tmp_path):
    frames = write_run(tmp_path / "run", 3.0)
    assert summarize(load_run(tmp_path / "run").frames, skip_s=1.0) == summarize(frames, skip_s=1.0)


def test_printed_table_has_every_known_figure():
    metrics = summarize(run(), missed_ticks=0)
    console = Console(width=200, record=True, file=open("/dev/null", "w"))
    console.print(summary_table(metrics, "a run"))
    text = console.export_text()
    for name, *_ in SUMMARY:
        assert (name in text) == (metrics[name] is not None)
    assert "9000" in text and "-320  " in text and "none" in text
    assert set(OUTSIDE) <= {name for name, *_ in SUMMARY}


PASSAGE = ("slam_max_n", "splash_tension_min_n", "splash_tension_max_n", "landing_speed_m_s")


def test_a_landing_has_the_speed_before_the_seabed_bears_even_after_a_start_on_it():
    frames = run(4.0)
    frames["status"][[0, 1, 20, 21, 30]] = Flag.SEABED
    frames["body_velocity"][:, 2] = -0.01 * np.arange(len(frames))
    assert summarize(frames)["landing_speed_m_s"] == pytest.approx(0.19)


def full(**other):
    """A summary in which everything is worth a row, but for what is given."""
    metrics = {name: 1.0 for name, *_ in SUMMARY}
    bodies = {"pod": {"depth_m": 2.0, "depth_std_m": 0.1}, "fish": {"depth_m": 2.0, "depth_std_m": 0.1}}
    metrics |= {"departure_angle_deg": 70.0, "bodies": bodies, "payout_min_m": 0.0}
    return metrics | other


def test_a_run_prints_at_most_twelve_rows_and_what_is_unusual_always():
    haul = dict.fromkeys(("tension_std_n", "body_depth_std_m", "ellipsoid_volume_m3"))
    for metrics in (full(), full(**haul), full(layback_max_m=0.0)):
        printed = rows(metrics)
        assert 8 <= len(printed) <= 12 and [row.unusual for row in printed].count(True) == 2
        assert printed[0].what == "tension at the sheave" and printed[-1].unit == "ms"
    dry = dict.fromkeys(PASSAGE)
    assert any(row.what == "scope" for row in rows(full(**haul, **dry)))
    assert not any(row.what == "layback" for row in rows(full(layback_max_m=0.0)))


def test_what_is_not_there_has_no_row():
    none = (*ATTITUDE, *PASSAGE, "strum_amplification", "latency_p99_ms")
    still = {name: 0.0 for name, *_ in SUMMARY} | dict.fromkeys(none)
    printed = rows(still | {"missed_ticks": None})
    assert [row.what for row in printed] == [
        "tension at the sheave",
        "depth of the towbody",
        "resultant on the sheave",
        "simulated over wall time",
    ]
