"""Drive of the winch: drum and cable in one step, motor, brake, modes, dead time, against closed forms."""

import re
from functools import partial
from math import cos, exp, sin, sqrt

import numpy as np
import pytest
from underway import at_rate, cautioned, refused, scene_with

from cable_sim_ros import Simulator
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.physics.winch_drive import BRAKE, EMERGENCY_STOP, MODES, RENDER, TENSION, taken_up
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.live_parameters import set_live
from verification.experiments.drum import WEIGHT, hanging
from verification.shipped import started

pytestmark = pytest.mark.trust

TOW = load_scene("full_scale")
RADIUS = TOW.winch.drum_radius + 0.5 * TOW.cable.diameter
MASS = 500.0  # kg at the cable
MOTOR = {
    "drive.model": "motor",
    "drive.inertia": MASS * RADIUS**2,
    "drive.curve_speed": [0.0, 2.0, 6.0],
    "drive.curve_pull": [2e4, 2e4, 1e4],
    "drive.brake_pull": 8e3,
}


scene = partial(scene_with, **MOTOR)


def test_a_motor_holds_a_tow_at_rest_to_the_bit():
    frames = started(scene()).run(100)
    assert (frames.payout == frames.payout[0]).all() and (frames.payout_rate == 0.0).all()
    assert (frames.drive_rounds == 1).all()
    assert frames.motor_pull == pytest.approx(frames.tension_drum, abs=1e-4 * TOW.contact.working_tension)


def test_cable_and_drum_together_are_second_order():
    """Half the step leaves a quarter of the error in what is paid out, under a heaving ship with the drum braked by its
    motor."""
    runs = {
        tick: offline.run(scene(solver__tick=tick), heave=(1.0, 6.0), duration=9.0, step="fixed").frames
        for tick in (0.02, 0.01, 0.0025)
    }
    when = np.arange(3.0, 8.9, 0.02)
    payout = {
        tick: np.interp(when, (frames.time - runs[0.0025].time[0]) * 1e-9, frames.payout)
        for tick, frames in runs.items()
    }
    coarse, fine = (np.abs(payout[tick] - payout[0.0025]).max() for tick in (0.02, 0.01))
    assert coarse < 1e-4 and 3.0 < coarse / fine < 6.0


def test_the_motor_carries_what_the_cable_and_the_mass_ask_for():
    """(1) at every tick of a haul, from what the tick outputs say."""
    frames = at_rate(started(scene(drive__viscous_friction=300.0)), -0.5, 200)
    moving = frames[20:][np.abs(frames.payout_rate[20:]) > 0.01]
    balance = MASS * moving.payout_acceleration + 300.0 * moving.payout_rate + moving.motor_pull - moving.tension_drum
    assert np.abs(balance).max() < 1.01 * 1e3 * 1e-7 * TOW.contact.working_tension + 1e-6
    assert frames.payout_rate[-1] == pytest.approx(-0.5, abs=0.01)
    assert frames.motor_power == pytest.approx(-frames.motor_pull * frames.payout_rate)


def test_a_motor_at_its_limit_is_overhauled_and_says_so():
    weak = scene(drive__curve_pull=[3400.0, 3400.0, 3400.0])
    frames = at_rate(started(weak), -2.0, 150)
    assert (frames.motor_pull <= 3400.0 * (1 + 1e-12)).all() and (frames.status[40:] & Flag.MOTOR_LIMITED).any()
    assert frames.motor_limited.max() == 1.0 and frames.payout_rate[-1] > -2.0
    power = scene(drive__max_power=2000.0)
    frames = at_rate(started(power), -1.5, 200)
    assert np.abs(frames.motor_power).max() < 2000.0 * 1.05 and abs(frames.payout_rate[-1]) < 0.75


