"""A value of the scene that the choice of the steps would put aside is refused."""

import pytest

from cable_sim_ros.io.scenes.document import SceneError
from cable_sim_ros.runs.offline import run


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
