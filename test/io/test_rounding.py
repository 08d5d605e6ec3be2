"""Rounded motion: how coarse the numbers are is found from them, and what the smoothing spline leaves wrong."""

from math import pi, radians

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from cable_sim_ros.io.messages.messages import decode_odometry
from cable_sim_ros.io.sources import coarse_bag
from cable_sim_ros.io.sources.coarse_bag import smooth_odometry
from cable_sim_ros.io.sources.motion_curves import Given, through
from cable_sim_ros.io.sources.motion_table import Samples, odometry_events, read_table
from cable_sim_ros.io.sources.recorded_tow import RecordedTow
from cable_sim_ros.io.sources.rounding import even, noise, resolution
from cable_sim_ros.physics.ship import Ship

pytestmark = pytest.mark.check

SHEAVE = (-16.0, 0.0, 6.0)
SHIP = Ship(tow_speed=2.0, heading_deg=30.0, reference_height=0.5)
HEAVE = Given("heave_m", "m", 1.0, False)
T = np.arange(0.0, 60.0, 0.1)
WAVE = np.sin(2.0 * pi * T / 7.3)


@pytest.mark.parametrize(
    ("values", "found"),
    [
        (np.round(WAVE, 2), 0.01),
        (np.round(2.06 * T + 0.2 * WAVE, 2), 0.01),
        (5e6 + np.round(2.06 * T + 0.2 * WAVE, 2), 0.01),
        (np.round(WAVE / 0.05) * 0.05, 0.05),
        (np.round(3.0 * WAVE) / 3.0, 1.0 / 3.0),
        (np.radians(300.0 + np.round(3.0 * WAVE, 1)), radians(0.1)),
        (np.round(np.radians(np.round(3.0 * WAVE, 1)), 6), radians(0.1)),  # rounded again in another unit
        (np.round(0.012 * WAVE, 2), 0.01),  # one increment up and down
        (np.round(np.sin(2.0 * pi * T / 8.0), 5), 1e-5),  # 80 different rows: no two differ by one increment
        (WAVE, 0.0),
        (2.06 * T, 0.0),  # on multiples of 0.206 without an error
        (0.0 * T, 0.0),
        ((0.1 * T) ** 2, 0.0),
        (np.round(WAVE[:20], 2), 0.0),  # too few to tell
    ],
)
def test_the_resolution_is_the_smallest_common_increment(values, found):
    assert resolution(values) == pytest.approx(found, rel=2e-5, abs=0.0)


def test_noise_beside_the_rounding_is_seen_where_the_rate_lets_it():
    random = np.random.default_rng(1)
    rough = np.round(WAVE + 0.006 * random.standard_normal(len(T)), 2)
    assert noise([rough], 0.01, 10.0)[0] == pytest.approx(np.hypot(0.006, 0.01 / 12**0.5), rel=0.1)
    assert noise([rough], 0.01, 1.0) == noise([np.round(WAVE, 2)], 0.01, 10.0) == (0.01 / 12**0.5,) * 2
    used, seen = noise([np.round(WAVE + 0.05 * random.standard_normal(len(T)), 2)], 0.01, 10.0)
    assert used == 0.01 and seen == pytest.approx(0.05, rel=0.15)


def test_rounded_times_of_even_rows_are_made_even_again():
    """30 Hz written to 10 ms: rows 30 and 40 ms apart, refused before."""
    true = np.delete(np.arange(900) / 30.0, [40, 41, 300])
    assert even(np.round(true, 2)) == pytest.approx(true, abs=1e-3) and even(true) is true
    wander = np.round(true + 0.02 * np.sin(true), 2)
    assert even(wander) is wander, "not even within the rounding"


