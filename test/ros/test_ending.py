"""The verdict of a node, which keeps counts and no tick outputs."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.ros.publisher import RunningSums
from cable_sim_ros.ros.report.diagnostics import verdict_of_node
from cable_sim_ros.runs import mean_track, verdict
from cable_sim_ros.sim.checks.friction_checks import slow

TICK = 0.01


def ended(statuses, problem="", maximum=2000.0, frames=(), changes=None, **metrics):
    frame = np.zeros(1, TICK_OUTPUT).view(np.recarray)[0]
    frame.status = list(statuses)[-1] if statuses else 0
    latest = frame if statuses else None
    scene = override(load_scene("full_scale"), changes or {})
    sums = RunningSums(TICK, slow(scene))
    for one in frames:
        sums.add(one)
    publisher = SimpleNamespace(statuses=Counter(statuses), latest=latest, max_tension=maximum, sums=sums)
    return verdict_of_node(SimpleNamespace(scene=scene, problem=problem), publisher, metrics)


@pytest.mark.parametrize(
    "given, state, flags",
    [
        (({0: 6000},), "ok", []),
        (({0: 5000, 64: 1000},), "doubtful", ["MOTION_STALE"]),
        (({0: 5999, 8: 1},), "doubtful", ["DETACHED"]),
        (({0: 6000}, "the solver gave up"), "failed", ["HALTED"]),
        (({}, "no static start"), "failed", ["HALTED"]),
        (({},), "ok", []),
        (({0: 6000}, "", 102e3), "doubtful", ["OVERLOAD"]),
    ],
)
def test_a_node_ends_as_its_ticks_say(given, state, flags):
    found = ended(*given)
    assert (found.state, [reason.flag for reason in found.reasons]) == (state, flags)


def sailing(bow_down=1.0, ringing=0.0):
    """60 s on a wave: the ship is drawn ahead as its bow goes down; ringing [N] is what the steps damped away."""
    t = TICK * np.arange(6000)
    frames = np.zeros(len(t), TICK_OUTPUT).view(np.recarray)
    frames.time = np.round(t * 1e9)
    pitch = bow_down * np.radians(2.0) * np.sin(0.7 * t)
    frames.ship_quaternion[:, 1], frames.ship_quaternion[:, 3] = np.sin(0.5 * pitch), np.cos(0.5 * pitch)
    frames.ship_velocity[:, 0] = 2.0 - 0.3 * np.cos(0.7 * t)
    frames.tension = 2000.0 + 100.0 * np.sin(0.7 * t)
    frames.tension_damped = ringing
    return frames


@pytest.mark.parametrize(
    "given, flags",
    [
        ({}, []),
        ({"bow_down": -1.0}, ["PITCH_SIGN"]),
        ({"ringing": 25.0}, ["RINGING_DAMPED"]),  # 2 % of 71 N more is 20 N of it, an amplitude
        ({"ringing": 15.0}, []),
    ],
)
def test_a_node_says_what_a_run_over_its_frames_says(given, flags):
    frames = sailing(**given)
    found = ended({0: len(frames)}, frames=frames)
    assert [reason.flag for reason in found.reasons] == flags
    offline = [*mean_track.pitch_sign(frames), *verdict.judge(frames).reasons]
    assert [reason.flag for reason in offline] == flags
    assert all(a.text.split(",")[0] == b.text.split(",")[0] for a, b in zip(found.reasons, offline)), "the same numbers"


def test_a_node_says_the_slam_that_its_ticks_left_out():
    frames = sailing()
    frames.status[100:102], frames.slam_estimate[100:102] = Flag.SURFACE_CROSSED, (300.0, 1234.0)
    found = ended({0: len(frames) - 2, int(Flag.SURFACE_CROSSED): 2}, frames=frames)
    assert [reason.flag for reason in found.reasons] == ["SURFACE_CROSSED"]
    assert "about 1.23e+03 N of the slam" in found.reasons[0].text == verdict.judge(frames).reasons[0].text


def test_lost_messages_and_lost_time_count():
    found = ended({0: 6000}, skips_ahead=1, recorder={"dropped": 3})
    assert [reason.flag for reason in found.reasons] == ["BEHIND", "NOT_RECORDED"]


def test_a_node_whose_winch_is_held_doubts_its_pull_where_there_is_friction():
    frames = np.zeros(50, TICK_OUTPUT).view(np.recarray)
    frames.ship_quaternion[:, 3], frames.scope = 1.0, 450.0
    friction = {"sheave.friction": 0.1, "sheave.bearing_friction": 0.02}
    assert ended({0: 50}, frames=frames).state == "ok"
    assert [r.flag for r in ended({0: 50}, frames=frames, changes=friction).reasons] == ["FRICTION_SLIP"]
    frames.payout_rate[:48] = 0.1
    assert ended({0: 50}, frames=frames, changes=friction).state == "ok"