def test_an_emergency_stop_sets_the_brake_which_slips_and_holds():
    """Worst case for a brake: the motor lets go under way. What it slips is that of the bare balance of the drum."""
    sim = started(scene())
    before = at_rate(sim, 1.0, 200)[-1]
    set_live(sim, "drive.mode", "emergency_stop")
    frames = sim.run(300)
    assert set(frames.winch_mode) == {EMERGENCY_STOP} and (frames.motor_pull == 0.0).all()
    assert (frames.payout_rate[-100:] == 0.0).all() and frames.brake_set[-1] == 1.0, "it holds"
    assert frames.brake_pull[-1] == pytest.approx(frames.tension_drum[-1], abs=1e-4 * TOW.contact.working_tension)
    x, v, brake, h = 0.0, float(before.payout_rate), 0.0, 1e-3
    while v > 0.0:  # the same with the tension of the run, by small steps
        tension = np.interp(x, frames.payout - before.payout, frames.tension_drum)
        brake = min(brake + h / 0.3, 1.0)
        v += h / MASS * (tension - 0.8 * 8e3 * brake)
        x += h * max(v, 0.0)
    assert frames.payout[-1] - before.payout == pytest.approx(x, rel=0.05)
    assert 0.0 < frames.brake_slip[-1] <= x * 1.1 and frames.brake_heat[-1] > 0.0
    set_live(sim, "drive.mode", "follow")
    back = sim.run(200)
    assert np.abs(np.diff(back.payout_rate)).max() < 20.0 * 0.01 * 1.5, "no jump"
    assert back.brake_set[-1] == 0.0 and np.abs(back.payout_acceleration[-50:]).max() < 1.0


@pytest.mark.parametrize("h", [0.02, 0.01, 0.002])
def test_an_integral_slides_along_its_bound_whatever_the_step(h):
    """The speed falls by c a second from 1 m/s, with no rate asked for: the integral stands while p v is above the
    bound, keeps p v + I there until i v = p c, and takes i v^2 / 2c after it. What stood still as long as a step would
    have gone past the bound was off by i v h, 900 N at 10 ms."""
    p, i, c, bound, integral = 1e4, 2e5, 0.5, 3600.0, 0.0
    for k in range(round(1.0 / (c * h))):
        before, after = 1.0 - c * h * k, 1.0 - c * h * (k + 1)
        up = 0.5 * h * i * (before + after)
        motor = min(p * after + integral + up, bound)
        integral += taken_up(p, integral, before, after, up, motor) if motor == bound else up
    left = p * c / i
    assert integral == pytest.approx(bound - p * left + 0.5 * i * left**2 / c, rel=3.0 * (h * i / p) ** 2)


def test_an_integral_stands_while_its_law_is_past_the_bound_also_where_that_falls_fast():
    """The speed loses in the step more than the integral would take: the law comes nearer to its bound, 3.6 kN, of
    itself."""
    assert taken_up(1e4, 3600.0, 1.0, 0.9, 200.0, 3600.0) == 0.0
    assert taken_up(1e4, -3600.0, -1.0, -0.9, -200.0, -3600.0) == 0.0


def test_commands_count_from_when_the_brake_is_open_whatever_the_step():
    """A brake that lifts in ten steps is open after them: round-off made it one more, 40 mm at 0.8 m/s."""
    braked = scene(drive__mode="brake", setpoint__algorithm="hold")
    run = {"duration": 3.0, "winch": "0.1 rate 0.8", "changes": [(0.5, "drive.mode", "follow")]}
    fine, *others = (
        offline.run(override(braked, {"solver.tick": tick}), step=step, every=every, **run).frames.payout[-1]
        for tick, step, every in ((0.005, "fixed", None), (0.05, "fixed", None), (0.01, "chosen", 0.1))
    )
    assert all(payout == pytest.approx(fine, abs=0.01) for payout in others)