@pytest.mark.parametrize("rate", [1.0, 5.0, 10.0, 25.0])
@pytest.mark.parametrize("period", [5.3, 8.7, 12.0])
def test_the_smoothed_acceleration_is_that_of_the_wave_without_lag(rate, period):
    t, w, x = np.arange(0.0, 121.0, 1.0 / rate), 2.0 * pi / period, np.arange(20.0, 100.0, 0.05)
    value = np.round(0.15 * np.sin(w * t + 0.4), 2)
    (curve,), found = through(HEAVE, [(t, value, None)])
    true, ours = -0.15 * w * w * np.sin(w * x + 0.4), curve(x, 2)
    seen = ours @ np.exp(-1j * w * x) / (true @ np.exp(-1j * w * x))
    assert np.std(ours) == pytest.approx(np.std(true), rel=0.02)
    assert abs(seen) == pytest.approx(1.0, abs=0.02) and abs(np.degrees(np.angle(seen))) < 1.0
    assert found.resolution == pytest.approx(0.01)
    assert np.std(ours - true) < 2.0 * found.left < 0.25 * found.motion
    if rate > 5.0:
        assert found.raw > 5.0 * found.motion, "what came in without smoothing"
        assert found.raw == pytest.approx(np.std(CubicSpline(t, value)(x, 2)), rel=0.2)


def test_rates_beside_rounded_values_are_used():
    t = np.arange(0.0, 120.0, 0.1)
    exact, rates = 0.15 * np.sin(t), 0.15 * np.cos(t)
    only, both, fine = (
        through(HEAVE, [(t, np.round(exact, 2), beside)]) for beside in (None, np.round(rates, 2), rates)
    )
    x = t[200:-200]
    off = [np.std(curves[0](x, 2) + 0.15 * np.sin(x)) for curves, _ in (only, both, fine)]
    assert off[2] < 0.2 * off[1] < 0.2 * off[0] and both[1].left < only[1].left
    curves, found = through(HEAVE, [(t, exact, np.round(rates, 2))])
    assert found is None and np.array_equal(curves[0](x), CubicSpline(t, exact)(x)), "the values give the rates"


def table(path, t=T, **columns):
    rows = zip(t, *columns.values())
    path.write_text("\n".join([",".join(("time_s", *columns)), *(",".join(map(repr, map(float, r))) for r in rows)]))
    return path


def test_an_exact_table_passes_bit_for_bit_and_a_rounded_one_is_told(tmp_path):
    exact = read_table(table(tmp_path / "a.csv", heave_m=WAVE, roll_deg=2.0 * WAVE), SHIP, SHEAVE)
    decoded = [decode_odometry(event.data) for event in exact.events]
    at = (np.array([m.stamp for m in decoded]) - decoded[0].stamp) / 1e9
    assert np.array_equal([m.position[2] for m in decoded], CubicSpline(T, WAVE + 0.5)(at))
    assert exact.rounded == [] and exact.notices == [] and exact.doubts == []
    coarse = read_table(table(tmp_path / "b.csv", heave_m=np.round(WAVE, 2), roll_deg=2.0 * WAVE), SHIP, SHEAVE)
    (report,) = coarse.rounded
    assert report["column"] == "heave_m" and report["resolution"] == pytest.approx(0.01) and report["unit"] == "m"
    assert report["acceleration_left"] < 0.02 * report["acceleration_motion"] < report["acceleration_rounded"]
    assert "b.csv: heave_m is rounded to 0.01 m, which by itself makes" in coarse.notices[0] and not coarse.doubts
    heights = np.array([decode_odometry(event.data).position[2] for event in coarse.events])
    assert heights[100:-100] == pytest.approx(CubicSpline(T, WAVE + 0.5)(at)[100:-100], abs=0.005)


def test_motion_of_a_quantum_or_two_makes_a_run_doubtful(tmp_path):
    calm = read_table(table(tmp_path / "calm.csv", heave_m=np.round(0.025 * WAVE, 2)), SHIP, SHEAVE)
    (doubt,) = calm.doubts
    assert doubt.flag == "MOTION_ROUNDED" and "tension_std_n" in doubt.metrics
    assert "rounded (heave_m to 0.01 m); smoothed within that, it still leaves 0.00" in doubt.text
    assert "limit 8 %). Write the motion with more digits" in doubt.text
    fine = read_table(table(tmp_path / "fine.csv", heave_m=np.round(0.025 * WAVE, 4)), SHIP, SHEAVE)
    assert fine.rounded and not fine.doubts
    noisy = WAVE + 0.1 * np.random.default_rng(2).standard_normal(len(T))  # far more than the last digit
    assert read_table(table(tmp_path / "noisy.csv", heave_m=np.round(noisy, 2)), SHIP, SHEAVE).doubts


