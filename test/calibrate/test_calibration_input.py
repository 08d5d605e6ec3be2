"""What a calibration takes of a record, and that a verdict is that of the calibrated numbers. 3 s."""

import numpy as np
import pytest
from made_tow import NUMBERS, TRUE, log, tow

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.sim.verdict import Verdict
from cable_sim_ros.tools.calibrate import tow_model
from cable_sim_ros.tools.calibrate.confidence import confidence, linear_intervals
from cable_sim_ros.tools.calibrate.free import CalibrateError, free_of
from cable_sim_ros.tools.calibrate.least_squares import Nuisance, Problem, fit, lasting
from cable_sim_ros.tools.calibrate.observed import observed
from cable_sim_ros.tools.calibrate.tow_model import TowModel
from cable_sim_ros.tools.logs.own_signals import Signal


def taken(time_s, value, noise=None, steady=False, last=400.0):
    signal = Signal("tension", np.round(np.asarray(time_s) * 1e9).astype(np.int64), np.asarray(value, float))
    return observed({"tension": signal}, {"tension": noise}, 0, (0.0, last), 1.0 / 3.0, 0.1, steady)[0]


def test_a_constant_record_needs_a_stated_noise():
    t = np.arange(0.0, 400.0)
    with pytest.raises(CalibrateError, match="tension: shows 800 N throughout; .*--signal tension~NOISE"):
        taken(t, np.full(len(t), 800.0))
    assert taken(t, np.full(len(t), 800.0), noise=5.0).noise == 5.0


def test_what_is_no_number_and_stamps_that_go_back_are_left_out():
    t = np.arange(0.0, 400.0)
    value = 800.0 + np.sin(t)
    value[10] = np.nan
    t[200] = 20.0
    found = taken(t, value)
    assert len(found.time) == 398 and np.all(np.diff(found.time) > 0.0) and np.isfinite(found.value).all()
    with pytest.raises(CalibrateError, match="tension: 0 values to fit and 0 held out"):
        taken(t, np.full(len(t), np.nan))


def test_a_stamp_in_the_far_future_costs_no_windows():
    t = np.append(np.arange(0.0, 600.0), 1e9)
    with pytest.raises(CalibrateError, match="20 windows of 30 s to fit and 0 held out"):
        taken(t, 800.0 + np.sin(t), steady=True, last=1e9)


def test_noise_that_lasts_over_a_short_record_widens_the_intervals_enough():
    """200 seeds, 2 numbers: fewer than 370 of 400 has a probability of 1 % at 95 %; autocorrelations that are not
    corrected for the length give 357."""
    hits = 0
    for seed in range(200):
        problem = Problem(tow, NUMBERS, log(seed, 20.0, lag=0.3, lasts=58.5), [Nuisance("lag", "tension", None, -2, 2)])
        found = fit(problem)
        intervals = linear_intervals(problem, found, confidence(problem, found))
        for one, interval, value in zip(NUMBERS, intervals, TRUE):
            place = one.place(value)
            hits += (interval.low is None or interval.low <= place) and (
                interval.high is None or place <= interval.high
            )
    assert hits >= 370
    white = np.random.default_rng(0).standard_normal(400)
    assert lasting(white) < 1.5 and lasting(np.cumsum(white)) > 40.0


def test_the_verdict_is_of_the_numbers_asked_for_not_of_the_last_run(monkeypatch):
    scene = load_scene("side_scan")
    frames = np.zeros(100, [("time", np.int64)]).view(np.recarray)
    frames["time"] = np.arange(100) * 10**8
    monkeypatch.setattr(TowModel, "_frames", lambda self, scene: (frames, "", []))
    monkeypatch.setattr(tow_model, "signals_of_frames", lambda frames, source: [])
    monkeypatch.setattr(
        tow_model, "judge", lambda frames, scene, others: Verdict(notes=(f"{scene.towbody.net_weight:g}",))
    )
    model = TowModel(scene, free_of(["towbody.net_weight"], scene), None, None)
    for weight in (357.0, 400.0, 357.0):
        model((weight,))
    assert model.told((357.0,))[0].notes == ("357",) and model.told((400.0,))[0].notes == ("400",)
    assert model.runs == 2
