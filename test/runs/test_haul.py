"""A haul of 200 m, recorded and replayed: the same numbers to the last bit, from the drum to the towbody."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs import offline

pytestmark = pytest.mark.trust
PLAN = "0 hold, 1 rate -3.5, 59 hold"  # 203 m


@pytest.mark.parametrize("law", ["hold", "simplified_sheave"])
def test_a_haul_is_replayed_bit_for_bit(tmp_path, law):
    scene = override(load_scene("full_scale"), {"solver.tick": 0.05, "setpoint.algorithm": law})
    first = offline.run(scene, heave=(1.0, 8.0), duration=62.0, winch=PLAN, out=tmp_path)
    assert first.frames.scope[0] - first.frames.scope[-1] == pytest.approx(203.0, abs=2.5)
    assert np.abs(first.frames.payout + first.frames.cable_on_drum - 600.0).max() < 1e-9
    again = offline.replay(first.bag)
    assert again.metrics["largest_difference"] == {"field": "", "difference": 0.0, "ticks": len(first.frames)}
    assert read_tow(first.bag).about["scene_yaml"]


def test_the_haul_of_the_command_line_is_replayed_bit_for_bit(tmp_path):
    """With chosen steps, as a user gets them; 60 m of it."""
    line = ["run", "full_scale", "--heave", "1,8", "--winch", "0 rate -3, 20 hold", "--duration", "25", "--json"]
    line += ["--set", "contact.working_tension=9000"]
    for words in ([*line, "--out", str(tmp_path)], ["replay", str(tmp_path / "tow"), "--json"]):
        result = CliRunner().invoke(commands.main, words, catch_exceptions=False)
        assert result.exit_code == 0, result.stderr
        metrics = json.loads(result.stdout)
    assert metrics["largest_difference"]["difference"] == 0.0
    assert metrics["scope_max_m"] - metrics["scope_min_m"] == pytest.approx(60.0, abs=2.0)