def test_chosen_steps_see_the_drum_as_its_brake_stops_it():
    """2 t on 800 m lowered at 1.4 m/s: the way of the stop is that of the bare balance under the tension of fine steps,
    within the position asked for; steps that saw the cable alone were 11 mm off as the drum began to turn."""
    mass, brake, slips = 2000.0, 5e4, 0.8
    lowered = load_scene("lowered_ctd")
    radius = lowered.winch.drum_radius + 0.5 * lowered.cable.diameter
    deep = {
        "towbody.mass": 2000.0,
        "towbody.net_weight": 1.6e4,
        "winch.scope": 800.0,
        "cable.sections": {"wire": {"length": 1000.0}},
        "contact.working_tension": 2.5e4,
        "drive.inertia": mass * radius**2,
        "drive.controller_mass": 4000.0,
        "drive.curve_speed": [0.0, 6.0],
        "drive.curve_pull": [6e4, 6e4],
        "drive.brake_pull": brake,
    }
    what = override(lowered, MOTOR | deep)
    run = {"duration": 7.0, "winch": "0.5 rate 1.4", "changes": [(6.0, "drive.mode", "emergency_stop")]}
    fine, chosen = (offline.run(what, step=step, **run) for step in ("fixed", "chosen"))
    times, let_go = (fine.frames.time - fine.frames.time[0]) * 1e-9 + 0.01, 599
    x, v, h = float(fine.frames.payout[let_go]), float(fine.frames.payout_rate[let_go]), 1e-4
    ways, t = {}, 0.0
    while t < 0.9:  # the brake sets in 0.3 s
        tension = np.interp(6.0 + t, times, fine.frames.tension_drum)
        v = max(v + h / mass * (tension - slips * brake * min(t / 0.3, 1.0)), 0.0)
        x, t = x + h * v, t + h
        ways[round(t / h)] = x
    assert v == 0.0 and fine.frames.payout[-1] == pytest.approx(x, abs=2e-3)
    off = np.interp(chosen.frames.time, fine.frames.time, fine.frames.payout) - chosen.frames.payout
    assert np.abs(off).max() < 3e-3 and chosen.metrics["steps_taken"] < 0.75 * len(fine.frames)
    assert chosen.frames.brake_slip[-1] == pytest.approx(fine.frames.brake_slip[-1], abs=2e-3)
    deep_off = np.interp(chosen.frames.time, fine.frames.time, fine.frames.body_position[:, 2])
    assert np.abs(deep_off - chosen.frames.body_position[:, 2]).max() < 0.01, "the position asked for"


def test_the_verdict_of_a_stop_says_the_step_that_its_peak_needs():
    """2.5 t in air on 6 m, stopped by its brake: at 20 ms 5 % of the peak are missed, at 2 ms less than 0.1 %."""
    peaks = {}
    for tick in (0.02, 0.002):
        short = hanging(2000.0, 4.0, tick=tick, drive__brake_set_time=0.05, drive__brake_pull=3.0 * WEIGHT)
        way = {"winch": "0 rate 0.05", "duration": 0.6, "changes": [(0.3, "drive.mode", "emergency_stop")]}
        run = offline.run(short, step="fixed", **way)
        peaks[tick] = float(run.frames.tension_drum.max())
        found = [reason for reason in run.verdict.reasons if reason.flag == "STOP_STEP"]
        if tick == 0.02:
            assert len(found) == 1 and "tension_max_n" in found[0].metrics
            assert "steps of 20 ms may miss" in found[0].text and "--step fixed --every 0.01" in found[0].text
        else:
            assert not found
    assert 0.03 < 1.0 - peaks[0.02] / peaks[0.002] < 0.08


def test_a_brake_holds_up_to_its_pull_and_slips_above_it():
    holds = started(scene(drive__mode="brake", drive__brake_pull=3400.0))
    frames = holds.run(100)
    assert (frames.payout_rate == 0.0).all() and (frames.brake_set == 1.0).all() and not frames.motor_pull.any()
    weak = scene(drive__mode="brake", drive__brake_pull=3300.0)
    slips = offline.run(weak, heave=(2.0, 5.0), duration=12.0, step="fixed").frames
    assert slips.brake_slip[-1] > 0.01 and (slips.status & Flag.BRAKE_SLIPPED).any()
    assert slips.tension_drum.max() < 3300.0 * 1.02
    assert slips.brake_heat[-1] == pytest.approx(0.8 * 3300.0 * slips.brake_slip[-1])


@pytest.mark.parametrize("rate", [1.0, -1.0])
def test_a_brake_asked_for_under_way_sets_once_the_motor_has_stopped_the_drum(rate):
    sim = started(scene())
    begin = at_rate(sim, rate, 200)[-1]
    set_live(sim, "drive.mode", "brake")
    frames = sim.run(300)
    stop, set_at = np.flatnonzero(frames.payout_rate == 0.0)[0], np.flatnonzero(frames.brake_set > 0.0)[0]
    assert set_at * 0.01 < 2.0 and np.abs(frames.payout_rate[:set_at]).min() < 0.02, "first at rest, then set"
    assert abs(frames.payout[-1] - begin.payout) < 0.5 and not frames.payout_rate[stop:].any()
    assert frames.brake_slip[-1] < 0.01 and frames.brake_set[-1] == 1.0 and frames.motor_pull[-1] == 0.0


