"""Constant tension, feed-forward and prediction on a tow: what is left of its tension, live changes, refusals."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
import pytest
from underway import cautioned, refused, scene_with

from cable_sim_ros.io.scenes.load import override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.checks.deviation_checks import drifting
from cable_sim_ros.sim.compensation_setup import impedance
from cable_sim_ros.sim.live_parameters import set_live
from cable_sim_ros.sim.simulator import Simulator, StartError
from cable_sim_ros.sim.static_gradients import StaticGradients
from verification.shipped import started

pytestmark = pytest.mark.trust

scene = partial(scene_with, setpoint__transfer_time=2.0)
TOW = scene()
SLOW = {"drive.model": "rate_loop", "drive.bandwidth": 6.0}
WAVE = (0.5, 7.0)  # m, s


def frames(what, seconds: float = 20.0):
    return offline.run(what, heave=WAVE, duration=seconds, step="fixed").frames


def left(one, other) -> float:
    """Deviation of the difference of two runs' pay-out over that of the second, in the last wave."""
    last = slice(-700, None)
    return np.std((one.payout - other.payout)[last]) / np.std(other.payout[last])


@pytest.fixture(scope="module")
def prompt():
    return frames(TOW)


def test_dead_time_leaves_what_the_formula_says_and_prediction_a_tenth_of_it(prompt):
    tau = 0.4
    late = left(frames(scene(drive__dead_time=tau)), prompt)
    assert late == pytest.approx(2.0 * np.sin(np.pi * tau / WAVE[1]), rel=0.03)
    assert left(frames(scene(drive__dead_time=tau, setpoint__prediction=True)), prompt) < 0.1 * late


def test_feed_forward_and_prediction_make_a_slow_and_late_drive_a_prompt_one(prompt):
    slow = SLOW | {"drive.dead_time": 0.2}
    both = left(frames(override(TOW, slow | {"setpoint.feed_forward": True, "setpoint.prediction": True})), prompt)
    assert both < 0.015, "without them 0.26 is left"


def test_constant_tension_takes_the_wave_out_and_keeps_the_set_tension():
    held, kept = (frames(scene(setpoint__algorithm=law), 13.0) for law in ("hold", "constant_tension"))
    assert kept.tension[600:].std() < 0.3 * held.tension[600:].std()
    assert kept.tension[600:].mean() == pytest.approx(kept.tension[0], abs=10.0)
    assert not (kept.status & Flag.SETPOINT_LIMITED).any()


def test_another_tension_set_while_it_runs_is_paid_out_for_and_limited():
    sim = started(scene(setpoint__algorithm="constant_tension", setpoint__max_amplitude=1.0))
    begin = sim.run(100)
    assert np.ptp(begin.payout) < 1e-3
    set_live(sim, "setpoint.tension", float(begin.tension[-1]) - 1000.0)
    after = sim.run(800)
    assert after.payout[200] > begin.payout[-1] + 0.3, "less tension: cable goes out"
    assert after.payout.max() <= begin.payout[-1] + 1.001 and after.status[-1] & Flag.SETPOINT_LIMITED
    assert np.abs(np.diff(after.payout_rate)).max() < 0.2
    assert sim.scene.setpoint.tension == pytest.approx(float(begin.tension[-1]) - 1000.0)


def test_options_set_while_it_runs_reach_the_law_and_are_part_of_the_state():
    sim = started(override(TOW, SLOW | {"drive.dead_time": 0.1}))
    for name in ("feed_forward", "prediction"):
        set_live(sim, f"setpoint.{name}", True)
        assert sim.state.now.setpoint[name].on == 1
    sim.run(20)
    assert sim.state.now.setpoint.prediction.horizon == 0.1
    saved = sim.snapshot()
    expected = sim.run(50).tobytes()
    sim.restore(saved)
    assert sim.run(50).tobytes() == expected
    set_live(sim, "setpoint.prediction", False)
    assert sim.state.now.setpoint.prediction.on == 0


def test_what_the_scene_leaves_out_follows_from_cable_and_drive():
    def law(**values):
        sim = started(scene(**values))
        return sim.state.now.setpoint

    matched = 1.0 / impedance(TOW)
    one = law()
    assert one.tension.gain == pytest.approx(0.4 * matched) and one.tension.integral_time == pytest.approx(0.1)
    assert one.tension.at_start == one.tension.at_start > 3000.0 and one.tension.max_rate == TOW.winch.max_rate
    late = law(drive__dead_time=0.3)
    assert late.tension.gain == pytest.approx(0.05 * matched) and late.tension.integral_time == pytest.approx(0.35)
    given = law(setpoint__tension_gain=1e-4, setpoint__horizon=0.7)
    assert given.tension.gain == 1e-4 and given.prediction.horizon == 0.7


