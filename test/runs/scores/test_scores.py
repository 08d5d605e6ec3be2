"""Scores of signals whose gain, bias, lag, sign, unit and noise are known, and what cannot be scored."""

import numpy as np
import pytest
from score_seas import EPOCH, sea, signal

from cable_sim_ros.tools.compare.alignment import clock_of
from cable_sim_ros.tools.compare.comparison import CompareError, compare
from cable_sim_ros.tools.compare.score import FIGURES, cycles, double_amplitudes, ellipsoid, exceedance, inside, score
from cable_sim_ros.tools.compare.spectra import correlation_time
from cable_sim_ros.tools.compare.units import FACTORS
from cable_sim_ros.tools.logs.own_signals import Signal


def within(one, name, value):
    low, high = one.intervals[name]
    return low <= value <= high


def test_bias_gain_and_rms_of_closed_forms():
    time, x = sea(1)
    one = score(signal(time, 3000.0 + 30.0 * x), signal(time, 3010.0 + 33.0 * x))
    f = one.figures
    mean = x.mean()
    assert f["bias"] == pytest.approx(10.0 + 3.0 * mean, abs=1e-9)
    assert f["gain"] == pytest.approx(1.1, rel=1e-12)
    assert f["spectrum_ratio"] == pytest.approx(1.21, rel=1e-9)
    assert f["coherence"] == pytest.approx(1.0, abs=1e-12)
    assert f["lag_s"] == 0.0 or abs(f["lag_s"]) < 1e-9
    assert f["rms"] == pytest.approx(np.sqrt(((10.0 + 3.0 * x) ** 2).mean()), rel=1e-12)
    assert f["peak_ratio"] == pytest.approx(1.1, rel=1e-9)
    assert f["damage_ratio"] == pytest.approx(1.1, rel=1e-9)
    assert set(f) == set(FIGURES)
    assert within(one, "bias", 10.0 + 3.0 * mean) and within(one, "gain", 1.1)


def test_two_equal_signals_differ_by_nothing():
    time, x = sea(2, 120.0)
    one = score(signal(time, x), signal(time, x))
    assert [one.figures[name] for name in ("bias", "rms", "largest", "lag_s")] == [0.0] * 4
    assert one.figures["gain"] == one.figures["peak_ratio"] == one.figures["damage_ratio"] == 1.0


def test_a_lag_of_parts_of_a_sample_with_its_sign():
    time, x = sea(3)
    later = sea(3, lag=0.137)[1]
    one = score(signal(time, x), signal(time, later))
    assert one.figures["lag_s"] == pytest.approx(0.137, rel=0.02)  # B comes later: positive. The windows do not move
    assert one.figures["phase_deg"] == pytest.approx(360.0 * one.figures["peak_hz"] * 0.137, rel=0.02)


def test_rates_that_differ_are_taken_to_the_slower_one_without_aliasing():
    rng = np.random.default_rng(4)
    slow, fast = sea(4, rate=2.0), sea(4, rate=50.0)
    noise = rng.standard_normal(len(fast[0]))  # white to 25 Hz: of its variance 1/31 lies below 0.8 Hz
    one = score(signal(*slow), signal(fast[0], fast[1] + noise))
    assert one.figures["rate_hz"] == pytest.approx(2.0)
    assert one.figures["rms"] < 0.25  # 1.0 with what would fold down
    assert 0.3 < one.figures["removed"] < 0.6
    assert any("B is the faster one: low-passed at 0.8 Hz" in note for note in one.notes)


def test_gaps_are_left_out_and_counted():
    time, x = sea(5)
    kept = (time < 200.0) | (time > 260.0)
    y = np.where((time > 400.0) & (time < 405.0), np.nan, 2.0 * x)
    one = score(signal(time[kept], x[kept]), signal(time, y))
    assert one.figures["gaps_s"] == pytest.approx(65.0, abs=0.5)
    assert one.figures["gain"] == pytest.approx(2.0, rel=1e-9)
    assert one.dropped_b == {"not finite": 49}
    assert one.figures["samples"] == pytest.approx(5350, abs=5)


def test_stamps_that_go_back_are_left_out_and_counted():
    time, x = sea(6, 100.0)
    again = signal(np.concatenate([time[:500], time[400:]]), np.concatenate([x[:500], x[400:]]))
    one = score(again, signal(time, x))
    assert one.dropped_a == {"stamp not after the one before": 100}
    assert one.figures["largest"] < 1e-9


