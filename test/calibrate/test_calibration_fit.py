"""A fit finds what made a log, within intervals that hold for correlated rests; what it cannot know it says."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_tow import NUMBERS, TRUE, log, tow

from cable_sim_ros.tools.calibrate import confidence as confidence_module
from cable_sim_ros.tools.calibrate.confidence import QUANTILE, Surface, confidence, linear_intervals, profile
from cable_sim_ros.tools.calibrate.free import CalibrateError
from cable_sim_ros.tools.calibrate.least_squares import Nuisance, Problem, first_lags, fit, repeats, scales
from cable_sim_ros.tools.calibrate.observed import _slower
from cable_sim_ros.tools.calibrate.result import Calibration
from cable_sim_ros.tools.calibrate.systematic import SHARE, _faster, systematic
from cable_sim_ros.tools.calibrate.tow_model import Curve, TrialError
from cable_sim_ros.tools.compare.pairing import Cleaned

LAG = Nuisance("lag", "tension", None, -2.0, 2.0)
BIAS = Nuisance("bias", "tension", None, -500.0, 500.0)


def inside(interval, value):
    return (interval.low is None or interval.low <= value) and (interval.high is None or value <= interval.high)


def fitted(signals, nuisances=(LAG,), numbers=NUMBERS, simulate=tow):
    problem = Problem(simulate, numbers, signals, nuisances)
    found = fit(problem)
    return problem, found, confidence(problem, found)


@pytest.mark.parametrize("correlated", [0.0, 4.0], ids=["white", "correlated"])
def test_known_numbers_are_within_their_intervals_as_often_as_they_say(correlated):
    """20 seeds, 3 parameters each: fewer than 52 of 60 has a probability of 1 % at 95 %."""
    hits = 0
    for seed in range(20):
        problem, found, known = fitted(log(seed, correlated, lag=0.3))
        assert found.converged and not known.apart
        true = [one.place(value) for one, value in zip(NUMBERS, TRUE)] + [0.3]
        hits += sum(inside(a, b) for a, b in zip(linear_intervals(problem, found, known), true))
    assert hits >= 52


def test_a_rest_that_lasts_makes_intervals_wider():
    white, lasting = (fitted(log(3, correlated))[2] for correlated in (0.0, 4.0))
    assert lasting.independent["tension"] < 0.4 * white.independent["tension"]
    assert lasting.deviation[0] > 1.5 * white.deviation[0]


def test_the_profile_agrees_with_the_covariance_of_a_tow_that_hardly_bends():
    pytest.importorskip("iminuit")
    problem, found, known = fitted(log(1, lag=0.3))
    linear, profiled = linear_intervals(problem, found, known), profile(problem, found, known)
    for a, b in zip(linear, profiled):
        half = 0.5 * (a.high - a.low)
        assert abs(a.low - b.low) < 0.1 * half and abs(a.high - b.high) < 0.1 * half
    rises = [rise for one in profiled[:2] for rise in one.rise]
    assert rises == pytest.approx([1.0] * 4, abs=0.05)


def test_the_profile_of_one_number_is_where_the_likelihood_rises():
    """A signal that goes with the square: the exact profile is known."""
    pytest.importorskip("iminuit")
    from cable_sim_ros.tools.calibrate.free import Free
    from cable_sim_ros.tools.calibrate.observed import Observed

    def square(values):
        return {"tension": Curve(lambda t: np.full(len(t), values[0] ** 2), lambda t: np.zeros(len(t)))}

    t = np.arange(100.0)
    value = 4.0 + 8.0 * np.random.default_rng(0).standard_normal(100)
    problem = Problem(square, [Free("x", "", 1.0, 0.5, 5.0)], [Observed("tension", "N", t, value, 8.0, t < 200)])
    found = fit(problem)
    known = confidence(problem, found)
    low, high = (problem.free[0].at(end) for end in profile(problem, found, known)[0][:2])
    at = problem.free[0].at(float(found.x[0])) ** 2
    half = (QUANTILE * known.inflation[0] / 100.0) ** 0.5 * scales(problem, found.noise, found.correlated)["tension"]
    assert low == pytest.approx((at - half) ** 0.5, rel=2e-3) and high == pytest.approx((at + half) ** 0.5, rel=2e-3)


def swell(values):
    """The made tow in a swell of two periods, which does not repeat itself within the log."""
    curves, w = tow(values), 2.0 * np.pi / 11.3
    heave = curves["tension"]
    return curves | {
        "tension": Curve(
            lambda t: heave.value(t) + 14.0 * np.sin(w * t), lambda t: heave.rate(t) + 14.0 * w * np.cos(w * t)
        )
    }


@pytest.mark.parametrize("late", [-7.0, -3.0, 5.0, 7.9])
@pytest.mark.parametrize("simulate", [tow, swell], ids=["one period", "two periods"])
def test_a_lag_of_more_than_half_a_period_is_found_or_known_up_to_the_period(simulate, late):
    nuisance = LAG._replace(low=-8.5, high=8.5)
    problem = Problem(simulate, NUMBERS, log(4, lag=late, simulate=simulate, begin=20.0), [nuisance])
    found = fit(problem, first_lags(problem, problem.start()))
    known = confidence(problem, found)
    low, high, *_ = linear_intervals(problem, found, known)[2]
    again = repeats(problem, found, known.inflation)
    if simulate is swell:
        assert low <= late <= high and not again
        return
    assert again["lag of tension"] == pytest.approx(8.0, abs=0.1)
    assert any(low <= late + turn <= high for turn in (-16.0, -8.0, 0.0, 8.0, 16.0))
    assert abs(found.x[2]) < 4.1, "of those that fit alike the least"


def test_a_signal_that_stands_still_has_no_lag_to_begin_from():
    still = {"tension": Curve(lambda t: np.full(len(t), 600.0), np.zeros_like)}
    problem = Problem(lambda v: tow(v) | still, NUMBERS, log(0), [LAG])
    assert first_lags(problem, problem.start())[2] == 0.0
    found = fit(Problem(tow, NUMBERS, log(0), [LAG]))
    assert repeats(problem, found, np.ones(3)) == {}


def test_what_cannot_be_told_apart_is_named():
    problem, found, known = fitted(log(0), (BIAS, LAG))
    assert any({"bias of tension", "drag"} <= set(group) for group in known.apart)
    free = fitted(log(0, bias=20.0), (BIAS._replace(sd=10.0), LAG), NUMBERS[:1], lambda v: tow((v[0], 380.0)))
    assert not free[2].apart
    same = [NUMBERS[0], NUMBERS[0]._replace(key="other")]
    _, _, known = fitted(log(0), (), same, lambda v: tow((v[0] + v[1] - 1.8, 380.0)))
    assert known.apart == [("drag", "other")]


def test_a_prior_is_a_residual():
    numbers = [NUMBERS[0]._replace(mean=1.5, sd=1e-4), NUMBERS[1]]
    problem, found, _ = fitted(log(0), (LAG,), numbers)
    assert problem.values(found.x)[0] == pytest.approx(1.5, abs=1e-3)


def test_a_bound_holds_and_a_number_without_effect_is_refused():
    numbers = [NUMBERS[0]._replace(high=1.9), NUMBERS[1]]
    problem, found, _ = fitted(log(0), (LAG,), numbers)
    assert problem.values(found.x)[0] == pytest.approx(1.9, abs=1e-3)
    nothing = Problem(lambda v: tow((v[0], 380.0)), NUMBERS, log(0))
    with pytest.raises(CalibrateError, match="--free weight: has no effect on tension, body_depth in this tow"):
        nothing.check_effect()


def test_derivatives_are_those_of_the_rests():
    problem = Problem(tow, NUMBERS, log(0), (BIAS, LAG, Nuisance("gain", "body_depth", 0.1, 0.2, 5.0)))
    x = np.array([0.4, 0.5, 3.0, 0.2, 1.01])
    scale = {"tension": 5.0, "body_depth": 0.2}
    slope = problem.weighted_slope(x, scale)
    for k in range(len(x)):
        way = 1e-4 * np.eye(len(x))[k]
        numeric = (problem.weighted(x + way, scale) - problem.weighted(x - way, scale)) / 2e-4
        assert np.allclose(slope[:, k], numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


def test_the_surface_goes_through_the_runs_that_made_it():
    problem, found, known = fitted(log(2))
    surface = Surface(problem, found.x, np.full(3, 0.1))
    for way in ([0.0, 0.0], [1.0, 0.0], [0.0, -1.0], [1.0, 1.0]):
        x = np.array(found.x)
        x[:2] = surface.centre + surface.scale * np.array(way)
        for one in problem.signals:
            exact = problem.rest(x, one, tow(problem.values(x)), one.fitted)
            assert np.allclose(surface.rest(x, one), exact, atol=1e-8)


def test_a_profile_that_minuit_gives_up_on_is_no_open_end(monkeypatch):
    pytest.importorskip("iminuit")
    problem, found, known = fitted(log(1, lag=0.3))

    class Fitter:
        """Finds the lower end, gives up at the upper one, far from the range."""

        def __init__(self, cost, x, name):
            self.values, self.fixed = np.array(x), {}
            one = SimpleNamespace(lower=-1e-3, upper=0.0, lower_valid=True, upper_valid=False)
            one.at_lower_limit = one.at_upper_limit = False
            self.merrors = dict.fromkeys(name, one)

        def migrad(self):
            pass

        def minos(self, name, cl):
            pass

    monkeypatch.setattr(confidence_module, "minuit", lambda: Fitter)
    half = QUANTILE**0.5 * known.deviation
    for k, one in enumerate(profile(problem, found, known)):
        assert one.linear and one.low == pytest.approx(found.x[k] - 1e-3)
        assert one.high == pytest.approx(found.x[k] + half[k])


def test_signals_or_a_prior_that_contradict_each_other_are_told():
    """A depth 3 m off, which no free number explains; a bias that is known to be none."""
    signals = [one._replace(value=one.value + 3.0) if one.quantity == "body_depth" else one for one in log(1)]
    problem, found, known = fitted(signals, (), NUMBERS[:1], lambda values: tow((values[0], TRUE[1])))
    still = SimpleNamespace(steady=True, scene=SimpleNamespace(solver=SimpleNamespace(tick=0.1)))
    still.on_own_mesh = lambda values: None
    out = Calibration("made", None)
    systematic(out, problem, found, known, still)
    flags = [reason.flag for reason in out.reasons]
    assert "OFFSET" in flags and "calibrated, the scene is " in out.reasons[0].text, out.reasons

    def gives_up(values):
        raise TrialError("drag = 2: no static tow")

    out, still.on_own_mesh = Calibration("made", None), gives_up
    systematic(out, problem, found, known, still)
    assert out.reasons[-1].flag == "MESH" and "on their own mesh, " in out.reasons[-1].text
    still.on_own_mesh = lambda values: None

    known_well = (BIAS._replace(sd=0.5),)
    problem, found, known = fitted(log(1, bias=50.0), known_well, NUMBERS[:1], lambda values: tow((values[0], TRUE[1])))
    out = Calibration("made", None)
    systematic(out, problem, found, known, still)
    assert any(reason.flag == "PRIOR" and "bias of tension lies" in reason.text for reason in out.reasons), out.reasons


def test_a_direction_without_any_slope_is_not_known_and_no_division():
    problem, found, _ = fitted(log(1, lag=0.3))
    with np.errstate(all="raise"):
        known = confidence(problem, found._replace(slope=0.0 * found.slope))
    assert all(end is None for one in linear_intervals(problem, found, known) for end in one[:2])
    assert np.isfinite(known.correlation).all()


def test_waves_that_simulated_values_are_too_seldom_for_are_seen():
    for tick, fast in ((0.1, False), (0.5, False), (1.0, True)):
        assert (_faster(lambda t: 50.0 + np.sin(2.0 * np.pi * t / 3.0), (20.0, 120.0), tick) > SHARE) == fast


def test_a_stamp_far_off_makes_no_grid_of_years():
    t = np.append(np.arange(0.0, 60.0, 0.02), 1.7e9)
    grid, value = _slower(Cleaned(t, np.sin(t), 0.02), 0.1, 10.0, 50.0)
    assert 9.7 <= grid[0] <= 10.0 and 49.9 <= grid[-1] <= 50.2 and len(grid) == len(value) < 420
