"""What a careless user commands: the run goes on to its end, says what it did, and every number of it is finite."""

import numpy as np
import pytest
from underway import scene_with

from cable_sim_ros.physics.inputs import push_command
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.simulator import Simulator
from verification.shipped import started

NAN = np.nan
HALT = Flag.NEWTON_FAILED | Flag.NOT_FINITE
FED, FIXED = "full_scale", "full_scale_contact"


def ran(name: str, orders: list[tuple[float, float, float]], ramp=None, **changes) -> tuple[Simulator, np.recarray]:
    """The shipped tow under orders (seconds, length, rate), as they would come from a topic; a halt raises."""
    sim = started(scene_with(name, **changes, winch__command_timeout=3600.0, winch__command_acceleration=ramp))
    parts = []
    for seconds, payout, rate in orders:
        push_command(sim.inputs, int(sim.frame.time), payout, rate)
        parts.append(sim.run(round(seconds / sim.scene.solver.tick)))
    frames = np.concatenate(parts).view(np.recarray)
    assert all(np.isfinite(frames[field]).all() for field in frames.dtype.names) and not (frames.status & HALT).any()
    return sim, frames


def at_an_end(frames: np.recarray, travel: tuple[float, float]) -> bool:
    """Did the winch come to rest at an end, and say that more is asked than it can do?"""
    low, high = travel
    last = frames[-1]
    near = min(abs(float(last.payout) - low), abs(float(last.payout) - high))
    return near < 0.05 and abs(last.payout_rate) < 0.05 and bool(last.status & Flag.COMMAND_LIMITED)


def travel_of(sim: Simulator) -> tuple[float, float]:
    drum = sim.model.settings[0].drum
    return float(drum.payout_0 + drum.min_reach), float(drum.payout_0 + drum.max_reach)


def test_twenty_metres_out_given_as_a_length_hauls_nearly_all_of_it_in():
    """450 m at 5 m/s; a report is there all the while, and the sender can think better of it at any time."""
    sim, frames = ran(FED, [(60.0, 20.0, NAN), (5.0, NAN, 0.0)])
    assert frames.payout_rate.min() == pytest.approx(-5.0, abs=0.1)
    assert np.ptp(frames.payout[-100:]) < 0.1 and frames.payout[-1] > 150.0, "a stop stops it"


@pytest.mark.parametrize("ramp, maximum", [(None, 20e3), (2.0, 12e3)])
@pytest.mark.parametrize(
    "payout, rate",
    [
        (20.0, NAN),
        pytest.param(NAN, -5.0, marks=pytest.mark.nightly),
        pytest.param(-1e308, NAN, marks=pytest.mark.nightly),
        (NAN, -1e308),
    ],
)
def test_a_mesh_fixed_to_the_material_hauls_in_as_far_as_it_is_fine(payout, rate, ramp, maximum):
    """It halted after 2 s at 119 kN, with 25 m elements on the sheave."""
    sim, frames = ran(FIXED, [(6.0, payout, rate), (2.0, NAN, 5.0), (2.0, NAN, -5.0)], ramp)
    low, high = travel_of(sim)
    assert low == pytest.approx(458.09, abs=0.01) and high == pytest.approx(462.82, abs=0.01)
    assert at_an_end(frames[:600], (low, high)) and frames.tension.max() < maximum


@pytest.mark.parametrize("ramp", [None, 2.0])
def test_from_one_end_stop_to_the_other_at_the_largest_rate_and_against_it(ramp):
    """Rates from each end and against it; the way back is taken at once."""
    fast = [(4.0, NAN, 5.0), (6.0, NAN, -5.0)]
    sim, out = ran(FED, fast, ramp, winch__scope=590.0)
    assert at_an_end(out[:400], travel_of(sim)) and out.payout[410] < out.payout[399]
    sim, back = ran(FED, [(15.0, NAN, -5.0), (1.0, NAN, 5.0), (4.0, NAN, -5.0)], ramp, winch__scope=30.0)
    assert at_an_end(back[:1500], travel_of(sim)) and back.payout[1510] > back.payout[1499]


@pytest.mark.parametrize("ramp, fastest, tension", [(None, 5.01, 20e3), (2.0, 1.1, 6e3)])
@pytest.mark.parametrize("name", [FED, FIXED])
def test_the_largest_rate_in_and_out_by_turns(name, ramp, fastest, tension):
    sim, frames = ran(name, [(0.5 if k % 3 else 0.05, NAN, 5.0 * (-1) ** k) for k in range(10)], ramp)
    assert np.abs(frames.payout_rate).max() < fastest and frames.tension.max() < tension


@pytest.mark.parametrize("name", [FED, FIXED])
def test_no_number_is_too_large_and_none_is_no_command(name):
    orders = [(2.0, 1e308, NAN), (0.5, NAN, NAN), (2.0, NAN, 1e308), (2.0, -1e308, NAN), (1.0, NAN, -1e308)]
    _, frames = ran(name, orders)
    assert (frames.status & Flag.COMMAND_LIMITED).any() and np.abs(frames.payout_rate).max() <= 5.0 * (1 + 1e-9)
