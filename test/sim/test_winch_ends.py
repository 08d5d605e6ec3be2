"""A winch that feeds, at the ends of its travel and under senseless commands: reported, and no cable made or lost."""

import numpy as np
import pytest
from underway import goes_on, refused, scene_with

from cable_sim_ros.physics.inputs import push_command
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.simulator import Simulator
from verification.shipped import started

pytestmark = pytest.mark.trust

TICK = 0.05  # s
STOPPED = Flag.DRUM_END | Flag.WINCH_LIMIT


def held(**changes) -> Simulator:
    """full_scale at rest, its winch held but for the commands."""
    return started(scene_with(setpoint__algorithm="hold", solver__tick=TICK, winch__command_timeout=3600.0, **changes))


def commanded(sim: Simulator, seconds: float, rate: float) -> np.recarray:
    """Tick outputs of a rate given now, whatever its size."""
    push_command(sim.inputs, int(sim.frame.time), np.nan, rate)
    return sim.run(round(seconds / TICK))


def keeps_cable(frames: np.recarray, total: float = 600.0) -> bool:
    """Is what is out and what is on the drum all the cable, at every tick?"""
    return bool(np.abs(frames.payout + frames.cable_on_drum - total).max() < 1e-9)


@pytest.mark.parametrize(
    "changes, rate, minimum, maximum, flag",
    [
        ({"winch.most_scope": 453.0}, 2.0, 450.0, 453.0, Flag.WINCH_LIMIT),
        ({"winch.least_scope": 447.0}, -2.0, 447.0, 450.0, Flag.WINCH_LIMIT),
        # 0.3 rad of the 0.305 m of the drum stay on it, and what is dead besides
        ({"winch.scope": 588.0, "winch.dead_length": 1.0}, 2.0, 588.0, 600.0 - 8.0398 - 1.0 - 0.0915, Flag.DRUM_END),
        ({"winch.scope": 590.0, "winch.most_scope": 1e4}, 2.0, 590.0, 600.0 - 8.0398 - 0.0915, Flag.DRUM_END),
    ],
    ids=["soft limit, paying out", "soft limit, hauling in", "end stop with dead length", "end stop within the limit"],
)
def test_the_winch_stops_at_a_limit_and_reports_it(changes, rate, minimum, maximum, flag):
    sim = held(**changes)
    before = sim.frame.scope
    frames = commanded(sim, 4.0, rate)
    assert keeps_cable(frames)
    assert frames.scope.min() > minimum - 1e-9 and frames.scope.max() < maximum + 1e-3
    end = maximum if rate > 0.0 else minimum
    assert frames.scope[-1] == pytest.approx(end, abs=1e-3) and frames.payout_rate[-1] == pytest.approx(0.0, abs=1e-3)
    assert Flag(int(frames.status[-1])) & STOPPED == flag and not Flag(int(frames.status[0])) & STOPPED
    assert np.abs(np.diff(frames.payout_rate)).max() <= 20.0 * TICK * 1.05, "it brakes ahead of the end"
    back = commanded(sim, 1.0, -rate)  # what was commanded past the end is not saved up
    assert keeps_cable(back) and not Flag(int(back.status[-1])) & STOPPED
    assert abs(back.scope[-1] - end) == pytest.approx(2.0, abs=0.2) and before == pytest.approx(
        minimum if rate > 0.0 else maximum
    )


def test_hauling_in_ends_where_the_towbody_comes_to_the_mesh_of_the_sheave():
    sim = held(**{"winch.scope": 30.0, "accuracy.position": 0.05})
    minimum = sim.frame.payout + float(sim.model.settings[0].drum.min_length)
    frames = commanded(sim, 25.0, -2.0)
    assert keeps_cable(frames) and np.isfinite(frames.tension).all()
    assert Flag(int(frames.status[-1])) & STOPPED == Flag.DRUM_END
    assert frames.payout[-1] == pytest.approx(minimum, abs=1e-3) and frames.payout.min() > minimum - 1e-9
    assert 0.0 < frames.scope[-1] < 5.0, "nearly all of it is in"