def test_the_drum_is_in_balance_however_coarse_the_cable_is_solved():
    frames = at_rate(started(scene(solver__tolerance=1e-5)), 0.5, 100)
    left = MASS * frames.payout_acceleration + frames.motor_pull - frames.tension_drum
    assert np.abs(left[10:]).max() < 1.1e-4 * TOW.contact.working_tension


def test_a_dead_band_does_not_hold_a_constant_tension():
    calm = {"drive__mode": "tension", "drive__set_pull": 3150.0, "drive__dead_band": 0.2}
    assert started(scene(**calm)).run(50).motor_pull == pytest.approx(3150.0)


def test_render_pays_out_at_the_set_pull_and_recovers():
    """A light drum: what its inertia takes or gives stands in the cable beside the motor's pull."""
    motion = {"heave": (2.0, 5.0), "duration": 14.0, "step": "fixed"}
    held = offline.run(scene(drive__mode="follow"), **motion).frames
    light = scene(drive__mode="render", drive__set_pull=3300.0, drive__inertia=50.0 * RADIUS**2)
    render = offline.run(light, **motion).frames
    assert held.tension_drum.max() > 3400.0
    late = render.time > render.time[0] + 8_000_000_000
    assert render.tension_drum[late].max() == pytest.approx(3300.0, rel=0.02)
    assert set(render.winch_mode) == {RENDER} and np.ptp(render.payout[late]) > 0.05


def test_a_drum_that_comes_to_its_largest_pull_and_leaves_it_goes_the_same_way_in_finer_steps():
    """300 kg over a rosette on 300 m. The integral that stood by what the rate lags, not by the law of the motor, lost
    0.02 m in steps of 10 ms; what these and longer ones may still lose, the verdict says."""
    tow = load_scene("lowered_ctd")
    radius = tow.winch.drum_radius + 0.5 * tow.cable.diameter
    values = {"drive.mode": "render", "drive.set_pull": 3500.0, "winch.scope": 300.0}
    what = override(tow, MOTOR | values | {"drive.inertia": 300.0 * radius**2})
    runs = {
        every: offline.run(what, heave=(1.0, 6.0), duration=10.0, step="fixed", every=every) for every in (0.01, 0.001)
    }
    coarse, fine = (runs[every].frames.payout[round(1.0 / every) - 1 :: round(0.01 / every)] for every in (0.01, 0.001))
    assert np.ptp(fine) > 2.0 and np.abs(coarse - fine).max() < 4e-3
    flags = {every: [reason.flag for reason in run.verdict.reasons] for every, run in runs.items()}
    assert flags == {0.01: ["RENDER_PLACE"], 0.001: []}
    (said,) = runs[0.01].verdict.reasons
    assert {"payout_max_m", "body_depth_m"} <= set(said.metrics) and "--step fixed --every 0.001" in said.text


def test_constant_tension_follows_the_ship():
    sim = scene(drive__mode="tension", drive__set_pull=3183.0, drive__inertia=50.0 * RADIUS**2)
    motion = {"heave": (1.0, 6.0), "duration": 14.0, "step": "fixed"}
    frames, held = offline.run(sim, **motion).frames, offline.run(scene(), **motion).frames
    assert set(frames.winch_mode) == {TENSION}
    assert frames.tension_drum[800:].std() < 0.5 * held.tension_drum[800:].std()


@pytest.mark.parametrize("model", ["servo", "motor"])
def test_the_operator_comes_before_the_compensation(model):
    """Both share winch.max_rate: what is too much for it is taken from the compensation, not from the mean rate."""
    own = MOTOR | {"drive.bandwidth": 20.0} if model == "motor" else {}
    what = override(TOW, own | {"winch.max_rate": 1.0, "setpoint.washout_period": 0.0})
    swing = {}
    for rate in (0.2, 1.0):
        plan = f"0 hold, 5 rate -{rate}"
        run = offline.run(what, heave=(1.0, 8.0), winch=plan, duration=20.0, step="fixed", every=0.02)
        frames = run.frames[-400:]
        assert frames.payout[-1] - frames.payout[0] == pytest.approx(-rate * 7.98, rel=0.02)
        swing[rate] = np.ptp(frames.payout_rate)
    assert swing[0.2] > 0.25 and swing[1.0] < 0.02, "a period: compensated, and nothing left for it"


