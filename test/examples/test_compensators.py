"""Three compensators to copy, each closed through topics in lockstep against the same wave and the held winch.

One node for all of them: the wave goes on, and one after the other takes the winch over from where the last left it.
"""

import importlib
import sys
import time
from pathlib import Path

import pytest
from test_heave_compensator import GROWS, waves

HERE = Path(__file__).parent
SAMPLE, DELAY = 20_000_000, 30_000_000  # ns: of the motion; input_delay
CALM, TAKES_OVER, COUNTED = 0.5, 2.0, 4.0  # s
FACTORS = {"pd": 15.0, "pid": 15.0, "lq": 20.0}  # least that each divides the deviation by; docs/closed_loop.md


def stamp_of(message):
    """Stamp of a message, ns."""
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def test_each_divides_the_deviation_of_the_tension_by_its_factor(tow_sim):
    from sensor_msgs.msg import JointState

    # the node's own off; a tick for each sample of the motion; a busy machine is waited for
    parameters = {"setpoint.algorithm": "hold", "solver.tick": 0.02, "lockstep.wait": 20.0}
    sim = tow_sim("full_scale", mode="lockstep", parameters=parameters)
    commands = sim.listen(JointState, "winch/command")
    sim.feed(waves(CALM + GROWS + 1.0 + COUNTED + len(FACTORS) * (TAKES_OVER + COUNTED) + 0.5, CALM))
    sim.advance(CALM + GROWS + 1.0)
    held = sim.advance(COUNTED).tension
    assert held.std() > 300.0
    for name, factor in FACTORS.items():
        controller = HERE / f"{name}_compensator.py"
        process = sim.run(
            [sys.executable, controller, "--ros-args", "-p", "use_sim_time:=true"], name=name, within=600.0
        )
        sim.advance(TAKES_OVER)
        frames = sim.advance(COUNTED)
        print(f"{name}: {frames.tension.std():.1f} N of {held.std():.1f}, 1 / {held.std() / frames.tension.std():.1f}")
        assert frames.tension.std() < held.std() / factor
        assert abs(frames.tension.mean() - held.mean()) < 0.1 * held.std(), "the tow hangs as it did"
        clock, until = frames.time[-1] + DELAY, time.monotonic() + 600.0
        while stamp_of(commands[-1]) <= clock - SAMPLE:  # it owes the newest sample its command
            assert time.monotonic() < until
            time.sleep(0.02)
        process.stop()
    assert not (unmet := sim.unmet), f"every command was there at its time: {unmet}"


@pytest.mark.parametrize("name", FACTORS)
def test_a_sheave_that_draws_cable_is_paid_out_to_and_nothing_winds_up(name):
    pytest.importorskip("rclpy")
    sys.path.insert(0, str(HERE))
    module = importlib.import_module(f"{name}_compensator")
    assert len(Path(module.__file__).read_text("utf-8").splitlines()) <= 120, "docs/closed_loop.md says so"
    second = module.SECOND

    def asked(speed, short, steps=100):
        """Rate and integral after so many samples in which the winch was short by so much all along [m]."""
        it = object.__new__(getattr(module, f"{name.capitalize()}Compensator"))  # without a node
        it.begun, it.last, it.datum, it.tension = second, None, 100.0 + short, 3000.0
        it.length = it.integral = it.slope = it.error = it.trim = it.paid = it.asked = 0.0
        it.lengths, it.past = module.deque(maxlen=50), module.deque(maxlen=50)
        tension = (3000.0,) if name == "pid" else ()
        if name == "lq":
            it.gains, it.rate = module.gains(), 0.0
        step = type(it).control if name == "lq" else type(it).rate
        for k in range(steps):
            stamp = 4 * second + k * second // 50
            got = step(it, stamp, speed, stamp - round(module.STATE_AGE * second), 100.0, *tension)
        return got, it.integral

    assert asked(0.3, 0.0, 1)[0] == pytest.approx(0.3, abs=0.03)
    assert asked(-0.3, 0.0, 1)[0] == pytest.approx(-0.3, abs=0.03)
    assert asked(0.0, 0.1, 1)[0] > 0.01 and asked(0.0, -0.1, 1)[0] < -0.01
    if name != "pd":  # which has no integral
        assert asked(0.0, 0.01)[1] > 1e-4 and asked(0.0, 100.0) == (module.MAX_RATE, 0.0)