def test_a_reversal_at_every_tick_moves_nothing_far():
    """200 m/s^2 are wanted and 2 allowed: in each of the hundred ticks the rate gets 0.1 m/s on its way and back."""
    sim, frames = held(**{"winch.command_acceleration": 2.0}), []
    for k in range(100):
        frames.append(commanded(sim, TICK, 5.0 if k % 2 else -5.0))
    frames = np.concatenate(frames).view(np.recarray)
    assert keeps_cable(frames) and np.isfinite(frames.tension).all()
    assert np.abs(frames.payout - frames.payout[0]).max() < 1.0
    assert np.abs(frames.payout_rate).max() <= 0.11
    assert commanded(sim, 3.0, 0.0).payout[-1] == pytest.approx(458.0398 - 100 * TICK * 0.05, abs=1e-3)
    assert not (frames.status & (Flag.NEWTON_FAILED | Flag.NOT_FINITE | STOPPED)).any()


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"winch.scope": None, "winch.cable_on_drum": 0.0}, "cable_on_drum leaves 0 m on the drum at the start, but"),
        ({"winch.scope": 400.0, "winch.least_scope": 420.0}, "winch.least_scope = 420 m is more than 400 m, the scope"),
        ({"winch.most_scope": 420.0}, "winch.most_scope = 420 m is less than 450 m, the scope at the start"),
        ({"winch.least_scope": 460.0, "winch.most_scope": 420.0}, "= 460 m is not below winch.most_scope = 420 m: the"),
    ],
)
def test_a_start_beyond_an_end_is_refused(changes, text):
    assert text in refused(scene_with, **changes)


def test_a_start_at_a_limit_is_at_it():
    sim = held(**{"winch.least_scope": 450.0})
    frames = commanded(sim, 1.0, -1.0)
    assert Flag(int(frames.status[-1])) & STOPPED == Flag.WINCH_LIMIT
    assert frames.scope[-1] == pytest.approx(450.0, abs=1e-6)


def test_a_haul_saved_half_way_goes_on_bit_for_bit(tmp_path):
    """The strain that the cable was wound with and the place of the nodes go with it."""
    sim = held()
    commanded(sim, 10.0, -3.5)
    first = goes_on(sim, 200, tmp_path)
    assert first.payout[0] - first.payout[-1] == pytest.approx(3.5 * 9.95, abs=0.01) and keeps_cable(first)


def test_a_body_on_the_line_stops_before_it_comes_to_the_sheave():
    """A depressor at the end of the bare cable: the winch stops with it outboard, where it is clamped; and back."""
    depressor = {"at": "bare", "mass": 40.0, "net_weight": 250.0, "drag_area": (0.02, 0.2, 0.2)}
    sim = held(**{"bodies": {"depressor": depressor}, "winch.scope": 158.0, "ship.tow_speed": 1.0})
    node = int(sim.model.line.body_nodes[1])
    frames = commanded(sim, 8.0, -2.0)
    assert Flag(int(frames.status[-1])) & Flag.DRUM_END and keeps_cable(frames)
    assert frames.payout_rate[-1] == pytest.approx(0.0, abs=1e-3)
    assert sim.state.arc[node] == pytest.approx(450.0, abs=1e-6), "it stays where it is clamped"
    assert 150.0 < frames.scope[-1] < 157.0, "8 m were to be hauled in; the short elements beside it stop it first"
    away = np.linalg.norm(sim.state.q[node, :3] - sim.state.now.sheave.position)
    assert away > 2.0 * sim.scene.sheave.radius
    back = commanded(sim, 2.0, 1.0)
    assert back.scope[-1] > frames.scope[-1] + 1.5 and not Flag(int(back.status[-1])) & Flag.DRUM_END


@pytest.mark.parametrize(
    "changes, plan, end, flag",
    [
        ({"winch.scope": 6.0}, "0 hold, 1 rate -1", 1.23529, Flag.DRUM_END),
        ({"winch.scope": 60.0, "winch.least_scope": 58.0}, "0 hold, 1 rate -0.5", 58.0, Flag.WINCH_LIMIT),
        ({"winch.scope": 60.0, "winch.most_scope": 63.0}, "0 hold, 1 rate 1", 63.0, Flag.WINCH_LIMIT),
    ],
    ids=["hauled in to the end stop", "hauled in to a soft limit", "paid out to a soft limit"],
)
def test_with_chosen_steps_the_winch_comes_to_rest_at_an_end(changes, plan, end, flag):
    """As `cable-sim run` does it by default: steps follow the braking, and the slack and snaps of 2 m of cable."""
    report = offline.run(scene_with("side_scan", **changes), winch=plan, duration=9.0, step="chosen")
    assert report.problem == "" and len(report.frames) == 90
    last = report.frames[-1]
    assert last.scope == pytest.approx(end, abs=1e-5) and last.payout_rate == pytest.approx(0.0, abs=1e-6)
    assert Flag(int(last.status)) & STOPPED == flag
    assert keeps_cable(report.frames, 300.0)
