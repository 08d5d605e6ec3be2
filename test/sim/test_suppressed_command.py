"""A rate that ros2_control's hardware component does not repeat once the winch has it, in the whole simulation."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
from hardware_component import INTERFACES, Component, Joint, Message

from cable_sim_ros import ShipMotion, Simulator, WinchCommand, load_scene
from cable_sim_ros.physics.tick_output import Flag

pytestmark = pytest.mark.trust

RATE, SECONDS = 0.3, 6.0


def towed(threshold: str):
    """(rates [m/s], stale, commands sent) of 6 s of full_scale; a component in cycles of 50 Hz."""
    sim = Simulator(load_scene("full_scale"))
    sim.start()
    it = Component({"payout": Joint(("velocity",), INTERFACES)}, {"trigger_joint_command_threshold": threshold})
    it.command["payout/velocity"] = RATE
    rates, stale, sent = [], [], 0
    for tick in range(int(SECONDS * 100)):
        sim.push(
            ShipMotion(
                time_ns=(tick + 1) * 10_000_000,
                position=(0.022 * (tick + 1), 0.0, 0.0),
                velocity=(2.2, 0.0, 0.0),
                attitude=(0.0, 0.0, 0.0),
                rate=(0.0, 0.0, 0.0),
            )
        )
        message = it.write() if tick % 2 == 0 else None
        if message is not None:
            sim.push(WinchCommand(rate=message.velocity[0]))
            sent += 1
        frame = sim.tick()
        it.read(Message(["payout"], [float(frame["payout"])], [float(frame["payout_rate"])], [0.0]))
        rates.append(float(frame["payout_rate"]))
        stale.append(bool(int(frame["status"]) & Flag.COMMAND_STALE))
    return np.array(rates), np.array(stale), sent


def test_with_the_default_threshold_the_winch_brakes_again_and_again():
    rates, stale, sent = towed("1e-5")
    starts = np.flatnonzero(stale[1:] & ~stale[:-1])
    assert len(starts) >= 2 and rates[100:].min() < 0.5 * RATE and sent < 250


def test_with_a_threshold_below_zero_the_rate_lasts():
    rates, stale, sent = towed("-1")
    assert sent == 300 and not stale.any() and rates[150:] == pytest.approx(RATE, abs=1e-3)
