"""Figures of the AHC benchmark against closed forms: sines, ellipsoids of known covariance, counted snaps."""

import json
import math

import numpy as np
import pytest

from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.runs.summary import CHI_SQUARE, FRACTION, ellipsoid_volume
from cable_sim_ros.tools.ahc import figures as f
from cable_sim_ros.tools.ahc.tables import against_twin

TICK, SECONDS = 0.01, 120.0
T = np.arange(round(SECONDS / TICK)) * TICK
RULES = f.Rules(20.0, (0.03, 0.6), 0.1)
MIDDLE = T[T > 20.0 - 0.5 * TICK].mean()  # of what is counted: a cosine about it has no slope, so none is taken off


def wave(amplitude, period, phase=0.0):
    return amplitude * np.cos(2.0 * np.pi * (T - MIDDLE) / period + phase)


def tow(heave=0.0, payout=0.0, tension=3000.0, rate=0.0):
    """Tick outputs of a ship that goes east at 2 m/s, its sheave heaving, the cable straight down."""
    frames = np.zeros(len(T), TICK_OUTPUT).view(np.recarray)
    frames["time"] = np.round((T + TICK) * 1e9).astype(np.int64)
    frames["ship_velocity"][:, 0] = 2.0
    frames["sheave_position"] = np.column_stack((2.0 * T, 0.0 * T, 3.0 + heave + 0.0 * T))
    frames["body_position"] = np.column_stack((2.0 * T, 0.0 * T, -100.0 + heave - payout + 0.0 * T))
    frames["payout"], frames["payout_rate"] = 50.0 + payout, rate
    frames["tension"] = frames["tension_tick_min"] = frames["tension_tick_max"] = tension
    frames["tension_drum"] = frames["contact_resultant"] = tension
    return frames


def figures(frames, twin=None, rules=RULES, motor=False):
    return f.figures(frames, rules, twin or f.twin_of(frames, rules.start_up), motor)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, -0.5])
def test_decoupling_of_a_sine_that_is_compensated_in_part(share):
    heave = wave(1.0, 10.0)
    found = figures(tow(heave, share * heave))
    assert found["decoupling"] == pytest.approx(1.0 - abs(1.0 - share), abs=1e-6)
    assert found["input_rms_m"] == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-6)
    assert found["residual_rms_m"] == pytest.approx(abs(1.0 - share) / np.sqrt(2.0), abs=1e-6)
    assert found["depth_rms_m"] == pytest.approx(abs(1.0 - share) / np.sqrt(2.0), abs=1e-6)


def test_dead_time_leaves_two_sine_of_half_its_angle():
    late, w = 0.4, 2.0 * np.pi / 10.0
    found = figures(tow(wave(1.0, 10.0), wave(1.0, 10.0, -w * late)))
    # a sine over ten periods has a slope of 6/(10 pi), and 0.6 % of its rms with it
    assert found["decoupling"] == pytest.approx(1.0 - 2.0 * np.sin(0.5 * w * late), abs=0.006 * 0.25)


def test_what_is_outside_the_wave_band_does_not_count():
    for period in (100.0, 1.0):  # a washed-out drift, a shake
        heave = wave(1.0, 10.0)
        found = figures(tow(heave + wave(5.0, period), heave))
        assert found["input_rms_m"] == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-5)
        assert found["decoupling"] == pytest.approx(1.0, abs=1e-5)
    kept = T > 20.0 - 0.5 * TICK
    x = f.in_band((3.0 + 0.2 * T + wave(1.0, 10.0))[kept], TICK, (0.03, 0.6))
    assert f.rms(x) == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-9)


def test_along_a_cable_that_leads_aft():
    frames, angle = tow(wave(1.0, 10.0)), np.radians(78.0)
    frames["sheave_position"][:, 0] += wave(0.5, 8.0)
    surge = wave(0.5, 8.0) + 2.0 * T
    assert np.allclose(f.along_cable(frames, angle), np.sin(angle) * surge + np.cos(angle) * (3.0 + wave(1.0, 10.0)))


def test_ellipsoid_of_a_known_covariance():
    rng = np.random.default_rng(3)
    sigma, turn = np.array([0.5, 2.0, 0.1]), np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    time = np.arange(40_000) * TICK
    places = rng.normal(size=(len(time), 3)) * sigma @ turn
    places[:, :2] += np.outer(time, (2.2, 0.3))  # the track
    axes = f.ellipsoid(time, places)
    root = math.sqrt(0.5 * CHI_SQUARE)  # the regularised incomplete gamma function of 3/2
    assert math.erf(root) - 2.0 * root * math.exp(-root * root) / math.sqrt(math.pi) == pytest.approx(
        FRACTION, abs=1e-15
    )
    assert axes == pytest.approx(np.sqrt(CHI_SQUARE) * sigma[[1, 0, 2]], rel=0.02)
    assert f.volume(axes) == pytest.approx(ellipsoid_volume(time, places)[0], rel=1e-9)
    places[:, 2] = 7.0
    assert f.ellipsoid(time, places)[2] == 0.0 and f.volume(f.ellipsoid(time, places)) == 0.0


