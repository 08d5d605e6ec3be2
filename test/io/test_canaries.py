"""YAML made to break a reader, and seeded mutations of the shipped scenes: a scene, or a text that names the error."""

from __future__ import annotations

import pytest

from cable_sim_ros.io.scenes.load import SceneError, scene_from_text
from verification.soak.files import CANARIES, files, judge

pytestmark = pytest.mark.check

REMEDY = "; nothing was started. Correct the YAML"


@pytest.mark.parametrize("name", CANARIES)
def test_a_canary_is_refused_with_a_text_and_soon(name):
    found, seconds = judge(CANARIES[name])
    assert found == "refused" and seconds < 20.0, "bounded, whatever else this machine does"


@pytest.mark.parametrize(
    "name, text",
    [
        ("20 000 brackets", "x.yaml:1: brackets or indentation are nested deeper than 50 levels" + REMEDY),
        ("900 levels of indentation", "x.yaml:50: brackets or indentation are nested deeper than 50 levels" + REMEDY),
        ("aliases 2500 levels deep", "x.yaml:1: is nested deeper than 50 levels through aliases" + REMEDY),
        ("a billion laughs", "x.yaml:1: has more than 3000 values, counting aliases" + REMEDY),
        ("20 000 keys", "x.yaml:3000: has more than 3000 values, counting aliases" + REMEDY),
        ("a value of a million letters", "x.yaml: has 1000006 characters, more than 1000000" + REMEDY),
    ],
)
def test_the_text_names_line_and_bound(name, text):
    with pytest.raises(SceneError) as error:
        scene_from_text(CANARIES[name], "x.yaml")
    assert str(error.value) == text


def test_broken_parameter_files_never_break_the_loader():
    found = files.run(True)
    assert all(figure.passed for figure in found.metrics if figure.name == "that broke the loader"), found.notes
    measured = {figure.name: figure.value for figure in found.metrics}
    assert measured["that are scenes"] >= 10 and measured["refused with a text"] >= 100