def test_a_dead_time_is_pure():
    late = started(override(TOW, {"drive.dead_time": 0.123}))
    prompt = started(TOW)
    one, other = at_rate(late, 0.4, 100), at_rate(prompt, 0.4, 100)
    times = (one.time - one.time[0]) * 1e-9
    shifted = np.interp(times - 0.123, times, other.payout)
    assert np.abs(one.payout - shifted)[20:].max() < 2e-5, "by the line between two ticks"
    late.run(7)
    saved = late.snapshot()
    expected = late.run(30).tobytes()
    late.restore(saved)
    assert late.run(30).tobytes() == expected, "what is under way is part of the state"


@pytest.mark.parametrize("zeta", [0.7, 0.0])
def test_a_rate_loop_answers_a_step_as_its_order_says(zeta):
    w, rate, dead = 6.0, 0.5, 0.08
    loop = {"drive.model": "rate_loop", "drive.bandwidth": w, "drive.damping": zeta, "drive.length_gain": 0.0}
    free = {"winch.max_acceleration": 400.0, "winch.command_acceleration": 400.0, "drive.dead_time": dead}
    frames = at_rate(started(override(TOW, loop | free)), rate, 200)
    t = (frames.time - frames.time[0]) * 1e-9 + 0.01 - dead
    t = np.maximum(t, 0.0)
    if zeta:
        wd = w * sqrt(1.0 - zeta**2)
        closed = [rate * (1 - exp(-zeta * w * x) * (cos(wd * x) + zeta * w / wd * sin(wd * x))) for x in t]
    else:
        closed = [rate * (1.0 - exp(-w * x)) for x in t]
    assert np.abs(frames.payout_rate - closed).max() < 5e-3 * rate, "the rate takes 1.25 ms to change"
    assert not frames.motor_pull.any() and not frames.drive_rounds.any()


def test_a_power_limit_holds_on_a_light_drum_and_no_energy_comes_from_nowhere():
    """The limit is that of the speed at the end of the step: one of its beginning gained 4 kJ here."""
    light = scene(drive__inertia=4.5, drive__max_power=5000.0)
    frames = offline.run(light, winch="0 rate -5", duration=20.0, step="fixed").frames
    assert frames.motor_power.max() <= 5000.0 * (1 + 1e-6)
    assert abs(frames.energy_residual[-1]) < 1e-4 * frames.work_supplied[-1]
    assert np.abs(frames.payout_acceleration).max() < 10.0


def test_commands_do_not_add_up_while_the_brake_holds():
    sim = started(scene())
    at_rate(sim, 1.0, 200)
    set_live(sim, "drive.mode", "emergency_stop")
    stopped = at_rate(sim, 1.0, 200)
    assert (stopped.status & Flag.BRAKE_SLIPPED).any(), "while it sets"
    assert abs(stopped.payout_setpoint[-1] - stopped.payout[-1]) < 0.02
    set_live(sim, "drive.mode", "follow")
    back = sim.run(200)
    assert np.abs(back.payout - back.payout[0]).max() < 0.01 and np.abs(back.payout_rate).max() < 0.02
    on = at_rate(sim, 0.3, 100)
    assert 0.0 < on.payout[-1] - back.payout[-1] < 0.35, "a rate begins where the drum is"


def test_constant_tension_begins_without_a_bump():
    sim = started(scene(drive__mode="render", drive__set_pull=3300.0))
    at_rate(sim, 0.3, 100)
    set_live(sim, "drive.mode", "tension")
    assert sim.run(50).motor_pull == pytest.approx(3300.0)


def test_a_run_goes_on_in_another_mode(tmp_path):
    motion = {"heave": (1.0, 6.0), "duration": 4.0, "step": "fixed"}
    begun = offline.run(scene(drive__mode="brake"), save=tmp_path / "a.npz", **motion).frames
    on = offline.run(scene(), resumed=tmp_path / "a.npz", **motion).frames
    assert on.payout[0] == begun.payout[-1] and set(on.winch_mode) == {0} and on.brake_set[-1] == 0.0
    opened = np.argmin(on.brake_set)  # the motor has the load by then: nothing drops
    assert np.abs(on.payout[: opened + 1] - on.payout[0]).max() < 1e-5 and np.abs(on.payout - on.payout[0]).max() < 1.0


