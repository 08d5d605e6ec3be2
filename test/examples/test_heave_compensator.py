"""A heave compensator closed through topics, at 50 and 100 Hz, in real time and in lockstep: the same result.

To copy: `tow_sim` comes with the package's pytest plugin (docs/testing.md); the controller is a process that knows
nothing of the simulator. 450 m of cable out, a wave after a calm begin, tension at the sheave. Each rate is simulated
in lockstep once for all tests of this file.
"""

import functools
import os
import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from cable_sim_ros import ShipMotion
from cable_sim_ros.testing import tow

CONTROLLER = Path(__file__).with_name("heave_compensator.py")
HEAVE, SURGE, PERIOD = 0.5, 0.25, 4.0  # m, m, s
CALM, GROWS, COUNTED = 1.5, 1.5, 4.0  # s: without waves, while they grow, and the wave that counts
RAMP = 1.0  # s until the controller has its whole gain, after 1 s at rest: before the wave counts
PART = CALM + 1.0  # s that are simulated a second time: the controller takes over, and the waves have begun
LATE = 0.02  # s; a command that is later than this was held up by the machine
STARTS = 6  # a start that lost a message on a machine that is busy is made again
HOLD = 363.0  # N, standard deviation of the tension over that wave without compensation


def waves(seconds=CALM + GROWS + COUNTED + 2.0, calm=CALM):
    """The ship's motion, 50 samples a second. It begins calm: the static start is then the same at every moment."""
    t = np.arange(0.0, seconds, 0.02)
    height = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - calm) / GROWS, 0.0, 1.0))
    x = 2.2 * t + SURGE * height * np.cos(2 * np.pi / PERIOD * t)
    z = HEAVE * height * np.sin(2 * np.pi / PERIOD * t)
    level = {"attitude": (0.0, 0.0, 0.0), "rate": (0.0, 0.0, 0.0)}
    rows = zip(np.round(t * 1e9).astype(int), x, z, np.gradient(x, t), np.gradient(z, t))
    return [ShipMotion(time_ns=n, position=(a, 0, b), velocity=(u, 0, w), **level) for n, a, b, u, w in rows]


def stalled(sim):
    """Let the node stand still while a controller starts, as on a busy machine: it learns of it late."""
    pid = sim.node.pid
    os.kill(pid, signal.SIGSTOP)
    timer = threading.Timer(3.0, os.kill, (pid, signal.SIGCONT))
    timer.daemon = True
    timer.start()


def closed_loop(tow_sim, rate, mode, seconds=CALM + GROWS + COUNTED, meanwhile=lambda sim: None, **options):
    """Tick outputs of so many seconds of the motion, from the first tick on; the stamp of its begin, s; what was unmet.

    meanwhile(sim): called before the controller starts.
    """
    parameters = {"setpoint.algorithm": "hold"}  # the node's own compensation off: both would add up
    if mode == "lockstep":
        parameters["lockstep.command_period"] = 1.0 / rate  # each command is waited for, from the first one on,
        parameters["lockstep.wait"] = 20.0  # s, however busy the machine is
    with tow_sim("full_scale", mode=mode, parameters=parameters, **options) as sim:
        said = ["-p", f"use_sim_time:={mode == 'lockstep'}", "-p", f"ramp:={RAMP}"]
        meanwhile(sim)
        sim.run([sys.executable, CONTROLLER, rate, "--ros-args", *said], within=600.0)
        begin = sim.feed(waves())
        frames = sim.wait_until(lambda frames: frames.time[-1] * 1e-9 > begin + seconds, within=20.0)
        return frames, begin, {} if mode == "realtime" else sim.unmet


def whole(start):
    """Tick outputs and begin of start(number), of the first of STARTS in which every input was there at its time.

    A process that is held up by the machine may lose what is sent to it by best effort; the node says so, and such a
    start is made again. None that is whole may differ from another.
    """
    for number in range(STARTS):
        frames, begin, unmet = start(number)
        if not unmet:
            return frames, begin
        print(f"start {number}: {unmet}")
    pytest.fail(f"in none of {STARTS} starts was every input there at its time, last {unmet}")


def counted(frames, begin):
    """Tick outputs of the wave that counts."""
    seconds = frames.time * 1e-9 - begin - CALM - GROWS
    return frames[(seconds > 0.0) & (seconds <= COUNTED)]


@pytest.fixture(scope="module")
def stepped(tmp_path_factory):
    """Function: rate -> what `closed_loop` gives in lockstep, simulated when it is first asked for."""
    pytest.importorskip("rclpy")

    def simulated(rate):
        return whole(lambda number: closed_loop(tow, rate, "lockstep", folder=tmp_path_factory.mktemp(f"at{rate}")))

    return functools.cache(simulated)


def test_in_lockstep_it_compensates(stepped):
    assert counted(*stepped(100)).tension.std() < 0.1 * HOLD


@pytest.mark.realtime
@pytest.mark.parametrize("rate", [50, 100])
def test_the_same_in_real_time_and_in_lockstep(tow_sim, stepped, rate):
    alone = counted(*stepped(rate)).tension
    frames = counted(*closed_loop(tow_sim, rate, "realtime")[:2])
    print(f"{rate} Hz: {frames.tension.std():.1f} N in real time, {alone.std():.1f} N in lockstep")
    late = frames.command_age.max() - 1.0 / rate  # s, a command after it was due
    if late >= LATE:
        pytest.skip(f"this machine does not hold real time: a command came {late:.3f} s late")
    # In lockstep a command acts at its stamp. In real time it is under way for some milliseconds and acts with the next
    # tick: late by tau on a wave of pulsation w leaves 2 sin(w tau / 2) of what hold shows: 3 % for LATE, 2 % for the
    # tick. The rest is for motion that was late in the same way.
    assert abs(frames.tension.std() - alone.std()) < 0.06 * HOLD
    assert abs(frames.tension.mean() - alone.mean()) < 0.06 * HOLD


def same_bits(one, other):
    """Fail where two runs differ in their first PART seconds."""
    (frames, begin), (again, other_begin) = one, other
    count = round(PART / 0.01)
    assert begin == other_begin and min(len(frames), len(again)) >= count
    differ = [name for name in frames.dtype.names if not np.array_equal(frames[name][:count], again[name][:count])]
    assert not differ


@pytest.mark.nightly  # every run of CI shows it of this controller in a chain: test_winch_relay.py
def test_two_runs_in_lockstep_are_the_same_bits(tmp_path, stepped):
    """Also where the node stands still while the controller starts."""
    other = whole(lambda number: closed_loop(tow, 100, "lockstep", PART, stalled, folder=tmp_path / str(number)))
    same_bits(stepped(100), other)
