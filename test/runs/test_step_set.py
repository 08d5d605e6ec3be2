"""A value of the scene that the choice of the steps would put aside is refused."""

import re

import pytest

from cable_sim_ros.io.scenes.document import SceneError
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs.offline import run
from cable_sim_ros.runs.step_choice import stepped

pytestmark = pytest.mark.trust


@pytest.mark.parametrize(
    "settings, how, text",
    [
        ({"solver.tick": 0.001}, {"step": "chosen"}, r"solver.tick is set by step = chosen: .* Give step = fixed"),
        ({"solver.tick": 0.001}, {"step": "fixed", "every": 0.1}, r"solver.tick is set by every = 0.1 s: .* Leave one"),
        (
            {"solver.tension_error": 0.01},
            {"step": "fixed"},
            r"tension_error is a bound of chosen steps.* step = chosen",
        ),
    ],
)
def test_a_value_that_would_count_for_nothing_is_refused(settings, how, text):
    with pytest.raises(SceneError, match=text):
        run("side_scan", settings=settings, duration=0.1, **how)


@pytest.mark.parametrize("bandwidth, tick", [(10.0, 0.1), (20.0, 0.05), (33.0, 0.02)])
def test_a_run_takes_the_tick_that_a_motor_can_follow(bandwidth, tick):
    scene = override(load_scene("recovery_3t"), {"drive.bandwidth": bandwidth, "rules.set": "none"})
    assert stepped(scene, "chosen", None).solver.tick == tick
    with pytest.raises(SceneError, match=r"faster than solver.tick = 0.2 s.*Give solver.tick \(--every\)") as refused:
        stepped(scene, "chosen", 0.2)
    given = float(re.search(r"\(--every\) of (\S+) s or less", str(refused.value))[1])
    assert stepped(scene, "chosen", given).solver.tick == given