@pytest.mark.parametrize(
    "values, words",
    [
        ({"model": "servo", "mode": "brake"}, "mode = brake needs a motor and a brake"),
        ({"mode": "render"}, "set_pull = 0 N"),
        ({"mode": "brake", "brake_pull": 0.0}, "brake_pull = 0 N"),
        ({"curve_pull": [2e3, 2e3, 2e3]}, "curve_pull begins with 2000 N at the layer that runs off, not"),
        ({"brake_pull": 1e3}, "brake_pull holds 1000 N at the layer that runs off, not above"),
        ({"curve_speed": [0.0, 3.0, 2.0]}, "curve_speed has 3 speeds"),
        ({"curve_speed": [0.0, 1.0, 2.0]}, "curve_speed ends at 2 m/s, less than winch.max_rate"),
        ({"curve_speed": 5}, "curve_speed = 5 is a number"),
        ({"inertia": 0.0}, "inertia = 0 kg m"),
        ({"dead_time": 0.5}, "dead_time = 0.5 s is not below winch.command_timeout"),
        ({"damping": 0.0}, "damping = 0 is less than 0.1"),
        ({"length_gain": 9.0}, "length_gain = 9 1/s is not below 8.4 1/s"),
        ({"bandwidth": 200.0, "damping": 1.0}, "bandwidth = 200 rad/s is more than 100 rad/s"),
        ({"mode": "render", "set_pull": 3e4}, "set_pull = 30000 N is more than 20000 N, the most of"),
        ({"dry_friction": 1.7e4}, "dry_friction = 17000 N is not below "),
    ],
)
def test_what_a_drive_cannot_do_is_refused(values, words):
    assert f"drive.{words}" in refused(scene, **{f"drive.{key}": value for key, value in values.items()})


def test_what_a_drive_cannot_do_is_not_set_while_it_runs():
    sim = Simulator(override(TOW, {"drive.dead_time": 0.3}))
    with pytest.raises(ValueError, match="drive.dead_time = 0.3 s is not below winch.command_timeout = 0.2 s.*changed"):
        sim.set("winch.command_timeout", 0.2)
    sim = Simulator(TOW)
    with pytest.raises(ValueError, match="drive.mode = emergency_stop needs a motor"):
        sim.set("drive.mode", "emergency_stop")
    assert sim.scene is TOW and MODES.index("brake") == BRAKE


@pytest.mark.parametrize(
    "values, words",
    [
        ({"drive.model": "servo"}, "drive.inertia = .* kg m.2 has no effect: drive.model = servo has no motor"),
        ({"drive.model": "servo", "drive.bandwidth": 3.0}, "drive.bandwidth = 3 rad/s has no effect: .* loop"),
        ({"drive.model": "rate_loop", "drive.brake_set_time": 1.0}, "brake_set_time = 1 s has no effect: .* no motor"),
        ({"drive.inertia": 10.0 * RADIUS**2}, "drive.inertia makes 10 kg at the cable, less than 50 kg, 0.2 of towb"),
        ({"winch.flange_radius": 0.35}, "winch.flange_radius = 0.35 m has no effect: without winch.lay_width"),
        ({"drive.max_power": 3e3}, "drive.max_power leaves 600 N at 5 m/s, .* at 0.95 m/s or faster"),
        ({"drive.curve_pull": [1e4, 1e3, 1e4]}, "drive.curve_pull leaves 1[0-9]* N at .* or faster, it overhauls"),
        ({"drive.mode": "brake", "drive.curve_pull": [3e3] * 3}, "curve_pull begins with 3000 N, .* once the brake"),
        ({"drive.mode": "tension", "drive.set_pull": 1e3}, "set_pull = 1000 N is less than .* pays out from the start"),
    ],
)
def test_what_a_drive_does_otherwise_than_one_thinks_is_said(values, words):
    assert re.search(words, "\n".join(cautioned(scene, **values)))
