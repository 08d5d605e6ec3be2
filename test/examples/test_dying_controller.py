"""A controller that dies: the winch must hold within winch.command_timeout, and the node must say so.

In lockstep, so that every time below is exact; lockstep.wait is how long (wall time) a step waits for a command that
does not come, five times before the controller counts as silent: long while it lives, short once it is dead.
"""

import sys
from pathlib import Path

import numpy as np

from cable_sim_ros.physics.tick_output import Flag

CONTROLLER = Path(__file__).with_name("heave_compensator.py")
PARAMETERS = ("-p", "use_sim_time:=true", "-p", "ramp:=1.0")  # s until the controller has its whole gain
TIMEOUT, REST = 0.5, 0.3  # s: winch.command_timeout; until the winch's servo has come to rest


def test_the_winch_holds_when_its_controller_dies(tow_sim):
    sim = tow_sim("full_scale", mode="lockstep", parameters={"setpoint.algorithm": "hold", "lockstep.wait": 60.0})
    controller = sim.run([sys.executable, CONTROLLER, 50, "--ros-args", *PARAMETERS], within=600.0)
    sim.feed(heave=(2.0, 6.0), duration=12.0)
    sim.wait_until(lambda frames: abs(frames.payout_rate[-1]) > 0.2, within=9.0)

    controller.kill()  # as a crash: no last command
    died = sim.frames.time[-1]
    sim.set("lockstep.wait", 0.2)
    frames = sim.wait_until(lambda frames: frames.status[-1] & Flag.COMMAND_STALE, within=2.0, every=0.01)
    # the newest command is up to one period and the input delay ahead of the tick output that was seen last
    assert TIMEOUT <= (frames.time[-1] - died) * 1e-9 <= TIMEOUT + 0.02 + 0.03 + 0.01

    after = sim.advance(1.0)
    held = after[round(REST / 0.01) :]
    assert abs(held.payout_rate).max() < 0.01 and np.ptp(held.payout) < 0.002
    assert (after.status & Flag.COMMAND_STALE).all()
    assert sim.diagnostic("command", lambda level, text, values: values["stale"] == "true")[0] == 1  # WARN
    assert sim.unmet["commands_missed"] == 5  # lockstep.silent_after: such a run does not repeat, and says so
    assert "silent" in sim.diagnostic("lockstep", lambda level, text, values: level == 2)[1]  # ERROR

    sim.command(rate=0.1)  # whoever commands next has the winch
    sim.wait_until(lambda frames: frames.payout_rate[-1] > 0.09, within=1.0)
    assert not sim.frames.status[-1] & Flag.COMMAND_STALE