def test_a_log_of_a_tenth_of_a_hertz_has_no_waves():
    time, x = sea(7, 3600.0, 0.1)
    one = score(signal(time, 500.0 + x), signal(time, 503.0 + x))
    assert one.figures["bias"] == pytest.approx(3.0) and one.figures["coherence"] is None
    assert one.figures["lag_s"] is None and one.band_hz is None
    assert any("0.1 Hz is too slow for 0.03 to 0.5 Hz" in note for note in one.notes)


def test_a_constant_has_a_bias_and_nothing_that_needs_change():
    time, x = sea(8, 100.0)
    one = score(signal(time, np.full(len(time), 7.0)), signal(time, x))
    assert one.scored and one.figures["bias"] == pytest.approx(x.mean() - 7.0)
    assert one.figures["gain"] is None and one.figures["coherence"] is None and one.figures["normalised_rms"] is None
    both = score(signal(time, np.full(len(time), 7.0)), signal(time, np.full(len(time), 9.0)))
    assert both.figures["bias"] == 2.0 and both.figures["gain"] is None


@pytest.mark.parametrize("count", [0, 1, 7])
def test_too_few_values_are_named(count):
    time, x = sea(9, 60.0)
    one = score(signal(time[:count], x[:count]), signal(time, x))
    assert not one.scored and one.notes == [f"not scored: A has {count} values, fewer than 8"]


def test_no_overlap_is_named():
    time, x = sea(10, 60.0)
    with pytest.raises(CompareError, match="nothing could be scored .tension: no overlap: A has 0 to 59.9 s, B 1000"):
        compare([signal(time, x)], [signal(time + 1000.0, x)], "a", "b")


def test_signals_without_a_common_quantity_are_named():
    time, x = sea(10, 60.0)
    with pytest.raises(CompareError, match="a and b share no quantity .A: tension; B: payout.; nothing was compared"):
        compare([signal(time, x)], [signal(time, x, "payout")], "a", "b")


def test_half_of_the_signals_are_scored_and_the_rest_named():
    time, x = sea(11, 120.0)
    found = compare(
        [signal(time, x), signal(time, x, "payout")], [signal(time, x), signal(time, x, "layback")], "a", "b"
    )
    assert [one.quantity for one in found.scores] == ["tension"]
    assert found.only_a == ["payout"] and found.only_b == ["layback"] and found.verdict.state == "ok"


def test_what_a_log_assumed_is_a_note_with_its_quantity_once():
    time, x = sea(11, 60.0)
    log = Signal("tension", signal(time, x).time, x, "log", ["tension: stamps of the logger", "sign turned"])
    notes = compare([log], [signal(time, x)], "a", "b").verdict.notes
    assert notes == ("A, tension: stamps of the logger", "A, tension: sign turned")


def test_a_record_that_is_worth_few_samples_has_no_interval():
    time = np.arange(0.0, 60.0, 0.1)
    one = score(signal(time, time), signal(time, time + 0.01 * time**2))
    assert "bias" not in one.intervals
    assert any("independent samples, fewer than 25" in note for note in one.notes)


@pytest.mark.parametrize("factor", [-1.0, 4.4482216, 1e3, 0.1])
def test_signs_and_units_are_named_and_taken_back_only_where_asked(factor):
    time, x = sea(12, 300.0)
    noise = 0.02 * np.random.default_rng(12).standard_normal(len(time))
    log, run = signal(time, (3000.0 + 30.0 * (x + noise)) / factor), signal(time, 3000.0 + 30.0 * x)
    found = compare([log], [run], "log", "run")
    assert found.verdict.code == 4 and "not applied" in found.doubts[0].text
    if factor == -1.0:
        assert "sign reversed" in found.doubts[0].text
    else:
        unit = {4.4482216: "A is in lbf", 1e3: "A is in kN", 0.1: "B is in daN"}[factor]
        assert unit in found.doubts[0].text
    assert found.scores[0].figures["gain"] == pytest.approx(factor, rel=0.01)
    back = compare([log], [run], "log", "run", align="all")
    assert back.scores[0].figures["gain"] == pytest.approx(1.0, rel=0.01)
    assert back.verdict.code == 4, "what was applied makes it doubtful"


