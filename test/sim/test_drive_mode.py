"""The mode of the winch in force: each of eight words, of a row and counted over a run."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros import WinchCommand, replay, run
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.physics.winch_drive import MODES, WinchMode
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


@pytest.mark.parametrize("mode, command, law, status, brake, word", CASES)
def test_a_row_says_its_mode(mode, command, law, status, brake, word):
    row = np.zeros((), TICK_OUTPUT)
    row["winch_mode"], row["status"], row["brake_set"] = MODES.index(WinchMode(mode)), status, brake
    assert mode_in_force(row, command, law) == word


def test_every_word_has_a_case():
    assert {case[-1] for case in CASES} == set(WORDS) and len(WORDS) == 8


def test_a_run_says_how_long_each_mode_was_in_force(tmp_path):
    scene = override(
        load_scene("full_scale"),
        {
            "drive.model": "motor",
            "drive.inertia": 45.0,
            "drive.curve_speed": [0.0, 5.0],
            "drive.curve_pull": [2e4, 1e4],
            "drive.brake_pull": 8e3,
            "drive.set_pull": 3300.0,
            "setpoint.algorithm": "hold",
        },
    )
    plan = "0.1 rate 0.2, 0.3 length 450, 0.6 mode tension, 0.7 mode render, 0.8 mode emergency_stop, 0.9 mode brake"
    law = [(1.0, "setpoint.algorithm", "simplified_sheave"), (1.0, "drive.mode", "follow")]
    result = run(scene, winch=plan, changes=law, duration=1.7, step="fixed", every=0.01, out=tmp_path / "run")
    expected = {"hold": 0.1, "rate": 0.2, "length": 0.3, "tension": 0.1, "render": 0.1, "emergency_stop": 0.1}
    found = result.metrics["winch_modes"]
    assert {word: found[word] for word in expected} == pytest.approx(expected)
    lifted = float(np.count_nonzero(result.frames.brake_set[100:])) * 0.01
    assert found["brake"] == pytest.approx(0.1 + lifted) and found["ahc"] == pytest.approx(0.7 - lifted)
    assert replay(result.bag).metrics["winch_modes"] == found
