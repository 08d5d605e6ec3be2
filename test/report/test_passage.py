"""A load through the surface, on slack cable, onto the seabed: what summary, plan and report say of it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.runs.passage import events
from cable_sim_ros.runs.summary import passage

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")


def ticks(count: int) -> np.recarray:
    """Tick outputs of 0.1 s without events."""
    frames = np.zeros(count, TICK_OUTPUT).view(np.recarray)
    frames.time, frames.tension = 100_000_000 * np.arange(count), 100.0
    frames.tension_tick_min, frames.tension_tick_max = 99.0, 101.0
    return frames


def test_events_are_peaks_of_their_own_ticks_with_their_times():
    frames = ticks(60)
    assert events(frames) == {} and set(passage(frames).values()) == {None}
    frames.status[10:13] = int(Flag.SURFACE_CROSSED)
    frames.slam[11], frames.slam[30] = 40.0, 99.0
    frames.tension_tick_max[12], frames.tension_tick_min[10] = 300.0, 5.0
    frames.status[20] = int(Flag.SLACK)
    frames.tension_tick_max[25], frames.tension_tick_max[45] = 500.0, 900.0  # the second more than 2 s after
    frames.status[50:] = int(Flag.SEABED)
    frames.body_velocity[49, 2] = -0.4
    found = {name: (event.value, event.at_s) for name, event in events(frames).items()}
    assert found == {
        "slam": (40.0, 1.2),
        "splash_tension": (300.0, 1.3),
        "splash_tension_least": (5.0, 1.1),
        "snap": (500.0, 2.6),
        "landing_speed": (0.4, 5.0),
    }
    assert passage(frames) == {
        "slam_max_n": 40.0,
        "splash_tension_min_n": 5.0,
        "splash_tension_max_n": 300.0,
        "landing_speed_m_s": 0.4,
    }


def test_plan_and_report_of_a_lift_through_the_surface_say_what_happened(tmp_path):
    """A rosette near the surface under a ship that heaves by 1.5 m: it dips, its cable goes slack and snaps."""
    line = ["plan", "lowered_ctd", "--heave", "1.5,4", "--duration", "9", "--set", "winch.scope=7.5"]
    line += ["--set", "setpoint.algorithm=hold", "--json", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(commands.main, [*line, "--report", str(tmp_path / "lift.html")])
    assert done.exit_code == 4, done.output
    plan, frames = json.loads(done.stdout), load_run(tmp_path / "run" / "tow").frames
    rows = {row["need"]: row for row in plan["plan"]}
    crossed = frames.status & Flag.SURFACE_CROSSED != 0
    assert rows["splash_tension"]["needed"] == np.fmax(frames.tension, frames.tension_tick_max)[crossed].max()
    least = rows["splash_tension_least"]
    assert least["has"] == pytest.approx(220.0) and least["margin"] == pytest.approx(least["needed"] - 220.0)
    assert rows["slam"]["needed"] == np.nanmax(frames.slam[crossed])
    assert rows["snap"]["needed"] > 3000.0
    assert any("splash_tension_least" in text and "below 220 N" in text for text in plan["short"])
    page = (tmp_path / "lift.html").read_text("utf-8")
    section = page[page.index('id="passage"') :]
    section = section[: section.index("</section>")]
    for text in ("While a body was in the water surface", "came tight with", "largest slam", "cable without tension"):
        assert text in section