def loop_gain(law) -> float:
    """What the law adds to a mean error, k t_r (1 + t_r / t_i) dT/dL."""
    return law.gain / law.back * (1.0 + 1.0 / (law.back * law.integral_time)) * law.slope


def test_the_return_of_constant_tension_follows_from_the_tow_at_rest():
    sim = started(scene(setpoint__algorithm="constant_tension"))
    law, at_rest = sim.state.now.setpoint.tension, sim.frame.tobytes()
    assert law.slope == pytest.approx(StaticGradients(TOW)("winch.scope").slopes[0].slope, rel=0.01)
    assert loop_gain(law) == pytest.approx(0.2) and 2.0 < 1.0 / law.back < 60.0
    later = started(TOW)
    assert later.state.now.setpoint.tension.back == 0.0
    assert later.frame.tobytes() == at_rest, "the tows beside it leave nothing behind"
    later.run(10)
    set_live(later, "setpoint.algorithm", "constant_tension")
    assert later.state.now.setpoint.tension.back == law.back


@pytest.mark.parametrize(
    "values, key, most",
    [
        ({"setpoint.tension_return_time": 60.0}, "setpoint.tension_return_time = 60 s", r"give (\S+) s or less"),
        ({"setpoint.tension_return_time": 0.0}, "setpoint.tension_return_time = 0 s", r"give (\S+) s or less \(0 is"),
        ({"setpoint.tension_gain": 0.1}, "setpoint.tension_gain = 0.1 m/(N s)", r"Give (\S+) m/\(N s\) or less"),
    ],
)
def test_a_constant_tension_that_would_run_away_is_refused_with_the_number_that_holds(values, key, most):
    """At the start, and while it runs."""
    tow, law = override(TOW, values), {"setpoint.algorithm": "constant_tension"}
    with pytest.raises(StartError, match=re.escape(key) + r".*tension of this tow at rest by 1.92 N/m") as refused:
        Simulator(override(tow, law)).start()
    sim = started(tow)
    with pytest.raises(ValueError, match=re.escape(key)):
        set_live(sim, "setpoint.algorithm", "constant_tension")
    assert sim.scene.setpoint.algorithm == "simplified_sheave"
    holds = float(re.search(most, str(refused.value))[1])
    Simulator(override(tow, law | {next(iter(values)): holds})).start()


def test_a_pay_out_that_goes_on_and_on_is_doubtful():
    law, t = scene(setpoint__algorithm="constant_tension"), np.linspace(0.0, 1500.0, 15001)
    wave = 0.2 * np.sin(0.9 * t)
    (reason,) = drifting(law, 1500.0, wave - 1.5 * np.exp(t / 1500.0))
    assert reason.flag == "SETPOINT_DRIFT" and "hauled in" in reason.text
    for settles in (wave, wave - 9.0 * np.exp(-t / 400.0), 0.1 * np.sin(0.01 * t) + wave):
        assert drifting(law, 1500.0, settles) == ()
    assert drifting(TOW, 1500.0, t) == (), "another law"


def test_a_servo_without_a_rate_gain_has_no_inverse():
    text = "setpoint.feed_forward = true inverts the servo, but winch.derivative_gain = 0 1/s: "
    assert text in refused(scene, setpoint__feed_forward=True, winch__derivative_gain=0.0)
    sim = Simulator(scene(winch__derivative_gain=0.0))
    with pytest.raises(ValueError, match=text + ".*; nothing was changed. Give winch.derivative_gain above 0 1/s"):
        set_live(sim, "setpoint.feed_forward", True)
    assert sim.scene.setpoint.feed_forward is False


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"algorithm": "hold", "feed_forward": True}, "feed_forward = true has no effect: setpoint.algorithm = hold"),
        ({"algorithm": "constant_tension", "prediction": True}, "prediction = true has no effect: setpoint.algorithm"),
        ({"prediction": True}, "prediction = true has no effect: drive.dead_time = 0 s"),
    ],
)
def test_an_option_that_acts_on_nothing_is_a_caution(changes, text):
    said = cautioned(scene, **{f"setpoint.{key}": value for key, value in changes.items()})
    assert f"setpoint.{text}" in "\n".join(said)