def odometry(rate=True, pose=0.01, twist=0.0):
    """A tow in waves as odometry, poses rounded to `pose` m and ten times that in deg, twist absent or rounded."""
    t = T
    curves = [
        CubicSpline(t, a * np.sin(0.8 * t + k) + (2.0 * t if k == 0 else 0.0)) for k, a in enumerate((0.2, 0.1, 0.3))
    ]
    curves += [CubicSpline(t, radians(a) * np.sin(0.8 * t + k)) for k, a in enumerate((2.0, 1.0, 0.5))]
    value, rates = np.column_stack([c(t) for c in curves]), np.column_stack([c(t, 1) for c in curves])
    if pose:
        grain = np.array([pose] * 3 + [radians(10.0 * pose)] * 3)
        value = np.round(value / grain) * grain
    events = odometry_events(
        Samples(np.round((t + 1.0) * 1e9).astype(np.int64), value, rates if rate else 0.0 * rates), ""
    )
    if twist:
        events = [event._replace(data=_with_twist(event.data, twist)) for event in events]
    return RecordedTow("made", events), curves, t


def _with_twist(data, grain, knots=1.0):
    numbers = np.frombuffer(data[-680:], "<f8").copy()
    numbers[43:46] *= knots
    numbers[43:49] = np.round(numbers[43:49] / grain) * grain
    return data[:-680] + numbers.tobytes()


@pytest.mark.parametrize("given", [{"rate": False}, {"twist": 0.002}])
def test_rounded_odometry_of_a_bag_is_smoothed_where_its_twist_does_not_help(given):
    tow, curves, t = odometry(**given)
    smooth_odometry(tow, SHEAVE)
    assert len(tow.rounded) == 6 and len(tow.notices) == 6
    read = [decode_odometry(event.data) for event in tow.events]
    inside = slice(100, -100)
    for k, allowed in ((0, 0.01), (2, 0.01)):
        ours = np.array([m.position[k] for m in read])
        assert ours[inside] == pytest.approx(curves[k](t)[inside], abs=allowed)
    climb = np.gradient(np.array([m.position[2] for m in read]), 0.1)
    assert np.std(np.gradient(climb, 0.1)[inside] - curves[2](t, 2)[inside]) < 0.05 * np.std(curves[2](t, 2))
    assert [event.arrival for event in tow.events] == [event.time for event in tow.events]


def test_odometry_that_needs_no_smoothing_or_cannot_be_judged_is_left_alone():
    exact, _, _ = odometry(pose=0.0, rate=False)
    fine, _, _ = odometry()  # its exact twist serves the node's own way
    broken, _, _ = odometry(rate=False)
    broken.events[50] = broken.events[50]._replace(data=b"")
    knots, _, _ = odometry()
    knots.events = [event._replace(data=_with_twist(event.data, 0.01, 1.944)) for event in knots.events]
    for tow in (exact, fine, broken, knots):
        before = list(tow.events)
        smooth_odometry(tow, SHEAVE)
        assert tow.events == before and tow.rounded == []


def test_a_bag_is_smoothed_once_for_all_runs_of_a_process_and_another_one_anew(monkeypatch):
    worked_out = []
    monkeypatch.setattr(coarse_bag, "_kept", {})
    work = coarse_bag._smoothed
    monkeypatch.setattr(coarse_bag, "_smoothed", lambda *given: worked_out.append(1) or work(*given))
    first, again, other = (odometry(rate=False)[0] for _ in range(3))
    again.path = "again"
    again.events = [event._replace(arrival=event.arrival + 5) for event in again.events]
    other.events = other.events[:-1]
    for tow in (first, again, other):
        smooth_odometry(tow, SHEAVE)
    assert len(worked_out) == 2
    assert [event.data for event in again.events] == [event.data for event in first.events]
    assert [event.arrival for event in again.events] == [event.arrival + 5 for event in first.events]
    assert again.rounded == first.rounded and again.notices[0].startswith("again: ")
    assert [event.data for event in other.events] != [event.data for event in first.events[:-1]]
    monkeypatch.setattr(coarse_bag, "_kept", {})
    monkeypatch.setattr(coarse_bag, "LONGEST", 10)
    smooth_odometry(long := odometry(rate=False)[0], SHEAVE)
    assert not coarse_bag._kept and [event.data for event in long.events] == [event.data for event in first.events]