def test_snaps_are_counted_from_slack_to_taut():
    tension = np.array([3.0, 0.2, 1.0, 0.1, 3.5, 2.0, 0.2, 2.9, 0.0, 4.0, 0.1])
    assert f.snaps(tension, tension, 0.3, 3.0) == 2  # 2.9 is not taut, the last one is not back yet
    assert f.snaps(tension, tension, 0.0, 3.0) == 0
    deep = 3000.0 + 0.0 * T
    for at in (30.0, 60.0, 90.0, 5.0):  # the last one falls into the start-up
        deep[round(at / TICK)] = 100.0
        deep[round(at / TICK) + 20] = 6000.0
    assert figures(tow(tension=deep))["snaps"] == 3


def test_tension_comes_from_the_time_steps_between_ticks():
    frames = tow(tension=3000.0 + wave(300.0, 10.0))
    frames["tension_tick_min"][5000], frames["tension_tick_max"][6000] = 1000.0, 9000.0
    found = figures(frames)
    assert (found["tension_min_n"], found["tension_max_n"]) == (1000.0, 9000.0)
    assert found["tension_std_n"] == pytest.approx(300.0 / np.sqrt(2.0), rel=1e-6)
    assert found["tension_mean_n"] == pytest.approx(3000.0, rel=1e-9)


def test_contact_and_its_loss():
    frames = tow()
    twin = f.twin_of(frames, 20.0)
    frames["contact_resultant"][4000:4250] = 290.0  # below a tenth of the mean
    frames["status"][7000:7050] = int(Flag.DETACHED)
    found = figures(frames, twin)
    assert found["lifted_s"] == pytest.approx(3.0) and found["contact_least_n"] == 290.0


def test_what_the_winch_did():
    w = 2.0 * np.pi / 10.0
    frames = tow(payout=wave(1.0, 10.0, -0.5 * np.pi), rate=wave(w, 10.0))
    frames["payout_rate_tick_max"] = np.abs(frames["payout_rate"])
    frames["drum_torque"] = 900.0
    frames["winch_power_tick_min"] = frames["winch_power_tick_max"] = -3000.0 * frames["payout_rate"]
    frames["rate_limited"][5000:5100], frames["motor_limited"][5050:5200] = 1.0, 0.5
    found = figures(frames)
    assert found["travel_m"] == pytest.approx(40.0, rel=1e-4)  # 4 m a period, ten of them
    assert found["rate_max_m_s"] == pytest.approx(w, rel=1e-5)  # the peak falls between two ticks
    assert found["power_max_w"] == pytest.approx(3000.0 * w, rel=1e-5)
    assert found["energy_j"] == pytest.approx(3000.0 * 20.0, rel=1e-4)  # what it hauled in
    assert found["saturated_s"] == pytest.approx(1.0 + 0.5)
    assert found["torque_max_nm"] == 900.0
    frames["motor_power"], frames["motor_pull"], frames["drum_lay_radius"] = -500.0, -2000.0, 0.3
    driven = figures(frames, motor=True)
    assert (driven["power_max_w"], driven["energy_j"], driven["torque_max_nm"]) == (500.0, 0.0, 600.0)


def test_after_a_fault():
    tension = 3000.0 + wave(100.0, 10.0)
    tension[6000:6500] += 250.0
    rules = RULES._replace(fault=(60.0, 65.0))
    held = f.Twin(0.0, 3000.0, 3000.0, 2800.0, 3200.0)
    found = figures(tow(tension=tension), held, rules)
    assert found["overshoot_n"] == pytest.approx(250.0, abs=1e-6)
    last = T[np.flatnonzero(tension > 3200.0)[-1]] + TICK
    assert found["time_to_safe_s"] == pytest.approx(last - 60.0, abs=0.011)
    calm = figures(tow(tension=3000.0 + wave(100.0, 10.0)), held, rules)
    assert calm["overshoot_n"] == pytest.approx(0.0, abs=1e-6) and calm["time_to_safe_s"] == 0.0
    assert figures(tow())["overshoot_n"] is None and figures(tow())["time_to_safe_s"] is None


def test_every_figure_is_declared_and_fits_into_json():
    found = figures(tow(wave(1.0, 10.0)))
    assert tuple(found) == f.NAMES
    json.dumps(found)


@pytest.mark.parametrize("run, twin, change", [(9.0, 100.0, -0.91), (9.0, 0.0, None), (None, 1.0, None)])
def test_change_against_the_twin(run, twin, change):
    row = {"figures": {"tension_std_n": run}, "twin": {"tension_std_n": twin}}
    assert against_twin("tension_std_n")(row) == (change and pytest.approx(change))
