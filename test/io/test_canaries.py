"""YAML made to break a reader, and seeded mutations of the shipped scenes: a scene, or a text that names the error."""

import random
from collections import Counter
from pathlib import Path

import pytest

from cable_sim_ros.io.scenes.document import find_scene, shipped_scenes
from cable_sim_ros.io.scenes.load import SceneError, scene_from_text
from verification.soak import files
from verification.soak.files import CANARIES, judge, mutated

pytestmark = pytest.mark.check

TEXTS = {
    "20 000 brackets": "x.yaml:1: brackets or indentation are nested deeper than 50 levels",
    "900 levels of indentation": "x.yaml:50: brackets or indentation are nested deeper than 50 levels",
    "aliases 2500 levels deep": "x.yaml:1: is nested deeper than 50 levels through aliases",
    "a billion laughs": "x.yaml:1: has more than 3000 values, counting aliases",
    "20 000 keys": "x.yaml:3000: has more than 3000 values, counting aliases",
    "a value of a million letters": "x.yaml: has 1000006 characters, more than 1000000",
}


@pytest.mark.parametrize("name", CANARIES)
def test_a_canary_is_refused_with_a_text(name):
    """How soon: `make soak`. Of some: line and bound."""
    if name not in TEXTS:
        assert judge(CANARIES[name])[0] == "refused"
        return
    with pytest.raises(SceneError) as error:
        scene_from_text(CANARIES[name], "x.yaml")
    assert str(error.value) == TEXTS[name] + "; nothing was started. Correct the YAML"


def test_the_stress_row_counts_what_breaks_the_loader(monkeypatch):
    monkeypatch.setattr(files, "CANARIES", {"one": "x"})
    monkeypatch.setattr(files, "mutated", lambda text, draw: "x")
    monkeypatch.setattr(files, "judge", lambda text: ("KeyError", 0.1))
    found = {metric.name: metric.value for metric in files.files.run(True).metrics}
    assert found["that broke the loader"] == found["files"] > 1


def test_broken_parameter_files_never_break_the_loader():
    """10 000 of them and the canaries are stress row S5."""
    draw, scenes = random.Random(11), [Path(find_scene(name)).read_text("utf-8") for name in shipped_scenes()]
    found = Counter(judge(mutated(draw.choice(scenes), draw))[0] for _ in range(50))
    assert set(found) == {"scene", "refused"} and found["scene"] >= 3 and found["refused"] >= 30