def test_a_clock_sign_or_unit_that_is_not_found_is_doubtful():
    """Whatever an instrument may do to a tension or a rate, the verdict is not ok, and says which."""
    seed = 31
    time, x = sea(seed, 300.0, 2.0)
    n, late = np.random.default_rng(seed).standard_normal(len(time)), time > 180.0
    swell, rate = np.sin(2.0 * np.pi * time / 8.0), 0.3 * x
    load, regular = 3000.0 + 100.0 * x, 3000.0 + 100.0 * swell
    shifted = 3000.0 + 100.0 * np.sin(2.0 * np.pi * (time - 1.7) / 8.0)
    for kind, quantity, a, b in (
        ("STILL", "tension", 0.0 * x, load),
        ("STILL", "tension", 0.0 * x, np.full(len(x), 3000.0)),
        ("STILL", "tension", 3100.0 + 0.1 * n, load),
        ("STILL", "payout_rate", 0.0 * x, rate),
        ("SIGN", "tension", -load + 200.0 * n, load),
        ("SIGN", "tension", n - 3000.0, 3000.0 + 0.0 * x),
        ("SIGN", "payout_rate", 0.3 * n, rate),
        ("STEP", "tension", np.where(late, 1e6, 1e3) + n, load),
        ("STEP", "tension", np.where(late, load / 1e3, load), load),
        ("STEP", "tension", np.where(late, 0.0, load), load),
        ("UNIT", "tension", shifted / 4.4482216 + n, regular),
        ("UNIT", "tension", load / 4.4482216 + 100.0 * n, load),
        ("UNIT", "tension", 0.4 * load, load),
        ("CLOCK", "tension", regular + 5.0 * n, regular + 5.0 * n[::-1]),
        ("CLOCK", "tension", 3000.0 + 100.0 * sea(seed + 500, 300.0, 2.0)[1], load),
    ):
        found = compare([signal(time, a, quantity)], [signal(time, b, quantity)], "log", "run").verdict
        assert kind in {one.flag for one in found.reasons} and found.code == 4, (kind, a[0], found)
    for quantity, a, b in (
        ("tension", 1.04 * load + 20.0 * n + 90.0, load),
        ("payout", 457.5 + 0.0 * x, 457.5 + 1e-4 * x),
        ("payout_rate", 0.003 * n, 0.0 * x),
        ("payout_rate", np.where(late, 0.5, 0.0) + 0.003 * n, np.where(late, 0.5, 0.0)),
    ):
        log, run = [signal(time, a, quantity), signal(time, x, "heave")], [signal(time, b, quantity)]
        assert compare(log, [*run, signal(time, x, "heave")], "log", "run").verdict.state == "ok", quantity


@pytest.mark.parametrize("value, cause", [(1e300, "beyond 1e+12 in SI units"), (np.inf, "not finite")])
def test_a_number_that_no_instrument_shows_is_left_out_and_counted(value, cause):
    time, x = sea(12, 120.0)
    one = compare([signal(time, np.where(time == 50.0, -value, x))], [signal(time, x)], "log", "run").scores[0]
    assert one.dropped_a == {cause: 1} and one.figures["gain"] == pytest.approx(1.0, rel=1e-3)


def test_degrees_knots_and_feet():
    for quantity, unit, word in (("pitch", "rad", "degrees"), ("speed", "m/s", "knots"), ("payout", "m", "ft")):
        time, x = sea(13, 200.0)
        factor = FACTORS[unit][word]
        found = compare([signal(time, x / factor, quantity)], [signal(time, x, quantity)], "log", "run")
        assert f"A is in {word}" in found.doubts[-1].text


def test_two_units_that_the_record_cannot_tell_apart_are_both_named_and_none_is_applied():
    time, x = sea(14, 300.0)
    noise = np.random.default_rng(14).standard_normal(len(time))
    found = compare(
        [signal(time, (x + 0.3 * noise) / 9.9)], [signal(time, x + 0.3 * noise[::-1])], "a", "b", align="all"
    )
    text = next(one.text for one in found.doubts if one.flag == "UNIT")
    assert "kgf" in text and "daN" in text and "not applied" in text


def test_a_clock_with_a_lag_and_a_drift():
    time, x = sea(15, 1200.0)
    other = sea(15, 1200.0, lag=7.345, drift=100e-6)[1]
    found = clock_of(signal(time, 30.0 * x), signal(time, 31.0 * other), EPOCH)
    assert found.found and found.interval[0] <= 7.345 <= found.interval[1]
    assert found.drift_ppm == pytest.approx(100.0, rel=0.2)
    assert found.drift_interval[0] <= 100.0 <= found.drift_interval[1]


def test_clocks_of_other_epochs_are_found_over_every_lag():
    time, x = sea(16, 600.0)
    begun = 86_400.0
    cut = slice(1000, 5000)
    run = Signal("tension", signal(time, x).time, x)
    log = signal(time[cut] - begun, x[cut])
    found = clock_of(log, run, EPOCH)
    assert found.found and found.lag == pytest.approx(begun, abs=0.01)
    moved = compare([log], [run], "log", "run", align="clock")
    assert moved.scores[0].figures["rms"] < 1e-3 and moved.clock_applied and moved.verdict.code == 4


