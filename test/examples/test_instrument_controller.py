"""A controller that hears instruments in lockstep, and loses them one after the other.

A reading comes with the tick, input_delay behind the clock; a command under its stamp is what the step waits for once
lockstep.chain_delay says so.
"""

import sys
from pathlib import Path

from cable_sim_ros.physics.tick_output import Flag

CONTROLLER = Path(__file__).with_name("instrument_controller.py")
PARAMETERS = {
    "solver.tick": 0.02,  # s
    "setpoint.algorithm": "hold",
    "instruments.mru.on": True,
    "instruments.encoder.on": True,
    "instruments.encoder.resolution": 0.002,
    "lockstep.command_period": 0.02,  # s: a reading each tick
    "lockstep.chain_delay": 0.03,  # s: input_delay
}


def test_what_a_controller_does_that_loses_its_instruments(tow_sim):
    sim = tow_sim("full_scale", mode="lockstep", parameters=PARAMETERS, may_be_doubtful=True)
    controller = sim.run([sys.executable, CONTROLLER, "--ros-args", "-p", "use_sim_time:=true"], within=600.0)
    sim.set("lockstep.wait", 20.0)  # s of wall time, however busy the machine is
    sim.feed(heave=(1.0, 6.0), duration=30.0)
    sim.advance(2.0)
    both = sim.advance(2.0)
    sim.set("faults.encoder.kind", "lost")
    alone = sim.advance(3.0)
    assert "the encoder is lost" in controller.text and abs(both.payout_rate).max() > 0.1
    assert abs(alone.payout_rate).max() > 0.1 and not (alone.status & Flag.COMMAND_STALE).any()
    assert sim.unmet == {}, "all this repeats"

    sim.set("lockstep.wait", 0.2)  # s for a command that will not come
    sim.set("faults.mru_heave.kind", "lost")
    held = sim.advance(2.0)[-50:]
    assert (held.status & Flag.COMMAND_STALE).all() and abs(held.payout_rate).max() < 0.01
