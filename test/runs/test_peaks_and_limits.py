"""What falls between ticks, what the steps damp, what the winch cannot do: in the figures and in the verdict."""

import re

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.runs import offline, verdict
from cable_sim_ros.runs.summary import summarize
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.trust
HELD = {"setpoint.algorithm": "hold"}


def scene(**keys):
    return override(load_scene("full_scale"), HELD | {key.replace("__", "."): value for key, value in keys.items()})


# ---- peaks between ticks


@pytest.fixture(scope="module")
def stopped():
    """Hauled in at 1 m/s from 2.03 s on and stopped: tick outputs of 0.1 s, steps chosen; and every 10 ms."""
    plan = "0 hold, 2.03 rate -1.0, 3.03 hold"
    coarse = offline.run(scene(), winch=plan, duration=4.0, step="chosen")
    return coarse, offline.run(scene(), winch=plan, duration=4.0, step="fixed")


def test_the_peaks_of_every_step_are_kept(stopped):
    frames = stopped[0].frames
    assert (frames.tension_tick_min <= frames.tension).all() and (frames.tension <= frames.tension_tick_max).all()
    assert (frames.tension_tick_max - frames.tension).max() > 100.0 and frames.substeps.max() > 1
    one = stopped[1].frames[stopped[1].frames.substeps == 1]
    assert (one.tension_tick_max == one.tension).all() and (one.tension_tick_min == one.tension).all()
    assert (frames.tension_most >= frames.tension_tick_max - 1e-9).all()
    assert (frames.tension_least <= frames.tension_tick_min + 1e-9).all()


def test_the_largest_tension_of_a_run_falls_in_its_tick(stopped):
    coarse, fine = stopped[0].metrics, stopped[1].metrics
    ends = summarize_ends(stopped[0].frames)
    for name in ("tension_max_n", "tension_min_n"):
        assert coarse[name] == pytest.approx(fine[name], rel=0.015)
    worst = max(abs(a / fine[name] - 1.0) for name, a in ends.items())
    assert worst > 0.01  # by the ends of the ticks alone
    assert coarse["tension_max_at_s"] == pytest.approx(fine["tension_max_at_s"], abs=0.11)
    k = round(coarse["tension_max_at_s"] / 0.1) - 1
    frame = stopped[0].frames[k]
    assert frame["tension_tick_max"] == coarse["tension_max_n"]
    assert (coarse["tension_max_payout_m"], coarse["tension_max_scope_m"]) == (frame["payout"], frame["scope"])


def summarize_ends(frames):
    """Least and largest by the ends of the ticks alone, as a recording of an older version has them."""
    old = frames.copy()
    for name in ("tension_tick_min", "tension_tick_max", "contact_resultant_tick_max", "tension_damped"):
        old[name] = np.nan
    old["winch_power_tick_max"] = old["rate_limited"] = np.nan
    metrics = summarize(old.view(np.recarray))
    assert metrics["tension_damped_n"] is None and metrics["winch_power_max_w"] is None
    assert metrics["winch_rate_limited_share"] is None and metrics["contact_resultant_max_n"] > 0.0
    return {name: metrics[name] for name in ("tension_max_n", "tension_min_n")}


def test_pull_and_power_of_the_winch(stopped):
    frames, metrics = stopped[1].frames, stopped[1].metrics
    power = -frames.tension_drum * frames.payout_rate
    assert metrics["winch_power_max_w"] == pytest.approx(power.max(), rel=1e-12)
    assert metrics["winch_power_min_w"] == pytest.approx(power.min(), rel=1e-12, abs=1e-9)
    assert metrics["winch_pull_max_n"] == frames.tension_drum.max()
    assert metrics["winch_rate_max_m_s"] >= abs(frames.payout_rate).max() > 0.99
    assert metrics["winch_acceleration_max_m_s2"] >= abs(frames.payout_acceleration).max()


# ---- ringing that the steps damp


@pytest.fixture(scope="module")
def ringing():
    """A towbody of 250 kg in air on 4 m of cable, hauled in by 0.2 m: at 10 ms and the step that is named."""
    plan, tow = "0 hold, 0.5 rate -0.1, 1.5 hold", scene(winch__scope=4.0)
    coarse = offline.run(tow, winch=plan, duration=4.0, step="fixed")
    step = float(re.search(r"--step fixed --every (\S+),", coarse.verdict.reasons[0].text).group(1))
    return coarse, offline.run(tow, winch=plan, duration=4.0, step="fixed", every=step)


