"""The stepping loop on its own: grid, overruns, resync, pause; and the clock of the data. In a process of their own,
because the stand-in takes the place of the simulator's modules."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from conftest import COMPILED, run_script

from cable_sim_ros.io.motion.arrival_order import DataClock, Stamp

HERE = Path(__file__).parent
pytestmark = COMPILED

SCRIPT = """
import json, os, time
import fake_sim
fake_sim.install()
import numpy as np
from cable_sim_ros.ros import loop as L
from cable_sim_ros.sim import loop as entry

class Scene:
    class solver: tick = 0.01
    class winch: command_timeout = 0.5; max_rate = 5.0

sim = fake_sim.Simulator(Scene)
output = fake_sim.make_output(sim.model, 20, 4096)
loop = L.Loop(sim.model, sim.state, sim.inputs, output, period_ns=10_000_000, max_catchup=3)
loop.warm_up()
target = time.monotonic_ns() - 5_000_000_000
loop.start(5_000_000_000, target)
def until(count):
    end = time.monotonic() + 100.0
    while loop.count < count and time.monotonic() < end:
        time.sleep(0.001)
    assert loop.count >= count, "the loop stands still"
until(40)
with loop.paused():
    before = loop.count
    time.sleep(0.025)
until(before + 10)
with loop.paused():
    resyncs = int(loop.control[L.RESYNCS])
    stalled = loop.count
    time.sleep(0.2)
    assert loop.count == stalled, "a tick ran during the pause"
until(stalled + 5)
lag = loop.row(stalled + 1).lag
until(stalled + 80)
later = loop.row(loop.count - 1).lag
loop.stop()
times = [loop.row(k).time for k in range(loop.count - 100, loop.count)]
print(json.dumps(dict(steps=sorted(set(np.diff(times).tolist())), new_resyncs=int(loop.control[L.RESYNCS]) - resyncs,
    skipped=int(loop.control[L.SKIPPED]), late=loop.overruns + resyncs, lag=lag, later=later,
    count=loop.count, reached=int(loop.control[L.REACHED]), hits=sum(entry._drive.stats.cache_hits.values()))))
loop.close()
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> list[dict]:
    """Two in a row on one cache on disk, empty at first."""
    cache = str(tmp_path_factory.mktemp("cache"))
    return [json.loads(run_script(SCRIPT, NUMBA_CACHE_DIR=cache).splitlines()[-1]) for _ in range(2)]


def test_time_stays_on_the_grid_and_a_stall_is_counted(runs):
    for report in runs:
        assert report["steps"] == [10_000_000], "simulation time jumped"
        assert report["reached"] == 5_000_000_000 + report["count"] * 10_000_000
        assert report["new_resyncs"] >= 1 and report["skipped"] >= 15
        assert report["late"] >= 1, "ticks after a short pause are late, or left out where a machine made it a long one"
        assert report["lag"] > 100_000_000


@pytest.mark.realtime
def test_a_lag_is_worked_off(runs):
    assert runs[1]["later"] < runs[1]["lag"] - 5_000_000


def test_the_loop_is_cached_on_disk(runs):
    assert runs[0]["hits"] == 0
    assert runs[1]["hits"] > 0, "the loop was compiled again"


SECOND = 10**9


def test_the_clock_takes_the_least_delay():
    clock = DataClock()
    assert clock.now(0) is None
    for k in range(100):
        clock.update(1000 * SECOND + k * 20_000_000, 5 * SECOND + k * 20_000_000 + (k * 7919) % 3_000_000)
    assert clock.offset == 5 * SECOND - 1000 * SECOND
    assert clock.now(6 * SECOND) == 1001 * SECOND


def test_the_clock_follows_a_drift_upwards():
    clock = DataClock()
    for k in range(60):
        clock.update(k * SECOND, k * SECOND + k * 1_000_000)  # the sender's clock is 1000 ppm slow
    assert 29_000_000 <= clock.offset <= 31_000_000, "the window of 30 s is not kept"


def test_one_wild_stamp_is_no_jump_but_five_are():
    clock = DataClock()
    clock.update(100 * SECOND, 0)
    assert clock.judge(100 * SECOND + 500_000_000, 0) is Stamp.FITS, "the least delay is still being found"
    assert clock.judge(50 * SECOND, 0) is Stamp.OFF
    assert clock.judge(900 * SECOND, 20_000_000) is Stamp.OFF, "two wild stamps that do not agree"
    judged = [clock.judge(50 * SECOND + k * 20_000_000, (2 + k) * 20_000_000) for k in range(5)]
    assert judged == [Stamp.OFF] * 4 + [Stamp.JUMPED]
    assert clock.jumps == 1 and clock.jump == pytest.approx(-50 * SECOND, abs=SECOND)


@pytest.mark.parametrize("jump, within", [(0.3, 5), (-0.3, 55), (0.9, 5), (-0.9, 55), (5.0, 5), (-5.0, 5)])
def test_a_jump_of_a_part_of_a_second_is_noticed(jump, within):
    """50 Hz with delays of up to 40 ms: ahead after five stamps, behind by less than a second after a second of it."""
    clock, after = DataClock(), None
    for k in range(300):
        stamp = 100 * SECOND + k * 20_000_000 + (round(jump * SECOND) if k >= 200 else 0)
        judged = clock.judge(stamp, k * 20_000_000 + (k * 7919) % 40_000_000)
        if judged is Stamp.JUMPED:
            after = k - 200 + 1
            break
        if judged is Stamp.FITS:
            clock.update(stamp, k * 20_000_000 + (k * 7919) % 40_000_000)
    assert after is not None and 5 <= after <= within
    assert clock.jump == pytest.approx(jump * SECOND, abs=0.05 * SECOND)


@pytest.mark.parametrize("stall", [0.15, 0.5, 0.9])
def test_a_stall_of_the_network_is_no_jump(stall):
    """Messages of the stall come at once at its end."""
    clock, held = DataClock(), round(stall * SECOND)
    for k in range(500):
        stamp = arrival = k * 20_000_000
        if 200 * 20_000_000 <= arrival < 200 * 20_000_000 + held:
            arrival = 200 * 20_000_000 + held + k
        assert clock.judge(stamp, arrival) is Stamp.FITS, k
        clock.update(stamp, arrival)
    assert clock.jumps == 0