def test_a_regular_swell_has_rivals_and_is_not_aligned():
    time = np.arange(0.0, 600.0, 0.1)
    noise = 0.05 * np.random.default_rng(17).standard_normal((2, len(time)))
    a, b = np.sin(2.0 * np.pi * time / 8.0), np.sin(2.0 * np.pi * (time - 1.0) / 8.0)
    found = clock_of(signal(time, a + noise[0]), signal(time, b + noise[1]), EPOCH)
    assert not found.found and "a regular swell fits itself a period later" in found.why
    assert len(found.rivals) > 1
    asked = compare([signal(time, a + noise[0])], [signal(time, b + noise[1])], "a", "b", align="clock")
    assert not asked.clock_applied and asked.verdict.code == 4
    assert "the clocks cannot be aligned" in asked.doubts[0].text and "s (" in asked.doubts[0].text


def test_signals_that_have_nothing_in_common_are_not_aligned():
    flat = 0
    for seed in range(20):
        time, x = sea(seed, 300.0)
        found = clock_of(signal(time, x), signal(time, sea(seed + 500, 300.0)[1]), EPOCH)
        flat += not found.found
        if not found.found and not found.rivals:
            assert "the correlation is flat" in found.why
    assert flat >= 19


def test_a_lag_that_nobody_applied_makes_the_figures_doubtful():
    time, x = sea(18)
    found = compare([signal(time, x)], [signal(time, sea(18, lag=2.3)[1])], "a", "b")
    assert found.verdict.code == 4 and "behind A" in found.doubts[0].text
    assert found.scores[0].figures["lag_s"] == pytest.approx(2.3, abs=0.02)


def test_the_correlation_time_of_an_autoregression():
    rng, x, rho = np.random.default_rng(19), np.zeros(40_000), 0.9
    noise = rng.standard_normal(len(x))
    for k in range(1, len(x)):
        x[k] = rho * x[k - 1] + noise[k]
    assert correlation_time(x) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.15)  # 19
    assert correlation_time(noise) == pytest.approx(1.0, abs=0.1)


def test_waves_cycles_and_levels_of_a_sine():
    time = np.arange(0.0, 80.0, 0.05)
    x = 3.0 * np.sin(2.0 * np.pi * time / 8.0)
    heights, ends = double_amplitudes(x)
    assert len(heights) == 8 and heights == pytest.approx(6.0, rel=1e-3) and (np.diff(ends) == 160).all()
    count, largest, damage = cycles(x, 4.0, 80.0)
    assert count == pytest.approx(10.0, abs=0.6) and largest == pytest.approx(6.0, rel=1e-3)
    assert damage == pytest.approx(6.0 * (10.0 / 80.0) ** 0.25, rel=0.02)
    rows = exceedance(np.tile(x, 10), np.tile(2.0 * x, 10))
    assert rows[0]["share_a"] == pytest.approx(0.1, abs=0.005)
    share = 0.5 - np.arcsin(rows[0]["level"] / 6.0) / np.pi
    assert rows[0]["share_b"] == pytest.approx(share, abs=0.005)


def test_the_ellipsoid_of_normal_places():
    rng = np.random.default_rng(20)
    places = rng.standard_normal((20_000, 3)) * [3.0, 2.0, 1.0] + [10.0, 0.0, 0.0]
    found = ellipsoid(places)
    assert found["semi_axes_m"] == pytest.approx([3.0 * 2.7955, 2.0 * 2.7955, 2.7955], rel=0.02)
    assert inside(places, places) == pytest.approx(0.95, abs=0.005)


def test_the_towbody_about_its_track():
    time, x = sea(21, 200.0)
    waves = {"body_x": x, "body_y": np.roll(x, 300), "body_depth": np.roll(x, 900)}
    a = [signal(time, value + (2.0 * time if name == "body_x" else 0.0), name) for name, value in waves.items()]
    b = [signal(time, one.value + 0.5, one.quantity) for one in a]
    body = compare(a, b, "a", "b").body
    assert body["offset_m"] == pytest.approx([0.5] * 3) and body["volume_ratio"] == pytest.approx(1.0)
    assert max(body["a"]["semi_axes_m"]) < 4.0 * x.std(), "the way of 400 m is not in it"


def test_headings_either_side_of_north_are_near():
    time, x = sea(22, 100.0)
    one = score(signal(time, 3.1 + 0.1 * x, "yaw"), signal(time, np.angle(np.exp(1j * (3.12 + 0.1 * x))), "yaw"))
    assert one.figures["bias"] == pytest.approx(0.02, abs=1e-6)
