"""A drive and instruments that a user writes as a relay around a controller, and the same as lines of the scene.

The mode of the winch in force: each of eight words, of a row and counted over a run.
"""

from collections import deque
from math import cos, sin

import numpy as np
import pytest

from cable_sim_ros import WinchCommand, replay, run
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.physics.winch_drive import MODES, WinchMode
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.drive_mode import WORDS, mode_in_force

pytestmark = pytest.mark.trust
HOLD, LAW = SetpointLaw.HOLD, SetpointLaw.SIMPLIFIED_SHEAVE
RATE, LENGTH, STILL = WinchCommand(rate=0.5), WinchCommand(payout=450.0), WinchCommand(rate=0.0)
CASES = [  # drive.mode, command, law, status, brake, word
    ("follow", None, HOLD, 0, 0.0, "hold"),
    ("follow", STILL, HOLD, 0, 0.0, "hold"),
    ("follow", RATE, HOLD, 0, 0.0, "rate"),
    ("follow", RATE, HOLD, Flag.COMMAND_STALE, 0.0, "hold"),
    ("follow", LENGTH, HOLD, 0, 0.0, "length"),
    ("follow", LENGTH, HOLD, Flag.COMMAND_STALE, 0.0, "hold"),
    ("follow", WinchCommand(payout=1.0, rate=2.0), HOLD, 0, 0.0, "length"),
    ("follow", None, LAW, 0, 0.0, "ahc"),
    ("follow", RATE, LAW, Flag.COMMAND_STALE, 0.0, "ahc"),
    ("follow", RATE, LAW, 0, 0.1, "brake"),
    ("follow", RATE, SetpointLaw.CONSTANT_TENSION, 0, 0.0, "tension"),
    ("render", RATE, SetpointLaw.CONSTANT_TENSION, 0, 0.0, "render"),
    ("tension", RATE, LAW, 0, 0.0, "tension"),
    ("render", RATE, LAW, 0, 0.0, "render"),
    ("render", RATE, LAW, 0, 0.5, "brake"),
    ("brake", RATE, LAW, 0, 0.0, "brake"),
    ("emergency_stop", RATE, LAW, 0, 1.0, "emergency_stop"),
]

TICK = 0.01
TOW = override(load_scene("full_scale"), {"setpoint.algorithm": "hold"})
MOTION = {"heave": (1.0, 8.0), "duration": 18.0, "step": "fixed"}
LINES = {  # the relay below
    "drive.model": "rate_loop",
    "drive.bandwidth": 6.0,
    "drive.damping": 0.7,
    "drive.dead_time": 0.08,
    "drive.length_gain": 0.0,
    "winch.max_rate": 1.5,
    "winch.max_acceleration": 2.0,
    "instruments.feed": "instruments",
    "instruments.mru.on": True,
    "instruments.mru.latency": 0.06,
    "instruments.encoder.on": True,
    "instruments.encoder.resolution": 0.002,
}


@pytest.mark.parametrize("mode, command, law, status, brake, word", CASES)
def test_a_row_says_its_mode(mode, command, law, status, brake, word):
    row = np.zeros((), TICK_OUTPUT)
    row["winch_mode"], row["status"], row["brake_set"] = MODES.index(WinchMode(mode)), status, brake
    assert mode_in_force(row, command, law) == word


def test_every_word_has_a_case():
    assert {case[-1] for case in CASES} == set(WORDS) and len(WORDS) == 8


def test_a_run_says_how_long_each_mode_was_in_force(tmp_path):
    motor = {"model": "motor", "inertia": 45.0, "curve_speed": [0.0, 5.0], "curve_pull": [2e4, 1e4]}
    motor |= {"brake_pull": 8e3, "set_pull": 3300.0}
    scene = override(TOW, {f"drive.{key}": value for key, value in motor.items()})
    plan = "0.1 rate 0.2, 0.3 length 450, 0.6 mode tension, 0.7 mode render, 0.8 mode emergency_stop, 0.9 mode brake"
    law = [(1.0, "setpoint.algorithm", "simplified_sheave"), (1.0, "drive.mode", "follow")]
    result = run(scene, winch=plan, changes=law, duration=1.7, step="fixed", every=0.01, out=tmp_path / "run")
    expected = {"hold": 0.1, "rate": 0.2, "length": 0.3, "tension": 0.1, "render": 0.1, "emergency_stop": 0.1}
    found = result.metrics["winch_modes"]
    assert {word: found[word] for word in expected} == pytest.approx(expected)
    lifted = float(np.count_nonzero(result.frames.brake_set[100:])) * 0.01
    assert found["brake"] == pytest.approx(0.1 + lifted) and found["ahc"] == pytest.approx(0.7 - lifted)
    assert replay(result.bag).metrics["winch_modes"] == found


class Compensator:
    """Pays out as fast as the sheave moves along the cable, and brings the length back where it lags."""

    def __init__(self):
        self.length, self.datum = 0.0, None

    def __call__(self, row):
        if self.datum is None:
            self.datum, self.angle = row.payout, row.departure_angle
        ahead, up = row.sheave_velocity[0] - TOW.ship.tow_speed, row.sheave_velocity[2]
        rate = ahead * sin(self.angle) + up * cos(self.angle)
        self.length += TICK * rate
        return WinchCommand(rate=float(rate + 0.5 * (self.length - (row.payout - self.datum))))


def clip(value, maximum):
    return max(-maximum, min(maximum, value))


class Relay:
    """A rate loop of second order with dead time behind a controller, an MRU that is late and an encoder before it."""

    def __init__(self, controller):
        self.controller, self.velocities, self.asked = controller, deque(), deque()
        self.rate = self.acceleration = 0.0

    def __call__(self, row):
        self.velocities.append(row.sheave_velocity.copy())
        row.sheave_velocity[:] = self.velocities[max(len(self.velocities) - 1 - 6, 0)]
        row.payout = 0.002 * np.floor(row.payout / 0.002 + 0.5)
        self.asked.append(self.controller(row).rate)
        wanted = self.asked[-9] if len(self.asked) > 8 else 0.0
        way = 0.0
        for _ in range(10):
            jerk = 36.0 * (clip(wanted, 1.5) - self.rate) - 2.0 * 0.7 * 6.0 * self.acceleration
            self.acceleration = clip(self.acceleration + 1e-3 * jerk, 2.0)
            self.rate = clip(self.rate + 1e-3 * self.acceleration, 1.5)
            way += 1e-3 * self.rate
        return WinchCommand(rate=float(way / TICK))


def test_a_dozen_lines_of_scene_are_the_relay_that_users_write():
    """Held 136 N, ideal 15 N; drive and instruments leave 51 N, by either way, and the scene repeats to the bit."""
    held = offline.run(TOW, **MOTION).frames
    ideal = offline.run(TOW, controller=Compensator(), **MOTION).frames
    relay = offline.run(TOW, controller=Relay(Compensator()), **MOTION).frames
    scene = offline.run(override(TOW, LINES), controller=Compensator(), **MOTION).frames
    again = offline.run(override(TOW, LINES), controller=Compensator(), **(MOTION | {"duration": 3.0})).frames
    deviation = [frames.tension[1000:].std() for frames in (held, ideal, relay, scene)]
    assert deviation[1] < 0.2 * deviation[0] and 2.5 * deviation[1] < deviation[2] < 0.5 * deviation[0]
    assert deviation[3] == pytest.approx(deviation[2], rel=0.02)
    travel = np.ptp(relay.payout[1000:])
    assert np.abs(relay.payout - scene.payout)[1000:].max() < 0.01 * travel
    assert scene[: len(again)].tobytes() == again.tobytes()
