"""A program of rclpy on the AHC benchmark: the node in lockstep beside it, live changes as parameters."""

import os
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")

from cable_sim_ros.tools.ahc import benchmark, definition  # noqa: E402
from cable_sim_ros.tools.ahc.definition import Cell, Class  # noqa: E402
from cable_sim_ros.tools.ahc.entrants import external  # noqa: E402
from cable_sim_ros.tools.ahc.simulate import Span  # noqa: E402

EXAMPLE = Path(__file__).parents[1] / "examples" / "heave_compensator.py"


def test_a_program_of_rclpy_compensates_until_the_winch_is_braked(monkeypatch):
    command = f"{sys.executable} {EXAMPLE} 50 --ros-args -p use_sim_time:=true -p ramp:=1.0"
    entrant = external(None, None, command)
    assert (entrant.name, entrant.rank) == ("heave_compensator", "external")
    motor = definition.place("full_scale").drive
    one = Class("braked", "", motor, changes=((4.0, "drive.mode", "brake"),), fault=(4.0, 5.0), drive=True)
    monkeypatch.setattr(definition, "CLASSES", (*definition.CLASSES, one))
    done = benchmark.run_cell(entrant, Cell("full_scale", "nbp1406", "braked"), Span(6.5, 2.0))
    frames = done.frames
    time = (frames["time"] - frames["time"][0]) * 1e-9
    assert len(frames) == 650
    speed = abs(frames["payout_rate"])
    assert speed[(time > 2.5) & (time < 4.0)].max() > 0.05 and speed[time > 6.0].max() < 1e-3
    assert (frames["winch_mode"][time < 3.9] == 0).all() and (frames["winch_mode"][time > 4.1] == 3).all()