def test_steps_that_damp_what_rings_are_said(ringing):
    coarse, fine = ringing
    crossed = "SURFACE_CROSSED"  # the body is hauled out
    assert [reason.flag for reason in coarse.verdict.reasons] == ["RINGING_DAMPED", crossed]
    assert coarse.verdict.code == 4
    text = coarse.verdict.reasons[0].text
    assert "by steps of 0.01 s. Steps of 0.00" in text
    assert [reason.flag for reason in fine.verdict.reasons] == [crossed], "the step that it names will do"
    assert fine.metrics["tension_std_n"] > 1.2 * coarse.metrics["tension_std_n"]


def test_the_size_of_what_is_missing_is_of_the_right_size(ringing):
    coarse, fine = (run.metrics for run in ringing)
    missing = np.sqrt(fine["tension_std_n"] ** 2 - coarse["tension_std_n"] ** 2)
    assert 0.5 * missing < coarse["tension_damped_n"] < 2.0 * missing
    assert fine["tension_damped_n"] < 0.2 * fine["tension_std_n"]


def test_a_deviation_that_misses_ringing_is_said_without_a_flag():
    reason = verdict.judge(stand_in(3000.0, 30.0, damped=10.0), scene()).reasons[0]
    assert reason.flag == "RINGING_DAMPED" and "7.07 N rms or more beside a deviation of 30 N" in reason.text
    assert verdict.judge(stand_in(3000.0, 30.0, damped=9.0), scene()).state == "doubtful"
    assert verdict.judge(stand_in(3000.0, 30.0, damped=6.0), scene()).state == "ok"  # 1 % of the deviation
    assert verdict.judge(stand_in(3000.0, 0.0, damped=3.0), scene()).state == "ok"  # 2 N of 3000


def stand_in(mean, deviation, damped):
    """Tick outputs of 60 s with a sine of the tension."""
    frames = np.zeros(6000, TICK_OUTPUT).view(np.recarray)
    frames.time = np.arange(1, 6001) * 10_000_000
    frames.tension = mean + np.sqrt(2.0) * deviation * np.sin(2.0 * np.pi * np.arange(6000) / 1000.0)
    frames.tension_most, frames.tension_damped, frames.substeps = frames.tension, damped, 1
    return frames


# ---- a winch at its limits


@pytest.fixture(scope="module")
def saturated():
    """Heave of 1 m in 4 s, and a winch of 0.4 m/s and 0.6 m/s2."""
    keys = {"setpoint.algorithm": "simplified_waterline", "winch.max_rate": 0.4, "winch.max_acceleration": 0.6}
    return offline.run(override(scene(), keys), heave=(1.0, 4.0), duration=11.0, step="fixed")


def test_a_compensation_at_the_limits_of_its_winch_is_said(saturated):
    metrics, frames = saturated.metrics, saturated.frames
    at_rate = float(np.mean(abs(frames.payout_rate) >= 0.4 - 1e-9))
    hardest = float(np.mean(abs(frames.payout_acceleration) >= 0.6 - 1e-9))
    assert metrics["winch_rate_limited_share"] == pytest.approx(at_rate, abs=0.02) and at_rate > 0.1
    assert metrics["winch_acceleration_limited_share"] == pytest.approx(hardest, abs=0.05) and hardest > 0.1
    assert (metrics["winch_rate_max_m_s"], metrics["winch_acceleration_max_m_s2"]) == (0.4, 0.6)
    reason = next(reason for reason in saturated.verdict.reasons if reason.flag == "WINCH_SATURATED")
    assert f"winch.max_rate held it {100.0 * metrics['winch_rate_limited_share']:.3g} % of the run" in reason.text
    behind = abs(frames.payout_setpoint - frames.payout).max()
    assert f"up to {behind:.3g} m behind" in reason.text and saturated.verdict.code == 4
    assert "WINCH_SATURATED" not in [reason.flag for reason in verdict.judge(frames, scene()).reasons], "hold"


def test_what_holds_a_command_and_the_end_of_the_travel():
    sim = Simulator(scene(winch__command_acceleration=0.5, winch__max_rate=1.0, winch__most_scope=450.2))
    sim.start()
    sim.push(WinchCommand(rate=0.3))
    ramp = sim.run(40)
    assert ramp.ramp_limited.mean() == pytest.approx(1.0) and not ramp.rate_limited.any()
    assert not ramp.travel_limited.any() and not ramp.command_limited.any()
    sim.push(WinchCommand(rate=3.0))
    assert sim.run(1).command_limited[0] == 1.0
    for _ in range(4):
        sim.push(WinchCommand(rate=3.0))
        frames = sim.run(40)
    assert frames.travel_limited.mean() == pytest.approx(1.0) and (frames.status & Flag.WINCH_LIMIT).all()
